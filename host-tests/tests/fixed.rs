//! Fixed point against the reference in f64 at the same rounded samples.

use crate::common;
use crate::common::elastic;
use gmhm::inverse::Invertible;
use gmhm::memory::MemoryLaw;
use gmhm::memory::masing::Masing as MasingLaw;
use gmhm::memory::time::Time;
use gmhm::scalar::{Fixed, Scalar};
use gmhm::{Elastic, Gate, Gear, Inverse, Kernel, Law, Memory, Output, Params};
use gmhm_host_tests::integral::{Clock, Integral};
use gmhm_host_tests::masing::Masing;
use gmhm_host_tests::paths::{self, Path};
use gmhm_host_tests::{Constants, Weighed};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The largest error of a step, as a share of the rated torque: a thousandth of what a drive would notice.
const BOUND: f64 = 5e-8;

/// The path in units of 2^−28 of the rated deflection.
fn rounded(path: &Path) -> Vec<Fixed> {
    path.theta.iter().map(|theta| Fixed::from_f64(theta / common::A)).collect()
}

/// The largest error away from the tips and at them, as shares of the rated torque.
fn walk<L: MemoryLaw<Fixed>, const N: usize>(
    gear: &Gear<Fixed, L>,
    params: &Params,
    path: &[Fixed],
    mut reference: impl FnMut(f64) -> f64,
) -> [f64; 2] {
    let mut state = gear.start::<N>(path[0]);
    let mut worst = [0.0_f64; 2];
    for &u in &path[1..] {
        let torque = gear.step(&mut state, u).torque.to_f64();
        assert!(!state.status().refused);
        let expected = reference(u.to_f64() * common::A) / params.torque_scale_nm();
        let at_tip = usize::from(u.to_f64().abs() > 0.999);
        worst[at_tip] = worst[at_tip].max((torque - expected).abs() / expected.abs().max(1.0));
    }
    worst
}

fn merge(worst: &mut [f64; 2], other: [f64; 2]) {
    *worst = [worst[0].max(other[0]), worst[1].max(other[1])];
}

#[test]
fn masing_follows_the_reference() {
    let mut worst = [0.0; 2];
    for seed in 1..=10 {
        for path in paths::every(seed, common::A) {
            let play = Fixed::from_f64(0.5 * path.play / common::A).to_f64() * 2.0 * common::A;
            let mut memory = common::masing().memory();
            memory.reversal_play_rad = play;
            let params = Params::new(common::A, elastic(), memory).expect("the published gear");
            let gear = Gear::with_law(&params, MasingLaw::<Fixed>::new(&params));
            let samples = rounded(&path);
            let start = samples[0].to_f64() * common::A;
            for capacity in [16, 256] {
                let mut reference = Masing::new(Constants::PUBLISHED, capacity, play, start);
                let follow = |theta| reference.step(theta);
                let found = match capacity {
                    16 => walk::<_, 16>(&gear, &params, &samples, follow),
                    _ => walk::<_, 256>(&gear, &params, &samples, follow),
                };
                assert!(found[0].max(found[1]) <= BOUND, "{}, room {capacity}: {found:?}", path.name);
                merge(&mut worst, found);
            }
        }
    }
    println!("masing: {:.1e} away from the tips, {:.1e} at them", worst[0], worst[1]);
}

#[test]
fn time_follows_the_reference() {
    for kernel in [Kernel::Deflection, Kernel::Rate] {
        for gate in [Gate::Cycle, Gate::None] {
            let params = common::params(Law::Time, kernel, gate);
            let constants = Constants { alpha: params.memory().alpha, ..Constants::PUBLISHED };
            let weighed = if kernel == Kernel::Rate { Weighed::Rate } else { Weighed::Deflection };
            let mut worst = [0.0; 2];
            for (seed, period_s) in [(1, 1e-3), (2, 1e-4), (3, 1e-2), (4, 1e-5)] {
                let gear = Gear::with_law(&params, Time::<Fixed>::new(&params, period_s));
                for path in paths::every(seed, common::A) {
                    let samples = rounded(&path);
                    let start = samples[0].to_f64() * common::A;
                    let mut reference =
                        Integral::new(constants, weighed, gate == Gate::Cycle, Clock::Real(period_s), start);
                    let found = walk::<_, 16>(&gear, &params, &samples, |theta| reference.step(theta));
                    assert!(found[0].max(found[1]) <= BOUND, "{}, {period_s} s: {found:?}", path.name);
                    merge(&mut worst, found);
                }
            }
            let (kernel, gate) = (kernel.name(), gate.name());
            println!("time {kernel} {gate}: {:.1e} away from the tips, {:.1e} at them", worst[0], worst[1]);
        }
    }
}

/// Ten million small steps with turns at random: every branch starts from its own turning point, so nothing adds up.
#[test]
fn masing_does_not_drift_over_ten_million_samples() {
    const SAMPLES: u32 = 10_000_000;
    let params = common::masing();
    let gear = Gear::with_law(&params, MasingLaw::<Fixed>::new(&params));
    let mut dice = ChaCha8Rng::seed_from_u64(8);
    let mut state = gear.start::<256>(Fixed::ZERO);
    let mut reference = Masing::new(Constants::PUBLISHED, 256, 0.0, 0.0);
    let (mut place, mut stride) = (0, 1 << 18);
    let (mut worst, mut late) = ([0.0_f64; 2], [0.0_f64; 2]);
    for k in 0..SAMPLES {
        if dice.random_bool(0.01) {
            stride = dice.random_range(-(1 << 22)..1 << 22);
        }
        place = (place + stride).clamp(-(1 << 28), 1 << 28);
        let u = Fixed::from_bits(place);
        let torque = gear.step(&mut state, u).torque.to_f64();
        let expected = reference.step(u.to_f64() * common::A) / params.torque_scale_nm();
        let error = (torque - expected).abs();
        let seen = if k < SAMPLES / 10 { &mut worst } else { &mut late };
        let at_tip = usize::from(u.to_f64().abs() > 0.999);
        seen[at_tip] = seen[at_tip].max(error);
    }
    println!("masing, {SAMPLES} samples: {worst:?} in the first tenth, {late:?} later (away from the tips, at them)");
    assert!(late[0].max(late[1]) <= BOUND, "{late:?}");
}

#[test]
fn masing_follows_the_reference_for_any_gear() {
    let mut dice = ChaCha8Rng::seed_from_u64(7);
    let mut worst = [0.0; 2];
    for seed in 1..=60 {
        let (e, h) = (dice.random_range(0.0..0.8), dice.random_range(1e-3..0.5));
        let (c1, c2, c3) = (2.0e4, dice.random_range(-0.35..0.5), dice.random_range(-0.15..0.15));
        let constants = Constants {
            a: common::A,
            c1,
            c2: c2 * c1 / common::A.powi(2),
            c3: c3 * c1 / common::A.powi(4),
            // ω = h and β = e make α = (e² + h²)·c1.
            alpha: (e * e + h * h) * c1,
            beta: e,
            omega: h,
        };
        let elastic =
            Elastic { c1_nm_per_rad: constants.c1, c2_nm_per_rad3: constants.c2, c3_nm_per_rad5: constants.c3 };
        let memory = Memory { alpha: constants.alpha, beta_per_s: e, omega_per_s: h, ..Memory::default() };
        let params = Params::new(common::A, elastic, memory).expect("a gear");
        let gear = Gear::with_law(&params, MasingLaw::<Fixed>::new(&params));
        for path in paths::every(seed, common::A).iter().filter(|path| path.play == 0.0) {
            let samples = rounded(path);
            let mut reference = Masing::new(constants, 16, 0.0, samples[0].to_f64() * common::A);
            let found = walk::<_, 16>(&gear, &params, &samples, |theta| reference.step(theta));
            assert!(found[0].max(found[1]) <= 3.0 * BOUND, "{params:?}, {}: {found:?}", path.name);
            merge(&mut worst, found);
        }
    }
    println!("any gear: {:.1e} away from the tips, {:.1e} at them", worst[0], worst[1]);
}

/// A memory of hours, ten million samples: every step forgets a part in ten million, far less than half a unit of most memories.
#[test]
fn time_does_not_drift_over_ten_million_samples() {
    const SAMPLES: u32 = 10_000_000;
    const PERIOD_S: f64 = 1e-4;
    for (kernel, tau_s) in [(Kernel::Deflection, 1000.0), (Kernel::Rate, 1000.0), (Kernel::Rate, 100.0)] {
        let mut memory = common::memory(Law::Time, kernel, Gate::None);
        memory.beta_per_s = 1.0 / tau_s;
        // A steady deflection of A/2 fills the memory to about a tenth of the rated torque.
        memory.alpha = if kernel == Kernel::Deflection { 6.0e3 / tau_s } else { 6.0e3 };
        let params = Params::new(common::A, elastic(), memory).expect("a gear");
        let gear = Gear::with_law(&params, Time::<Fixed>::new(&params, PERIOD_S));
        let mut state = gear.start::<16>(Fixed::ZERO);
        let (gain, decay) = (memory.alpha * common::A / params.torque_scale_nm(), (-PERIOD_S / tau_s).exp());
        let growth = -(-PERIOD_S / tau_s).exp_m1() * tau_s / PERIOD_S;
        let (mut exact, mut lost, mut from) = (0.0_f64, 0.0_f64, 0.0_f64);
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for k in 0..SAMPLES {
            // Half a second up, half a second down, about a bias.
            let sweep = f64::from(k % 10_000) / 5000.0;
            let u = Fixed::from_f64(0.3 + 0.4 * if sweep < 1.0 { sweep } else { 2.0 - sweep });
            let hysteresis = gear.step(&mut state, u).hysteresis.to_f64();
            let to = u.to_f64();
            let x = PERIOD_S / tau_s;
            let added = match kernel {
                Kernel::Rate => gain * growth * (to - from),
                // φ1 and φ2 of so small an x.
                Kernel::Deflection => -gain * PERIOD_S * ((1.0 - 0.5 * x) * from + (0.5 - x / 6.0) * (to - from)),
            };
            // Compensated, so that f64 itself does not drift.
            let change = (decay - 1.0) * exact + added + lost;
            let next = exact + change;
            lost = change - (next - exact);
            (exact, from) = (next, to);
            (worst, largest) = (worst.max((hysteresis - exact).abs()), largest.max(exact.abs()));
        }
        println!(
            "time {}, {tau_s} s: {worst:.1e} off over {SAMPLES} samples, memory up to {largest:.3}",
            kernel.name()
        );
        assert!(largest > 0.05 && worst < Fixed::EPSILON, "{worst:e} off");
    }
}

/// Words of every size, the ends and their neighbours among them.
fn words(dice: &mut ChaCha8Rng) -> i32 {
    let near = dice.random_range(-3..=3);
    match dice.random_range(0..4) {
        0 => i32::MIN.saturating_add(near),
        1 => i32::MAX.saturating_add(near),
        2 => (1_i32 << dice.random_range(0..31)).wrapping_add(near),
        _ => dice.random::<i32>() >> dice.random_range(0..31),
    }
}

/// Overflow is checked in this build: whatever wraps, panics.
#[test]
fn no_word_makes_a_step_wrap_or_panic() {
    let mut dice = ChaCha8Rng::seed_from_u64(5);
    let mut laws = vec![];
    for play in [0.0, 0.01, 5.0] {
        let memory = Memory { reversal_play_rad: play * common::A, ..common::masing().memory() };
        laws.push(Params::candidate(common::A, elastic(), memory).expect("a gear"));
    }
    for params in laws {
        storm(&Gear::with_law(&params, MasingLaw::<Fixed>::new(&params)), &mut dice);
    }
    for params in common::every_law().into_iter().filter(|params| params.memory().law == Law::Time) {
        for period_s in [1e-9, 1e-4, 1.0, 1e9] {
            storm(&Gear::with_law(&params, Time::<Fixed>::new(&params, period_s)), &mut dice);
        }
    }
}

/// Steps to any words, most of them refused; the state of a gear that was never refused stays finite all the same.
fn storm<L: MemoryLaw<Fixed>>(gear: &Gear<Fixed, L>, dice: &mut ChaCha8Rng) {
    let mut state = gear.start::<16>(Fixed::from_bits(words(dice)));
    let limit = Fixed::from_f64(Fixed::REFUSED_BEYOND);
    for _ in 0..100_000 {
        let u = Fixed::from_bits(words(dice));
        let before = gear.output(&state);
        let after = gear.step(&mut state, u);
        assert_eq!(state.status().refused, u.abs() > limit);
        if state.status().refused {
            assert_eq!(after, Output { refused: true, ..before });
        }
        let _ = gear.start_uncertainty(&state);
    }
}

#[test]
fn no_word_makes_an_inverse_wrap_or_panic() {
    let mut dice = ChaCha8Rng::seed_from_u64(6);
    for play in [0.0, 0.01, 5.0] {
        let memory = Memory { reversal_play_rad: play * common::A, ..common::masing().memory() };
        let params = Params::candidate(common::A, elastic(), memory).expect("a gear");
        invert_storm(&Inverse::of(&params, MasingLaw::<Fixed>::new(&params), 0.0).expect("a range"), &mut dice);
    }
    for params in common::every_law().into_iter().filter(|params| params.memory().law == Law::Time) {
        for period_s in [0.0, 1e-9, 1e-4, 1.0] {
            let law = Time::<Fixed>::new(&params, period_s);
            let Ok(inverse) = Inverse::of(&params, law, period_s) else { continue };
            invert_storm(&inverse, &mut dice);
        }
    }
}

/// Torques of any words, from states that any words led to.
fn invert_storm<L: Invertible<Fixed>>(inverse: &Inverse<Fixed, L>, dice: &mut ChaCha8Rng) {
    let mut state = inverse.gear().start::<16>(Fixed::from_bits(words(dice)));
    for _ in 0..100_000 {
        inverse.gear().step(&mut state, Fixed::from_bits(words(dice)));
        let torque = Fixed::from_bits(words(dice));
        let solution =
            if dice.random_bool(0.5) { inverse.peek(&state, torque) } else { inverse.commit(&mut state, torque).0 };
        assert!(solution.converged && solution.theta.abs() <= inverse.range(), "{torque:?}: {solution:?}");
    }
}

#[test]
fn saturation_keeps_the_sign() {
    // A spring of 8 rated torques at the limit: beyond what a word holds.
    let elastic = Elastic { c1_nm_per_rad: 1e3, c2_nm_per_rad3: 1e9, c3_nm_per_rad5: 1e15 };
    let params = Params::new(common::A, elastic, common::masing().memory()).expect("a gear");
    let gear = Gear::with_law(&params, MasingLaw::<Fixed>::new(&params));
    let mut state = gear.start::<16>(Fixed::ZERO);
    let up = gear.step(&mut state, Fixed::from_f64(2.5));
    assert_eq!(up.torque, Fixed::from_bits(i32::MAX));
    let down = gear.step(&mut state, Fixed::from_f64(-2.5));
    assert_eq!(down.torque, -up.torque);
    assert!(state.status().out_of_range);
}
