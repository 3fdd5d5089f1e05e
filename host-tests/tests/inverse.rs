//! forward(inverse(T)) = T under every law, kernel and gate, in both precisions, whatever the past; in fixed point under the laws that it has.
//!
//! What the forward call may be off, as a share of the torque scale, ε being the spacing of numbers next to 1:
//!
//! - twice the tolerance of residual (4ε, in fixed point that of `f32`): once counts as none, and the last step of the search leaves at most as much
//!   by the bound on d³T/dt³;
//! - 8ε of rounding in the two evaluations of T, and as much of dT/dθ times the rounding of θ, both of order one;
//! - where the gate is a root, θ is rounded by at most 2ε of A, which moves g by at most min(2ε/g, √(4ε)): that times e in `masing`, the largest
//!   memory M in the others. Fixed point rounds the product under the root as well, by ε/2.

use crate::common;
use std::fmt::Debug;

use crate::common::{A, elastic};
use gmhm::inverse::{InverseError, Invertible, MOST_STEPS, invertible_range};
use gmhm::memory::masing::Masing as MasingLaw;
use gmhm::memory::time::Time;
use gmhm::scalar::{Fixed, Scalar};
use gmhm::{Elastic, Gate, Gear, Inverse, Kernel, Law, Memory, Params, State};
use gmhm_host_tests::Weighed;
use gmhm_host_tests::integral::{Clock, Integral};
use gmhm_host_tests::masing::Masing;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What the root of the gate multiplies, as a share of the torque scale.
fn rooted(params: &Params) -> f64 {
    let Memory { law, kernel, gate, alpha, beta_per_s, .. } = params.memory();
    let size = match (law, kernel, gate) {
        (Law::Masing, ..) => params.memory().e(),
        (_, _, Gate::None) => 0.0,
        (_, Kernel::Deflection, _) => alpha / beta_per_s,
        (_, Kernel::Rate, _) => 2.0 * alpha,
    };
    size * params.rated_deflection_rad() / params.torque_scale_nm()
}

/// What forward(inverse(T)) may differ from T at u = θ/A.
fn bound<S: Scalar>(params: &Params, u: f64) -> f64 {
    let g = ((1.0 - u) * (1.0 + u)).max(0.0).sqrt();
    let rounding = if S::SI { 2.0 } else { 2.5 } * S::EPSILON;
    let root = (rounding / g).min((2.0 * rounding).sqrt());
    2.0 * S::TOLERANCE + 16.0 * S::EPSILON + rooted(params) * root
}

fn name(params: &Params) -> String {
    let Memory { law, kernel, gate, .. } = params.memory();
    format!("{} {} {}", law.name(), kernel.name(), gate.name())
}

/// What a run of random torques showed.
#[derive(Debug, Default)]
struct Seen {
    calls: u64,
    saturated: u64,
    tips: u64,
    steps: u64,
    most_steps: u8,
    merged: u32,
    /// The largest residual away from the tips, at them, and as a share of its bound.
    away: f64,
    at_tips: f64,
    of_bound: f64,
}

/// Loads, small and large, nested loops, holds, tips, torques beyond the range, deflections beyond the range, fresh starts.
fn random_calls<S: Scalar, L: Invertible<S> + Debug>(
    params: &Params,
    inverse: &Inverse<S, L>,
    calls: u64,
    seed: u64,
) -> Seen
where
    L::State<16>: Debug,
{
    let gear = inverse.gear();
    let (a, scale) = if S::SI { (params.rated_deflection_rad(), params.torque_scale_nm()) } else { (1.0, 1.0) };
    let edge = gear.output(&gear.start::<16>(inverse.range())).torque.to_f64();
    let tip = gear.output(&gear.start::<16>(S::from_f64(a))).torque.to_f64();
    let tips_are_exact = params.memory().law == Law::Masing
        && params.memory().reversal_play_rad == 0.0
        && rooted(params) > 0.01
        && inverse.range() == S::from_f64(a);
    let mut dice = ChaCha8Rng::seed_from_u64(seed);
    let mut state: State<S, 16, L> = gear.start(S::ZERO);
    let mut torque = 0.0_f64;
    // On the rated cycle once both tips were reached, until the gear leaves the range. Merged pairs leave a gap there until the stack empties: the law itself
    // then gives another torque at the tip.
    let mut reached = [false; 2];
    let mut seen = Seen::default();
    while seen.calls < calls {
        let mut at_tip = false;
        match dice.random_range(0..100) {
            0 => {
                seen.merged += gear.merged_pairs(&state);
                state = gear.start(S::from_f64(dice.random_range(-1.0..1.0) * a));
                reached = [false; 2];
            }
            1 => {
                reached = [false; 2];
                gear.step(&mut state, S::from_f64(dice.random_range(-1.3..1.3) * a));
            }
            2 => {
                at_tip = tips_are_exact && reached == [true; 2] && gear.merged_pairs(&state) == 0;
                torque = if dice.random_bool(0.5) { tip } else { -tip };
            }
            3 => torque = dice.random_range(-1.5..1.5) * scale,
            4..20 => torque = dice.random_range(-1.0..1.0) * edge,
            20..60 => torque += dice.random_range(-0.1..0.1) * scale * 10_f64.powf(dice.random_range(-6.0..0.0)),
            60..65 => {}
            _ => torque *= -0.9,
        }
        let asked = S::from_f64(torque);
        let before = state.clone();
        let (solution, output) = inverse.commit(&mut state, asked);
        let told = || format!("{}, seed {seed}: {asked:?} from {before:?}: {solution:?}", name(params));
        assert!(solution.converged && !solution.refused && solution.steps < MOST_STEPS, "{}", told());
        assert!(solution.theta.abs() <= inverse.range(), "{}", told());
        reached[0] |= solution.theta == -inverse.range();
        reached[1] |= solution.theta == inverse.range();
        seen.calls += 1;
        seen.steps += u64::from(solution.steps);
        seen.most_steps = seen.most_steps.max(solution.steps);
        if at_tip {
            seen.tips += 1;
            assert_eq!(solution.theta.abs(), gear.frame().rated(), "the tip: {}", told());
        }
        let missing = (asked.to_f64() - output.torque.to_f64()) / scale;
        if solution.saturated {
            seen.saturated += 1;
            // The edge is the best there is, on whichever side.
            assert_eq!(solution.theta.abs(), inverse.range(), "{}", told());
            continue;
        }
        let u = solution.theta.to_f64() / a;
        let allowed = bound::<S>(params, u);
        assert!(missing.abs() <= allowed, "{missing:e} above {allowed:e}: {}", told());
        seen.of_bound = seen.of_bound.max(missing.abs() / allowed);
        let place = if u.abs() <= 0.999 { &mut seen.away } else { &mut seen.at_tips };
        *place = place.max(missing.abs());
    }
    seen
}

fn print(name: &str, seen: &Seen) {
    println!(
        "{name:30} {:>9} calls, {:>6} saturated, {:>6} at a tip, {:>6} pairs merged, {:.2} steps, at most {}; residual {:.1e} away from the tips, {:.1e} at them, {:.2} of its bound",
        seen.calls,
        seen.saturated,
        seen.tips,
        seen.merged,
        seen.steps as f64 / seen.calls as f64,
        seen.most_steps,
        seen.away,
        seen.at_tips,
        seen.of_bound
    );
}

/// Ten million random calls of a law, half of them in each precision, over its kernels and gates and two periods.
fn ten_million(law: Law) {
    const CALLS: u64 = 10_000_000;
    let gears: Vec<Params> = common::every_law().into_iter().filter(|params| params.memory().law == law).collect();
    let runs = 4 * gears.len() as u64;
    for (index, params) in gears.iter().enumerate() {
        for (round, period_s) in [1e-3, 1e-4].into_iter().enumerate() {
            let seed = (2 * index + round) as u64;
            let inverse = Inverse::<f64>::with_period(params, period_s).expect("a range");
            let double = random_calls(params, &inverse, CALLS.div_ceil(runs), seed);
            print(&format!("{} f64", name(params)), &double);
            let inverse = Inverse::<f32>::with_period(params, period_s).expect("a range");
            let single = random_calls(params, &inverse, CALLS.div_ceil(runs), seed);
            print(&format!("{} f32", name(params)), &single);
            for seen in [double, single] {
                assert!(seen.saturated > 0 && (law != Law::Masing || seen.merged > 0 && seen.tips > 0));
            }
        }
    }
}

#[test]
fn ten_million_random_calls_converge_in_law_masing() {
    ten_million(Law::Masing);
}

#[test]
fn ten_million_random_calls_converge_in_law_phase() {
    ten_million(Law::Phase);
}

#[test]
fn ten_million_random_calls_converge_in_law_time() {
    ten_million(Law::Time);
}

#[test]
fn ten_million_random_calls_converge_in_fixed_point() {
    const CALLS: u64 = 2_500_000;
    for (seed, period_s) in [(1, 1e-4), (2, 1e-3)] {
        let params = common::masing();
        let inverse = Inverse::of(&params, MasingLaw::<Fixed>::new(&params), 0.0).expect("a range");
        let seen = random_calls(&params, &inverse, CALLS, seed);
        print("masing, fixed point", &seen);
        assert!(seen.saturated > 0 && seen.merged > 0 && seen.tips > 0);
        assert!(seen.at_tips < 2e-5, "{seen:?}");
        for params in common::every_law().into_iter().filter(|params| params.memory().law == Law::Time) {
            let law = Time::<Fixed>::new(&params, period_s);
            let inverse = Inverse::of(&params, law, period_s).expect("a range");
            let seen = random_calls(&params, &inverse, CALLS.div_ceil(4), seed);
            print(&format!("{}, fixed point", name(&params)), &seen);
            assert!(seen.saturated > 0);
        }
    }
}

#[test]
fn any_gear_with_a_range_is_inverted() {
    let mut dice = ChaCha8Rng::seed_from_u64(3);
    let (mut gears, mut ranges, mut too_bent) = (0_u32, 0, 0);
    let mut worst = Seen::default();
    while gears < 1000 {
        let (e, h) = (dice.random_range(0.0..0.8), dice.random_range(1e-3..0.5));
        let e = if dice.random_bool(0.2) { 1e-3 * e } else { e };
        let play = if dice.random_bool(0.3) { dice.random_range(0.0..0.1) * A } else { 0.0 };
        let (c2, c3) = (dice.random_range(-0.35..0.5), dice.random_range(-0.15..0.15));
        let c1 = 2.0e4;
        let elastic =
            Elastic { c1_nm_per_rad: c1, c2_nm_per_rad3: c2 * c1 / (A * A), c3_nm_per_rad5: c3 * c1 / A.powi(4) };
        // ω = h and β = e make α = (e² + h²)·c1.
        let memory = Memory {
            alpha: (e * e + h * h) * c1,
            beta_per_s: e,
            omega_per_s: h,
            reversal_play_rad: play,
            ..Memory::default()
        };
        let params = Params::new(A, elastic, memory).expect("a gear");
        let Ok(range) = invertible_range(&params, 0.0) else { continue };
        gears += 1;
        ranges += u32::from(range < 1.0);
        let seed = u64::from(gears);
        let double = random_calls(&params, &Inverse::<f64>::new(&params).expect("a range"), 1000, seed);
        let single = random_calls(&params, &Inverse::<f32>::new(&params).expect("a range"), 1000, seed);
        let fixed = match Inverse::of(&params, MasingLaw::<Fixed>::new(&params), 0.0) {
            Ok(inverse) => random_calls(&params, &inverse, 1000, seed),
            Err(error) => {
                assert!(matches!(error, InverseError::Format { .. }), "{error}");
                too_bent += 1;
                Seen::default()
            }
        };
        for seen in [double, single, fixed] {
            worst.calls += seen.calls;
            worst.steps += seen.steps;
            worst.most_steps = worst.most_steps.max(seen.most_steps);
            worst.of_bound = worst.of_bound.max(seen.of_bound);
        }
    }
    print("random gears", &worst);
    println!("{too_bent} of {gears} gears bend too sharply for fixed point");
    assert!(ranges > 50, "{ranges} of {gears} gears have a range below A");
    assert!(too_bent > 0 && too_bent < gears / 50, "{too_bent} of {gears} gears bend too sharply for fixed point");
}

/// The reference under any law.
enum Reference {
    Masing(Masing),
    Integral(Integral),
}

impl Reference {
    fn new(params: &Params, period_s: f64) -> Self {
        let Memory { law, kernel, gate, alpha, reversal_play_rad, .. } = params.memory();
        let gear = gmhm_host_tests::Constants { alpha, ..gmhm_host_tests::Constants::PUBLISHED };
        let clock = match law {
            Law::Masing => return Self::Masing(Masing::new(gear, 256, reversal_play_rad, 0.0)),
            Law::Phase => Clock::Pseudo,
            Law::Time => Clock::Real(period_s),
        };
        let weighed = if kernel == Kernel::Deflection { Weighed::Deflection } else { Weighed::Rate };
        Self::Integral(Integral::new(gear, weighed, gate == Gate::Cycle, clock, 0.0))
    }

    fn step(&mut self, theta: f64) -> f64 {
        match self {
            Self::Masing(masing) => masing.step(theta),
            Self::Integral(integral) => integral.step(theta),
        }
    }
}

#[test]
fn the_reference_gives_back_the_torque_that_was_asked_for() {
    const PERIOD_S: f64 = 1e-3;
    let with_play = {
        let memory = Memory { reversal_play_rad: 0.03 * A, ..common::masing().memory() };
        Params::new(A, elastic(), memory).expect("a gear")
    };
    for params in common::every_law().into_iter().chain([with_play]) {
        let inverse = Inverse::<f64>::with_period(&params, PERIOD_S).expect("a range");
        let edge = inverse.gear().output(&inverse.gear().start::<16>(inverse.range())).torque;
        let mut state = inverse.gear().start::<256>(0.0);
        let mut reference = Reference::new(&params, PERIOD_S);
        let mut dice = ChaCha8Rng::seed_from_u64(11);
        let mut worst = 0.0_f64;
        for k in 0..4000 {
            let phase = 0.02 * f64::from(k);
            let wave = phase.sin() + 0.4 * (5.3 * phase).sin() + dice.random_range(-0.01..0.01);
            let torque = 0.6 * edge * wave;
            let (solution, _) = inverse.commit(&mut state, torque);
            let told = reference.step(solution.theta);
            if !solution.saturated {
                worst = worst.max((told - torque).abs() / params.torque_scale_nm());
            }
        }
        println!("{}: {worst:.1e}", name(&params));
        assert!(worst < 1e-9, "{}: {worst:e}", name(&params));
    }
}

#[test]
fn closed_loops_come_back_to_where_they_turned() {
    let inverse = Inverse::<f64>::new(&common::masing()).expect("a range");
    let mut state = inverse.gear().start::<16>(0.0);
    // Turns at 20, −10, 12, −2, 8, 1 N·m; each loop is closed in turn.
    let turns: Vec<f64> = [20.0, -10.0, 12.0, -2.0, 8.0, 1.0]
        .into_iter()
        .map(|torque| inverse.commit(&mut state, torque).0.theta)
        .collect();
    let depth = |state: &State<f64, 16>| match state.memory() {
        gmhm::memory::AnyMemory::Masing(path) => path.turning_points().len(),
        _ => 0,
    };
    assert_eq!(depth(&state), 6);
    for (torque, turn, left) in [(8.0, 4, 5), (12.0, 2, 3), (20.0, 0, 0)] {
        let (solution, _) = inverse.commit(&mut state, torque * (1.0 + 1e-12));
        assert!((solution.theta - turns[turn]).abs() < 1e-11 * A, "{torque} N·m");
        assert_eq!(depth(&state), left, "at {torque} N·m");
    }
}

#[test]
fn peek_tells_what_commit_does_and_moves_nothing() {
    for params in common::every_law() {
        let inverse = Inverse::<f32>::with_period(&params, 1e-3).expect("a range");
        let mut state = inverse.gear().start::<16>(0.0);
        for k in 0..2000 {
            let torque = 0.2 * params.torque_scale_nm() as f32 * (0.37 * k as f32).sin();
            let before = format!("{state:?}");
            let peeked = inverse.peek(&state, torque);
            let _ = inverse.peek(&state, -torque);
            assert_eq!(format!("{state:?}"), before, "{}", name(&params));
            let (solution, output) = inverse.commit(&mut state, torque);
            assert_eq!((solution, output), (peeked, inverse.gear().output(&state)));
            assert_eq!(state.theta(), solution.theta);
        }
    }
}

#[test]
fn a_torque_that_is_held_moves_nothing() {
    for params in common::every_law().into_iter().filter(|params| params.memory().law != Law::Time) {
        let inverse = Inverse::<f32>::new(&params).expect("a range");
        let mut state = inverse.gear().start::<16>(0.0);
        for torque in [3.0, -1.0, 2.0] {
            inverse.commit(&mut state, torque);
        }
        let theta = state.theta();
        for _ in 0..1000 {
            assert_eq!(inverse.commit(&mut state, 2.0).0.theta, theta);
        }
    }
}

#[test]
fn beyond_the_range_the_solution_is_its_edge() {
    for params in common::every_law() {
        let inverse = Inverse::<f64>::with_period(&params, 1e-3).expect("a range");
        let mut state = inverse.gear().start::<16>(0.0);
        for (torque, side) in [(60.0, 1.0), (1e9, 1.0), (-1e9, -1.0), (60.0, 1.0)] {
            let (solution, _) = inverse.commit(&mut state, torque);
            assert!(solution.saturated && solution.converged, "{}: {solution:?}", name(&params));
            assert_eq!(solution.theta, side * inverse.range());
        }
        let (back, output) = inverse.commit(&mut state, 1.0);
        assert!(!back.saturated && (output.torque - 1.0).abs() < 1e-9, "{}: {back:?}", name(&params));
    }
}

#[test]
fn what_is_no_torque_is_refused_and_moves_nothing() {
    for params in common::every_law() {
        let inverse = Inverse::<f32>::with_period(&params, 1e-3).expect("a range");
        let mut state = inverse.gear().start::<16>(0.0);
        inverse.commit(&mut state, 3.0);
        let before = inverse.gear().output(&state);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
            let (solution, output) = inverse.commit(&mut state, bad);
            assert!(solution.refused && solution.theta == state.theta());
            assert_eq!(output, before);
        }
        for period in [f32::NAN, -1e-6, 1.1e-3] {
            assert!(inverse.commit_after(&mut state, 3.0, period).0.refused);
            assert_eq!(inverse.gear().output(&state), before);
        }
        assert!(inverse.start::<16>(f32::NAN).1.refused);
    }
}

#[test]
fn a_start_under_load_carries_it() {
    for params in common::every_law() {
        let inverse = Inverse::<f64>::with_period(&params, 1e-3).expect("a range");
        for torque in [-5.0, 0.0, 4.0] {
            let (state, solution) = inverse.start::<16>(torque);
            assert_eq!(state.theta(), solution.theta);
            assert!((inverse.gear().output(&state).torque - torque).abs() < 1e-13 * params.torque_scale_nm());
        }
    }
}

#[test]
fn periods_may_vary_up_to_the_longest() {
    let mut dice = ChaCha8Rng::seed_from_u64(5);
    for params in common::every_law() {
        let inverse = Inverse::<f64>::with_period(&params, 5e-3).expect("a range");
        let gear = Gear::<f64>::new(&params);
        let mut state = inverse.gear().start::<16>(0.0);
        let mut other: State<f64, 16> = gear.start(0.0);
        for k in 0..2000 {
            let period = dice.random_range(0.0..5e-3);
            let torque = 6.0 * (0.01 * f64::from(k)).sin();
            let (solution, _) = inverse.commit_after(&mut state, torque, period);
            let told = gear.step_after(&mut other, solution.theta, period).torque;
            assert!(
                (told - torque).abs() < 1e-12 * params.torque_scale_nm() || solution.saturated,
                "{}",
                name(&params)
            );
        }
    }
}

#[test]
fn the_range_is_where_the_torque_stops_rising() {
    let ranges: Vec<(String, f64)> = common::every_law()
        .iter()
        .map(|params| (name(params), invertible_range(params, 1e-3).expect("a range")))
        .collect();
    let expected = [
        ("masing deflection cycle", 1.0),
        ("phase deflection cycle", 0.7157),
        ("phase deflection none", 0.6695),
        ("phase rate cycle", 0.3653),
        ("phase rate none", 0.4890),
        ("time deflection cycle", 0.9747),
        ("time deflection none", 1.0),
        ("time rate cycle", 0.8329),
        ("time rate none", 1.0),
    ];
    for ((name, range), (expected_name, expected)) in ranges.iter().zip(expected) {
        assert_eq!(name, expected_name);
        assert!((range - expected).abs() < 1e-4, "{name}: {range}");
    }
}

#[test]
fn a_memory_stronger_than_the_spring_has_no_inverse_but_a_forward() {
    // h = 0.6·c1: a branch that falls with 2h beats the spring.
    let (c1, h) = (2.0e4, 1.2e4);
    let elastic = Elastic { c1_nm_per_rad: c1, ..Elastic::default() };
    let memory = Memory { alpha: h, beta_per_s: 0.0, omega_per_s: 1.0, ..Memory::default() };
    let params = Params::new(A, elastic, memory).expect("a gear all the same");
    let Err(InverseError::NoRange { law: Law::Masing, slope_nm_per_rad }) = Inverse::<f32>::new(&params) else {
        panic!("it has no inverse");
    };
    assert!((slope_nm_per_rad - (c1 - 2.0 * h)).abs() < 1e-6);
    assert!(Gear::<f32>::new(&params).step(&mut Gear::new(&params).start::<16>(0.0), 1e-4).torque > 0.0);
    assert!(matches!(Inverse::<f64>::with_period(&params, f64::NAN), Err(InverseError::Period { .. })));
}
