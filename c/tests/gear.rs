//! The small type of `gmhm.h` for every law: its torques and deflections are those of `gmhm_joint` to the bit, and what goes wrong is counted; the counters of the feed-forwards.

use crate::common;
use std::mem::MaybeUninit;

use crate::common::{A, at, block, block_in_time, block_of, block_with, joint, number, random, strange, without};
use gmhm::block::{BlockError, Joint as JointOfGear, PREPARED, TorqueUnit};
use gmhm::diagnostics::{Fault, SelfTest};
use gmhm_c::{
    ContributionC, DemandC, DiagnosticsC, FeedForwardC, GearC, Law, LimitsC, NULL, OK, OutputC, SampleC, StatusC, UNIT,
    VALUE, flag,
};

/// What a call writes, and what it returns.
fn out<T, R>(call: impl FnOnce(Option<&mut MaybeUninit<T>>) -> R) -> (T, R) {
    let mut to = MaybeUninit::uninit();
    let returned = call(Some(&mut to));
    // SAFETY: the call has written it.
    (unsafe { to.assume_init() }, returned)
}

fn init(block: &[u8]) -> (Box<GearC>, u16) {
    let mut gear = Box::new(MaybeUninit::uninit());
    // SAFETY: the block outlives the call, and gmhm_gear_init writes the gear.
    unsafe {
        let code = gmhm_c::gmhm_gear_init(Some(&mut gear), block.as_ptr(), block.len() as u32);
        (gear.assume_init(), code)
    }
}

fn gear(block: &[u8]) -> Box<GearC> {
    let (gear, code) = init(block);
    assert_eq!(code, OK);
    gear
}

fn step(gear: &mut GearC, u: f32) -> OutputC {
    let (output, flags) = out(|to| gmhm_c::gmhm_gear_step(Some(gear), u * A, to));
    assert_eq!(output.flags, flags);
    output
}

fn load(gear: &mut GearC, block: &[u8]) -> u16 {
    // SAFETY: the block outlives the call.
    unsafe { gmhm_c::gmhm_gear_load(Some(gear), block.as_ptr(), block.len() as u32) }
}

fn status(gear: &GearC) -> StatusC {
    out(|to| gmhm_c::gmhm_gear_get_status(Some(gear), to)).0
}

fn seen(gear: &GearC) -> DiagnosticsC {
    let (seen, code) = out(|to| gmhm_c::gmhm_gear_get_diagnostics(Some(gear), to));
    assert_eq!(code, OK);
    seen
}

#[test]
fn torques_and_deflections_are_those_of_a_joint() {
    for bytes in [block(), block_in_time()] {
        let (mut gear, mut joint) = (gear(&bytes), joint());
        // SAFETY: the block outlives the call.
        let code = unsafe { gmhm_c::gmhm_load(Some(&mut joint), bytes.as_ptr(), bytes.len() as u32) };
        assert_eq!(code, OK);
        for k in 0..3000_u32 {
            let phase = (k % 200) as f32 / 100.0 - 1.0;
            let u = (1.0 - 2.0 * phase.abs()) * (0.2 + (k / 200) as f32 / 10.0);
            let of_joint = common::gmhm_step(Some(&mut joint), Some(&at(u * A)));
            assert_eq!(step(&mut gear, u), of_joint);
            let (aim, _) = out(|to| gmhm_c::gmhm_gear_invert(Some(&mut gear), 10.0 * u, to));
            assert_eq!(aim, common::gmhm_invert(Some(&mut joint), 10.0 * u, None));
            // Another block with the loop running.
            if k == 1500 {
                let other = block_with(1.2, &[]);
                assert_eq!(load(&mut gear, &other), OK);
                // SAFETY: the block outlives the call.
                let code = unsafe { gmhm_c::gmhm_load(Some(&mut joint), other.as_ptr(), other.len() as u32) };
                assert_eq!(code, OK);
            }
        }
        assert_eq!(status(&gear), common::gmhm_get_status(Some(&joint)));
    }
}

#[test]
fn faults_are_counted_until_they_are_cleared() {
    let mut gear = gear(&block());
    assert_eq!(gmhm_c::gmhm_gear_set_largest_step(None, 1.0), NULL);
    for none in [f32::NAN, -1.0] {
        assert_eq!(gmhm_c::gmhm_gear_set_largest_step(Some(&mut gear), none), VALUE);
    }
    assert_eq!(gmhm_c::gmhm_gear_set_largest_step(Some(&mut gear), 0.1 * A), OK);
    for u in [f32::NAN, 0.0, f32::NAN, 0.05, 5.0, 0.1, 0.7, 0.72, 0.74] {
        step(&mut gear, u);
    }
    let last_fault = u32::from(Fault::Restarted.number());
    let tested = DiagnosticsC { self_test: u32::from(SelfTest::Passed.number()), ..DiagnosticsC::default() };
    assert_eq!(seen(&gear), DiagnosticsC { refused: 2, quarantined: 3, restarted: 1, last_fault, ..tested });
    gmhm_c::gmhm_gear_clear_diagnostics(Some(&mut gear));
    assert_eq!(seen(&gear), tested);
    gmhm_c::gmhm_gear_restart(Some(&mut gear));
    assert_eq!(step(&mut gear, 0.9).flags, 0);
}

#[test]
fn what_is_none_is_refused_and_changes_nothing() {
    let zero = JointOfGear { ratio: Some(-100.0), deflection_zero_rad: 0.125, motor_side: true };
    let mut gear = gear(&block_of(&zero, TorqueUnit::NewtonMetre));
    let in_force = status(&gear);
    assert_eq!((in_force.ratio, in_force.deflection_zero_rad, in_force.torque_on_motor_side), (-100.0, 0.125, 1));
    let amperes = block_of(&JointOfGear::default(), TorqueUnit::Ampere);
    let mut damaged = block();
    damaged[60] ^= 1;
    for (bytes, code) in [
        (&amperes, UNIT),
        (&damaged, BlockError::Checksum.code()),
        (&without(block(), PREPARED.tag), BlockError::Missing(PREPARED.tag).code()),
    ] {
        assert_eq!(load(&mut gear, bytes), code);
        assert_eq!(status(&gear), in_force);
    }
    // SAFETY: the block outlives the call.
    unsafe {
        let load = gmhm_c::gmhm_gear_load_amperes;
        assert_eq!(load(Some(&mut gear), amperes.as_ptr(), amperes.len() as u32), OK);
        assert_eq!(load(None, amperes.as_ptr(), 0), NULL);
        assert_eq!(load(Some(&mut gear), std::ptr::null(), 0), NULL);
    }
    assert_eq!(status(&gear).torque_in_amperes, 1);
    let (mut empty, code) = init(&damaged);
    assert_eq!(code, BlockError::Checksum.code());
    assert_eq!(step(&mut empty, 0.1).flags, flag::NOT_LOADED);
    assert_eq!(gmhm_c::gmhm_gear_step(None, 0.0, None), flag::NOT_LOADED);
    assert_eq!(gmhm_c::gmhm_gear_get_diagnostics(None, None), NULL);
}

/// As a feed-forward does, a gear and a joint count the torques that they are asked for beyond the range, and those that are none.
#[test]
fn an_inverse_counts_what_goes_wrong() {
    let bytes = block();
    let (mut gear, mut joint) = (gear(&bytes), joint());
    // SAFETY: the block outlives the call.
    let code = unsafe { gmhm_c::gmhm_load(Some(&mut joint), bytes.as_ptr(), bytes.len() as u32) };
    assert_eq!(code, OK);
    let expected = DiagnosticsC { refused: 1, saturated: 2, last_fault: 5, self_test: 1, ..DiagnosticsC::default() };
    for torque_nm in [5.0, 1e4, f32::NAN, -1e4, 5.0] {
        let (aim, _) = out(|to| gmhm_c::gmhm_gear_invert(Some(&mut gear), torque_nm, to));
        assert_eq!(aim, common::gmhm_invert(Some(&mut joint), torque_nm, Some(&at(0.0))));
    }
    assert_eq!(out(|to| gmhm_c::gmhm_gear_get_diagnostics(Some(&gear), to)).0, expected);
    assert_eq!(out(|to| gmhm_c::gmhm_get_diagnostics(Some(&joint), to)).0, expected);
    // With terms, too.
    let with_terms = block_with(1.0, &["coulomb_friction"]);
    // SAFETY: the block outlives the call.
    let code = unsafe { gmhm_c::gmhm_load(Some(&mut joint), with_terms.as_ptr(), with_terms.len() as u32) };
    assert_eq!(code, OK);
    common::gmhm_step(Some(&mut joint), Some(&at(0.0)));
    for torque_nm in [5.0, 1e4, f32::NAN] {
        common::gmhm_invert(Some(&mut joint), torque_nm, Some(&at(0.0)));
    }
    let expected = DiagnosticsC { refused: 2, saturated: 3, last_fault: 1, ..expected };
    assert_eq!(out(|to| gmhm_c::gmhm_get_diagnostics(Some(&joint), to)).0, expected);
}

const LIMITS: LimitsC = LimitsC {
    period_s: 1e-3,
    ramp_s: 0.1,
    offset_slew_rad_per_s: f32::INFINITY,
    torque_slew_nm_per_s: f32::INFINITY,
    largest_rate_rad_per_s: 100.0 * A,
};

/// A good torque, one beyond the range, one that is none, then measured deflections of which three lie too far off.
fn demands() -> impl Iterator<Item = DemandC> {
    let good = DemandC { torque_nm: 5.0, gain_ratio: 1.0, on: 1, ..DemandC::default() };
    let torques = [5.0, 1e4, f32::NAN, 5.0].map(|torque_nm| DemandC { torque_nm, ..good });
    let measured = |u: f32| DemandC { deflection_rad: u * A, along_measurement: 1, ..good };
    torques.into_iter().chain([0.25, 0.2, f32::NAN, 0.9, 0.91, 0.92, 0.93].map(measured))
}

const SEEN: DiagnosticsC = DiagnosticsC {
    refused: 2,
    out_of_range: 0,
    quarantined: 2,
    restarted: 1,
    saturated: 1,
    merged_pairs: 0,
    last_fault: 4,
    self_test: 1,
};

#[test]
fn the_law_counts_what_goes_wrong() {
    let bytes = block();
    let mut law = Box::new(MaybeUninit::<Law>::uninit());
    // SAFETY: the block outlives the call, and gmhm_law_init writes the law.
    let mut law = unsafe {
        assert_eq!(gmhm_c::gmhm_law_init(Some(&mut law), bytes.as_ptr(), bytes.len() as u32, Some(&LIMITS)), OK);
        law.assume_init()
    };
    for demand in demands() {
        out::<ContributionC, _>(|to| gmhm_c::gmhm_law_step(Some(&mut law), Some(&demand), to));
    }
    let seen = |law: &Law| out(|to| gmhm_c::gmhm_law_get_diagnostics(Some(law), to)).0;
    let found: DiagnosticsC = seen(&law);
    assert_eq!(DiagnosticsC { out_of_range: 0, ..found }, SEEN);
    gmhm_c::gmhm_law_clear_diagnostics(Some(&mut law));
    assert_eq!(seen(&law), DiagnosticsC { self_test: 1, ..DiagnosticsC::default() });
}

#[test]
fn the_feed_forward_counts_what_goes_wrong_and_tells_the_zero() {
    let zero = JointOfGear { ratio: Some(100.0), deflection_zero_rad: 0.125, motor_side: true };
    let bytes = block_of(&zero, TorqueUnit::NewtonMetre);
    let mut feed = Box::new(MaybeUninit::<FeedForwardC>::uninit());
    // SAFETY: the block outlives the call, and gmhm_feed_forward_init writes the feed-forward.
    let mut feed = unsafe {
        let code = gmhm_c::gmhm_feed_forward_init(Some(&mut feed), bytes.as_ptr(), bytes.len() as u32, Some(&LIMITS));
        assert_eq!(code, OK);
        feed.assume_init()
    };
    for demand in demands() {
        let sample = SampleC::default();
        out::<ContributionC, _>(|to| gmhm_c::gmhm_feed_forward_step(Some(&mut feed), Some(&demand), Some(&sample), to));
    }
    let seen = |feed: &FeedForwardC| out(|to| gmhm_c::gmhm_feed_forward_get_diagnostics(Some(feed), to)).0;
    let found: DiagnosticsC = seen(&feed);
    assert_eq!(DiagnosticsC { out_of_range: 0, ..found }, SEEN);
    gmhm_c::gmhm_feed_forward_clear_diagnostics(Some(&mut feed));
    assert_eq!(seen(&feed), DiagnosticsC { self_test: 1, ..DiagnosticsC::default() });
    let (status, flags): (StatusC, u32) = out(|to| gmhm_c::gmhm_feed_forward_get_status(Some(&feed), to));
    assert_eq!((status.ratio, status.deflection_zero_rad, status.flags), (100.0, 0.125, flags));
    assert!(status.range_rad > 0.0);
}

/// Whatever a sample, a torque or a gate is, and torn blocks between: torques and deflections are finite and within their limits, and the next good sample is taken.
#[test]
fn fuzzed_samples_are_answered() {
    // Law `time` follows the sizes of strokes, so a gate is what keeps it from absurd ones.
    for (bytes, is_gated) in [(block(), false), (block(), true), (block_in_time(), true)] {
        let (mut gear, mut next) = (gear(&bytes), random());
        if is_gated {
            assert_eq!(gmhm_c::gmhm_gear_set_largest_step(Some(&mut gear), 0.1 * A), OK);
        }
        let mut torn = bytes.clone();
        let (mut good, mut refused) = (0, 0_u64);
        for k in 0..number("GMHM_FUZZ", 100_000) / 3 {
            let is_bad = next().is_multiple_of(8);
            good = if is_bad { 0 } else { good + 1 };
            let u = if is_bad { strange(&mut next) / A } else { 0.8 * (k as f32 * 1e-2).sin() };
            let output = step(&mut gear, u);
            refused += u64::from(output.flags & flag::REFUSED != 0);
            assert!(output.torque_nm.abs() < 4e6 && output.hysteresis_nm.abs() < 20.0, "{k}: {output:?}");
            assert!(output.deflection_rad.abs() <= 1.01e5 * A, "{k}: {output:?}");
            assert!(good == 0 || output.flags & flag::REFUSED == 0, "{k}: {:x}", output.flags);
            // Samples that agreed may have been taken for a new place.
            let taken = if is_gated { 4 } else { 1 };
            assert!(good < taken || output.flags == 0, "{k}: a good sample is taken, {:x}", output.flags);
            let torque = if is_bad { strange(&mut next) } else { output.torque_nm };
            let (aim, flags) = out(|to| gmhm_c::gmhm_gear_invert(Some(&mut gear), torque, to));
            assert!(aim.deflection_rad.abs() <= 1.01e5 * A && flags & flag::NOT_CONVERGED == 0, "{k}: {aim:?}");
            if next().is_multiple_of(1000) {
                let (at, bit) = (next() as usize % torn.len(), next() % 8);
                torn[at] ^= 1 << bit;
                assert_ne!(load(&mut gear, &torn), OK, "byte {at}");
                torn[at] ^= 1 << bit;
                let none = -strange(&mut next).abs();
                assert_eq!(gmhm_c::gmhm_gear_set_largest_step(Some(&mut gear), none), VALUE, "{none}");
                if next().is_multiple_of(8) {
                    gmhm_c::gmhm_gear_restart(Some(&mut gear));
                }
            }
        }
        assert!(refused > 0);
    }
}
