//! Fits are held where feed-forward has an inverse, unless the recordings say that there is none.

use crate::gears::{Path, cycle, given, published, record};
use gmhm::inverse::invertible_range;
use gmhm::{Elastic, Gate, Kernel, Law, Memory, Params};
use gmhm_tools::fit::verdict::{Assessment, Cause};
use gmhm_tools::fit::{Fit, fit};
use gmhm_tools::recording::Recording;

const A: f64 = 1.168e-3;

fn range(fit: &Fit) -> Option<f64> {
    invertible_range(&fit.model.params(A).unwrap().unwrap(), 1e-3).ok()
}

fn reasons(fit: &Fit, recording: Recording) -> Vec<Cause> {
    Assessment::of(fit, &[recording], &()).unwrap().verdict.reasons.into_iter().map(|reason| reason.cause).collect()
}

#[test]
fn noise_does_not_take_the_inverse_from_a_gear_recorded_to_half_its_range() {
    let (elastic, memory) = published();
    let path = Path { theta: cycle(0.5 * A, 300, 2.0), period_s: 1e-2 };
    let mut held = 0;
    for seed in 0..20 {
        let recording = record(A, elastic, memory, &path, 0.1, seed);
        let found = fit(std::slice::from_ref(&recording), &given(A, memory), &()).unwrap();
        assert!(range(&found).is_some_and(|r| r > 0.995), "seed {seed}: {:?}", range(&found));
        assert!((found.rms - 0.1).abs() < 0.02, "seed {seed}: {} N·m left", found.rms);
        if found.held_invertible {
            held += 1;
            assert!(reasons(&found, recording).iter().any(|cause| matches!(cause, Cause::HeldInvertible(_))));
        }
    }
    assert!((1..20).contains(&held), "{held} of 20 were held");
}

#[test]
fn a_gear_without_an_inverse_is_fitted_as_it_is_and_said() {
    let elastic = Elastic { c1_nm_per_rad: 8e3, c2_nm_per_rad3: 0.0, c3_nm_per_rad5: 0.0 };
    let memory = Memory { alpha: 6e6, beta_per_s: 10.0, omega_per_s: 226.31, ..published().1 };
    let recording = record(A, elastic, memory, &Path { theta: cycle(A, 1000, 3.0), period_s: 1e-2 }, 0.1, 1);
    let found = fit(std::slice::from_ref(&recording), &given(A, memory), &()).unwrap();
    assert!(!found.held_invertible && range(&found).is_none());
    assert!((found.rms - 0.1).abs() < 0.01, "{} N·m left", found.rms);
    assert!(reasons(&found, recording).iter().any(|cause| matches!(cause, Cause::FeedForwardRefused(_))));
}

/// α at which a law just has an inverse up to `reach` of the rated deflection.
fn at_the_bound(elastic: Elastic, memory: Memory, period_s: f64, reach: f64) -> Memory {
    let has = |alpha: f64| {
        let params = Params::candidate(A, elastic, Memory { alpha, ..memory }).unwrap();
        invertible_range(&params, period_s).is_ok_and(|range| range >= reach)
    };
    let (mut low, mut high) = (0.0, 1e12);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        *(if has(middle) { &mut low } else { &mut high }) = middle;
    }
    Memory { alpha: low, ..memory }
}

/// Recordings of gears of one law at the bound of an inverse up to `reach` of the rated deflection are held there where noise would take it away; a gear that has
/// clearly none is fitted as it is.
fn stays_at_the_bound(memory: Memory, period_s: f64, reach: f64) {
    let (elastic, _) = published();
    let path = Path { theta: cycle(0.9 * A, 400, 3.0), period_s };
    let bound = at_the_bound(elastic, memory, period_s, reach);
    let name = format!("{:?}/{:?}/{:?}", memory.law, memory.kernel, memory.gate);
    let mut held = 0;
    for seed in 0..12 {
        let recording = record(A, elastic, bound, &path, 0.1, seed);
        let found = fit(std::slice::from_ref(&recording), &given(A, bound), &()).unwrap();
        let found_reach = invertible_range(&found.model.params(A).unwrap().unwrap(), period_s);
        assert!(found_reach.is_ok_and(|r| r >= reach), "{name}, seed {seed}: {found_reach:?}");
        assert!((found.rms - 0.1).abs() < 0.02, "{name}, seed {seed}: {} N·m left", found.rms);
        if found.held_invertible {
            held += 1;
            let held = Cause::HeldInvertible(reach == 1.0);
            assert!(reasons(&found, recording).contains(&held));
        }
    }
    assert!((1..12).contains(&held), "{name}: {held} of 12 were held");
    let beyond = Memory { alpha: 1.3 * bound.alpha, ..bound };
    let found = fit(&[record(A, elastic, beyond, &path, 0.1, 1)], &given(A, beyond), &()).unwrap();
    assert!(!found.held_invertible && (found.rms - 0.1).abs() < 0.02, "{name}: {} N·m left", found.rms);
}

#[test]
fn law_phase_is_held_where_it_has_an_inverse_up_to_half_the_rated_deflection() {
    for (kernel, gate) in [(Kernel::Deflection, Gate::Cycle), (Kernel::Rate, Gate::None)] {
        let memory = Memory { law: Law::Phase, kernel, gate, beta_per_s: 1.0, omega_per_s: 1.0, ..Memory::default() };
        stays_at_the_bound(memory, 1e-2, 0.5);
    }
}

#[test]
fn law_time_is_held_where_it_has_an_inverse_at_the_period_of_the_recording() {
    let time = Memory { law: Law::Time, beta_per_s: 20.0, omega_per_s: 0.0, ..Memory::default() };
    stays_at_the_bound(Memory { kernel: Kernel::Deflection, gate: Gate::None, ..time }, 5e-2, 1.0);
    stays_at_the_bound(Memory { kernel: Kernel::Rate, gate: Gate::Cycle, ..time }, 1e-2, 0.5);
}
