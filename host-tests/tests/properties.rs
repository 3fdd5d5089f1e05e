//! Every property that MODEL.md sections 3 and 4 state, on random gears and paths.

use crate::common::*;
use gmhm::memory::AnyMemory;
use gmhm::{Gate, Gear, Kernel, Law, Memory, Params, State};
use proptest::prelude::*;

/// Rounding along a path of a few hundred samples, in rated torques.
const ROUNDING: f64 = 1e-12;

fn gate(u: f64) -> f64 {
    ((1.0 - u) * (1.0 + u)).max(0.0).sqrt()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn masing_is_the_steady_cycle_once_both_tips_were_reached(p in any_masing(), before in corners(1.0, 1..8), u in -1.0..1.0f64) {
        let mut path = walk(&before, 0.05);
        path.extend([A, -A, u * A]);
        let rising = *torques(&p, &path, 0.0).last().unwrap();
        path.pop();
        path.extend([A, u * A]);
        let falling = *torques(&p, &path, 0.0).last().unwrap();
        let m = p.memory();
        let single = p.elastic().torque_nm(u * A) - m.e() * u * A * gate(u);
        let half_width = m.h() * A * (1.0 - u * u);
        prop_assert!((rising - (single + half_width)).abs() < ROUNDING * p.rated_torque_nm().max(1.0));
        prop_assert!((falling - (single - half_width)).abs() < ROUNDING * p.rated_torque_nm().max(1.0));
    }

    #[test]
    fn masing_is_continuous(p in any_masing(), turns in corners(0.95, 2..40)) {
        let step = 1e-3;
        let path = walk(&turns, step);
        // |dT/dθ| ≤ |f′| + e·max|(θg)′| + 2h within 0.95 A, where (1 − 2u²)/g stays below 2.6.
        let stiffest = (0..=95).map(|k| p.elastic().stiffness_nm_per_rad(A * f64::from(k) / 100.0).abs()).fold(0.0, f64::max);
        let bound = (stiffest * 1.1 + 2.6 * p.memory().e() + 2.0 * p.memory().h()) * step * A;
        for pair in torques(&p, &path, 0.0).windows(2) {
            prop_assert!((pair[1] - pair[0]).abs() <= bound * 1.001);
        }
    }

    #[test]
    fn minor_loops_close_and_are_forgotten(p in any_masing(), turns in corners(1.0, 1..12), a in 0.05..0.95f64, b in 0.05..0.95f64, to in -1.0..1.0f64) {
        // On the way to the last corner, go back a part of the stroke and come again: nothing of that may be left.
        let mut turns = turns;
        turns.push(to * A);
        let (from, to) = (turns[turns.len() - 2], turns[turns.len() - 1]);
        let turn = from + a * (to - from);
        let back = turn - b * (turn - from);
        let mut with_loop = turns[..turns.len() - 1].to_vec();
        with_loop.extend([turn, back, turn]);
        let closed = *torques(&p, &with_loop, 0.0).last().unwrap();
        let mut plain = turns[..turns.len() - 1].to_vec();
        plain.push(turn);
        let open = *torques(&p, &plain, 0.0).last().unwrap();
        prop_assert!((closed - open).abs() < ROUNDING * p.torque_scale_nm(), "loop leaves {}", closed - open);
        with_loop.push(to);
        plain.push(to);
        let (with_loop, plain) = (torques(&p, &with_loop, 0.0), torques(&p, &plain, 0.0));
        prop_assert!((with_loop.last().unwrap() - plain.last().unwrap()).abs() < ROUNDING * p.torque_scale_nm());
    }

    #[test]
    fn passing_an_extreme_wipes_out_what_was_inside(p in any_masing(), inside in corners(0.5, 1..20), beyond in 0.6..1.0f64) {
        // Two histories with the same outermost turning points agree from there on.
        let (low, high) = (-0.55 * A, 0.55 * A);
        let mut long = vec![0.0, high, low];
        long.extend(inside);
        long.extend([high, beyond * A]);
        let short = [0.0, high, low, high, beyond * A];
        let difference = torques(&p, &long, 0.0).last().unwrap() - torques(&p, &short, 0.0).last().unwrap();
        prop_assert!(difference.abs() < ROUNDING * p.torque_scale_nm());
        let gear = Gear::<f64>::new(&p);
        let AnyMemory::Masing(path) = after(&gear, &long).memory().clone() else { panic!("law masing") };
        prop_assert!(path.turning_points().is_empty(), "the initial curve resumes beyond its own extremes");
    }

    #[test]
    fn every_law_is_odd(turns in corners(1.2, 2..12)) {
        for p in every_law() {
            let path = walk(&turns, 0.05);
            let mirrored: Vec<f64> = path.iter().map(|theta| -theta).collect();
            for (plus, minus) in torques(&p, &path, 1e-3).iter().zip(torques(&p, &mirrored, 1e-3)) {
                prop_assert_eq!(*plus, -minus);
            }
        }
    }

    #[test]
    fn masing_and_phase_know_no_rate(p in any_masing(), turns in corners(1.0, 2..12), fine in 0.01..0.05f64) {
        // Any subdivision of the way gives the same torque at the corners, however long it takes.
        let coarse = walk(&turns, 0.5);
        let mut refined = vec![coarse[0]];
        for pair in coarse.windows(2) {
            refined.extend(walk(pair, fine).into_iter().skip(1));
        }
        for p in [p, params(Law::Phase, Kernel::Deflection, Gate::Cycle), params(Law::Phase, Kernel::Rate, Gate::None)] {
            let (a, b) = (torques(&p, &coarse, 1e-3), torques(&p, &refined, 10.0));
            prop_assert!((a.last().unwrap() - b.last().unwrap()).abs() < 1e-9 * p.torque_scale_nm());
        }
    }

    #[test]
    fn a_zero_increment_changes_nothing_but_time(turns in corners(1.0, 2..12)) {
        for p in every_law() {
            let gear = Gear::<f64>::with_period(&p, 1e-3).expect("a period");
            let mut state = after(&gear, &turns);
            let before = gear.output(&state);
            let still = gear.step(&mut state, *turns.last().unwrap());
            if p.memory().law == Law::Time {
                // m ← E·m for kernel rate; kernel deflection goes on integrating.
                if p.memory().kernel == Kernel::Rate {
                    let kept = (-p.memory().beta_per_s * 1e-3).exp();
                    prop_assert!((still.hysteresis - kept * before.hysteresis).abs() < ROUNDING * p.torque_scale_nm());
                }
            } else {
                prop_assert_eq!(still, before);
            }
        }
    }

    #[test]
    fn a_closed_stroke_dissipates_what_rayleigh_says(p in any_masing(), middle in -1.0..1.0f64, stroke in 0.05..1.95f64) {
        let h = p.memory().h();
        let middle = middle * (1.0 - 0.5 * stroke).max(0.0);
        let (low, high) = ((middle - 0.5 * stroke) * A, (middle + 0.5 * stroke) * A);
        let way = walk(&[0.0, high, low, high, low, high], 1e-3 * stroke);
        let torque = torques(&p, &way, 0.0);
        let start = way.len() - walk(&[high, low, high], 1e-3 * stroke).len();
        let loss = work(&way[start..], &torque[start..]);
        let s = stroke * A;
        // The trapezoidal rule on parabolas is exact to the square of the step; the single-valued part cancels.
        let exact = h * s.powi(3) / (3.0 * A);
        prop_assert!((loss - exact).abs() < 1e-5 * exact + 1e-12 * p.torque_scale_nm() * A, "{loss} against {exact}");
    }

    #[test]
    fn a_stroke_past_both_tips_dissipates_the_whole_loop(p in any_masing(), beyond in 1.0..3.0f64) {
        let way = walk(&[0.0, beyond * A, -beyond * A, beyond * A], 1e-3);
        let torque = torques(&p, &way, 0.0);
        let start = way.len() - walk(&[beyond * A, -beyond * A, beyond * A], 1e-3).len();
        let loss = work(&way[start..], &torque[start..]);
        let exact = 8.0 * p.memory().h() * A * A / 3.0;
        prop_assert!((loss - exact).abs() < 1e-5 * exact, "{loss} against {exact}");
    }

    #[test]
    fn torque_rises_with_deflection_where_the_spring_outweighs_the_loop(p in any_masing(), turns in corners(1.0, 2..30)) {
        let m = p.memory();
        let slope = |u: f64| p.elastic().stiffness_nm_per_rad(u * A) - m.e() * (1.0 - 2.0 * u * u) / gate(u) - 2.0 * m.h();
        prop_assume!((-999..=999).all(|k| slope(f64::from(k) / 1000.0) > 0.0));
        let path = walk(&turns, 0.02);
        for (x, t) in path.windows(2).zip(torques(&p, &path, 0.0).windows(2)) {
            prop_assert!((x[1] - x[0]) * (t[1] - t[0]) >= 0.0);
        }
    }

    #[test]
    fn the_true_past_lies_within_the_start_uncertainty(p in any_masing(), start in -0.99..0.99f64, rising in any::<bool>(), turns in corners(1.0, 0..12)) {
        // Two pasts end at the start: the rising and the falling branch of the rated cycle. Their torques differ by twice the spread, and the further of them from the model's by the uncertainty.
        let gear = Gear::<f64>::new(&p);
        let mut path = vec![start * A];
        path.extend(turns);
        let nominal = after(&gear, &path);
        let with_past = |tips: [f64; 2]| {
            let mut whole = tips.to_vec();
            whole.extend(&path);
            gear.output(&after(&gear, &whole)).torque
        };
        let pasts = [[A, -A], [-A, A]].map(with_past);
        let (spread, stated) = ((pasts[0] - pasts[1]).abs() / 2.0, gear.start_spread(&nominal));
        prop_assert!((spread - stated).abs() < ROUNDING * p.torque_scale_nm(), "{spread} against {stated}");
        let torque = gear.output(&nominal).torque;
        let off = pasts.iter().fold(0.0_f64, |most, past| most.max((past - torque).abs()));
        let bound = gear.start_uncertainty(&nominal);
        prop_assert!((off - bound).abs() < ROUNDING * p.torque_scale_nm(), "{off} against {bound}");
        let tip = if rising { A } else { -A };
        let mut state = nominal;
        gear.step(&mut state, tip);
        prop_assert_eq!(gear.start_spread(&state), 0.0);
    }

    #[test]
    fn play_hides_what_is_smaller_than_its_width(p in any_masing(), turns in corners(0.9, 2..8), noise in proptest::collection::vec(-0.5..0.5f64, 50)) {
        let width = 0.02 * A;
        let memory = Memory { reversal_play_rad: width, ..p.memory() };
        let p = Params::new(A, p.elastic(), memory).expect("a gear");
        let gear = Gear::<f64>::new(&p);
        let mut state = after(&gear, &turns);
        let rest = state.theta();
        let points = |state: &State<f64, N>| match state.memory() {
            AnyMemory::Masing(path) => (path.turning_points().len(), path.eta()),
            _ => unreachable!("law masing"),
        };
        let mut flicker = Vec::new();
        for n in &noise {
            // Half a width to either side of where the play sits cannot move it twice.
            gear.step(&mut state, rest + 0.5 * n * width);
            flicker.push(points(&state));
        }
        let first = flicker.iter().skip_while(|now| **now != flicker[flicker.len() - 1]).count();
        prop_assert!(first >= 1);
        prop_assert!(flicker.iter().map(|(count, _)| *count).max().unwrap() <= points(&after(&gear, &turns)).0 + 2);
    }

    #[test]
    fn merged_pairs_leave_the_torque_continuous_and_heal(p in any_masing(), depth in 10..60usize) {
        let gear = Gear::<f64>::new(&p);
        let mut small: State<f64, 16> = gear.start(0.0);
        let mut large: State<f64, N> = gear.start(0.0);
        // Ever smaller loops fill the stack; going out again unwinds it.
        let mut turns: Vec<f64> = (0..depth).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 } * A * (0.9 - 0.8 * k as f64 / depth as f64)).collect();
        turns.insert(0, 0.0);
        turns.push(0.95 * A);
        let path = walk(&turns, 2e-3);
        let limit = (p.elastic().stiffness_nm_per_rad(0.0).abs() * 6.0 + 8.0 * p.memory().e() + 8.0 * p.memory().h()) * 2e-3 * A;
        let mut last = gear.output(&small).torque;
        for &theta in &path[1..] {
            let (a, b) = (gear.step(&mut small, theta).torque, gear.step(&mut large, theta).torque);
            prop_assert!((a - last).abs() < limit, "a jump of {}", a - last);
            prop_assert!((a - b).abs() < 2.0 * p.memory().h() * A);
            last = a;
        }
        prop_assert_eq!(gear.merged_pairs(&small) > 0, depth >= 16);
        // Beyond the outermost turning point the stack is empty and the memory exact again.
        prop_assert!((gear.output(&small).torque - gear.output(&large).torque).abs() < ROUNDING * p.torque_scale_nm());
    }

    #[test]
    fn the_torque_is_exact_where_no_open_loop_may_lack_a_pair(p in any_masing(), depth in 18..60usize, up in any::<bool>()) {
        let gear = Gear::<f64>::new(&p);
        let mut small: State<f64, 16> = gear.start(0.0);
        let mut large: State<f64, N> = gear.start(0.0);
        let turn = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 } * A * (0.9 - 0.8 * k as f64 / depth as f64);
        // A full stack keeps the mirror image of the first turn and the thirteen first turns.
        let beyond = if up { 12 } else { 11 };
        let back = 0.5 * (turn(beyond) + turn(beyond - 2));
        let ends: Vec<f64> = [0.0].into_iter().chain((0..depth).map(turn)).chain([back]).collect();
        let (mut lacked, mut left) = (false, 0);
        for &theta in &walk(&ends, 2e-3)[1..] {
            let (a, b) = (gear.step(&mut small, theta).torque, gear.step(&mut large, theta).torque);
            let AnyMemory::Masing(path) = small.memory() else { unreachable!("law masing") };
            let lacks = path.may_lack_pairs();
            prop_assert!(lacks || (a - b).abs() < ROUNDING * p.torque_scale_nm(), "{} N·m apart", a - b);
            lacked |= lacks;
            left = if lacks { 0 } else { path.turning_points().len() };
        }
        prop_assert!(lacked && left > 8, "{left} turning points left");
    }

    #[test]
    fn a_peek_tells_what_a_step_gives_and_moves_nothing(p in any_masing(), play in prop_oneof![Just(0.0), 0.0..0.1f64], turns in corners(1.2, 2..30)) {
        let params = Params::new(A, p.elastic(), Memory { reversal_play_rad: play * A, ..p.memory() }).unwrap();
        let gear = Gear::<f32>::new(&params);
        // Four turning points: many are merged.
        let mut state: State<f32, 4> = gear.start(0.0);
        for (k, theta) in walk(&turns, 0.1).into_iter().chain([f64::NAN, 0.0]).enumerate() {
            let (theta, aside) = (theta as f32, turns[k % turns.len()] as f32);
            let before = gear.output(&state);
            let peeked = gear.peek_after(&state, theta, 1e-3);
            let _ = gear.peek_after(&state, aside, 1e-3);
            prop_assert_eq!(gear.output(&state), before);
            prop_assert_eq!(gear.step_after(&mut state, theta, 1e-3).torque.to_bits(), peeked.to_bits());
        }
    }

    #[test]
    fn memory_stands_still_outside_the_rated_range(turns in corners(0.9, 1..6), beyond in 1.01..3.0f64, up in any::<bool>()) {
        let tip = if up { A } else { -A };
        for kernel in [Kernel::Deflection, Kernel::Rate] {
            let gear = Gear::<f64>::new(&params(Law::Phase, kernel, Gate::None));
            let mut path = turns.clone();
            path.push(tip);
            let mut state = after(&gear, &path);
            let at_tip = gear.output(&state).hysteresis;
            let out = gear.step(&mut state, beyond * tip);
            prop_assert!(state.status().out_of_range);
            prop_assert!((out.hysteresis - at_tip).abs() < ROUNDING);
            prop_assert!((gear.step(&mut state, tip).hysteresis - at_tip).abs() < ROUNDING);
        }
    }

    #[test]
    fn a_viscoelastic_memory_never_gives_energy(turns in corners(1.0, 1..10), slow in any::<bool>()) {
        // Kernel rate, gate none, from m = 0 along any closed path.
        let mut turns = turns;
        turns.push(turns[0]);
        let path = walk(&turns, 0.01);
        for law in [Law::Phase, Law::Time] {
            let p = params(law, Kernel::Rate, Gate::None);
            let gear = Gear::<f64>::with_period(&p, if slow { 1e-2 } else { 1e-4 }).expect("a period");
            let mut state: State<f64, N> = gear.start(path[0]);
            let z: Vec<f64> = path.iter().enumerate().map(|(k, &x)| if k == 0 { 0.0 } else { gear.step(&mut state, x).hysteresis }).collect();
            // z between samples lies above its chord on the way up and below on the way down, so the trapezoidal rule underrates the loss.
            let scale = p.torque_scale_nm() * A;
            prop_assert!(work(&path, &z) >= -1e-12 * scale, "{}", work(&path, &z) / scale);
        }
    }

    #[test]
    fn gauges_change_nothing(k in 0.1..10.0f64, turns in corners(1.0, 2..12)) {
        let path = walk(&turns, 0.05);
        for law in [Law::Masing, Law::Phase] {
            let m = memory(law, Kernel::Deflection, Gate::Cycle);
            let scaled = Memory { alpha: k * m.alpha, beta_per_s: k * m.beta_per_s, omega_per_s: k * m.omega_per_s, ..m };
            same(&m, &scaled, &path)?;
            // The published triple has both signs turned.
            same(&m, &Memory { beta_per_s: -m.beta_per_s, omega_per_s: -m.omega_per_s, ..m }, &path)?;
        }
        let m = memory(Law::Phase, Kernel::Rate, Gate::Cycle);
        same(&m, &Memory { beta_per_s: k * m.beta_per_s, omega_per_s: k * m.omega_per_s, ..m }, &path)?;
    }

    #[test]
    fn time_is_exact_for_any_subdivision_of_a_ramp(from in -1.0..1.0f64, to in -1.0..1.0f64, split in 0.01..0.99f64, period in 1e-6..1e-1f64) {
        for p in every_law().into_iter().filter(|p| p.memory().law == Law::Time) {
            let gear = Gear::<f64>::new(&p);
            let (from, to) = (from * A, to * A);
            let mut whole: State<f64, N> = gear.start(from);
            let mut parts = whole.clone();
            let once = gear.step_after(&mut whole, to, period);
            gear.step_after(&mut parts, from + split * (to - from), split * period);
            let twice = gear.step_after(&mut parts, to, (1.0 - split) * period);
            prop_assert!((once.hysteresis - twice.hysteresis).abs() < ROUNDING * p.torque_scale_nm());
        }
    }

    #[test]
    fn plain_memory_in_time_is_monotone_a_step_ahead(turns in corners(1.0, 2..10), a in -1.0..1.0f64, b in -1.0..1.0f64) {
        // f′ + αφ1 > 0 (rate) and f′ > αΔφ2 (deflection) hold for these parameters.
        for kernel in [Kernel::Rate, Kernel::Deflection] {
            let gear = Gear::<f64>::with_period(&params(Law::Time, kernel, Gate::None), 1e-4).expect("a period");
            let state = after(&gear, &walk(&turns, 0.1));
            let at = |u: f64| gear.step(&mut state.clone(), u * A).torque;
            prop_assert!((a - b) * (at(a) - at(b)) >= 0.0);
        }
    }
}

fn same(one: &Memory, other: &Memory, path: &[f64]) -> Result<(), TestCaseError> {
    let torque = |memory: &Memory| torques(&Params::new(A, elastic(), *memory).expect("a gear"), path, 0.0);
    for (a, b) in torque(one).iter().zip(torque(other)) {
        prop_assert!((a - b).abs() < 1e-11, "{a} against {b}");
    }
    Ok(())
}

#[test]
fn the_kernels_are_not_the_same() {
    let path = walk(&[0.0, A, -A, A], 0.05);
    for law in [Law::Phase, Law::Time] {
        let m = memory(law, Kernel::Deflection, Gate::Cycle);
        // One α for both is that of no gear in one of them.
        let params = |kernel| Params::candidate(A, elastic(), Memory { kernel, ..m }).expect("numbers");
        let torque = |kernel| torques(&params(kernel), &path, 1e-3);
        let apart =
            torque(Kernel::Deflection).iter().zip(torque(Kernel::Rate)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart > 1.0, "kernels of law {} are only {apart} N·m apart", law.name());
    }
}

#[test]
fn kernel_deflection_can_give_energy() {
    // A limit of the law, stated: closed paths from m = 0 that give work, for each gate.
    for gate in [Gate::Cycle, Gate::None] {
        let gear = Gear::<f64>::new(&params(Law::Phase, Kernel::Deflection, gate));
        let share = (1..20)
            .flat_map(|far| (0..20).map(move |near| (f64::from(far) / 20.0, f64::from(near) / 20.0)))
            .map(|(far, near)| {
                let path = walk(&[far * A, near * A, far * A], 1e-2);
                let mut state: State<f64, N> = gear.start(path[0]);
                let z: Vec<f64> = path.iter().map(|&x| gear.step(&mut state, x).hysteresis).collect();
                work(&path, &z) / (masing().rated_torque_nm() * A)
            })
            .fold(f64::INFINITY, f64::min);
        println!("kernel deflection, gate {}: least work over closed paths from m = 0: {share:.3e} T_A·A", gate.name());
        assert!(share < 0.0);
    }
}
