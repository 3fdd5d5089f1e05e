//! What an adaptation promises: it follows a gear, stays within its bounds, and never makes the prediction worse.

use crate::common::adapting::{Case, PERIOD_S, block, run};
use gmhm::adapt::{AdaptError, Adaptation, AdaptationState, Change, Settings, Warning, changed};
use gmhm::memory::masing::Masing;
use gmhm::{Gear, Inverse, Kernel, Law, Memory, Params};
use gmhm_host_tests::drift::{Fault, Motion};

/// A block's rated deflection, rad, its adaptation with the settings it has by default, and the gear itself.
fn of_block(block: &Params) -> (f32, Adaptation<f32>, Gear<f32, Masing<f32>>) {
    let adaptation = Adaptation::new(block, &Settings::default()).expect("law masing");
    (block.rated_deflection_rad() as f32, adaptation, Gear::with_law(block, Masing::new(block)))
}

/// Stiffness −10 %, hysteresis +20 % in ten minutes, noise 1 %.
#[test]
fn feed_forward_follows_a_gear_that_drifts() {
    for motion in Motion::MOVING {
        let outcome = run::<f32>(&Case { motion, drift: [0.9, 1.2], ..Case::default() }, |_, _| {});
        let [fixed, adapted] = outcome.feed_forward;
        assert!(adapted <= 0.35 * fixed, "{motion:?}: {adapted} for {fixed}");
        let [_, adapted, truth] = outcome.one_step;
        assert!(adapted <= 1.3 * truth, "{motion:?}: {adapted} for {truth}");
        assert!(outcome.warnings.has(Warning::ScaleOrGear), "{motion:?}");
        // Nothing is wrong with the signal.
        for fault in [Warning::Spikes, Warning::Delay, Warning::Offset] {
            assert!(!outcome.warnings.has(fault), "{motion:?}: {:?}", outcome.warnings);
        }
    }
}

/// The same statement over a thousand runs of ten minutes: `adapt_long`.
#[test]
fn a_gear_that_does_not_drift_keeps_its_block() {
    let mut beyond = 0;
    let mut runs = 0;
    for motion in Motion::FIVE {
        for seed in 0..6 {
            let outcome = run::<f32>(&Case { motion, seed, seconds: 200.0, ..Case::default() }, |_, _| {});
            let [fixed, adapted, _] = outcome.one_step;
            assert!(adapted <= 1.02 * fixed, "{motion:?} {seed}: {adapted} for {fixed}");
            assert_eq!(outcome.warnings.bits(), 0, "{motion:?} {seed}: {:?}", outcome.warnings);
            beyond += usize::from(outcome.deviations.iter().any(|z| z.abs() > 3.0));
            runs += 1;
        }
    }
    assert!(beyond <= runs / 20, "{beyond} of {runs} runs beyond three standard deviations");
}

/// Faults that begin at once or later, on the five motions: no worse than 1.02 of the block against the true torque and its noise, and reported.
#[test]
fn no_fault_of_the_signal_makes_the_prediction_worse() {
    let rated = block().torque_scale_nm();
    let faults = [
        (Fault::Stuck, Some(Warning::Dead)),
        (Fault::Zero, Some(Warning::Dead)),
        (Fault::Offset(0.05 * rated), Some(Warning::Offset)),
        (Fault::Offset(0.5 * rated), Some(Warning::Offset)),
        (Fault::Delay(1e-3), None),
        (Fault::Delay(5e-3), Some(Warning::Delay)),
        (Fault::Spikes(50), Some(Warning::Spikes)),
        (Fault::SpikesUp(50), Some(Warning::Spikes)),
        (Fault::NotNumbers(3), Some(Warning::NotANumber)),
        (Fault::AllNotNumbers, Some(Warning::NotANumber)),
    ];
    for (fault, warning) in faults {
        for motion in Motion::FIVE {
            for from in [0.0, 60.3] {
                let case = Case { motion, fault: (fault, from), seconds: 120.0, ..Case::default() };
                let outcome = run::<f32>(&case, |_, _| {});
                let [fixed, adapted, _] = outcome.one_step;
                assert!(adapted <= 1.02 * fixed, "{fault:?} {motion:?} from {from} s: {adapted} for {fixed}");
                // 5 ms at 0.2 A a second move the torque by a tenth of its noise, and look like h.
                let hidden = motion == Motion::Slow && matches!(fault, Fault::Delay(_));
                if let Some(warning) = warning.filter(|_| !hidden) {
                    assert!(
                        outcome.warnings.has(warning),
                        "{fault:?} {motion:?} from {from} s: {:?}",
                        outcome.warnings
                    );
                }
            }
        }
    }
}

/// The same faults on a gear that drifts: what was taken over before is no reason to be worse than the block.
#[test]
fn faults_on_a_gear_that_drifts() {
    let rated = block().torque_scale_nm();
    for fault in [Fault::Zero, Fault::Offset(0.05 * rated), Fault::Delay(5e-3), Fault::Spikes(50)] {
        for motion in Motion::FIVE {
            let case = Case { motion, fault: (fault, 60.3), seconds: 120.0, drift: [0.95, 1.1], ..Case::default() };
            let [fixed, adapted, _] = run::<f32>(&case, |_, _| {}).one_step;
            assert!(adapted <= 1.02 * fixed, "{fault:?} {motion:?}: {adapted} for {fixed}");
        }
    }
}

/// How small a fault is reported depends on the motion.
#[test]
fn small_faults_are_reported() {
    let rated = block().torque_scale_nm();
    let told: [(Fault, Warning, &[Motion]); 6] = [
        (Fault::Offset(0.01 * rated), Warning::Offset, &[Motion::Sine, Motion::Tones, Motion::Moves]),
        (Fault::Offset(0.02 * rated), Warning::Offset, &Motion::FIVE),
        (Fault::Delay(1e-3), Warning::Delay, &[Motion::Sine, Motion::Tones, Motion::Fast]),
        (
            Fault::Delay(2.5e-3),
            Warning::Delay,
            &[Motion::Sine, Motion::Tones, Motion::OneSided, Motion::Moves, Motion::Fast],
        ),
        (Fault::Spikes(2000), Warning::Spikes, &Motion::FIVE),
        (Fault::Spikes(10_000), Warning::Spikes, &Motion::FIVE),
    ];
    for (fault, warning, motions) in told {
        for &motion in motions {
            let case = Case { motion, fault: (fault, 0.0), seconds: 150.0, ..Case::default() };
            let warnings = run::<f32>(&case, |_, _| {}).warnings;
            assert!(warnings.has(warning), "{fault:?} {motion:?}: {warnings:?}");
        }
    }
}

/// What a gear leaves that drifts twice as fast as above, under coloured noise, is no delay and no offset of the signal.
#[test]
fn a_gear_that_drifts_is_no_fault_of_the_signal() {
    for motion in [Motion::OneSided, Motion::Tones, Motion::Fast] {
        for drift in [[0.9, 1.2], [1.1, 0.8]] {
            for seed in [1, 3] {
                let case = Case { motion, drift, seed, coloured: [0.007, 0.95], seconds: 300.0, ..Case::default() };
                let warnings = run::<f32>(&case, |_, _| {}).warnings;
                let seen = [Warning::Delay, Warning::Offset].map(|warning| warnings.has(warning));
                assert_eq!(seen, [false; 2], "{motion:?} {drift:?} {seed}: {warnings:?}");
            }
        }
    }
}

/// The level tells a jump of the signal from a gear that became another.
#[test]
fn an_offset_that_jumps_is_no_other_gear() {
    let rated = block().torque_scale_nm();
    for motion in Motion::MOVING {
        for by in [0.05, 0.2] {
            let case = Case { motion, fault: (Fault::Offset(by * rated), 60.3), seconds: 120.0, ..Case::default() };
            let outcome = run::<f32>(&case, |_, _| {});
            assert!(outcome.deviations.iter().all(|z| z.abs() < 3.0), "{motion:?} {by}: {:?}", outcome.deviations);
            assert!(outcome.warnings.has(Warning::Offset), "{motion:?} {by}: {:?}", outcome.warnings);
            assert!(!outcome.warnings.has(Warning::LostMotion), "{motion:?} {by}: {:?}", outcome.warnings);
        }
    }
}

/// A sensor that warms with its gear: its offset grows evenly within ten minutes. 5 Hz over a third of the rated deflection does not tell that from a gear with more hysteresis, until the offset is seen.
#[test]
fn a_sensor_that_warms_with_its_gear() {
    let rated = block().torque_scale_nm();
    for motion in Motion::MOVING {
        for percent in [-5.0, 2.0, 8.0, 20.0] {
            let fault = (Fault::Drift(0.01 * percent * rated / 600.0), 0.0);
            let outcome = run::<f32>(&Case { motion, fault, drift: [0.95, 1.1], ..Case::default() }, |_, _| {});
            let [fixed, adapted, _] = outcome.one_step;
            let most = match motion {
                Motion::Fast => 1.35,
                Motion::OneSided => 1.05,
                _ => 1.01,
            };
            assert!(adapted <= most * fixed, "{motion:?} {percent} %: {adapted} for {fixed}");
        }
    }
}

/// Faults that are just large enough to be learnt as another gear before they are seen.
#[test]
fn faults_are_seen_before_they_are_taken_over() {
    let rated = block().torque_scale_nm();
    for (motion, fault, seed) in [
        (Motion::OneSided, (Fault::Offset(0.04 * rated), 0.0), 2),
        (Motion::Fast, (Fault::Delay(5e-3), 60.0), 3),
        (Motion::Fast, (Fault::Delay(5e-3), 100.3), 3),
    ] {
        for drift in [[1.0; 2], [0.95, 1.1]] {
            let case = Case { motion, fault, seed, drift, seconds: 200.0, ..Case::default() };
            let [fixed, adapted, _] = run::<f32>(&case, |_, _| {}).one_step;
            assert!(adapted <= 1.02 * fixed, "{fault:?} {motion:?}: {adapted} for {fixed}");
        }
    }
}

/// Coefficients and state of a joint; its flash and instructions are held by `cargo xtask size` and `cargo xtask cost`.
#[test]
fn a_joint_takes_half_a_kibibyte() {
    assert!(size_of::<Adaptation<f32>>() + size_of::<AdaptationState<f32>>() <= 512);
}

/// Ten minutes without excitation after a minute with it: not a bit changes.
#[test]
fn what_is_not_excited_teaches_nothing() {
    let block = block();
    let (a, adaptation, gear) = of_block(&block);
    // Standing, a tiny amplitude, a slow walk of the sensor, steady load on one side.
    let idle: [fn(f32) -> (f32, f32); 4] = [
        |_| (0.5, 0.0),
        |t| (0.5 + 0.02 * (3.0 * t).sin(), 0.0),
        |t| (0.0, 1e-2 * t),
        |t| (0.7 + 0.05 * (0.05 * t).sin(), 0.5),
    ];
    for (number, of) in idle.into_iter().enumerate() {
        let (mut state, mut path) = (adaptation.start(), gear.start::<16>(0.0));
        let mut learnt = None;
        for k in 0..660_000 {
            let t = k as f32 * 1e-3;
            let (u, off) = if t < 60.0 { (0.95 * (4.0 * t).sin(), 0.0) } else { of(t - 60.0) };
            let torque = 1.02 * gear.step(&mut path, a * u).torque + off;
            let _ = adaptation.period(&mut state, &path, torque);
            if k == 90_000 {
                learnt = Some((state.estimate(), state.variances()));
            }
        }
        let (estimate, variances) = learnt.expect("a minute of motion");
        assert!((estimate[0] + estimate[1] + estimate[2] - 0.02).abs() < 1e-3, "{estimate:?}");
        assert_eq!(state.estimate(), estimate, "motion {number}");
        assert_eq!(state.variances(), variances, "motion {number}");
    }
}

/// The least of p′ − e(1 − u²) − 2h at the places where the slope is held, N·m/rad.
fn least_slope(params: &Params) -> f64 {
    let (a, elastic, memory) = (params.rated_deflection_rad(), params.elastic(), params.memory());
    let slope = |square: f64| {
        let x = square * a * a;
        let rises = elastic.c1_nm_per_rad + x * (3.0 * elastic.c2_nm_per_rad3 + x * 5.0 * elastic.c3_nm_per_rad5);
        rises - memory.e() * (1.0 - square) - 2.0 * memory.h()
    };
    [0.0, 0.25, 0.5, 0.75, 1.0].map(slope).into_iter().fold(f64::INFINITY, f64::min)
}

/// Gears far outside the bounds, and signals of another scale: what is in force stays within the bounds, acceptable and invertible, at every takeover.
#[test]
fn what_is_in_force_stays_within_its_bounds() {
    let block = block();
    let (a, scale) = (block.rated_deflection_rad(), block.torque_scale_nm());
    let settings = Settings::default();
    let adaptation = Adaptation::<f32>::new(&block, &settings).expect("law masing");
    let other = |stiffness: f64, hysteresis: f64| {
        let (mut elastic, memory) = (block.elastic(), block.memory());
        elastic.c1_nm_per_rad *= stiffness;
        Params::new(a, elastic, Memory { alpha: memory.alpha * hysteresis, ..memory }).expect("a gear")
    };
    let mut taken = 0;
    for (stiffness, hysteresis, torque_scale) in [
        (1.3, 1.0, 1.0),
        (0.7, 1.0, 1.0),
        (1.0, 4.0, 1.0),
        (1.0, 0.0, 1.0),
        (1.0, 1.0, 1.33),
        (1.0, 1.0, 0.75),
        (1.1, 2.5, 0.9),
    ] {
        let truth = other(stiffness, hysteresis);
        let plant = Gear::<f32, _>::with_law(&truth, Masing::new(&truth));
        let gear = Gear::<f32, _>::with_law(&block, Masing::new(&block));
        let (mut state, mut path) = (adaptation.start(), gear.start::<16>(0.0));
        for k in 0..200_000 {
            let t = k as f32 * 1e-3;
            gear.step(&mut path, a as f32 * 0.97 * (3.0 * t).sin() * (0.17 * t).cos());
            let torque = torque_scale * plant.output(&path).torque;
            if adaptation.period(&mut state, &path, torque) == Change::TakenOver {
                taken += 1;
                let params = adaptation.params(&state, &block).expect("acceptable");
                Inverse::<f32>::new(&params).expect("invertible");
                for change in state.in_force() {
                    assert!(change.abs() <= settings.largest_change as f32 * 1.000_1);
                }
                let slope = least_slope(&params);
                assert!(slope > 0.499 * least_slope(&block), "{stiffness} {hysteresis} {torque_scale}: {slope}");
                let torques = params.rated_torque_nm() / block.rated_torque_nm();
                assert!((torques - 1.0).abs() <= 1.1 * settings.largest_change, "{torques}");
                assert!(scale > 0.0);
            }
        }
        if torque_scale != 1.0 {
            assert!(state.warnings().has(Warning::ScaleOrGear) || state.warnings().has(Warning::Dead));
        }
    }
    assert!(taken >= 7, "{taken} takeovers");
}

/// The gear is that of the block, and its torque has no noise: the remaining rounding errors must not cause a takeover or a return.
#[test]
fn a_clean_signal_decides_nothing() {
    let block = block();
    let (a, adaptation, gear) = of_block(&block);
    let (mut state, mut path) = (adaptation.start(), gear.start::<16>(0.0));
    for k in 0..100_000 {
        let t = k as f32 * 1e-3;
        let torque = gear.step(&mut path, a * 0.9 * (4.0 * t).sin()).torque;
        assert_eq!(adaptation.period(&mut state, &path, torque), Change::None, "at {t} s");
    }
    assert!(state.stretches() > 50, "{}", state.stretches());
}

/// A gear that drifted and is put right again, as after a repair: the block's own parameters, or others as good, are in force again.
#[test]
fn parameters_are_given_back_where_they_stop_predicting() {
    let block = block();
    let (a, adaptation, gear) = of_block(&block);
    let (mut state, mut path) = (adaptation.start(), gear.start::<16>(0.0));
    let (mut taken, mut late) = (0, 0.0_f32);
    for k in 0..240_000 {
        let t = k as f32 * 1e-3;
        let out = gear.step(&mut path, a * 0.9 * (4.0 * t).sin());
        let stiffness = if (60.0..120.0).contains(&t) { 0.93 } else { 1.0 };
        taken += usize::from(adaptation.period(&mut state, &path, stiffness * out.torque) == Change::TakenOver);
        if (110.0..120.0).contains(&t) {
            assert!(state.in_force()[0] < -0.03, "{:?} at {t} s", state.in_force());
        }
        if t > 150.0 {
            late = late.max(state.in_force().iter().sum::<f32>().abs());
        }
    }
    assert!(taken > 0 && late < 0.01, "{taken} takeovers, {late} left");
}

/// A gear that never comes near its tips, from a past that nobody knows: what is missing of the loop is an offset.
#[test]
fn an_unknown_past_is_no_obstacle() {
    let block = block();
    let (a, adaptation, gear) = of_block(&block);
    // The gear itself came from its tips.
    let mut plant = gear.start::<16>(0.0);
    for u in [0.99, -0.99, 0.3] {
        gear.step(&mut plant, a * u);
    }
    let (mut state, mut path) = (adaptation.start(), gear.start::<16>(0.3 * a));
    for k in 0..180_000 {
        let t = k as f32 * 1e-3;
        let deflection = a * (0.3 + 0.25 * (1.0 + 0.2 * (0.7 * t).sin()) * (4.0 * t).sin());
        gear.step(&mut path, deflection);
        // Nothing happens for a minute; then it softens by 5 %.
        let stiffness = 1.0 - 0.05 * ((t - 60.0) / 120.0).max(0.0);
        let torque = stiffness * gear.step(&mut plant, deflection).torque;
        let change = adaptation.period(&mut state, &path, torque);
        assert!(t > 60.0 || change == Change::None, "{change:?} at {t} s, with nothing to tell");
    }
    // The level that nobody knows may keep it in the shadow: what counts is what was learnt.
    let [k1, k3, .., e, h] = state.estimate();
    let slope = k1 + 3.0 * 0.09 * k3 - 0.86 * e;
    assert!(state.stretches() > 100 && slope < -0.02 && h.abs() < 0.02, "{:?}", state.estimate());
}

/// A drive sets its adaptation up from what a loaded block holds.
#[test]
fn the_adaptation_of_a_gear_is_that_of_its_parameters() {
    let block = block();
    let gear = Gear::<f32, _>::with_law(&block, Masing::new(&block));
    for period_s in [1e-4, 2.5e-4, PERIOD_S, 0.01, 1.0 / 30.0, 0.05, 1.0] {
        let settings = Settings { period_s, drift: 2e-3, ..Settings::default() };
        let of_params = Adaptation::<f32>::new(&block, &settings).expect("law masing");
        assert_eq!(Adaptation::of_gear(&gear, &settings.cast()), Ok(of_params), "{period_s} s");
    }
    let settings = Settings::<f32> { drift: f32::NAN, ..Settings::default() };
    let refused = Adaptation::of_gear(&gear, &settings).expect_err("no number");
    assert!(refused.to_string().starts_with("drift = NaN must be"), "{refused}");
}

/// In single precision alone, beside the inverse of the changed parameters that double precision sets up.
#[test]
fn a_changed_inverse_is_that_of_the_changed_parameters() {
    let block = block();
    let inverse = Inverse::<f32, _>::of(&block, Masing::new(&block), 0.0).expect("an inverse");
    let a = inverse.gear().frame().rated();
    assert_eq!(inverse.changed(&[0.0; 5]).map(|same| *same.gear()), Some(*inverse.gear()));
    for change in [
        [0.0; 5],
        [-0.1, 0.0, 0.0, 0.0, 0.05],
        [0.25, -0.2, 0.1, 0.2, -0.1],
        [-0.2, 0.1, 0.1, -0.5, -0.5],
        // Its torque falls short of the tip.
        [0.2, 0.0, -0.45, 0.0, 0.1],
    ] {
        let params = changed(&block, &change.map(f64::from)).expect("a gear");
        let reference = Inverse::<f64, _>::of(&params, Masing::new(&params), 0.0).expect("an inverse");
        let ours = inverse.changed(&change).expect("an inverse");
        let (range, there) = (f64::from(ours.range()), reference.range());
        assert!(range <= there * (1.0 + 1e-6) && range > 0.997 * there, "{change:?}: {range} {there}");
        let scale = inverse.gear().frame().torque_scale();
        // The bound of the third derivative, N·m, from the last step 6 of the tolerance over it.
        let (numbers, exact) = (ours.search_numbers(), reference.search_numbers());
        let third = f64::from(numbers.tolerance * scale / numbers.last_step.powi(3));
        let reference_third = exact.tolerance * reference.gear().frame().torque_scale() / exact.last_step.powi(3);
        assert!(third > 0.99 * reference_third, "{change:?}: {third} {reference_third}");
        let mut state = ours.gear().start::<16>(0.0);
        let mut twin = reference.gear().start::<16>(0.0);
        for k in 0..20_000_u32 {
            let share = (f64::from(k) * 0.37).sin() * (f64::from(k) * 1.3e-3).cos();
            let torque = 0.9 * share * reference.gear().frame().torque_scale();
            let (solution, out) = ours.commit(&mut state, torque as f32);
            let (exact, _) = reference.commit(&mut twin, torque);
            assert!(solution.converged && !solution.refused);
            assert!((solution.theta - exact.theta as f32).abs() < 1e-3 * a, "{change:?}: step {k}");
            if !solution.saturated {
                assert!((out.torque - torque as f32).abs() <= 3e-6 * scale, "{change:?}: step {k}");
            }
        }
    }
    for refused in [[-2.0, 0.0, 0.0, 0.0, 0.0], [f32::NAN, 0.0, 0.0, 0.0, 0.0]] {
        assert_eq!(inverse.changed(&refused), None);
    }
}

#[test]
fn what_cannot_be_adapted_is_refused() {
    let published = block();
    let of = |law, kernel| Memory { law, kernel, ..published.memory() };
    let time = Params::new(published.rated_deflection_rad(), published.elastic(), of(Law::Time, Kernel::Deflection));
    let refused = Adaptation::<f32>::new(&time.expect("a gear"), &Settings::default());
    assert_eq!(refused.err(), Some(AdaptError::Law(Law::Time)));
    for settings in [
        Settings { period_s: 0.0, ..Settings::default() },
        Settings { drift: f64::NAN, ..Settings::default() },
        Settings { largest_change: 0.9, ..Settings::default() },
        Settings { false_acceptance: 0.0, ..Settings::default() },
    ] {
        let refused = Adaptation::<f32>::new(&published, &settings).expect_err("out of range");
        assert!(refused.to_string().contains("must be"), "{refused}");
    }
}

/// Periods from 0.1 ms to those of a slow recording: it is the same adaptation.
#[test]
fn any_period_will_do() {
    let block = block();
    let a = block.rated_deflection_rad() as f32;
    for period_s in [1e-4, PERIOD_S, 0.01, 0.05] {
        let adaptation =
            Adaptation::<f32>::new(&block, &Settings { period_s, ..Settings::default() }).expect("law masing");
        let gear = Gear::<f32, _>::with_law(&block, Masing::new(&block));
        let (mut state, mut path) = (adaptation.start(), gear.start::<16>(0.0));
        for k in 0..(120.0 / period_s) as u32 {
            let t = f64::from(k) * period_s;
            let torque = 0.95 * gear.step(&mut path, a * 0.9 * (2.0 * t).sin() as f32).torque;
            let _ = adaptation.period(&mut state, &path, torque);
        }
        let change: f32 = state.in_force()[..3].iter().sum();
        assert!((change + 0.05).abs() < 5e-3, "{period_s} s: {change}");
    }
}

/// The residual of a gear that is far from its block moves while a stretch is worked on: that is no spike of the signal.
#[test]
fn a_gear_far_from_its_block_has_no_spikes() {
    let block = block();
    let a = block.rated_deflection_rad() as f32;
    for (period_s, speed, spread) in
        [(1e-3, 2.0, 0.6), (1e-3, 6.0, 0.1), (5e-3, 2.0, 0.6), (5e-3, 4.0, 0.1), (5e-3, 6.0, 0.02)]
    {
        let adaptation =
            Adaptation::<f32>::new(&block, &Settings { period_s, ..Settings::default() }).expect("law masing");
        let gear = Gear::<f32, _>::with_law(&block, Masing::new(&block));
        let (mut state, mut path) = (adaptation.start(), gear.start::<16>(0.0));
        let mut noise = 1_u32;
        for k in 0..(120.0 / period_s) as u32 {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            // Strokes with rests at their ends.
            let deflection = a * 0.9 * (3.0 * (speed * f64::from(k) * period_s).sin()).clamp(-1.0, 1.0) as f32;
            let torque = 0.85 * gear.step(&mut path, deflection).torque;
            let _ = adaptation.period(&mut state, &path, torque + spread * ((noise >> 8) as f32 / 16_777_216.0 - 0.5));
        }
        assert!(state.is_taken_over(), "{period_s} s");
        assert!(!state.warnings().has(Warning::Spikes), "{period_s} s: {:?}", state.warnings());
    }
}
