//! The feed-forward of a joint: what it adds is the inverse's, it never steps, it enters as the past gets known, and large angles cost nothing.

use crate::common;
use crate::common::{A, masing};
use gmhm::drive::pair::{Place, SetupError};
use gmhm::drive::{EncoderPair, Mounting, Setup};
use gmhm::feedforward::{
    Contribution, Controls, Demand, FeedForward, FeedForwardError, FeedForwardState, MotorEncoder, MotorSide, Settings,
    Source,
};
use gmhm::memory::masing::Masing;
use gmhm::scalar::{Fixed, Float, Scalar};
use gmhm::{Elastic, Gear, Inverse, Memory, Params};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const PERIOD_S: f64 = 1e-3;

/// On at once, without limits.
fn instant() -> Settings {
    Settings { period_s: PERIOD_S, ramp_s: PERIOD_S, ..Settings::default() }
}

fn whole<S: Float>(source: Source) -> Controls<S> {
    Controls { on: true, source, ratio: S::ONE }
}

/// Two sines, the quicker one making nested reversals, N·m.
fn torque(share: f64, k: u32) -> f64 {
    let phase = 0.004 * f64::from(k);
    share * (0.7 * phase.sin() + 0.3 * (5.3 * phase).sin()) * masing().torque_scale_nm()
}

/// To both tips and back, so that the past is known.
fn settled<S: Float>(feed_forward: &FeedForward<S>, controls: &Controls<S>) -> FeedForwardState<S> {
    let mut state = feed_forward.start(S::ZERO);
    for deflection in [A, -A, 0.0].map(S::from_f64) {
        let side = if deflection == S::ZERO { 0.0 } else { 1e3 };
        let torque = S::from_f64(side * deflection.to_f64().signum());
        let _ = feed_forward.step(&mut state, controls, &Demand { torque, deflection });
    }
    state
}

fn contributes_the_inverse<S: Float>() {
    let feed_forward = FeedForward::<S>::new(&masing(), &instant()).expect("a feed-forward");
    let inverse = Inverse::<S>::new(&masing()).expect("an inverse");
    for source in [Source::Reference, Source::Measurement] {
        let controls = whole(source);
        let mut state = settled(&feed_forward, &controls);
        let mut other = state.gear().clone();
        for k in 0..5000 {
            let demand = Demand {
                torque: S::from_f64(torque(0.9, k)),
                deflection: S::from_f64(0.9 * A * (0.003 * f64::from(k)).sin()),
            };
            let is = feed_forward.step(&mut state, &controls, &demand);
            let (offset, hysteresis) = match source {
                Source::Reference => {
                    let (solution, output) = inverse.commit(&mut other, demand.torque);
                    (solution.theta, output.hysteresis)
                }
                Source::Measurement => {
                    let output = inverse.gear().step(&mut other, demand.deflection);
                    (inverse.peek(&other, demand.torque).theta, output.hysteresis)
                }
            };
            assert_eq!((is.offset, is.hysteresis), (offset, hysteresis), "{source:?}, period {k}");
            assert_eq!((is.gain, is.certainty), (S::ONE, S::ONE));
            assert!(!is.saturated && !is.refused && !is.slewing);
            assert_eq!(state.contribution(), &is);
        }
    }
}

#[test]
fn once_the_past_is_known_it_is_the_inverse_bit_by_bit() {
    contributes_the_inverse::<f64>();
    contributes_the_inverse::<f32>();
}

#[test]
fn every_law_is_fed_forward() {
    for params in common::every_law() {
        let feed_forward = FeedForward::<f32>::new(&params, &instant()).expect("a feed-forward");
        let exact = FeedForward::<f64>::new(&params, &instant()).expect("a feed-forward");
        let (mut state, mut other) = (feed_forward.start::<16>(0.0), exact.start::<256>(0.0));
        let mut worst = 0.0_f64;
        for k in 0..5000 {
            let torque = torque(0.25, k);
            let is = feed_forward.step(
                &mut state,
                &whole(Source::Reference),
                &Demand { torque: torque as f32, deflection: 0.0 },
            );
            let should = exact.step(&mut other, &whole(Source::Reference), &Demand { torque, deflection: 0.0 });
            worst = worst.max((f64::from(is.offset) - should.offset).abs() / A);
            worst = worst.max((f64::from(is.hysteresis) - should.hysteresis).abs() / params.torque_scale_nm());
            assert!((0.0..=1.0).contains(&is.certainty) && !is.refused);
        }
        let law = params.memory();
        println!(
            "{:?} {:?} {:?}: f32 beside f64 {worst:.1e} of rated deflection and torque",
            law.law, law.kernel, law.gate
        );
        assert!(worst < 1e-6, "{law:?}: {worst:e}");
    }
}

/// The largest change of a period, over A and T_A.
fn largest_change(last: &Contribution<f32>, is: &Contribution<f32>) -> f64 {
    let offset = f64::from((is.offset - last.offset).abs()) / A;
    offset.max(f64::from((is.hysteresis - last.hysteresis).abs()) / masing().torque_scale_nm())
}

#[test]
fn switching_makes_no_step() {
    const RAMP_S: f64 = 0.2;
    let settings = Settings { ramp_s: RAMP_S, ..instant() };
    let feed_forward = FeedForward::<f32>::new(&masing(), &settings).expect("a feed-forward");
    let mut state = settled(&feed_forward, &Controls::default());
    // Torque and deflection stand, far apart: whatever changes comes from switching.
    let demand = Demand { torque: 20.0, deflection: -0.8 * A as f32 };
    for _ in 0..10 {
        let is = feed_forward.step(&mut state, &Controls::default(), &demand);
        assert_eq!((is.offset, is.hysteresis, is.gain), (0.0, 0.0, 0.0));
    }
    let mut dice = ChaCha8Rng::seed_from_u64(1);
    let mut controls = Controls { on: true, ..Controls::default() };
    let mut last = *state.contribution();
    let mut reached = 0;
    for k in 0..20_000 {
        if k % 300 == 0 {
            controls.on = dice.random_bool(0.7);
            controls.ratio = dice.random_range(-0.5..1.5);
            controls.source = if dice.random_bool(0.5) { Source::Reference } else { Source::Measurement };
        }
        let is = feed_forward.step(&mut state, &controls, &demand);
        let change = largest_change(&last, &is);
        assert!(change <= 1.01 * PERIOD_S / RAMP_S, "{change} in period {k}");
        assert!((is.change - (is.offset - last.offset)).abs() < 1e-12);
        let asked = if controls.on { controls.ratio.clamp(0.0, 1.0) } else { 0.0 };
        if k % 300 == 299 {
            assert_eq!(is.gain, asked);
            reached += 1;
        }
        last = is;
    }
    assert_eq!(reached, 66);
}

#[test]
fn jumps_are_slewed_and_said() {
    let settings =
        Settings { offset_slew_rad_per_s: 0.05 * A / PERIOD_S, torque_slew_nm_per_s: 0.2 / PERIOD_S, ..instant() };
    let feed_forward = FeedForward::<f32>::new(&masing(), &settings).expect("a feed-forward");
    let mut dice = ChaCha8Rng::seed_from_u64(2);
    let mut state = settled(&feed_forward, &whole(Source::Reference));
    let mut demand = Demand::default();
    let mut controls = whole(Source::Reference);
    let (mut last, mut slewing) = (*state.contribution(), 0);
    for k in 0..20_000 {
        if k % 50 == 0 {
            demand = Demand { torque: dice.random_range(-28.0..28.0), deflection: dice.random_range(-1e-3..1e-3) };
            controls.source = if dice.random_bool(0.5) { Source::Reference } else { Source::Measurement };
        }
        let is = feed_forward.step(&mut state, &controls, &demand);
        assert!((is.offset - last.offset).abs() <= 0.0501 * A as f32, "{is:?}");
        assert!((is.hysteresis - last.hysteresis).abs() <= 0.2001, "{is:?}");
        slewing += u32::from(is.slewing);
        // Forty-five periods cross the whole range.
        assert!(k % 50 < 45 || !is.slewing, "{is:?}");
        last = is;
    }
    assert!(slewing > 2000, "{slewing}");
}

#[test]
fn a_start_gives_the_single_valued_deflection_and_the_rest_as_the_past_gets_known() {
    let feed_forward = FeedForward::<f64>::new(&masing(), &instant()).expect("a feed-forward");
    let spring = without_loop();
    let mut state = feed_forward.start::<16>(0.0);
    let mut certainty = 0.0;
    for k in 0..=1000 {
        let torque = 30.0 * f64::from(k) / 1000.0;
        let is = feed_forward.step(&mut state, &whole(Source::Reference), &Demand { torque, deflection: 0.0 });
        assert!(is.certainty >= certainty, "never less than before");
        certainty = is.certainty;
        if k == 1 {
            let single_valued = spring.peek(&spring.gear().start::<16>(0.0), torque).theta;
            assert!(certainty < 1e-2 && (is.offset / single_valued - 1.0).abs() < 0.05, "{is:?}");
        }
        // U = hA(1 − θ/A) on the first stroke.
        let u = state.gear().theta() / A;
        assert!((certainty - (1.0 - (1.0 - u).powi(2))).abs() < 1e-9, "{certainty} at {u}");
    }
    let _ = feed_forward.step(&mut state, &whole(Source::Reference), &Demand { torque: 100.0, deflection: 0.0 });
    assert_eq!(state.contribution().certainty, 1.0);
    // It stays so.
    assert_eq!(feed_forward.step(&mut state, &whole(Source::Reference), &Demand::default()).certainty, 1.0);
}

/// The published gear without its loop: h = 0, the same e.
fn without_loop() -> Inverse<f64> {
    let memory = Memory { alpha: masing().memory().e(), beta_per_s: 1.0, omega_per_s: 0.0, ..Memory::default() };
    Inverse::new(&Params::new(A, common::elastic(), memory).expect("a gear")).expect("an inverse")
}

#[test]
fn over_all_pasts_the_first_stroke_is_better_with_the_fade() {
    let feed_forward = FeedForward::<f64>::new(&masing(), &instant()).expect("a feed-forward");
    let inverse = Inverse::<f64>::new(&masing()).expect("an inverse");
    let single_valued = without_loop();
    // The two pasts that are furthest apart: the branches of the rated cycle through θ = 0. Every other lies between.
    let pasts = [[A, -A, 0.0], [-A, A, 0.0]].map(|path| {
        let mut state = inverse.gear().start::<256>(0.0);
        for theta in path {
            inverse.gear().step(&mut state, theta);
        }
        state
    });
    let mut state = feed_forward.start::<16>(0.0);
    let mut nominal = inverse.gear().start::<16>(0.0);
    let mut mean = [0.0_f64; 3];
    println!("largest error of the hysteresis torque over all pasts: faded in, nominal start, without the loop");
    for k in 1..=800 {
        // By the deflection: along the measurement.
        let theta = 1e-3 * f64::from(k) * A;
        let controls = whole(Source::Measurement);
        let is = feed_forward.step(&mut state, &controls, &Demand { torque: 0.0, deflection: theta });
        inverse.gear().step(&mut nominal, theta);
        let estimates = [
            is.hysteresis,
            inverse.gear().output(&nominal).hysteresis,
            single_valued.gear().output(&single_valued.gear().start::<4>(theta)).hysteresis,
        ];
        let truths = pasts.each_ref().map(|past| inverse.gear().step(&mut past.clone(), theta).hysteresis);
        let errors = estimates.map(|z| truths.iter().map(|truth| (z - truth).abs()).fold(0.0, f64::max));
        if k % 100 == 0 {
            println!("{:4.1} of A: {:.3} {:.3} {:.3} N·m", 1e-3 * f64::from(k), errors[0], errors[1], errors[2]);
        }
        for (mean, error) in mean.iter_mut().zip(errors) {
            *mean += error / 800.0;
        }
        assert!(errors[0] <= 1.001 * errors[1].min(errors[2]), "{errors:?} at {k}");
    }
    assert!(mean[0] < 0.9 * mean[1] && mean[0] < 0.9 * mean[2], "{mean:?}");
}

#[test]
fn what_is_no_number_holds_the_contribution_and_fades_it() {
    let settings = Settings { ramp_s: 100.0 * PERIOD_S, ..instant() };
    let feed_forward = FeedForward::<f32>::new(&masing(), &settings).expect("a feed-forward");
    for source in [Source::Reference, Source::Measurement] {
        let controls = whole(source);
        let mut state = settled(&feed_forward, &controls);
        let step = |_| feed_forward.step(&mut state, &controls, &Demand { torque: 12.0, deflection: 4e-4 });
        let good = (0..200).map(step).last().expect("a period");
        for bad in [f32::NAN, f32::INFINITY, -1e30] {
            let mut demands = vec![Demand { torque: bad, deflection: 4e-4 }];
            if source == Source::Measurement {
                demands.push(Demand { torque: 12.0, deflection: bad });
            }
            for demand in demands {
                let mut state = state.clone();
                for k in 1..=120 {
                    let is = feed_forward.step(&mut state, &controls, &demand);
                    assert!(is.refused, "{demand:?}");
                    let share = (1.0 - 0.01 * k as f32).max(0.0);
                    assert!((is.gain - share).abs() < 1e-5, "{demand:?}: {} in period {k}", is.gain);
                    assert!((is.offset - share * good.offset).abs() < 1e-8, "{demand:?} in period {k}");
                    assert!((is.hysteresis - share * good.hysteresis).abs() < 1e-4, "{demand:?} in period {k}");
                }
                let is = feed_forward.step(&mut state, &controls, &Demand { torque: 12.0, deflection: 4e-4 });
                assert!(!is.refused && (is.gain - 0.01).abs() < 1e-5);
            }
        }
        let is = feed_forward.step(&mut state, &controls, &Demand { torque: 12.0, deflection: 4e-4 });
        assert!(!is.refused && (is.offset - good.offset).abs() < 1e-9);
        // One bad period costs one step of the ramp, and one good period brings it back.
        let _ = feed_forward.step(&mut state, &controls, &Demand { torque: f32::NAN, deflection: 4e-4 });
        let is = feed_forward.step(&mut state, &controls, &Demand { torque: 12.0, deflection: 4e-4 });
        assert!(!is.refused && (is.offset - good.offset).abs() < 1e-9);
        // A ratio that is none switches off.
        let is = (0..101).fold(is, |_, _| {
            feed_forward.step(
                &mut state,
                &Controls { ratio: f32::NAN, ..controls },
                &Demand { torque: 12.0, deflection: 4e-4 },
            )
        });
        assert_eq!((is.gain, is.offset), (0.0, 0.0));
    }
    let feed_forward = FeedForward::<f32>::new(&masing(), &instant()).expect("a feed-forward");
    let saturated = feed_forward.step(
        &mut feed_forward.start::<16>(0.0),
        &whole(Source::Reference),
        &Demand { torque: 60.0, deflection: 0.0 },
    );
    assert!(saturated.saturated && saturated.offset == A as f32);
}

#[test]
fn settings_that_cannot_be_are_refused() {
    for (settings, name) in [
        (Settings { period_s: 0.0, ..instant() }, "period_s"),
        (Settings { ramp_s: f64::INFINITY, ..instant() }, "ramp_s"),
        (Settings { ramp_s: -1.0, ..instant() }, "ramp_s"),
        (Settings { offset_slew_rad_per_s: f64::NAN, ..instant() }, "offset_slew_rad_per_s"),
        (Settings { torque_slew_nm_per_s: 0.0, ..instant() }, "torque_slew_nm_per_s"),
    ] {
        let refused = FeedForward::<f32>::new(&masing(), &settings).expect_err(name);
        assert!(matches!(refused, FeedForwardError::Setting { setting, .. } if setting == name));
        assert!(refused.to_string().contains(name), "{refused}");
    }
    let (c1, h) = (2.0e4, 1.2e4);
    let elastic = Elastic { c1_nm_per_rad: c1, ..Elastic::default() };
    let memory = Memory { alpha: h, beta_per_s: 0.0, omega_per_s: 1.0, ..Memory::default() };
    let too_strong = Params::new(A, elastic, memory).expect("a gear all the same");
    assert!(matches!(FeedForward::<f32>::new(&too_strong, &instant()), Err(FeedForwardError::Inverse(_))));
}

const ENCODER: MotorEncoder = MotorEncoder {
    counts_per_turn: 10_000,
    ratio: (101, 1),
    reference_counts_per_turn: 1 << 30,
    rated_deflection_rad: A,
};

/// What a motor shows that has gone this far.
fn place(counts: i64) -> Place {
    Place { counts, within_turn: 0, change: 0 }
}

#[test]
fn hundreds_of_turns_cost_no_precision() {
    let motor = MotorSide::<f32>::new(&ENCODER).expect("a motor");
    let parts_per_rad = 101.0 * 10_000.0 * 256.0 / std::f64::consts::TAU;
    let mut dice = ChaCha8Rng::seed_from_u64(6);
    let mut worst = 0.0_f64;
    for turns in [0, 1, -1, 500, -500, 1_000_000, -1_000_000] {
        for _ in 0..2000 {
            let reference = turns * (1 << 30) + dice.random_range(-(1_i64 << 29)..1 << 29);
            let offset: f32 = dice.random_range(-1.2e-3..1.2e-3);
            let position = motor.position(reference, offset);
            // In 128 bits, to the nearest part.
            let exact = (2 * i128::from(reference) * 101 * 10_000 * 256 + (1 << 30)).div_euclid(1 << 31);
            let wanted = exact as i64 + (f64::from(offset) * parts_per_rad).round() as i64;
            worst = worst.max((position - wanted).abs() as f64);
            // A motor a few counts away sees just that.
            let behind = dice.random_range(-20..20);
            let counts = position.div_euclid(256) - behind;
            let error_rad = motor.error(position, &place(counts));
            let parts = (position - 256 * counts) as f64;
            assert!((f64::from(error_rad) * 256.0 * 10_000.0 / std::f64::consts::TAU - parts).abs() < 1e-3);
        }
    }
    println!("after a million turns the motor's reference is within {worst} of 256 parts of a count");
    assert!(worst <= 1.0);
}

#[test]
fn fixed_point_feeds_the_same_forward() {
    // Off, on, another source, another ratio, from a start without a past, with everything limited.
    let settings = Settings {
        ramp_s: 0.2,
        offset_slew_rad_per_s: 0.01 * A / PERIOD_S,
        torque_slew_nm_per_s: 0.05 / PERIOD_S,
        ..instant()
    };
    let (params, scale) = (masing(), masing().torque_scale_nm());
    let exact = FeedForward::<f64>::new(&params, &settings).expect("a feed-forward");
    let fixed = FeedForward::of(&params, Masing::<Fixed>::new(&params), &settings).expect("a feed-forward");
    let (mut state, mut other) = (exact.start::<16>(0.0), fixed.start::<16>(Fixed::ZERO));
    let mut worst = [0.0_f64; 3];
    for k in 0..20_000_u32 {
        let source = if k / 3000 % 2 == 0 { Source::Reference } else { Source::Measurement };
        let (on, ratio) = (k > 500, if k > 9000 { 0.5 } else { 1.0 });
        let torque = Fixed::from_f64(torque(0.9, k) / scale);
        let deflection = Fixed::from_f64(0.8 * (0.003 * f64::from(k)).sin());
        let demand = Demand { torque: torque.to_f64() * scale, deflection: deflection.to_f64() * A };
        let should = exact.step(&mut state, &Controls { on, source, ratio }, &demand);
        let controls = Controls { on, source, ratio: Fixed::from_f64(ratio) };
        let is = fixed.step(&mut other, &controls, &Demand { torque, deflection });
        for (worst, [is, should]) in worst.iter_mut().zip([
            [is.offset.to_f64(), should.offset / A],
            [is.hysteresis.to_f64(), should.hysteresis / scale],
            [is.certainty.to_f64(), should.certainty],
        ]) {
            *worst = worst.max((is - should).abs());
        }
    }
    println!(
        "fixed point beside f64, as shares: offset {:.1e}, hysteresis {:.1e}, certainty {:.1e}",
        worst[0], worst[1], worst[2]
    );
    // Of the order of what the inverse in fixed point may leave.
    assert!(worst[0] < 5e-7 && worst[1] < 2e-7 && worst[2] < 3e-7, "{worst:?}");
}

#[test]
fn fixed_point_accepts_and_gives_counts() {
    let (motor, exact) =
        (MotorSide::<Fixed>::new(&ENCODER).expect("a motor"), MotorSide::<f64>::new(&ENCODER).expect("a motor"));
    let mounting = |counts_per_turn| Mounting { counts_per_turn, reversed: false };
    let setup = Setup {
        motor: mounting(10_000),
        output: mounting(1 << 17),
        ratio: (101, 1),
        deflection_zero_rad: 2e-4,
        rated_deflection_rad: A,
    };
    let (pair, exact_pair) =
        (EncoderPair::<Fixed>::new(&setup).expect("a pair"), EncoderPair::<f64>::new(&setup).expect("a pair"));
    let mut dice = ChaCha8Rng::seed_from_u64(8);
    for _ in 0..20_000 {
        let u = Fixed::from_f64(dice.random_range(-1.2..1.2));
        let reference = dice.random_range(-(1_i64 << 40)..1 << 40);
        let (is, should) = (motor.position(reference, u), exact.position(reference, u.to_f64() * A));
        assert!((is - should).abs() <= 1, "{is} parts for {should}");
        let place = place(is / 256 + dice.random_range(-9..9));
        let turns = motor.error(is, &place).to_f64();
        assert!((turns - exact.error(is, &place) / std::f64::consts::TAU).abs() < 4e-9, "{turns} turns");

        let output = dice.random_range(-(1_i64 << 36)..1 << 36);
        // About where the motor has to be, wound up by up to twice the rated deflection.
        let counts = (output * 1_010_000).div_euclid(1 << 17) + dice.random_range(-300..300);
        let (is, should) = (pair.deflection(counts, output).to_f64(), exact_pair.deflection(counts, output) / A);
        assert!((is - should).abs() < 1e-8, "{is} for {should}");
    }
}

#[test]
fn the_motor_turns_with_the_offset() {
    let motor = MotorSide::<f32>::new(&ENCODER).expect("a motor");
    assert_eq!(motor.position(0, 0.0), 0);
    assert_eq!(motor.position(1 << 30, 0.0), 101 * 10_000 * MotorSide::<f32>::PARTS);
    assert_eq!(motor.position(-(1 << 30), 0.0), -101 * 10_000 * MotorSide::<f32>::PARTS);
    assert_eq!(motor.error(i64::MAX, &place(0)), motor.error(i64::from(i32::MAX), &place(0)), "saturates");
    assert!((motor.velocity(0.5, 1e-6, 1000.0) - 101.0 * 0.501).abs() < 1e-4);
    for (encoder, error) in [
        (MotorEncoder { counts_per_turn: 0, ..ENCODER }, SetupError::Counts),
        (MotorEncoder { reference_counts_per_turn: 1 << 31, ..ENCODER }, SetupError::Counts),
        (MotorEncoder { ratio: (100, 0), ..ENCODER }, SetupError::Ratio),
        (MotorEncoder { rated_deflection_rad: f64::NAN, ..ENCODER }, SetupError::Deflection),
        (MotorEncoder { counts_per_turn: 1 << 29, ..ENCODER }, SetupError::TooFine),
        (
            MotorEncoder { counts_per_turn: 999_999_937, ratio: (1, 999_983), rated_deflection_rad: 1e-9, ..ENCODER },
            SetupError::TooFine,
        ),
    ] {
        assert_eq!(MotorSide::<f32>::new(&encoder), Err(error));
    }
}

#[test]
fn the_joint_it_is_for_is_described_in_one_call_a_period() {
    // A gear that follows the motor at N·(q_o* + θ*) against a link that needs T* carries T*.
    let feed_forward = FeedForward::<f32>::new(&masing(), &instant()).expect("a feed-forward");
    let motor = MotorSide::<f32>::new(&ENCODER).expect("a motor");
    let gear = Gear::<f64>::new(&masing());
    let mut state = settled(&feed_forward, &whole(Source::Reference));
    let mut truth = gear.start::<256>(0.0);
    for theta in [A, -A, f64::from(state.gear().theta())] {
        gear.step(&mut truth, theta);
    }
    let mut worst = 0.0_f64;
    for k in 0..5000 {
        let torque = torque(0.8, k);
        let is = feed_forward.step(
            &mut state,
            &whole(Source::Reference),
            &Demand { torque: torque as f32, deflection: 0.0 },
        );
        // 321 turns out, the link exactly on its reference.
        let reference = 321 * (1 << 30);
        let wound = motor.position(reference, is.offset) - motor.position(reference, 0.0);
        let theta = wound as f64 / (101.0 * 10_000.0 * 256.0) * std::f64::consts::TAU;
        worst = worst.max((gear.step(&mut truth, theta).torque - torque).abs() / masing().torque_scale_nm());
    }
    println!("torque of the gear beside the reference, motor set in parts of a count: {worst:.1e} of the rated torque");
    assert!(worst < 3e-5, "{worst:e}");
}
