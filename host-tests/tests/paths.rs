//! The core in both precisions against the reference, on every kind of path under every law, kernel and gate.
//!
//! Bounds, as shares of the rated torque T_A = f(A):
//!
//! - Away from the tips (abs(θ) ≤ 0.999 A): 1e-9 in `f64`, 2e-6 in `f32`.
//! - At the tips and beyond them the gate is a square root. The core's θ/A differs from the exact one by at most two roundings, δ = 2ε in
//!   all (ε the distance of 1 to the next number), hence 1 − θ²/A² by at most 2δ, and as abs(√a − √b) ≤ √abs(a − b), g by at most √(2δ).
//!   In `masing` only −e·θ·g has the root: abs(ΔT) ≤ e·A·√(2δ). In the others z = g·m moves by abs(m)·√(2δ) through the gate and, in
//!   `phase`, m itself by at most that through m∞, for either side of a step. So abs(ΔT) ≤ 3·M·√(2δ), M the largest abs(m) that a path
//!   within ±A can leave. What is claimed away from the tips is added to it, times abs(T)/T_A where the torque is beyond T_A.

mod common;

use common::elastic;
use gmhm::scalar::Float;
use gmhm::{Gate, Gear, Kernel, Law, Memory, Params};
use gmhm_host_tests::integral::{Clock, Integral};
use gmhm_host_tests::masing::Masing;
use gmhm_host_tests::paths::{self, Path};
use gmhm_host_tests::{Constants, Weighed};

const SEEDS: [u64; 3] = [1, 2, 3];
const PERIOD_S: f64 = 1e-3;

/// Where in a run an error is the largest: away from the tips, and elsewhere as a share of its bound.
#[derive(Default)]
struct Worst {
    away: f64,
    tips: f64,
    of_tip_bound: f64,
}

/// The reference under any law.
enum Reference {
    Masing(Masing),
    Integral(Integral),
}

impl Reference {
    fn new(params: &Params, capacity: usize, theta_0: f64) -> Self {
        let Memory { law, kernel, gate, alpha, reversal_play_rad, .. } = params.memory();
        let gear = Constants { a: params.rated_deflection_rad(), alpha, ..Constants::PUBLISHED };
        let clock = match law {
            Law::Masing => return Self::Masing(Masing::new(gear, capacity, reversal_play_rad, theta_0)),
            Law::Phase => Clock::Pseudo,
            Law::Time => Clock::Real(PERIOD_S),
        };
        let weighed = match kernel {
            Kernel::Deflection => Weighed::Deflection,
            Kernel::Rate => Weighed::Rate,
        };
        Self::Integral(Integral::new(gear, weighed, gate == Gate::Cycle, clock, theta_0))
    }

    fn step(&mut self, theta: f64) -> f64 {
        match self {
            Self::Masing(masing) => masing.step(theta),
            Self::Integral(integral) => integral.step(theta),
        }
    }

    fn merged_pairs(&self) -> u32 {
        match self {
            Self::Masing(masing) => masing.merged_pairs,
            Self::Integral(_) => 0,
        }
    }
}

/// M, N·m.
fn largest_memory(params: &Params) -> f64 {
    let (a, memory) = (params.rated_deflection_rad(), params.memory());
    let size = match (memory.law, memory.kernel) {
        (Law::Masing, _) => return memory.e() * a / 3.0,
        (Law::Phase, Kernel::Deflection) => memory.alpha / memory.beta_per_s,
        (Law::Phase, Kernel::Rate) => 2.0 * memory.alpha,
        // θ itself reaches 1.6 A.
        (Law::Time, Kernel::Deflection) => 1.6 * memory.alpha / memory.beta_per_s,
        (Law::Time, Kernel::Rate) => 3.2 * memory.alpha,
    };
    size * a
}

/// Walks the core and the reference along a path; the samples must be exact in `S`.
fn compare<S: Float, const N: usize>(params: &Params, path: &Path, epsilon: f64, away: f64, worst: &mut Worst) {
    let a = params.rated_deflection_rad();
    let rated = params.rated_torque_nm();
    let at_tips = 3.0 * largest_memory(params) / rated * (2.0 * 2.0 * epsilon).sqrt();
    let gear = Gear::<S>::with_period(params, PERIOD_S);
    let mut state = gear.start::<N>(S::from_f64(path.theta[0]));
    let mut reference = Reference::new(params, N, path.theta[0]);
    let Memory { law, kernel, gate, .. } = params.memory();
    for (k, &theta) in path.theta.iter().enumerate().skip(1) {
        let core = gear.step(&mut state, S::from_f64(theta)).torque.to_f64();
        let expected = reference.step(theta);
        let error = (core - expected).abs() / rated;
        let what = || {
            let (law, kernel, gate) = (law.name(), kernel.name(), gate.name());
            format!("{law} {kernel} {gate}, {}, room {N}, sample {k} at {} A", path.name, theta / a)
        };
        let merged = gear.merged_pairs(&state);
        assert_eq!(merged, reference.merged_pairs(), "{}: pairs merged", what());
        if theta.abs() <= 0.999 * a {
            assert!(error <= away, "{}: error {error:e}, bound {away:e}", what());
            worst.away = worst.away.max(error);
        } else {
            let bound = at_tips + away * (expected.abs() / rated).max(1.0);
            assert!(error <= bound, "{}: error {error:e}, bound {bound:e} at the tips", what());
            worst.tips = worst.tips.max(error);
            worst.of_tip_bound = worst.of_tip_bound.max(error / bound);
        }
    }
}

/// The published gear under every law with every kernel and gate, `play` where the law has one.
fn gears(a: f64, play: f64) -> Vec<Params> {
    common::every_law()
        .into_iter()
        .map(|params| {
            let mut memory = params.memory();
            if memory.law == Law::Masing {
                memory.reversal_play_rad = play;
            }
            Params::new(a, elastic(), memory).expect("the published gear")
        })
        .collect()
}

fn walk_all<S: Float>(a: f64, epsilon: f64, away: f64, adapt: impl Fn(Path) -> Path) {
    println!("law, kernel, gate: largest error away from the tips | at them | as a share of the bound there");
    for index in 0..gears(a, 0.0).len() {
        let mut worst = Worst::default();
        for seed in SEEDS {
            for path in paths::every(seed, a).into_iter().map(&adapt) {
                let params = &gears(a, path.play)[index];
                compare::<S, 16>(params, &path, epsilon, away, &mut worst);
                compare::<S, 256>(params, &path, epsilon, away, &mut worst);
            }
        }
        let Memory { law, kernel, gate, .. } = gears(a, 0.0)[index].memory();
        let name = format!("{} {} {}", law.name(), kernel.name(), gate.name());
        println!("{name:24} {:.1e} | {:.1e} | {:.2}", worst.away, worst.tips, worst.of_tip_bound);
    }
}

#[test]
fn double_precision_follows_the_reference() {
    walk_all::<f64>(common::A, f64::EPSILON, 1e-9, |path| path);
}

#[test]
fn double_precision_follows_the_reference_on_single_precision_samples() {
    walk_all::<f64>(f64::from(common::A as f32), f64::EPSILON, 1e-9, Path::rounded);
}

#[test]
fn single_precision_follows_the_reference() {
    walk_all::<f32>(f64::from(common::A as f32), f64::from(f32::EPSILON), 2e-6, Path::rounded);
}

/// The paths are worth what they visit.
#[test]
fn the_paths_fill_both_stacks_and_empty_them() {
    for seed in SEEDS {
        for (name, capacity) in [("full stack", 16), ("overfull host stack", 256)] {
            let path = paths::every(seed, common::A).into_iter().find(|path| path.name == name).expect("a path");
            let mut masing = Masing::new(Constants::PUBLISHED, capacity, 0.0, path.theta[0]);
            let mut deepest = 0;
            let mut shallowest_after = usize::MAX;
            for &theta in &path.theta[1..] {
                masing.step(theta);
                if masing.depth() >= deepest {
                    (deepest, shallowest_after) = (masing.depth(), usize::MAX);
                }
                shallowest_after = shallowest_after.min(masing.depth());
            }
            println!("seed {seed}, {name}: {deepest} deep, {} pairs merged", masing.merged_pairs);
            assert_eq!(deepest, capacity, "{name}");
            assert!(masing.merged_pairs > 0, "{name}");
            assert!(shallowest_after <= 4, "{name}: {shallowest_after} left");
        }
    }
}
