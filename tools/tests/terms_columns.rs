//! Columns of terms: what is said to be linear is, and derivatives are those of the exact change.

use std::f64::consts::TAU;

use crate::common::PUBLISHED;
use gmhm::terms::{Domain, Form, KINDS, KeyInfo, Role};
use gmhm_tools::model::{Model, Term, TermValue, parse};
use gmhm_tools::numerics::levenberg_marquardt::descend;
use gmhm_tools::physics::columns::get;
use gmhm_tools::physics::{Evaluation, Parts, Signals};
use gmhm_tools::recording::Recording;
use gmhm_tools::regression::dataset::Dataset;
use gmhm_tools::regression::parameters::{is_linear, linear_together, of_gear, of_term, put, step, value};
use gmhm_tools::regression::variable_projection::{Iterate, VariableProjection, Weights};

const ROWS: usize = 2000;

/// 20 s of a running joint at uneven 100 Hz.
fn recording() -> Recording {
    let time_s: Vec<f64> = (0..ROWS).map(|k| 0.01 * k as f64 + 0.003 * (0.7 * k as f64).sin()).collect();
    let of_time = |f: &dyn Fn(f64) -> f64| Some(time_s.iter().map(|t| f(*t)).collect());
    Recording {
        name: "rec".into(),
        deflection_rad: of_time(&|t| 1.05e-3 * (1.3 * t).sin() * (0.6 + 0.4 * (0.31 * t).cos())),
        theta_out_rad: of_time(&|t| 1.5 * (0.7 * t).sin()),
        velocity_out_rad_per_s: of_time(&|t| 1.05 * (0.7 * t).cos()),
        temperature_c: of_time(&|t| 25.0 + 0.4 * t + 0.1 * (TAU * t).sin()),
        torque_sim_nm: of_time(&|t| 25.0 * (1.3 * t).sin()),
        time_s: time_s.into(),
        ..Recording::default()
    }
}

/// A gear with terms that scale, delay and depend on the deflection.
fn model() -> Model {
    let terms = "[[term]]\nkind = \"coulomb_friction\"\ntorque_nm = 0.4\nsmoothing_rad_per_s = 0.05\n\
        [[term]]\nkind = \"encoder_eccentricity\"\ncos_rad = 2e-5\nsin_rad = 1e-5\n\
        [[term]]\nkind = \"thermal_friction\"\nper_k = 0.02\nreference_c = 22\n\
        [[term]]\nkind = \"time_skew\"\ndelay_s = 0.004\n";
    parse("m.toml", &(PUBLISHED.to_owned() + terms)).unwrap()
}

/// A term of plausible values; lists of two.
fn term(kind: &str, choice: usize) -> Term {
    let info = gmhm::terms::kind(kind).unwrap();
    let number = |key: &KeyInfo, i: usize| {
        let (low, high) = key.plausible;
        match key.name {
            "orders" => [2.0, 3.0][i],
            "knots" => [-0.5, 0.5][i],
            "t1_nm" => 4.0,
            "t2_nm" => 12.0,
            "start_s" | "duration_s" => 5.0,
            "reference_c" => 22.0,
            // Small against the deflection.
            "cos_rad" | "sin_rad" => [3e-6, -2e-6][i],
            "half_gap_rad" | "delay_s" if kind != "time_skew" => 1e-5,
            _ => low + (high - low) * [0.01, 0.02][i],
        }
    };
    let mut values = std::collections::BTreeMap::new();
    let mut shape = None;
    for key in info.keys {
        let value = match key.form {
            Form::Choice(words) => {
                shape = (key.name == "shape").then_some(words[choice]).or(shape);
                TermValue::Text(words[choice].to_owned())
            }
            Form::List { .. } => TermValue::List((0..2).map(|i| number(key, i)).collect()),
            Form::Number => TermValue::Number(number(key, 0)),
        };
        if key.belongs_to(shape) {
            values.insert(key.name.to_owned(), value);
        }
    }
    Term { kind: kind.to_owned(), values }
}

fn choices(kind: &str) -> usize {
    let info = gmhm::terms::kind(kind).unwrap();
    let words = info.keys.iter().map(|key| if let Form::Choice(words) = key.form { words.len() } else { 1 });
    words.max().unwrap()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |a: f64, x| a.max(x.abs()))
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn the_change_is_the_sum_of_the_columns_where_a_kind_is_linear() {
    let recording = recording();
    let base = Evaluation::new(&model(), None, &recording).unwrap();
    for info in KINDS {
        for choice in 0..choices(info.name) {
            let term = term(info.name, choice);
            let columns = base.columns(&term).unwrap();
            let mut sum = vec![0.0; ROWS];
            for column in &columns {
                let value = get(&term, column.key, column.index);
                assert_ne!(value, 0.0, "{}", column.key.name);
                sum.iter_mut().zip(&column.values).for_each(|(s, x)| *s += value * x);
            }
            let change = base.change(&term).unwrap();
            let size = largest(&change);
            if columns.is_empty() {
                let linear = info.keys.iter().any(|key| key.role == Role::Linear && term.values.contains_key(key.name));
                assert!(!linear, "{}", info.name);
                continue;
            }
            let off: Vec<f64> = sum.iter().zip(&change).map(|(s, c)| s - c).collect();
            // A deflection term is linear but for the turning points that it moves.
            let (error, bound) =
                if info.domain == Domain::Deflection { (rms(&off), 0.05) } else { (largest(&off), 1e-9) };
            assert!(size > 0.0 && error <= bound * size, "{} {choice}: {error:e} of {size:e}", info.name);
        }
    }
}

/// The parts of terms that add to the torque make the change of the whole; the others change more than their own part.
#[test]
fn the_part_of_a_term_is_what_it_changes() {
    let recording = recording();
    let base = Evaluation::new(&model(), None, &recording).unwrap();
    for info in KINDS {
        let term = term(info.name, 0);
        let part = base.part(&term).unwrap();
        let adds = matches!(info.domain, Domain::Torque | Domain::Friction | Domain::Load);
        assert_eq!(part.is_some(), adds, "{}", info.name);
        let Some(part) = part else { continue };
        let change = base.change(&term).unwrap();
        let off: Vec<f64> = part.iter().zip(&change).map(|(p, c)| p - c).collect();
        assert!(largest(&off) <= 1e-9 * largest(&change), "{}", info.name);
    }
    let mut joint = joint();
    let (gravity, friction) = (term("gravity_load", 0), term("load_dependent_friction", 0));
    let part = |joint: &Model, term: &Term| Evaluation::new(joint, None, &recording).unwrap().part(term).unwrap();
    assert!(part(&joint, &gravity).is_some());
    assert!(part(&joint, &term("viscous_friction", 0)).is_some());
    assert_eq!(part(&joint, &friction), None);
    // The load of a joint is made of terms, and this friction depends on it.
    joint.terms.push(friction);
    assert_eq!(part(&joint, &gravity), None);
}

/// A joint without a gear.
fn joint() -> Model {
    parse("joint.toml", "format = 1\n[[term]]\nkind = \"gravity_load\"\ncos_nm = 9.0\nsin_nm = 1.0\n").unwrap()
}

/// What is known of a recording changes no total: other amplitudes, another delay and another shape are computed with what the models before left in the store.
#[test]
fn a_total_from_stored_parts_is_the_total() {
    let recording = recording();
    let follower = joint_with(&["load_dependent_friction"]);
    let mut compared = 0;
    for base in [model(), joint(), follower, joint_with(&["viscous_friction", "time_skew"])] {
        let parts = Parts::default();
        for info in KINDS {
            for choice in 0..choices(info.name) {
                let mut with = base.clone();
                with.terms.push(term(info.name, choice));
                for factor in [1.0, 1.1, 0.9] {
                    with.terms.iter_mut().for_each(|term| scale(term, factor));
                    let Ok(expected) = Evaluation::new(&with, None, &recording) else { continue };
                    let signals = Signals::new(&recording, &with);
                    let found = Evaluation::along(&with, None, &recording, signals, Some(&parts)).unwrap();
                    let off: Vec<f64> = expected.total().iter().zip(found.total()).map(|(e, f)| e - f).collect();
                    assert!(largest(&off) <= 1e-11 * largest(expected.total()), "{} {choice} {factor}", info.name);
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 300, "{compared}");
}

fn joint_with(kinds: &[&str]) -> Model {
    let mut joint = joint();
    joint.terms.extend(kinds.iter().map(|kind| term(kind, 0)));
    joint
}

/// Multiplies the numbers of a term that are no orders, knots or times.
fn scale(term: &mut Term, factor: f64) {
    let info = term.info().unwrap();
    for key in info.keys.iter().filter(|key| !matches!(key.name, "orders" | "knots" | "start_s" | "t1_nm" | "t2_nm")) {
        match term.values.get_mut(key.name) {
            Some(TermValue::Number(x)) => *x *= factor,
            Some(TermValue::List(list)) => list.iter_mut().for_each(|x| *x *= factor),
            _ => {}
        }
    }
}

#[test]
fn linear_values_need_not_be_given() {
    let recording = recording();
    let base = Evaluation::new(&model(), None, &recording).unwrap();
    let orders = [("orders".to_owned(), TermValue::List(vec![1.0, 2.0, 7.0]))];
    let ripple = Term { kind: "torque_ripple".into(), values: orders.into_iter().collect() };
    let columns = base.columns(&ripple).unwrap();
    let names: Vec<_> = columns.iter().map(|c| (c.key.name, c.index.unwrap())).collect();
    assert_eq!(names, [("cos_nm", 0), ("cos_nm", 1), ("cos_nm", 2), ("sin_nm", 0), ("sin_nm", 1), ("sin_nm", 2)]);
    let inertia = Term { kind: "inertia".into(), values: Default::default() };
    assert_eq!(base.columns(&inertia).unwrap().len(), 1);
    let strange = Term { kind: "inertai".into(), values: Default::default() };
    assert!(base.columns(&strange).is_err());
}

#[test]
fn the_friction_of_a_joint_follows_its_load() {
    let text = "format = 1\n[gear]\nratio = 100\ntorque_side = \"motor\"\n[[term]]\nkind = \"load_dependent_friction\"\nmu = 0.05\n";
    let recording = Recording { deflection_rad: None, ..recording() };
    let base = Evaluation::new(&parse("m.toml", text).unwrap(), None, &recording).unwrap();
    assert_eq!(largest(base.total()), 0.0);
    let columns = base.columns(&Term { kind: "gravity_load".into(), values: Default::default() }).unwrap();
    // cos q_o + 0.05 abs(cos q_o) sgn v.
    let (q, v) = (1.5_f64 * (0.7 * recording.time_s[7]).sin(), recording.velocity_out_rad_per_s.as_ref().unwrap()[7]);
    assert!((columns[0].values[7] - (q.cos() + 0.05 * q.cos().abs() * v.signum())).abs() < 1e-12);
}

/// Gears of two laws and a joint, each with terms that scale, delay and depend on the deflection.
fn bases() -> Vec<Model> {
    let (gear, mut slow, mut joint) = (model(), model(), model());
    slow.memory.as_mut().unwrap().law = gmhm::Law::Time;
    (joint.elastic, joint.memory) = (None, None);
    joint.terms.push(term("gravity_load", 0));
    vec![gear, slow, joint]
}

#[test]
fn what_is_eliminated_is_linear_together_and_what_follows_the_torque_is_not() {
    let recording = recording();
    let total = |model: &Model| Evaluation::new(model, None, &recording).map(|e| e.total().to_vec());
    let mut tried = 0;
    for base in bases() {
        for info in KINDS {
            for choice in 0..choices(info.name) {
                let mut model = base.clone();
                model.terms.push(term(info.name, choice));
                let Ok(here) = total(&model) else { continue };
                let mut parameters = of_gear(&model);
                parameters.extend((0..model.terms.len()).flat_map(|term| of_term(&model, term)));
                let together = linear_together(&model, &parameters);
                let alone: Vec<bool> = parameters.iter().map(|&parameter| is_linear(&model, parameter)).collect();
                // Far from here, each by another factor.
                let change = |k: usize| {
                    (0.3 + 0.1 * k as f64) * value(&model, parameters[k]) + 10.0 * step(&model, parameters[k])
                };
                let off = |chosen: &[bool]| {
                    let (mut all, mut left) = (model.clone(), vec![0.0; ROWS]);
                    for k in (0..parameters.len()).filter(|&k| chosen[k]) {
                        let mut one = model.clone();
                        for moved in [&mut all, &mut one] {
                            put(moved, parameters[k], value(&model, parameters[k]) + change(k));
                        }
                        let after = total(&one).unwrap();
                        left.iter_mut().zip(after.iter().zip(&here)).for_each(|(l, (a, b))| *l -= a - b);
                    }
                    let after = total(&all).unwrap();
                    left.iter_mut().zip(after.iter().zip(&here)).for_each(|(l, (a, b))| *l += a - b);
                    largest(&left) / largest(&after)
                };
                let name = format!("{} {choice} of {:?}", info.name, base.memory.map(|m| m.law));
                assert!(off(&together) < 1e-9, "{name}: {:e} beside the sum", off(&together));
                if together != alone {
                    assert!(off(&alone) > 1e-6, "{name}: linear after all");
                    tried += 1;
                }
            }
        }
    }
    assert!(tried >= 7, "{tried} terms that follow the torque");
}

#[test]
fn a_fit_leaves_nothing_that_the_eliminated_numbers_could_take() {
    let mut recording = Recording { torque_sim_nm: None, ..recording() };
    let mut truth = model();
    truth.terms.push(term("viscous_friction", 0));
    recording.torque = Some(Evaluation::new(&truth, None, &recording).unwrap().total().to_vec().into());
    let recordings = [recording];
    let mut model = truth.clone();
    let elastic = model.elastic.as_mut().unwrap();
    (elastic.c1_nm_per_rad, elastic.c2_nm_per_rad3) = (2e4, 0.0);
    let dataset = Dataset::new(&recordings, &model).unwrap();
    let mut parameters = of_gear(&model);
    parameters.extend((0..model.terms.len()).flat_map(|term| of_term(&model, term)));
    parameters.iter().for_each(|&parameter| {
        let wrong = 0.8 * value(&model, parameter);
        put(&mut model, parameter, wrong);
    });
    let together = linear_together(&model, &parameters);
    assert_eq!(together.iter().filter(|l| **l).count(), 7);
    for steps in [1, 3] {
        let from = Iterate::at(&dataset, &model, vec![None; parameters.len()]).unwrap();
        let mut walk = VariableProjection::start(&dataset, &from, &parameters, Weights::White, None, steps);
        let schedule = walk.schedule();
        let (mut stand, _) = descend(&mut walk, from, schedule, &()).unwrap();
        let columns = walk.columns(&mut stand).unwrap();
        for ((parameter, column), _) in parameters.iter().zip(&columns).zip(&together).filter(|(_, linear)| **linear) {
            let product: f64 = column.iter().zip(&stand.residual).map(|(x, r)| x * r).sum();
            let sizes = rms(column) * rms(&stand.residual) * ROWS as f64;
            assert!(product.abs() < 1e-6 * sizes, "{parameter:?} after {steps}: {product:e} of {sizes:e}");
        }
    }
}
