//! The core in both precisions against the reference, on every kind of path under every law, kernel and gate.
//!
//! Bounds, as shares of the rated torque T_A = f(A), times abs(T)/T_A where the torque is beyond it:
//!
//! - Where the scalar holds A exactly, 1e-9 in `f64` and 2e-6 in `f32`, at the tips too: A ± θ is then exact there, and the gate's root with it.
//! - Where it rounds A by a share δ, that is still so away from the tips (abs(θ) ≤ 0.999 A) on paths that do not turn about at a tip. At the
//!   tips g² = 1 − θ²/A² is off by 2δ and, as abs(√a − √b) ≤ √abs(a − b), g by at most r = √(2δ), which adds
//!   - e·A·r in `masing`, where only −e·θ·g has the root;
//!   - M·r in `time` with gate `cycle`, M the largest abs(m), and nothing with gate `none`;
//!   - in `phase` M·r through the gate, and what m itself is off: each visit to a tip lasts up to 2r more or less of pseudo-phase (asin has
//!     the modulus of continuity of the root), in which m moves by at most 2ρM a radian. The sum over visits converges, as m forgets e^(−ρΔφ)
//!     over the Δφ > 3 between two of them (the paths visit either tip in turn): 4ρM·r/(1 − e^(−3ρ)) more, away from the tips too.

use crate::common;
use crate::common::elastic;
use gmhm::scalar::Float;
use gmhm::{Gate, Gear, Kernel, Law, Memory, Params};
use gmhm_host_tests::integral::{Clock, Integral};
use gmhm_host_tests::masing::Masing;
use gmhm_host_tests::paths::{self, Path};
use gmhm_host_tests::{Constants, Weighed};

const SEEDS: [u64; 3] = [1, 2, 3];

/// The sample period in s that goes with each seed, law `time`: βΔ = 0.42, 0.042 (where φ2 is a series) and 4.2.
const PERIODS_S: [f64; 3] = [1e-3, 1e-4, 1e-2];

/// The largest errors of a run, and as a share of their bounds.
#[derive(Default)]
struct Worst {
    away: f64,
    tips: f64,
    of_bound: f64,
}

/// What a run may be off, as shares of the rated torque.
#[derive(Clone, Copy)]
struct Bounds {
    away: f64,
    tips: f64,
}

impl Bounds {
    fn everywhere(bound: f64) -> Self {
        Self { away: bound, tips: bound }
    }

    /// For a rated deflection that the scalar rounds by a share δ.
    fn rounded(params: &Params, bound: f64, delta: f64) -> Self {
        let memory = params.memory();
        let (rated, rho) = (params.rated_torque_nm(), memory.rho());
        let size = largest_memory(params) / rated * (2.0 * delta).sqrt();
        let gate = if memory.gate == Gate::Cycle { size } else { 0.0 };
        let visits = match memory.law {
            Law::Phase => 4.0 * rho * size / (1.0 - (-3.0 * rho).exp()),
            Law::Masing | Law::Time => 0.0,
        };
        Self { away: bound + visits, tips: bound + gate + visits }
    }
}

/// The reference under any law.
enum Reference {
    Masing(Masing),
    Integral(Integral),
}

impl Reference {
    fn new(params: &Params, capacity: usize, period_s: f64, theta_0: f64) -> Self {
        let Memory { law, kernel, gate, alpha, reversal_play_rad, .. } = params.memory();
        let gear = Constants { a: params.rated_deflection_rad(), alpha, ..Constants::PUBLISHED };
        let clock = match law {
            Law::Masing => return Self::Masing(Masing::new(gear, capacity, reversal_play_rad, theta_0)),
            Law::Phase => Clock::Pseudo,
            Law::Time => Clock::Real(period_s),
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

/// M (in `masing` e·A, what the root multiplies), N·m.
fn largest_memory(params: &Params) -> f64 {
    let (a, memory) = (params.rated_deflection_rad(), params.memory());
    let size = match (memory.law, memory.kernel) {
        (Law::Masing, _) => return memory.e() * a,
        (Law::Phase, Kernel::Deflection) => memory.alpha / memory.beta_per_s,
        (Law::Phase, Kernel::Rate) => 2.0 * memory.alpha,
        // θ itself reaches 1.6 A.
        (Law::Time, Kernel::Deflection) => 1.6 * memory.alpha / memory.beta_per_s,
        (Law::Time, Kernel::Rate) => 3.2 * memory.alpha,
    };
    size * a
}

/// Walks the core and the reference along a path; the samples must be exact in `S`.
fn compare<S: Float, const N: usize>(params: &Params, period_s: f64, path: &Path, bounds: Bounds, worst: &mut Worst) {
    let a = params.rated_deflection_rad();
    let rated = params.rated_torque_nm();
    let gear = Gear::<S>::with_period(params, period_s).expect("a period");
    let mut state = gear.start::<N>(S::from_f64(path.theta[0]));
    let mut reference = Reference::new(params, N, period_s, path.theta[0]);
    for (k, &theta) in path.theta.iter().enumerate().skip(1) {
        let core = gear.step(&mut state, S::from_f64(theta)).torque.to_f64();
        let expected = reference.step(theta);
        let error = (core - expected).abs() / rated;
        let what = || format!("{}, {}, room {N}, sample {k} at {} A", name(params), path.name, theta / a);
        assert_eq!(gear.merged_pairs(&state), reference.merged_pairs(), "{}: pairs merged", what());
        let (bound, seen) = if theta.abs() <= 0.999 * a {
            (bounds.away, &mut worst.away)
        } else {
            (bounds.tips * (expected.abs() / rated).max(1.0), &mut worst.tips)
        };
        assert!(error <= bound, "{}: error {error:e}, bound {bound:e}", what());
        *seen = seen.max(error);
        worst.of_bound = worst.of_bound.max(error / bound);
    }
}

fn name(params: &Params) -> String {
    let Memory { law, kernel, gate, .. } = params.memory();
    format!("{} {} {}", law.name(), kernel.name(), gate.name())
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

fn walk_all<S: Float>(
    a: f64,
    kept: impl Fn(&Path) -> bool,
    adapt: impl Fn(Path) -> Path,
    bounds: impl Fn(&Params) -> Bounds,
) {
    println!("{:24} away from the tips | at them | largest share of its bound", "largest errors");
    for index in 0..gears(a, 0.0).len() {
        let mut worst = Worst::default();
        for (seed, period_s) in SEEDS.into_iter().zip(PERIODS_S) {
            for path in paths::every(seed, a).into_iter().filter(&kept).map(&adapt) {
                let params = &gears(a, path.play)[index];
                compare::<S, 16>(params, period_s, &path, bounds(params), &mut worst);
                compare::<S, 256>(params, period_s, &path, bounds(params), &mut worst);
            }
        }
        let name = name(&gears(a, 0.0)[index]);
        println!("{name:24} {:.1e} | {:.1e} | {:.2}", worst.away, worst.tips, worst.of_bound);
    }
}

/// The published rated deflection as `f32` has it.
fn rounded_a() -> f64 {
    f64::from(common::A as f32)
}

#[test]
fn double_precision_follows_the_reference() {
    walk_all::<f64>(common::A, |_| true, |path| path, |_| Bounds::everywhere(1e-9));
}

#[test]
fn double_precision_follows_the_reference_on_single_precision_samples() {
    walk_all::<f64>(rounded_a(), |_| true, Path::rounded, |_| Bounds::everywhere(1e-9));
}

#[test]
fn single_precision_follows_the_reference() {
    walk_all::<f32>(rounded_a(), |_| true, Path::rounded, |_| Bounds::everywhere(2e-6));
}

#[test]
fn a_rated_deflection_between_two_single_precision_numbers_costs_digits_at_the_tips_only() {
    // Halfway between two numbers: no rated deflection is rounded by more.
    let above = f64::from((common::A as f32).next_up());
    let a = 0.5 * (rounded_a() + above);
    let delta = (a - f64::from(a as f32)).abs() / a;
    println!("A = {a:e} rad is rounded by {delta:.1e}");
    let turns_at_tips = |path: &Path| path.name.starts_with("tips");
    walk_all::<f32>(
        a,
        |path| !turns_at_tips(path),
        Path::rounded,
        |params| Bounds { away: 2e-6, ..Bounds::rounded(params, 2e-6, delta) },
    );
    walk_all::<f32>(a, turns_at_tips, Path::rounded, |params| Bounds::rounded(params, 2e-6, delta));
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
