//! A sample that the gear cannot have reached is quarantined, and what went through an outlier is uncertain again.

use crate::common::*;
use gmhm::gear::AGREEING_SAMPLES;
use gmhm::memory::masing::Masing;
use gmhm::scalar::{Fixed, Scalar};
use gmhm::terms::{Compensated, Sample, Setting, Stack};
use gmhm::{Gear, Output, State};
use proptest::prelude::*;

const LARGEST: f64 = 0.05;

/// A slow triangle of ±0.8 A.
fn triangle(k: u32) -> f64 {
    let phase = f64::from(k % 160);
    let up = if phase < 80.0 { phase } else { 160.0 - phase };
    0.8 * (up / 40.0 - 1.0)
}

#[test]
fn a_spike_changes_nothing_but_its_own_sample() {
    for params in every_law() {
        let plain = Gear::<f64>::with_period(&params, 1e-3).expect("a period");
        let gated = plain.with_largest_step(LARGEST * A);
        let mut state: State<f64, N> = gated.start(triangle(0) * A);
        let mut twin = state.clone();
        for k in 1..2000 {
            if k % 97 == 0 {
                let (before, uncertainty) = (gated.output(&state), gated.start_uncertainty(&state));
                for spike in [1.5, -1.2, 5.0, 1e4][..1 + k as usize % 2].iter() {
                    assert_eq!(gated.step(&mut state, spike * A), before);
                    assert!(state.status().quarantined && !state.status().refused);
                    assert_eq!(gated.start_uncertainty(&state), uncertainty);
                }
            }
            let theta = triangle(k) * A;
            assert_eq!(gated.step(&mut state, theta), plain.step(&mut twin, theta), "sample {k}");
            assert!(!state.status().quarantined);
        }
    }
}

#[test]
fn single_precision_fixed_point_and_terms_quarantine_alike() {
    let params = masing();
    let single = Gear::<f32>::new(&params).with_largest_step((LARGEST * A) as f32);
    let fixed = Gear::with_law(&params, Masing::<Fixed>::new(&params)).with_largest_step(Fixed::from_f64(LARGEST));
    let setting = Setting { sigma: -1.0, c1: 2.4737e4, rated_deflection: A as f32 };
    let with_terms = Compensated { gear: single, stack: Stack::<f32, 8>::of_gear(setting) };
    let sample = |u: f64| Sample { deflection: (u * A) as f32, period: 1e-3, ..Sample::default() };
    let mut a = single.start::<16>(0.0);
    let mut b = fixed.start::<16>(Fixed::ZERO);
    let mut c = with_terms.start::<16>(&sample(0.0));
    for u in [0.01, 0.04, 0.08, 1.5, 0.06, 0.02, -0.9, -0.01] {
        let torque = [
            f64::from(single.step(&mut a, (u * A) as f32).torque),
            fixed.step(&mut b, Fixed::from_f64(u)).torque.to_f64() * params.torque_scale_nm(),
            f64::from(with_terms.step(&mut c, &sample(u)).torque),
        ];
        let quarantined = u == 1.5 || u == -0.9;
        assert_eq!([a.status(), b.status(), c.gear().status()].map(|s| s.quarantined), [quarantined; 3], "{u}");
        assert!((torque[0] - torque[1]).abs() < 1e-4 && torque[0] == torque[2], "{u}: {torque:?}");
    }
}

#[test]
fn a_place_that_samples_agree_on_is_a_new_start() {
    type Step = fn(&Gear<f64>, &mut State<f64, N>, f64) -> Output<f64>;
    let steps: [Step; 2] =
        [|gear, state, theta| gear.step(state, theta), |gear, state, theta| gear.step_after(state, theta, 1e-3)];
    for (params, step) in every_law().into_iter().flat_map(|params| steps.map(|step| (params, step))) {
        let gear = Gear::<f64>::with_period(&params, 1e-3).expect("a period").with_largest_step(LARGEST * A);
        let mut state: State<f64, N> = gear.start(0.0);
        // Known from a tip on.
        for k in 0..=60 {
            step(&gear, &mut state, f64::from(k) / 60.0 * A);
        }
        for k in 1..=AGREEING_SAMPLES {
            step(&gear, &mut state, (0.2 + 0.01 * f64::from(k)) * A);
            assert_eq!(state.status().quarantined, k < AGREEING_SAMPLES, "{k}");
        }
        assert!(state.status().restarted);
        assert_eq!(state.theta(), 0.23 * A);
        let start: State<f64, N> = gear.start(0.23 * A);
        assert_eq!(gear.start_uncertainty(&state), gear.start_uncertainty(&start));
        step(&gear, &mut state, 0.24 * A);
        assert_eq!(state.status(), Default::default());
    }
}

#[test]
fn a_sample_may_be_as_much_further_as_time_has_passed() {
    let gear = Gear::<f64>::new(&masing()).with_largest_step(LARGEST * A);
    for missed in [f64::NAN, 3.0 * A] {
        let mut state: State<f64, N> = gear.start(0.0);
        gear.step(&mut state, 0.9 * LARGEST * A);
        gear.step(&mut state, missed);
        gear.step(&mut state, 2.7 * LARGEST * A);
        assert_eq!(state.status(), Default::default(), "two periods after the last good sample");
        gear.step(&mut state, 4.5 * LARGEST * A);
        assert!(state.status().quarantined, "one period after it");
    }
}

#[test]
fn what_went_through_an_outlier_is_uncertain_again() {
    for params in every_law() {
        let gear = Gear::<f64>::with_period(&params, 1e-3).expect("a period");
        let mut state: State<f64, N> = gear.start(0.0);
        for k in 0..=600 {
            gear.step(&mut state, (f64::from(k) * 0.1).sin() * A);
        }
        gear.step(&mut state, A);
        gear.step(&mut state, 0.3 * A);
        let known = gear.start_uncertainty(&state);
        gear.step(&mut state, 1.5 * A);
        gear.step(&mut state, 0.3 * A);
        let after = gear.start_uncertainty(&state);
        assert!(after > known + 0.1, "{:?}: {known} N·m before, {after} N·m after", params.memory());
        // A tip is a tip: behind both, law masing knows.
        if params.memory().law == gmhm::Law::Masing {
            assert_eq!(known, 0.0);
            gear.step(&mut state, A);
            assert_eq!(gear.start_spread(&state), 0.0);
            gear.step(&mut state, -A);
            assert_eq!(gear.start_uncertainty(&state), 0.0);
        }
    }
}

/// Without a gate an absurd sample leaves no absurd memory in law `time`.
#[test]
fn an_absurd_sample_leaves_no_absurd_memory() {
    type Step = fn(&Gear<f32>, &mut State<f32, N>, f32) -> Output<f32>;
    let steps: [Step; 2] =
        [|gear, state, theta| gear.step(state, theta), |gear, state, theta| gear.step_after(state, theta, 1e-3)];
    for params in every_law().into_iter().filter(|params| params.memory().law == gmhm::Law::Time) {
        let gear = Gear::<f32>::with_period(&params, 1e-3).expect("a period");
        for (step, spike) in steps.iter().flat_map(|step| [0.99e5, -0.99e5].map(|spike| (step, spike))) {
            let (mut struck, mut twin) = (gear.start::<N>(0.0), gear.start::<N>(0.0));
            for k in 0..4000 {
                let theta = (f64::from(k) * 0.01).sin() as f32 * A as f32;
                if k == 1000 {
                    step(&gear, &mut struck, spike * A as f32);
                }
                let [found, expected] = [(&mut struck), (&mut twin)].map(|state| step(&gear, state, theta).hysteresis);
                // A stroke of 10 rated deflections, whose memory fades.
                let most = if k < 1100 { 48.0 } else { 0.04 };
                assert!(
                    (found - expected).abs() < most,
                    "{:?}, sample {k}: {found} N·m for {expected}",
                    params.memory()
                );
            }
        }
    }
}

proptest! {
    #[test]
    fn any_samples_leave_a_gated_gear_within_its_spring(samples in proptest::collection::vec(any::<f32>(), 1..200)) {
        for params in every_law() {
            let gear = Gear::<f32>::with_period(&params, 1e-3).expect("a period").with_largest_step((LARGEST * A) as f32);
            let mut state = gear.start::<16>(0.0);
            for &sample in &samples {
                prop_assert!(gear.step(&mut state, sample).torque.is_finite());
                prop_assert!(gear.start_uncertainty(&state).is_finite());
            }
            gear.step(&mut state, f32::NAN);
            prop_assert!(state.status().refused);
        }
    }
}
