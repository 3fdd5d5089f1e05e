//! Whatever C hands over, a joint answers with finite numbers and is back at the next good sample.
//!
//! `GMHM_FUZZ=10000000 cargo test --release -p gmhm-c --test all faults` fuzzes as many samples; `GMHM_FUZZ_SEED` chooses others.

use std::mem::MaybeUninit;

use crate::common::{
    A, at, block, block_of, gmhm_get_status, gmhm_invert, gmhm_step, gmhm_step_counts, joint, number, random,
};
use gmhm::block::{Joint as JointOfGear, TorqueUnit};
use gmhm::diagnostics::{Fault, SelfTest};
use gmhm_c::{
    DiagnosticsC, EncodersC, Joint, NULL, OK, SampleC, UNIT, VALUE, flag, gmhm_clear_diagnostics, gmhm_get_diagnostics,
    gmhm_init, gmhm_load, gmhm_load_amperes, gmhm_pair_init, gmhm_restart, gmhm_set_largest_step,
};

const EXECUTIONS: u64 = 100_000;

#[test]
fn a_spike_is_quarantined_and_a_new_place_is_a_start() {
    let mut joint = joint();
    assert_eq!(gmhm_set_largest_step(None, 1.0), NULL);
    for none in [f32::NAN, -1.0] {
        assert_eq!(gmhm_set_largest_step(Some(&mut joint), none), VALUE);
    }
    assert_eq!(gmhm_set_largest_step(Some(&mut joint), 0.1 * A), OK);
    let mut step = |u: f32| gmhm_step(Some(&mut joint), Some(&at(u * A)));
    step(0.0);
    let good = step(0.08);
    let spike = step(5.0);
    assert_eq!((spike.flags, spike.torque_nm), (flag::QUARANTINED, good.torque_nm));
    assert_eq!(step(0.1).flags, 0);
    let flags = [0.7, 0.72, 0.74, 0.76].map(|u| step(u).flags);
    assert_eq!(flags, [flag::QUARANTINED, flag::QUARANTINED, flag::RESTARTED, 0]);
    let far = 5.0 * A;
    assert_eq!(gmhm_set_largest_step(Some(&mut joint), f32::INFINITY), OK);
    let beyond = gmhm_step(Some(&mut joint), Some(&at(far)));
    assert_eq!(beyond.flags, flag::OUT_OF_RANGE);
    assert!((160.0..165.0).contains(&beyond.elastic_nm), "{}", beyond.elastic_nm);
}

#[test]
fn faults_are_counted_until_they_are_cleared() {
    let mut joint = joint();
    assert_eq!(gmhm_set_largest_step(Some(&mut joint), 0.1 * A), OK);
    for u in [0.0, f32::NAN, 0.05, 5.0, 0.1, 0.7, 0.72, 0.74] {
        gmhm_step(Some(&mut joint), Some(&at(u * A)));
    }
    let seen = |joint: &Joint| {
        let mut to = MaybeUninit::uninit();
        assert_eq!(gmhm_get_diagnostics(Some(joint), Some(&mut to)), OK);
        // SAFETY: gmhm_get_diagnostics has written it.
        unsafe { to.assume_init() }
    };
    let last_fault = u32::from(Fault::Restarted.number());
    let tested = DiagnosticsC { self_test: u32::from(SelfTest::Passed.number()), ..DiagnosticsC::default() };
    assert_eq!(seen(&joint), DiagnosticsC { refused: 1, quarantined: 3, restarted: 1, last_fault, ..tested });
    gmhm_clear_diagnostics(Some(&mut joint));
    assert_eq!(seen(&joint), tested);
    assert_eq!(gmhm_get_diagnostics(Some(&joint), None), NULL);
    gmhm_clear_diagnostics(None);
}

#[test]
fn counts_become_the_deflection_of_the_block() {
    let joint_of_gear = JointOfGear { ratio: Some(-100.0), deflection_zero_rad: 0.1255, motor_side: true };
    let bytes = block_of(&joint_of_gear, TorqueUnit::NewtonMetre);
    let mut joint = joint();
    // SAFETY: the block outlives the call.
    assert_eq!(unsafe { gmhm_load(Some(&mut joint), bytes.as_ptr(), bytes.len() as u32) }, OK);
    let status = gmhm_get_status(Some(&joint));
    assert_eq!((status.ratio, status.deflection_zero_rad), (-100.0, 0.1255));
    assert_eq!((status.torque_on_motor_side, status.torque_in_amperes), (1, 0));
    let sample = SampleC::default();
    assert_eq!(gmhm_step_counts(Some(&mut joint), None, 0, 0, Some(&sample)).flags, flag::NOT_LOADED);
    let encoders =
        EncodersC { motor_counts_per_turn: 1 << 20, output_counts_per_turn: 1 << 20, ..EncodersC::default() };
    let pair_of = |encoders: &EncodersC| {
        let mut pair = MaybeUninit::uninit();
        // SAFETY: the block outlives the call, which writes the pair.
        unsafe {
            let code = gmhm_pair_init(Some(&mut pair), bytes.as_ptr(), bytes.len() as u32, Some(encoders));
            (code, pair.assume_init())
        }
    };
    let (code, mut none) = pair_of(&EncodersC::default());
    assert_eq!(code, VALUE);
    assert_eq!(gmhm_step_counts(Some(&mut joint), Some(&mut none), 0, 0, Some(&sample)).flags, flag::NO_ENCODERS);
    let (code, mut pair) = pair_of(&encoders);
    assert_eq!(code, OK);
    let turns = |angle: f64| ((angle / std::f64::consts::TAU).rem_euclid(1.0) * f64::from(1 << 20)) as u32;
    for k in 0..300 {
        let (output, theta) = (0.01 * f64::from(k), 0.5 * f64::from(A) * (0.1 * f64::from(k)).sin());
        let motor = turns(-100.0 * (output + theta + 0.1255));
        let out = gmhm_step_counts(Some(&mut joint), Some(&mut pair), motor, turns(output), Some(&sample));
        assert_eq!(out.flags, 0, "{k}");
        assert!((f64::from(out.deflection_rad) - theta).abs() < 1e-5, "{k}: {} for {theta}", out.deflection_rad);
        assert!(out.torque_nm.abs() < 20.0);
    }
}

#[test]
fn amperes_are_not_taken_for_newton_metres() {
    let bytes = block_of(&JointOfGear::default(), TorqueUnit::Ampere);
    let (pointer, length) = (bytes.as_ptr(), bytes.len() as u32);
    let mut joint = Box::new(MaybeUninit::uninit());
    // SAFETY: the block outlives the calls, and gmhm_init has written the joint.
    let mut joint = unsafe {
        assert_eq!(gmhm_init(Some(&mut joint), pointer, length), UNIT);
        joint.assume_init()
    };
    assert_eq!(gmhm_step(Some(&mut joint), Some(&at(1e-4))).flags, flag::NOT_LOADED);
    // SAFETY: the block outlives the call.
    assert_eq!(unsafe { gmhm_load_amperes(Some(&mut joint), pointer, length) }, OK);
    assert_eq!(gmhm_get_status(Some(&joint)).torque_in_amperes, 1);
    let newton_metres = block();
    // SAFETY: the block outlives the call.
    let code = unsafe { gmhm_load_amperes(Some(&mut joint), newton_metres.as_ptr(), newton_metres.len() as u32) };
    assert_eq!(code, UNIT);
}

#[test]
fn fuzzed_samples_are_answered() {
    let mut next = random();
    for gated in [false, true] {
        let mut joint = joint();
        if gated {
            assert_eq!(gmhm_set_largest_step(Some(&mut joint), 0.1 * A), OK);
        }
        let mut good = 0;
        for k in 0..number("GMHM_FUZZ", EXECUTIONS) / 2 {
            let mut theta = 0.8 * A * (k as f32 * 1e-2).sin();
            good += 1;
            if next().is_multiple_of(8) {
                good = 0;
                theta = match next() % 5 {
                    0 => f32::NAN,
                    1 => f32::INFINITY,
                    2 => 1e5 * A * 0.99,
                    3 => theta + A,
                    _ => f32::from_bits(next()),
                };
            }
            let output = gmhm_step(Some(&mut joint), Some(&at(theta)));
            assert!(output.torque_nm.abs() < 4e6 && output.hysteresis_nm.abs() < 20.0, "{output:?}");
            assert!(good == 0 || output.flags & flag::REFUSED == 0);
            // Samples that agreed may have been taken for a new place.
            assert!(good < 4 || output.flags == 0, "{k}: {:x}", output.flags);
            let torque = if next().is_multiple_of(8) { f32::from_bits(next()) } else { output.torque_nm };
            let solution = gmhm_invert(Some(&mut joint), torque, None);
            assert!(solution.deflection_rad.abs() <= 1.01e5 * A, "{solution:?} for {torque}");
            if next().is_multiple_of(10_000) {
                gmhm_restart(Some(&mut joint));
            }
        }
    }
}
