//! Bad input to the control path: torque within its limit, the state as it was, and back within a period.
//!
//! `GMHM_FUZZ=10000000 cargo test --release -p gmhm-host-tests --test all control_faults -- --nocapture` fuzzes as many periods of each; `GMHM_FUZZ_SEED` chooses others.

use std::f64::consts::TAU;

use crate::common::fuzz::{number, strange};
use crate::common::servos::*;
use crate::common::*;
use gmhm::drive::{Cascade, CascadeState, Gains, Reference, Servo, ServoError};
use gmhm::feedforward::{Controls, Demand, FeedForward, Settings, Source};
use gmhm::scalar::Scalar;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Periods where none are asked for.
const EXECUTIONS: u64 = 100_000;

fn dice() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(number("GMHM_FUZZ_SEED", 1))
}

#[test]
fn a_clamp_takes_no_limit_for_a_number_that_is_none() {
    assert!(Scalar::clamp(f32::NAN, -1.0, 1.0).is_nan());
    assert_eq!([-2.0, 0.5, 2.0].map(|x: f64| Scalar::clamp(x, -1.0, 1.0)), [-1.0, 0.5, 1.0]);
}

#[test]
fn gains_that_are_none_are_refused_by_name() {
    let good = gains();
    let bad = |name, value: f64| match name {
        "period_s" => Gains { period_s: value, ..good },
        "position_per_s" => Gains { position_per_s: value, ..good },
        "velocity_nms_per_rad" => Gains { velocity_nms_per_rad: value, ..good },
        "integral_rad_per_s" => Gains { integral_rad_per_s: value, ..good },
        "filter_rad_per_s" => Gains { filter_rad_per_s: value, ..good },
        _ => Gains { limit_nm: value, ..good },
    };
    let names = [
        ("period_s", false),
        ("position_per_s", true),
        ("velocity_nms_per_rad", true),
        ("integral_rad_per_s", true),
        ("filter_rad_per_s", false),
        ("limit_nm", false),
    ];
    for (name, zero) in names {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1e-9, 1e300] {
            let error = Cascade::<f32>::new(&bad(name, value)).expect_err(name);
            assert_eq!(error.gain, name);
            let servo = Servo::<f32>::new(&masing(), &gmhm::drive::ServoSetup { gains: bad(name, value), ..setup() });
            assert!(servo.is_err());
        }
        assert_eq!(Cascade::<f32>::new(&bad(name, 0.0)).is_ok(), zero, "{name} = 0");
    }
    assert!(matches!(
        Servo::<f32>::new(&masing(), &gmhm::drive::ServoSetup { gains: bad("limit_nm", f64::NAN), ..setup() }),
        Err(ServoError::Gains(_))
    ));
}

#[test]
fn a_refused_period_fades_and_leaves_a_cascade_as_it_was() {
    let cascade = Cascade::<f32>::new(&gains()).expect("gains");
    for bad in [(f32::NAN, 0.0), (f32::INFINITY, 0.0), (0.01, f32::NAN), (0.01, f32::NEG_INFINITY)] {
        let mut state = CascadeState::default();
        for k in 0..100 {
            let _ = cascade.step(&mut state, 0.01 + 1e-5 * k as f32, 0.5);
        }
        let before = state;
        let last = cascade.step(&mut state, 0.011, 0.5);
        let good = state;
        let mut torque = last;
        for _ in 0..200 {
            let next = cascade.step(&mut state, bad.0, bad.1);
            assert!(state.is_refused() && (0.0..=torque).contains(&next), "{next} after {torque}");
            torque = next;
        }
        assert_eq!(torque, 0.0, "200 ms after the last good input");
        // One good period, and the torque is as if nothing had been.
        let mut twin = good;
        let back = cascade.step(&mut state, 0.011, 0.5);
        assert!((back - cascade.step(&mut twin, 0.011, 0.5)).abs() < 0.05, "{back}");
        assert!(!state.is_refused() && before != state);
    }
}

#[test]
fn an_absurd_error_leaves_no_trace() {
    let cascade = Cascade::<f32>::new(&gains()).expect("gains");
    let mut state = CascadeState::default();
    for _ in 0..100 {
        let _ = cascade.step(&mut state, 0.01, 0.1);
    }
    let mut twin = state;
    for absurd in [1e30, -1e9, 1e4] {
        assert_eq!(cascade.step(&mut state, absurd, 0.0).abs(), LIMIT_NM);
    }
    let back = cascade.step(&mut state, 0.01, 0.1);
    assert!((back - cascade.step(&mut twin, 0.01, 0.1)).abs() < 1e-3);
}

#[test]
fn a_motor_turn_that_was_lost_is_found() {
    let servo = servo(&masing());
    let (motor, output) = counts(0.0, 0.2 * A);
    let mut state = servo.start::<16>(motor, output, 0);
    let controls = Controls { on: true, source: Source::Measurement, ratio: 1.0 };
    for k in 0..400 {
        // The motor runs 0.3 turns a period: some missed readings are more than half a turn.
        let (motor, output) = counts(0.003 * TAU * f64::from(k), 0.2 * A);
        if k % 40 < 3 && k > 10 {
            let _ = servo.period(
                &mut state,
                &controls,
                &Reference::default(),
                motor.wrapping_add(COUNTS / 3) % COUNTS,
                output,
            );
            continue;
        }
        let _ = servo.period(&mut state, &controls, &Reference::default(), motor, output);
        assert!((f64::from(state.seen().deflection) - 0.2 * A).abs() < 0.1 * A, "{k}: {}", state.seen().deflection);
    }
}

#[test]
fn fuzzed_cascades_stay_within_their_limit() {
    let cascade = Cascade::<f32>::new(&gains()).expect("gains");
    let (mut dice, mut state, mut refused) = (dice(), CascadeState::default(), 0_u64);
    for k in 0..number("GMHM_FUZZ", EXECUTIONS) {
        let (mut error, mut feed_forward) = (0.01 * (k as f32 * 1e-3).sin(), 0.2);
        let bad = dice.random_range(0..8) == 0;
        if bad {
            error = if dice.random() { strange(&mut dice) } else { error };
            feed_forward = if dice.random() { strange(&mut dice) } else { feed_forward };
        }
        let torque = cascade.step(&mut state, error, feed_forward);
        assert!(torque.abs() <= LIMIT_NM, "{torque} N·m for {error}, {feed_forward}");
        assert!(bad || !state.is_refused());
        refused += u64::from(state.is_refused());
    }
    println!("cascade: {refused} periods refused");
}

#[test]
fn fuzzed_feed_forwards_come_back() {
    let settings = Settings { period_s: PERIOD_S, ramp_s: RAMP_S, largest_rate_rad_per_s: 2.0, ..Settings::default() };
    let range = 1.01 * A as f32;
    for source in [Source::Reference, Source::Measurement] {
        for params in [masing(), every_law()[5]] {
            let feed_forward = FeedForward::<f32>::new(&params, &settings).expect("an inverse");
            let (mut dice, mut state) = (dice(), feed_forward.start::<16>(0.0));
            let (mut good, mut refused) = (0, 0_u64);
            for k in 0..number("GMHM_FUZZ", EXECUTIONS) / 4 {
                let phase = k as f32 * 1e-3;
                let mut demand = Demand { torque: 15.0 * phase.sin(), deflection: 0.5 * A as f32 * phase.sin() };
                let mut controls = Controls { on: true, source, ratio: 1.0 };
                if dice.random_range(0..8) == 0 {
                    good = 0;
                    demand.torque = if dice.random() { strange(&mut dice) } else { demand.torque };
                    demand.deflection = if dice.random() { strange(&mut dice) } else { demand.deflection };
                    controls.ratio = if dice.random() { strange(&mut dice) } else { 1.0 };
                } else {
                    good += 1;
                }
                let before = *state.contribution();
                let now = feed_forward.step(&mut state, &controls, &demand);
                assert!(now.offset.abs() <= range && now.hysteresis.abs() <= 30.0 && (0.0..=1.0).contains(&now.gain));
                // Absurd finite torques saturate, and are no fault.
                if now.refused {
                    refused += 1;
                    assert!(now.gain <= before.gain);
                }
                // The gate may wait for samples that agree; everything else is back at once.
                assert!(good < 4 || !now.refused, "{k}: {good} good periods");
            }
            println!("feed-forward along the {source:?}: {refused} periods refused");
        }
    }
}

#[test]
fn fuzzed_servos_stay_within_their_limit_and_come_back() {
    let servo = servo(&masing());
    let (mut dice, (motor, output)) = (dice(), counts(0.0, 0.0));
    let mut state = servo.start::<16>(motor, output, 0);
    let (mut good, mut refused) = (0, 0_u64);
    for k in 0..number("GMHM_FUZZ", EXECUTIONS) {
        let time = k as f64 * PERIOD_S;
        let (at, deflection) = (0.5 * time.sin(), 0.5 * A * (3.0 * time).sin());
        let (mut motor, mut output) = counts(at, deflection);
        let mut reference = Reference {
            counts: (at / TAU * f64::from(REFERENCE_COUNTS)) as i64,
            torque: (15.0 * (3.0 * time).sin()) as f32,
            feed_forward: 0.1,
        };
        if dice.random_range(0..10) == 0 {
            good = 0;
            match dice.random_range(0..7) {
                0 => motor = dice.random(),
                1 => output = dice.random(),
                // One of two bytes is older.
                2 => motor = motor & 0xfff00 | dice.random_range(0..256),
                3 => reference.torque = strange(&mut dice),
                4 => reference.feed_forward = strange(&mut dice),
                5 => reference.counts = dice.random(),
                _ => (motor, output, reference.torque) = (dice.random(), dice.random(), strange(&mut dice)),
            }
        } else {
            good += 1;
        }
        let controls = Controls {
            on: true,
            source: if k / 5000 % 2 == 0 { Source::Reference } else { Source::Measurement },
            ratio: 1.0,
        };
        let torque = servo.period(&mut state, &controls, &reference, motor, output);
        assert!(torque.abs() <= LIMIT_NM, "{torque} N·m in period {k}");
        refused += u64::from(state.is_refused());
        // A period works on the counts of the one before.
        if good >= 2 {
            assert!(!state.is_refused() && !state.contribution().refused, "period {k}");
            let seen = f64::from(state.seen().deflection);
            assert!((seen - deflection).abs() < 0.02 * A, "period {k}: {seen} rad for {deflection} rad");
        }
    }
    println!("servo: {refused} periods refused");
}
