//! Model files: what is written reads back bit for bit, what is wrong is refused at its place.

use gmhm::terms::{Form, KINDS, KeyInfo, Range};
use gmhm_tools::model::{Base, Model, ModelError, Term, TermValue, TorqueSide, parse};
use gmhm_tools::recording::TorqueUnit;
use proptest::prelude::*;

const PUBLISHED: &str = r#"format = 1
name = "published"
[gear]
ratio = 100
rated_deflection_rad = 1.168e-3
[elastic]
c1_nm_per_rad = 2.4737e4
c2_nm_per_rad3 = 1.0e9
c3_nm_per_rad5 = -1.1774e14
[memory]
law = "masing"
alpha = 2.6532e6
beta_per_s = 422.68
omega_per_s = 226.31
"#;

fn refused(text: &str) -> ModelError {
    parse("m.toml", text).expect_err(text)
}

#[test]
fn the_published_model_reads_with_its_defaults() {
    let model = parse("m.toml", PUBLISHED).unwrap();
    assert_eq!(model.gear.torque_side, TorqueSide::Output);
    assert_eq!((model.gear.ratio, model.gear.deflection_zero_rad), (Some(100.0), 0.0));
    assert_eq!(model.memory.unwrap().reversal_play_rad, 0.0);
    let signs = PUBLISHED.replace("422.68", "-422.68").replace("226.31", "-226.31");
    let as_printed = parse("m.toml", &signs).unwrap();
    assert_eq!(as_printed.memory.unwrap().beta_per_s, -422.68);
    assert_eq!(as_printed.params(1.168e-3).unwrap().unwrap(), model.params(1.168e-3).unwrap().unwrap());
}

#[test]
fn text_editors_may_save_as_they_like() {
    let model = parse("m.toml", PUBLISHED).unwrap();
    assert_eq!(parse("m.toml", &PUBLISHED.replace('\n', "\r\n")).unwrap(), model);
    assert_eq!(parse("m.toml", &format!("\u{feff}{PUBLISHED}")).unwrap(), model);
}

#[test]
fn a_joint_log_needs_no_elastic_and_no_memory() {
    let text = "format = 1\n[gear]\nratio = 101\n[[term]]\nkind = \"gravity_load\"\ncos_a = 1.5\nsin_a = -2\n";
    let model = parse("m.toml", text).unwrap();
    assert!(model.params(1.0).is_none());
    assert_eq!((model.torque_unit, model.gear.torque_side), (TorqueUnit::Ampere, TorqueSide::Motor));
    assert_eq!(model.terms[0].values["cos_nm"], TermValue::Number(1.5));
    assert!(model.to_toml().contains("sin_a = -2.0"), "{}", model.to_toml());
}

#[test]
fn each_malformed_file_is_refused_at_its_place() {
    let swap = |from: &str, to: &str| {
        assert!(PUBLISHED.contains(from));
        PUBLISHED.replace(from, to)
    };
    let cases = [
        (String::new(), "`format = 1` is missing"),
        (swap("format = 1", "format = 2"), "line 1, format: format 2 is not known"),
        (swap("ratio = 100", "ratio ="), "line 4: is not TOML"),
        (swap("ratio = 100", "ratio = 1\nratio = 2"), "line 5"),
        (swap("ratio", "ratoi"), "line 4, [gear] ratoi: unknown key; did you mean `ratio`?"),
        (swap("[memory]", "[memroy]"), "line 10, memroy: unknown key or section; did you mean `memory`?"),
        (swap("ratio = 100", "ratio = \"100\""), "line 4, [gear] ratio: must be a number, not a text"),
        (swap("ratio = 100", "ratio = 0"), "line 4, [gear] ratio: `0` must be another number than zero"),
        (swap("ratio = 100", "ratio = true"), "must be a number, not true or false"),
        (swap("1.168e-3", "-1.168e-3"), "line 5, [gear] rated_deflection_rad: `-0.001168` must be greater"),
        (swap("2.4737e4", "nan"), "line 7, [elastic] c1_nm_per_rad: `nan` is not a finite number"),
        (swap("2.4737e4", "1e999"), "not a finite number"),
        (swap("c2_nm_per_rad3 = 1.0e9\n", ""), "line 6, [elastic]: `c2_nm_per_rad3` is missing"),
        (swap("c1_nm", "c1_a"), "[elastic] c2_nm_per_rad3: is in newton-metres while `c1_a_per_rad` is in amperes"),
        (swap("\"masing\"", "\"massing\""), "[memory] law: \"massing\" is none of \"masing\", \"phase\", \"time\""),
        (swap("law = \"masing\"", "kernel = \"rate\""), "line 11, [memory] kernel"),
        (swap("law = \"masing\"", "gate = \"none\""), "line 11, [memory] gate"),
        (swap("2.6532e6", "-1"), "line 12, [memory] alpha"),
        (swap("422.68", "-422.68"), "[memory] omega_per_s: beta_per_s = -422.68 and omega_per_s = 226.31"),
        (swap("422.68", "0").replace("226.31", "0"), "must not both be zero"),
        (swap("omega_per_s = 226.31\n", ""), "line 10, [memory]: `omega_per_s` is missing"),
        (swap("omega_per_s = 226.31", "omega_per_s = 226.31\nreversal_play_rad = -1e-6"), "reversal_play_rad"),
        (PUBLISHED[..PUBLISHED.find("[memory]").unwrap()].to_owned(), "`[memory]` is missing"),
        (PUBLISHED[..PUBLISHED.len() - 10].to_owned(), "line 14"),
        (format!("{PUBLISHED}[[term]]\nmu = 1\n"), "line 15, [[term]]: `kind` is missing"),
        (format!("{PUBLISHED}[[term]]\nkind = \"inertia\"\ninertia_kgm2 = [[1]]\n"), "line 17, [[term]] inertia_kgm2"),
        (
            format!("{PUBLISHED}[[term]]\nkind = \"inertai\"\n"),
            "line 16, [[term]] kind: unknown kind of term; did you mean `inertia`?",
        ),
        (
            format!("{PUBLISHED}[[term]]\nkind = \"inertia\"\ninertia = 1\n"),
            "line 17, [[term]] inertia: unknown key; did you mean `inertia_kgm2`?",
        ),
        (
            format!("{PUBLISHED}[[term]]\nkind = \"inertia\"\n"),
            "line 15, [[term]] inertia_kgm2: `inertia_kgm2` is missing",
        ),
        (format!("{PUBLISHED}[[term]]\nkind = \"inertia\"\ninertia_kgm2 = [1]\n"), "`inertia_kgm2` must be a number"),
        (
            format!("{PUBLISHED}[[term]]\nkind = \"backlash\"\nshape = \"loose\"\nhalf_gap_rad = 1\n"),
            "line 17, [[term]] shape: `shape` must be one of \"clearance\" \"play\"",
        ),
        (
            format!("{PUBLISHED}[[term]]\nkind = \"backlash\"\nshape = \"play\"\nhalf_gap_rad = -1\n"),
            "line 18, [[term]] half_gap_rad: `half_gap_rad` must not be negative",
        ),
        (
            format!("{PUBLISHED}[[term]]\nkind = \"soft_windup\"\nshape = \"tanh\"\nk1_nm_per_rad = 1\n"),
            "line 18, [[term]] k1_nm_per_rad: unknown key",
        ),
        (
            format!("{PUBLISHED}[[term]]\nkind = \"creep\"\ntau_s = [1, 2]\nstiffness_nm_per_rad = [1]\n"),
            "line 18, [[term]] stiffness_nm_per_rad: `stiffness_nm_per_rad` must be as long as `tau_s`",
        ),
        (
            format!("{PUBLISHED}[[term]]\nkind = \"creep\"\ntau_s = [1,1,1,1,1,1,1,1,1]\nstiffness_nm_per_rad = [1]\n"),
            "`tau_s` holds more than 8 numbers",
        ),
        (format!("{PUBLISHED}[term]\nkind = \"inertia\"\n"), "must be [[term]] tables, not a section"),
    ];
    for (text, part) in cases {
        let error = refused(&text);
        assert!(error.to_string().starts_with("m.toml"), "{error}");
        assert!(error.to_string().contains(part), "{text}\n{error}\nshould say {part:?}");
    }
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![any::<f64>().prop_filter("finite", |x| x.is_finite()), Just(-0.0), -1e3..1e3_f64]
}

fn positive() -> impl Strategy<Value = f64> {
    prop_oneof![1e-6..1e6_f64, Just(0.1 + 0.2)]
}

/// A term of any kind with values that its registry entry accepts.
fn term() -> impl Strategy<Value = Term> {
    (prop::sample::select(KINDS.to_vec()), 0..4_usize, 1..8_usize, prop::collection::vec(number(), 8)).prop_map(
        |(kind, shape, length, numbers)| {
            let fit = |key: &KeyInfo, i: usize| match key.range {
                // Growing along a list and from key to key, as knots and kinks must.
                Range::Positive => 1.5 + i as f64,
                range if range.holds(numbers[i]) => numbers[i],
                _ => numbers[i].abs(),
            };
            let mut values = std::collections::BTreeMap::new();
            let mut shape_word = None;
            for (i, key) in kind.keys.iter().enumerate() {
                let value = match key.form {
                    Form::Choice(words) => {
                        let word = words[shape % words.len()];
                        shape_word = (key.name == "shape").then_some(word).or(shape_word);
                        TermValue::Text(word.to_owned())
                    }
                    Form::List { .. } if key.name == "knots" => {
                        TermValue::List((0..length).map(|i| i as f64).collect())
                    }
                    Form::List { .. } => TermValue::List((0..length).map(|i| fit(key, i)).collect()),
                    Form::Number => TermValue::Number(fit(key, i % 8)),
                };
                if key.belongs_to(shape_word) {
                    values.insert(key.name.to_owned(), value);
                }
            }
            Term { kind: kind.name.to_owned(), values }
        },
    )
}

prop_compose! {
    fn model()(
        name in "\\PC*",
        ampere in any::<bool>(),
        ratio in prop::option::of(positive()),
        motor in any::<bool>(),
        rated in prop::option::of(1e-6..1.0_f64),
        zero in number(),
        (joint, simulation) in (any::<bool>(), any::<bool>()),
        c in (positive(), -1e3..1e3_f64, -1e3..1e3_f64),
        law in 0..3_usize,
        (alpha, beta, omega) in (positive(), positive(), positive()),
        terms in prop::collection::vec(term(), 0..3),
    ) -> Model {
        use gmhm::{Elastic, Law, Memory};
        let elastic = Elastic { c1_nm_per_rad: c.0, c2_nm_per_rad3: c.1, c3_nm_per_rad5: c.2 };
        let law = [Law::Masing, Law::Phase, Law::Time][law];
        let memory = Memory { law, alpha, beta_per_s: beta, omega_per_s: omega, ..Memory::default() };
        Model {
            name,
            torque_unit: if ampere { TorqueUnit::Ampere } else { TorqueUnit::NewtonMetre },
            gear: gmhm_tools::model::GearSection {
                ratio: ratio.map(|n| -n),
                torque_side: if motor { TorqueSide::Motor } else { TorqueSide::Output },
                rated_deflection_rad: rated,
                deflection_zero_rad: zero,
                base: if simulation { Base::Simulation } else { Base::Model },
            },
            elastic: (!joint && !simulation).then_some(elastic),
            memory: (!joint && !simulation).then_some(memory),
            terms,
        }
    }
}

proptest! {
    #[test]
    fn written_models_read_back_bit_for_bit(model in model()) {
        let text = model.to_toml();
        let back = parse("m.toml", &text).map_err(|e| TestCaseError::fail(format!("{e}\n{text}")))?;
        // Debug tells −0 from 0, which == does not.
        prop_assert_eq!(format!("{back:?}"), format!("{model:?}"), "{}", text);
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "\\PC*") {
        let _ = parse("m.toml", &text);
    }
}
