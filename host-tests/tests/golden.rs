//! Golden blocks: what firmware in the field was given once stays readable for ever, to the bit.
//!
//! A golden block is never written again. `cargo test -p gmhm-host-tests --test all golden -- --ignored` adds those that are missing, for a new format version.

use crate::common;
use std::fmt::Debug;
use std::path::PathBuf;

use gmhm::block::{
    BlockError, BlockLaw, FORMAT_VERSION, Header, Identity, Joint, Parameters, Prepared, PreparedLaw, ScalarKind,
    TermStack, TorqueUnit, Word, Writer, verify,
};
use gmhm::diagnostics::SelfTest;
use gmhm::drive::Mounting;
use gmhm::memory::AnyLaw;
use gmhm::memory::masing::Masing;
use gmhm::memory::time::Time;
use gmhm::scalar::Fixed;
use gmhm::terms::{Form, KINDS, KeyInfo, KindInfo, Setting, Source, Stack, Term, TermError, Value};
use gmhm::{Gate, Gear, Inverse, Kernel, Law, Params};

const PERIOD_S: f64 = 1e-3;

/// File, CRC-32.
const GOLDEN: [(&str, u32); 22] = [
    ("block-1-masing", 0xbc7d_4194),
    ("block-1-phase", 0x7a4e_255d),
    ("block-1-time", 0x6913_b125),
    ("block-1-masing-fixed", 0xc282_aebc),
    ("block-1-time-fixed", 0x9a95_97f9),
    ("block-1-joint", 0x94d4_e0e2),
    ("block-1-terms-1", 0x4f32_b9a6),
    ("block-1-terms-9", 0x18b8_918b),
    ("block-1-terms-17", 0x2f3d_7dfe),
    ("block-1-shapes", 0x19b7_1ee5),
    ("block-1-terms-24", 0xfa9a_9165),
    ("block-1-tested", 0x4c1b_aaa0),
    ("block-1-tested-fixed", 0x2b72_d216),
    ("block-1-prepared", 0xa44a_a311),
    ("block-1-prepared-fixed", 0x864b_1aa7),
    ("block-1-phase-prepared-tested", 0xcc84_61d3),
    ("block-1-time-prepared-tested", 0x265e_822c),
    ("block-1-time-prepared-tested-fixed", 0x0a7f_a053),
    ("block-1-prepared-terms-1", 0x9c4f_a81d),
    ("block-1-prepared-terms-9", 0xf9cd_2b1f),
    ("block-1-prepared-terms-17", 0x1bb9_3869),
    ("block-1-prepared-shapes", 0xc120_ac28),
];

fn file(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/golden")).join(format!("{name}.bin"))
}

fn golden(name: &str) -> Vec<u8> {
    std::fs::read(file(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Values for every key, growing along lists and from key to key.
struct Grown {
    info: &'static KindInfo,
    shape: usize,
    /// Whether keys are stated that the first blocks had not.
    appended: bool,
}

impl Grown {
    fn first(info: &'static KindInfo, shape: usize) -> Self {
        Self { info, shape, appended: false }
    }
}

impl Source<f32> for Grown {
    fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, f32>> {
        if key.appended && !self.appended {
            return None;
        }
        let place = self.info.keys.iter().position(|other| other.name == key.name)?;
        Some(match key.form {
            Form::Number => Value::Number(1.0 + place as f32),
            Form::List { .. } if self.appended => Value::List(&[1.5, 2.0, 4.0]),
            Form::List { .. } => Value::List(&[0.25, 0.5, 2.0]),
            Form::Choice(_) => Value::Choice(self.shape),
        })
    }
}

/// Kinds of the first blocks.
const FIRST_KINDS: usize = 23;

/// The terms of a block by its name: eight kinds from a number on, every shape of the kinds that have one, or what came after the first blocks.
fn terms(name: &str) -> Vec<Grown> {
    let shaped = |info: &'static KindInfo| match info.keys.iter().find(|key| key.name == "shape").map(|key| key.form) {
        Some(Form::Choice(words)) => words.len(),
        _ => 0,
    };
    if name.ends_with("shapes") {
        let kinds = KINDS.iter().filter(|info| info.name != "wear");
        return kinds.flat_map(|info| (0..shaped(info)).map(move |shape| Grown::first(info, shape))).collect();
    }
    if name == "block-1-terms-24" {
        let earlier = KINDS[..FIRST_KINDS].iter().filter(|info| info.keys.iter().any(|key| key.appended));
        let later = KINDS[FIRST_KINDS..].iter();
        return earlier.chain(later).map(|info| Grown { info, shape: 1, appended: true }).collect();
    }
    let Some((_, first)) = name.split_once("terms-") else { return Vec::new() };
    let first: usize = first.parse().expect("a number");
    KINDS[..FIRST_KINDS].iter().skip(first - 1).take(8).map(|info| Grown::first(info, 0)).collect()
}

fn params(name: &str) -> Params {
    let law = name.split('-').nth(2).expect("a law");
    match law {
        "phase" => common::params(Law::Phase, Kernel::Deflection, Gate::Cycle),
        "time" => common::params(Law::Time, Kernel::Rate, Gate::None),
        _ => common::masing(),
    }
}

/// A golden block as the version of this crate writes it.
fn written(name: &str) -> Vec<u8> {
    let scalar = if name.ends_with("fixed") { ScalarKind::Fixed } else { ScalarKind::F32 };
    let unit = if name.ends_with("joint") { TorqueUnit::Ampere } else { TorqueUnit::NewtonMetre };
    let header =
        Header { period_s: PERIOD_S as f32, torque_unit: unit, ..Header::new(Identity::of_name(name), scalar) };
    let mut buffer = vec![0; 4096];
    let mut writer = Writer::new(&mut buffer, header);
    let (params, tested) = (params(name), name.contains("tested"));
    let done = match (scalar, params.memory().law) {
        _ if name.ends_with("joint") => Ok(()),
        (ScalarKind::F32, _) => gear(&mut writer, &params, AnyLaw::<f32>::new(&params, PERIOD_S), tested),
        (ScalarKind::Fixed, Law::Time) => gear(&mut writer, &params, Time::<Fixed>::new(&params, PERIOD_S), tested),
        (ScalarKind::Fixed, _) => gear(&mut writer, &params, Masing::<Fixed>::new(&params), tested),
    };
    done.expect("a gear");
    if name.contains("prepared") {
        match (scalar, params.memory().law) {
            (ScalarKind::F32, _) => prepare(&mut writer, &params, AnyLaw::<f32>::new(&params, PERIOD_S)),
            (ScalarKind::Fixed, Law::Time) => prepare(&mut writer, &params, Time::<Fixed>::new(&params, PERIOD_S)),
            (ScalarKind::Fixed, _) => prepare(&mut writer, &params, Masing::<Fixed>::new(&params)),
        }
    }
    let joint = Joint { ratio: Some(-100.0), deflection_zero_rad: 0.125, motor_side: unit == TorqueUnit::Ampere };
    writer.joint(&joint).expect("a joint");
    let of_joint = ["gravity_load", "inertia"].map(|name| gmhm::terms::kind(name).expect("a kind"));
    let of_joint = of_joint.into_iter().filter(|_| name.ends_with("joint")).map(|info| Grown::first(info, 0));
    for term in terms(name).into_iter().chain(of_joint) {
        writer.term(term.info.name, &term).expect("a term");
    }
    writer.name("Größe 25, Gelenk 3").expect("room");
    let length = writer.finish().expect("room");
    buffer.truncate(length);
    buffer
}

fn prepare<S: Word, L: PreparedLaw<S>>(writer: &mut Writer<'_>, params: &Params, law: L) {
    writer.prepared(&Inverse::of(params, law, PERIOD_S).expect("an inverse")).expect("room");
}

fn gear<S: Word, L: BlockLaw<S>>(
    writer: &mut Writer<'_>,
    params: &Params,
    law: L,
    tested: bool,
) -> Result<(), BlockError> {
    let gear = Gear::with_law(params, law);
    writer.gear(&gear, params)?;
    writer.inverse::<S>(params, PERIOD_S)?;
    if tested {
        let inverse = Inverse::of(params, law, PERIOD_S).expect("an inverse");
        writer.self_test(&gear, Some(&inverse))?;
    }
    Ok(())
}

/// The gear of a golden block has the coefficients of its parameters to the bit, and its inverse inverts it.
fn hold<S: Word, L, T>(name: &str, law: L, tolerance: f64)
where
    L: BlockLaw<S> + PartialEq + Debug,
    T: TermStack,
{
    let params = params(name);
    let loaded = Parameters::<S, L, T>::load_any(&golden(name), 16).expect("a good block");
    assert_eq!(loaded.gear, Some(Gear::with_law(&params, law)), "{name}");
    let expected = if name.contains("tested") { SelfTest::Passed } else { SelfTest::NotRun };
    assert_eq!(loaded.self_test, expected, "{name}");
    let inverse = loaded.inverse.expect("an inverse");
    let gear = inverse.gear();
    let mut state = gear.start::<16>(S::ZERO);
    for u in [0.1, 0.3, 0.2, -0.4, 0.3, -0.1, 0.35] {
        let torque = S::from_f64(u * gear.frame().torque_scale().to_f64());
        let (solution, out) = inverse.commit(&mut state, torque);
        assert!(solution.converged && !solution.saturated, "{name}");
        let error = (out.torque.to_f64() - torque.to_f64()) / gear.frame().torque_scale().to_f64();
        assert!(error.abs() < tolerance, "{name}: {error:e}");
    }
}

/// The parameters of a block in newton metres or amperes.
fn in_its_unit(bytes: &[u8]) -> Parameters {
    let block = verify(bytes).expect("a good block");
    Parameters::of_any_block(&block, 16, block.header().torque_unit).expect("a good block")
}

#[test]
fn golden_blocks_load_to_the_bit() {
    for (name, crc) in GOLDEN {
        assert_eq!(verify(&golden(name)).expect("a good block").crc(), crc, "{name}");
        let params = params(name);
        match (name.ends_with("fixed"), params.memory().law) {
            (true, Law::Time) => hold::<Fixed, _, ()>(name, Time::new(&params, PERIOD_S), 1e-6),
            (true, _) => hold::<Fixed, _, ()>(name, Masing::new(&params), 1e-6),
            (false, _) if name.ends_with("joint") => {
                let loaded = in_its_unit(&golden(name));
                assert!(loaded.gear.is_none() && loaded.header.torque_unit == TorqueUnit::Ampere);
            }
            (false, _) => hold::<f32, _, Stack<f32, 8>>(name, AnyLaw::new(&params, PERIOD_S), 1e-5),
        }
    }
}

#[test]
fn golden_blocks_hold_their_terms() {
    let (c1, rated_deflection) = (common::elastic().c1_nm_per_rad as f32, common::A as f32);
    let setting = Setting { sigma: -1.0, c1, rated_deflection };
    let mut count = 0;
    for (name, _) in GOLDEN {
        if name.ends_with("fixed") {
            continue;
        }
        let bytes = golden(name);
        let loaded = in_its_unit(&bytes);
        assert_eq!(verify(&bytes).expect("a good block").name(), "Größe 25, Gelenk 3");
        assert_eq!((loaded.joint.ratio, loaded.joint.deflection_zero_rad), (Some(-100.0), 0.125));
        let expected = terms(name);
        if !expected.is_empty() {
            let read = expected.iter().map(|term| Term::read(term.info.name, term, setting).expect("a term"));
            assert_eq!(loaded.terms.terms(), read.collect::<Vec<_>>(), "{name}");
        }
        count += loaded.terms.terms().len();
    }
    assert_eq!(count, 2 + 2 * (FIRST_KINDS + 8) + 8);
}

/// What loaders without double precision make of a block is what the other one does.
#[test]
fn prepared_blocks_load_to_the_same_gear_and_terms() {
    let mut count = 0;
    for (name, _) in GOLDEN.iter().filter(|(name, _)| name.contains("prepared") && !name.ends_with("fixed")) {
        let bytes = golden(name);
        let (block, loaded) = (verify(&bytes).expect("a good block"), Parameters::<f32>::load_any(&bytes, 16));
        let loaded = loaded.expect("a good block");
        assert_eq!(Parameters::<f32>::load(&bytes, 16).as_ref(), Ok(&loaded), "{name}");
        let prepared = Prepared::<f32, AnyLaw<f32>>::of_block(&block, 16).expect("a prepared block");
        assert_eq!((Some(prepared.inverse), prepared.self_test), (loaded.inverse, loaded.self_test), "{name}");
        let terms = prepared.terms::<8>(&block).expect("good terms").plant(&block);
        let plant = loaded.terms.plant();
        // Scaled by a c1 that was rounded otherwise.
        let is_exact = |term: &&Term<f32>| term.info().name != "thermal_stiffness";
        let exact = |terms: &[Term<f32>]| terms.iter().filter(is_exact).cloned().collect::<Vec<_>>();
        assert_eq!((exact(terms.terms()), terms.terms().len()), (exact(plant.terms()), plant.terms().len()), "{name}");
        count += terms.terms().len();
        if loaded.terms.terms().len() == 8 {
            let refused = prepared.terms::<7>(&block).expect_err("no room");
            assert!(matches!(refused, BlockError::Term { error: TermError::StackFull, .. }), "{refused:?}");
        }
    }
    assert!(count > FIRST_KINDS, "{count} terms");
}

/// What is written stays the same too. A change that means to write otherwise gives what it writes golden blocks of its own, and leaves these.
#[test]
fn the_present_version_writes_the_golden_blocks() {
    assert_eq!(FORMAT_VERSION, 1);
    for (name, _) in GOLDEN {
        assert!(written(name) == golden(name), "{name} is written otherwise");
    }
}

#[test]
#[ignore = "adds the golden blocks that are missing"]
fn write_missing_golden_blocks() {
    for (name, _) in GOLDEN {
        if !file(name).exists() {
            std::fs::write(file(name), written(name)).expect("a file");
        }
    }
}

/// The images load the published gear as it is set up from SI units.
#[test]
fn the_blocks_of_the_images_hold_the_published_gear() {
    fn check<S: Word>(name: &str)
    where
        Masing<S>: PreparedLaw<S>,
    {
        let block = std::fs::read(format!("{}/../src/bin/platform/{name}.bin", env!("CARGO_MANIFEST_DIR")));
        let block = block.expect("a block");
        let params = common::masing();
        let prepared = Prepared::<S>::load(&block, 16).expect("a prepared block");
        assert_eq!(
            prepared.inverse,
            Inverse::of(&params, Masing::new(&params), PERIOD_S).expect("an inverse"),
            "{name}"
        );
        let encoder = Mounting { counts_per_turn: 1 << 14, reversed: false };
        let encoders = prepared.encoders(&verify(&block).expect("a block"), encoder, encoder).expect("a joint");
        assert_eq!(
            (encoders.ratio, encoders.rated_deflection_rad),
            ((100, 1), params.rated_deflection_rad()),
            "{name}"
        );
    }
    check::<f32>("published");
    check::<Fixed>("published-fixed");
}
