//! Prepared blocks: the loader takes over the words of the host's set-up, to the bit, and refuses what is none.

use crate::common;
use std::fmt::Debug;

use gmhm::block::{
    BlockError, Header, Identity, Joint, PHASE, PREPARED, PREPARED_GEAR, Parameters, Prepared, PreparedLaw, SELF_TEST,
    ScalarKind, TIME, TorqueUnit, Word, Writer, crc32, verify,
};
use gmhm::diagnostics::SelfTest;
use gmhm::drive::{Mounting, SetupError};
use gmhm::feedforward::{Controls, Demand, FeedForward, Limits, Settings};
use gmhm::memory::AnyLaw;
use gmhm::memory::masing::Masing;
use gmhm::memory::phase::Phase;
use gmhm::memory::time::Time;
use gmhm::scalar::Fixed;
use gmhm::{Gate, Inverse, Kernel, Law, Params};

const PERIOD_S: f64 = 1e-3;

fn block<S: Word>(params: &Params) -> (Vec<u8>, Inverse<S, Masing<S>>) {
    block_of(params, Masing::new(params))
}

fn block_of<S: Word, L: PreparedLaw<S>>(params: &Params, law: L) -> (Vec<u8>, Inverse<S, L>) {
    block_in(params, law, &Joint::default())
}

fn block_in<S: Word, L: PreparedLaw<S>>(params: &Params, law: L, joint: &Joint) -> (Vec<u8>, Inverse<S, L>) {
    let inverse = Inverse::of(params, law, PERIOD_S).expect("an inverse");
    let mut buffer = vec![0; 1024];
    let header = Header { period_s: PERIOD_S as f32, ..Header::new(Identity::of_name("bench"), S::KIND) };
    let mut writer = Writer::new(&mut buffer, header);
    writer.gear(inverse.gear(), params).expect("a gear");
    writer.inverse::<S>(params, PERIOD_S).expect("an inverse");
    writer.self_test(inverse.gear(), Some(&inverse)).expect("room");
    writer.prepared(&inverse).expect("room");
    writer.joint(joint).expect("a joint");
    let length = writer.finish().expect("room");
    buffer.truncate(length);
    (buffer, inverse)
}

fn restamp(mut block: Vec<u8>) -> Vec<u8> {
    let end = block.len() - 4;
    let crc = crc32(&block[..end]).to_le_bytes();
    block[end..].copy_from_slice(&crc);
    block
}

/// The place of a record's words.
fn words_of(block: &[u8], tag: u16) -> usize {
    let mut at = 48;
    loop {
        let [t0, t1, l0, l1] = [0, 1, 2, 3].map(|k| block[at + k]);
        if u16::from_le_bytes([t0, t1]) == tag {
            return at + 4;
        }
        at += 4 + usize::from(u16::from_le_bytes([l0, l1]));
    }
}

fn same<S: Word, L: PreparedLaw<S> + PartialEq + Debug>(params: &Params, law: L)
where
    Inverse<S, L>: PartialEq + Debug,
{
    let (bytes, inverse) = block_of(params, law);
    let prepared = Prepared::<S, L>::load(&bytes, 16).expect("a good block");
    assert_eq!((prepared.inverse, prepared.self_test), (inverse, SelfTest::Passed));
    let whole = Parameters::<S, L, ()>::load(&bytes, 16).expect("the same block");
    assert_eq!(whole.inverse, Some(inverse));
    assert_eq!(Parameters::<S, L, ()>::load(&bytes, 16), Ok(whole));
    // A sector holds more than the block.
    let sector = [bytes.as_slice(), &[0xFF; 300]].concat();
    assert_eq!(Prepared::<S, L>::load(&sector, 16), Ok(prepared));
    assert_eq!(Prepared::<S, L>::load(&bytes, 8), Err(BlockError::StackDepth(16)));
}

#[test]
fn the_words_are_those_of_the_host() {
    let masing = common::masing();
    same::<f32, _>(&masing, Masing::new(&masing));
    same::<Fixed, _>(&masing, Masing::new(&masing));
    for kernel in [Kernel::Deflection, Kernel::Rate] {
        for gate in [Gate::Cycle, Gate::None] {
            let [phase, time] = [Law::Phase, Law::Time].map(|law| common::params(law, kernel, gate));
            same::<f32, _>(&phase, Phase::new(&phase));
            same::<f32, _>(&time, Time::new(&time, PERIOD_S));
            same::<Fixed, _>(&time, Time::new(&time, PERIOD_S));
            for params in [&masing, &phase, &time] {
                same::<f32, _>(params, AnyLaw::new(params, PERIOD_S));
            }
        }
    }
}

/// Without a control period law `time` takes no sample by `step`, loaded either way.
#[test]
fn a_block_without_a_period_has_none() {
    let params = common::params(Law::Time, Kernel::Deflection, Gate::Cycle);
    let (bytes, _) = block_of(&params, AnyLaw::<f32>::new(&params, PERIOD_S));
    let header = *verify(&bytes).expect("a block").header();
    let mut without = bytes.clone();
    without[..48].copy_from_slice(&Header { period_s: 0.0, ..header }.encode());
    // Its golden samples were those of a period.
    let samples = words_of(&without, SELF_TEST.tag);
    without[samples - 4..samples - 2].copy_from_slice(&0x8077_u16.to_le_bytes());
    let without = restamp(without);
    let prepared = Prepared::<f32, AnyLaw<f32>>::load(&without, 16).expect("a good block");
    let whole = Parameters::<f32, AnyLaw<f32>, ()>::load(&without, 16).expect("a good block");
    assert_eq!(whole.gear.as_ref(), Some(prepared.gear()));
    let mut state = prepared.gear().start::<16>(0.0);
    assert!(prepared.gear().step(&mut state, 1e-4).refused);
    assert!(!prepared.gear().step_after(&mut state, 1e-4, 1e-3).refused);
}

#[test]
fn a_block_of_another_law_is_refused() {
    let [phase, time] = [Law::Phase, Law::Time].map(|law| common::params(law, Kernel::Deflection, Gate::Cycle));
    let (of_phase, _) = block_of(&phase, Phase::<f32>::new(&phase));
    let (of_time, _) = block_of(&time, Time::<f32>::new(&time, PERIOD_S));
    assert_eq!(Prepared::<f32>::load(&of_phase, 16).map(drop), Err(BlockError::Missing(PREPARED.tag)));
    assert_eq!(Prepared::<f32, Phase<f32>>::load(&of_time, 16).map(drop), Err(BlockError::Missing(PHASE.tag)));
    assert_eq!(Prepared::<f32, Time<f32>>::load(&of_phase, 16).map(drop), Err(BlockError::Missing(TIME.tag)));
    let at = words_of(&of_phase, PREPARED_GEAR.tag);
    let mut nameless = of_phase.clone();
    nameless[at - 4..at - 2].copy_from_slice(&0x8077_u16.to_le_bytes());
    let loaded = Prepared::<f32, AnyLaw<f32>>::load(&restamp(nameless), 16).map(drop);
    assert_eq!(loaded, Err(BlockError::Missing(PREPARED_GEAR.tag)));
    // A law that differs from the one that was prepared comes out otherwise.
    for (bytes, tag) in [(&of_phase, PHASE.tag), (&of_time, TIME.tag)] {
        let mut changed = bytes.clone();
        let at = words_of(bytes, tag) + if tag == PHASE.tag { 4 } else { 32 };
        changed[at..at + 4].copy_from_slice(&0.01_f32.to_le_bytes());
        let loaded = Prepared::<f32, AnyLaw<f32>>::load(&restamp(changed), 16).map(drop);
        assert_eq!(loaded, Err(BlockError::SelfTest));
    }
}

#[test]
fn what_is_not_prepared_is_refused() {
    let params = common::masing();
    let (bytes, _) = block::<f32>(&params);
    assert_eq!(Prepared::<Fixed>::load(&bytes, 16), Err(BlockError::Scalar(ScalarKind::F32.bytes())));
    let at = words_of(&bytes, PREPARED.tag);
    let with = |at: usize, new: &[u8]| {
        let mut changed = bytes.clone();
        changed[at..at + new.len()].copy_from_slice(new);
        changed
    };
    let load = |bytes: Vec<u8>| Prepared::<f32>::load(&restamp(bytes), 16).map(drop);
    assert_eq!(Prepared::<f32>::load(&with(at, &[1]), 16).map(drop), Err(BlockError::Checksum));
    assert_eq!(load(with(at + 16, &f32::NAN.to_le_bytes())), Err(BlockError::Malformed(PREPARED.tag)));
    assert_eq!(load(with(at - 4, &0x8077_u16.to_le_bytes())), Err(BlockError::Missing(PREPARED.tag)));
    // A wrong stiffness, a wrong bound of the search: other torques or another solution than the host's.
    assert_eq!(load(with(at + 16, &1.0_f32.to_le_bytes())), Err(BlockError::SelfTest));
    let samples = words_of(&bytes, SELF_TEST.tag);
    for sample in 0..9 {
        let mut changed = bytes.clone();
        changed[samples + 4 * sample] ^= 1;
        assert_eq!(load(changed), Err(BlockError::SelfTest), "sample {sample}");
    }
    // Without samples nothing is compared.
    let untested = restamp(with(samples - 4, &0x8077_u16.to_le_bytes()));
    let prepared = Prepared::<f32>::load(&untested, 16).expect("a block of a writer without samples");
    assert_eq!(prepared.self_test, SelfTest::NotRun);
}

#[test]
fn amperes_are_not_taken_for_newton_metres() {
    let params = common::masing();
    let (bytes, _) = block::<f32>(&params);
    let header = *verify(&bytes).expect("a block").header();
    let mut amperes = bytes.clone();
    amperes[..48].copy_from_slice(&Header { torque_unit: TorqueUnit::Ampere, ..header }.encode());
    for (bytes, unit) in [(bytes, TorqueUnit::NewtonMetre), (restamp(amperes), TorqueUnit::Ampere)] {
        let block = verify(&bytes).expect("a block");
        for asked in [TorqueUnit::NewtonMetre, TorqueUnit::Ampere] {
            let loaded = Prepared::<f32>::of_block_in(&block, 16, asked).map(|_| ());
            assert_eq!(loaded, if asked == unit { Ok(()) } else { Err(BlockError::Unit(unit)) });
        }
        // Without a word of the unit it is newton metres.
        let loaded = Prepared::<f32>::load(&bytes, 16).map(|_| ());
        assert_eq!(loaded, if unit == TorqueUnit::NewtonMetre { Ok(()) } else { Err(BlockError::Unit(unit)) });
    }
}

/// Ratio, zero and rated deflection reach the encoders, in fixed point, too.
fn encoders_of<S: Word>() {
    let params = common::masing();
    let joint = Joint { ratio: Some(-100.5), deflection_zero_rad: 0.1255, motor_side: true };
    let (bytes, _) = block_in::<S, _>(&params, Masing::new(&params), &joint);
    let verified = verify(&bytes).expect("a block");
    let prepared = Prepared::<S>::of_block(&verified, 16).expect("a good block");
    let mounting = Mounting { counts_per_turn: 1 << 20, reversed: false };
    let setup = prepared.encoders(&verified, mounting, mounting).expect("a ratio");
    assert_eq!(Ok(setup), joint.encoders(mounting, mounting, common::A));
    assert_eq!((setup.ratio, setup.motor.reversed, setup.deflection_zero_rad), ((201, 2), true, 0.1255));
    assert_eq!(setup.rated_deflection_rad, common::A);
    // Another block, or one without a ratio.
    let (other, _) = block::<S>(&params);
    let other = verify(&other).expect("a block");
    assert_eq!(prepared.encoders(&other, mounting, mounting), Err(SetupError::Block));
    let without = Prepared::<S>::of_block(&other, 16).expect("a good block");
    assert_eq!(without.encoders(&other, mounting, mounting), Err(SetupError::Ratio));
}

#[test]
fn a_block_knows_its_encoders() {
    encoders_of::<f32>();
    encoders_of::<Fixed>();
}

#[test]
fn feed_forward_from_a_block_is_that_of_the_parameters() {
    let params = common::masing();
    let (bytes, _) = block::<f32>(&params);
    let prepared = Prepared::<f32>::load(&bytes, 16).expect("a good block");
    let settings = Settings { ramp_s: 0.2, offset_slew_rad_per_s: 0.05, ..Settings::default() };
    let limits = Limits::of(&settings);
    let from_block = FeedForward::of_inverse(&prepared.inverse, &limits).expect("limits");
    let from_params = FeedForward::<f32, _>::of(&params, Masing::new(&params), &settings).expect("settings");
    let (mut a, mut b) = (from_block.start::<16>(0.0), from_params.start::<16>(0.0));
    let controls = Controls { on: true, ..Controls::default() };
    for k in 0..2000 {
        let demand = Demand { torque: 20.0 * (0.01 * k as f32).sin(), deflection: 0.0 };
        let [a, b] = [from_block.step(&mut a, &controls, &demand), from_params.step(&mut b, &controls, &demand)];
        assert_eq!(a, b, "{k}");
    }
    for none in [f32::NAN, 0.0, -1.0] {
        assert!(FeedForward::of_inverse(&prepared.inverse, &Limits { ramp_s: none, ..limits }).is_err());
        assert!(FeedForward::of_inverse(&prepared.inverse, &Limits { torque_slew_nm_per_s: none, ..limits }).is_err());
    }
}
