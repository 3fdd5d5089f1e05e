//! No sample panics, and none poisons the state: each kind of bad input has one defined answer.

use crate::common::*;
use gmhm::gear::{LONGEST_PERIOD_S, SHORTEST_PERIOD_S};
use gmhm::memory::AnyLaw;
use gmhm::scalar::Float;
use gmhm::scalar::Scalar;
use gmhm::{Gear, Inverse, InverseError, Law, Output, Params, State};
use proptest::prelude::*;

const BAD: [f64; 6] =
    [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, 1.001 * <f64 as Scalar>::REFUSED_BEYOND * A];

/// The gear and its state after a few turns.
fn warm<S: Float>(params: &Params) -> (Gear<S>, State<S, 16>) {
    let gear = Gear::<S>::with_period(params, 1e-3).expect("a period");
    let mut state = gear.start(S::ZERO);
    for u in [0.9, -0.5, 0.3, 0.1, 0.2] {
        gear.step(&mut state, S::from_f64(u * A));
    }
    (gear, state)
}

fn refused_and_unchanged<S: Float>(params: &Params) {
    let (gear, state) = warm::<S>(params);
    let good = gear.output(&state);
    for bad in BAD.map(S::from_f64) {
        let mut after = state.clone();
        let out = gear.step(&mut after, bad);
        assert!(after.status().refused, "{bad:?} was accepted");
        assert_eq!(out, Output { refused: true, ..good }, "the answer to {bad:?} is the last good one");
        // What follows is as if the bad sample had not been.
        let mut untouched = state.clone();
        for u in [0.25, -0.9, 1.2, 0.0] {
            let theta = S::from_f64(u * A);
            assert_eq!(gear.step(&mut after, theta), gear.step(&mut untouched, theta));
        }
        assert!(!after.status().refused && !gear.output(&after).refused, "the flag belongs to one sample");
    }
}

#[test]
fn samples_that_are_no_deflection_are_refused() {
    for params in every_law() {
        refused_and_unchanged::<f32>(&params);
        refused_and_unchanged::<f64>(&params);
    }
}

#[test]
fn periods_that_are_no_time_are_refused() {
    for params in every_law() {
        let (gear, state) = warm::<f64>(&params);
        for period in [f64::NAN, f64::INFINITY, -1e-9, 1.001 * LONGEST_PERIOD_S] {
            let mut after = state.clone();
            let refused = Output { refused: true, ..gear.output(&state) };
            assert_eq!(gear.step_after(&mut after, 0.5 * A, period), refused);
            assert!(after.status().refused);
            assert_eq!(gear.output(&after), refused);
        }
    }
}

#[test]
fn a_period_of_zero_takes_the_limit() {
    // E = 1: kernel deflection stands still, kernel rate takes the whole increment, the other laws know no time.
    for params in every_law() {
        let (gear, state) = warm::<f64>(&params);
        let (mut at_once, mut shortly) = (state.clone(), state.clone());
        let now = gear.step_after(&mut at_once, 0.5 * A, 0.0);
        let soon = gear.step_after(&mut shortly, 0.5 * A, 1e-12);
        assert!(!at_once.status().refused);
        assert!((now.torque - soon.torque).abs() < 1e-8 * params.torque_scale_nm());
    }
}

#[test]
fn a_constant_period_that_is_no_time_is_an_error() {
    for params in every_law() {
        for period in [f64::NAN, f64::INFINITY, -1.0, 1.001 * LONGEST_PERIOD_S] {
            assert!(Gear::<f64>::with_period(&params, period).is_err(), "{period}");
        }
        let is_timed = params.memory().law == Law::Time;
        for short in [0.0, 1e-300, 0.999 * SHORTEST_PERIOD_S] {
            assert_eq!(Gear::<f64>::with_period(&params, short).is_err(), is_timed, "{short}");
            let refused = matches!(Inverse::<f32>::with_period(&params, short), Err(InverseError::Period { .. }));
            assert_eq!(refused, is_timed, "{short}");
        }
        // The shortest is remembered in single precision.
        let gear = Gear::<f32>::with_period(&params, SHORTEST_PERIOD_S).expect("a period");
        let mut state: State<f32, N> = gear.start(0.0);
        assert_ne!(gear.step(&mut state, 0.5 * A as f32).hysteresis, 0.0);
    }
}

#[test]
fn law_time_without_a_period_refuses_what_brings_none() {
    for params in every_law().into_iter().filter(|p| p.memory().law == Law::Time) {
        let of_period = |period_s| Gear::with_law(&params, AnyLaw::<f64>::new(&params, period_s));
        let gears = [
            Gear::new(&params),
            of_period(f64::NAN),
            of_period(-1.0),
            of_period(1e-300),
            of_period(2.0 * LONGEST_PERIOD_S),
        ];
        for gear in gears {
            for gear in [gear, gear.with_largest_step(A)] {
                let mut state: State<f64, N> = gear.start(0.0);
                assert_eq!(gear.step(&mut state, 0.5 * A).torque, 0.0);
                assert!(state.status().refused);
                assert!(gear.step_after(&mut state, 0.5 * A, 1e-3).torque != 0.0);
                assert!(!state.status().refused);
            }
        }
        assert!(matches!(Inverse::<f64>::new(&params), Err(InverseError::Period { .. })));
    }
}

#[test]
fn a_start_that_is_no_deflection_counts_as_zero() {
    for params in every_law() {
        let gear = Gear::<f32>::new(&params);
        for bad in [f32::NAN, f32::INFINITY, f32::MAX] {
            let state: State<f32, 16> = gear.start(bad);
            assert!(state.status().refused);
            assert_eq!(state.theta(), 0.0);
            assert_eq!(gear.output(&state).torque, 0.0);
        }
    }
}

#[test]
fn outside_the_rated_range_is_flagged_and_finite() {
    for params in every_law() {
        let (gear, mut state) = warm::<f32>(&params);
        for u in [1.001, -1.001, 50.0, -9.9e4, 9.9e4, 0.0] {
            let out = gear.step(&mut state, (u * A) as f32);
            assert_eq!(state.status().out_of_range, u != 0.0);
            assert!(out.torque.is_finite() && out.elastic.is_finite() && out.hysteresis.is_finite(), "{u}: {out:?}");
        }
    }
}

proptest! {
    #[test]
    fn any_bits_leave_a_finite_answer(samples in proptest::collection::vec((any::<f32>(), any::<f32>()), 1..200)) {
        for params in every_law() {
            let (gear, mut state) = warm::<f32>(&params);
            for &(theta, period) in &samples {
                let out = gear.step_after(&mut state, theta, period);
                prop_assert!(out.torque.is_finite(), "{} after {theta} in {period} s", out.torque);
                let out = gear.step(&mut state, theta);
                prop_assert!(out.torque.is_finite());
                prop_assert!(gear.start_uncertainty(&state).is_finite());
            }
        }
    }

    #[test]
    fn varying_periods_agree_with_a_constant_one(turns in corners(1.0, 2..30), period in 1e-5..1e-2f64) {
        for params in every_law() {
            let constant = Gear::<f64>::with_period(&params, period).expect("a period");
            let varying = Gear::<f64>::new(&params);
            let mut a: State<f64, N> = constant.start(turns[0]);
            let mut b = a.clone();
            for &theta in &turns {
                prop_assert_eq!(constant.step(&mut a, theta), varying.step_after(&mut b, theta, period));
            }
        }
    }
}
