//! Gears and paths that the promises share.

pub mod adapting;
pub mod blocks;
pub mod drives;
pub mod fuzz;
pub mod servos;

use gmhm::{Elastic, Gate, Gear, Kernel, Law, Memory, Params, State};
use proptest::prelude::*;

/// Rated deflection of the published gear, rad.
pub const A: f64 = 1.168e-3;

/// Turning points of a host state.
pub const N: usize = 256;

pub fn elastic() -> Elastic {
    Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 }
}

/// The published memory under any law.
pub fn memory(law: Law, kernel: Kernel, gate: Gate) -> Memory {
    // α of kernel `rate` has another unit: this one gives torques of the same size.
    let alpha = match kernel {
        Kernel::Deflection => 2.6532e6,
        Kernel::Rate => 2.6532e6 / 226.31,
    };
    Memory { law, kernel, gate, alpha, beta_per_s: 422.68, omega_per_s: 226.31, reversal_play_rad: 0.0 }
}

pub fn params(law: Law, kernel: Kernel, gate: Gate) -> Params {
    Params::new(A, elastic(), memory(law, kernel, gate)).expect("published parameters")
}

pub fn masing() -> Params {
    params(Law::Masing, Kernel::Deflection, Gate::Cycle)
}

/// Every law with every kernel and gate that it has.
pub fn every_law() -> Vec<Params> {
    let mut all = vec![masing()];
    for law in [Law::Phase, Law::Time] {
        for kernel in [Kernel::Deflection, Kernel::Rate] {
            for gate in [Gate::Cycle, Gate::None] {
                all.push(params(law, kernel, gate));
            }
        }
    }
    all
}

/// A gear with a loop of any width that its spring can carry, law `masing`.
pub fn any_masing() -> impl Strategy<Value = Params> {
    (0.0..0.4, 0.0..0.4, -0.3..0.5, -0.1..0.1).prop_map(|(e, h, c2, c3)| {
        let c1 = 2.0e4;
        let (e, h) = (e * c1, h * c1 + 1.0);
        let elastic =
            Elastic { c1_nm_per_rad: c1, c2_nm_per_rad3: c2 * c1 / (A * A), c3_nm_per_rad5: c3 * c1 / A.powi(4) };
        // ω = h and β = e make α = e² + h².
        let memory = Memory { alpha: e * e + h * h, beta_per_s: e, omega_per_s: h, ..Memory::default() };
        Params::new(A, elastic, memory).expect("a gear")
    })
}

/// Deflections within ±limit·A at which a path turns.
pub fn corners(limit: f64, count: impl Into<proptest::collection::SizeRange>) -> impl Strategy<Value = Vec<f64>> {
    proptest::collection::vec((-limit..limit).prop_map(|u| u * A), count)
}

/// The straight way from corner to corner in steps of at most `step`·A.
pub fn walk(corners: &[f64], step: f64) -> Vec<f64> {
    let mut path = vec![corners[0]];
    for pair in corners.windows(2) {
        let count = ((pair[1] - pair[0]).abs() / (step * A)).ceil().max(1.0);
        path.extend((1..=count as usize).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / count));
    }
    path
}

/// Torques along a path, its first sample included; `period_s` counts in law `time` alone.
pub fn torques(params: &Params, path: &[f64], period_s: f64) -> Vec<f64> {
    let gear = Gear::<f64>::with_period(params, period_s).expect("a period");
    let mut state: State<f64, N> = gear.start(path[0]);
    path.iter()
        .enumerate()
        .map(|(k, &theta)| if k == 0 { gear.output(&state).torque } else { gear.step(&mut state, theta).torque })
        .collect()
}

/// A state that went along a path.
pub fn after(gear: &Gear<f64>, path: &[f64]) -> State<f64, N> {
    let mut state = gear.start(path[0]);
    for &theta in &path[1..] {
        gear.step(&mut state, theta);
    }
    state
}

/// ∮ z dθ along a path by the trapezoidal rule, N·m·rad.
pub fn work(path: &[f64], torque: &[f64]) -> f64 {
    path.windows(2).zip(torque.windows(2)).map(|(x, t)| 0.5 * (t[0] + t[1]) * (x[1] - x[0])).sum()
}
