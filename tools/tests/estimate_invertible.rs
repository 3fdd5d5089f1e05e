//! Fits are held where feed-forward has an inverse, unless the recordings say that there is none.

mod gears;

use gears::{Path, cycle, given, published, record};
use gmhm::inverse::invertible_range;
use gmhm::{Elastic, Memory};
use gmhm_tools::estimate::judge::Assessment;
use gmhm_tools::estimate::{Fit, fit};
use gmhm_tools::recording::Recording;

const A: f64 = 1.168e-3;

fn range(fit: &Fit) -> Option<f64> {
    invertible_range(&fit.model.params(A).unwrap().unwrap(), 1e-3).ok()
}

fn reasons(fit: &Fit, recording: Recording) -> String {
    Assessment::of(fit, &[recording], &()).unwrap().verdict.reasons.into_iter().map(|r| r.words + "\n").collect()
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
            assert!(reasons(&found, recording).contains("held at the bound"));
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
    assert!(reasons(&found, recording).contains("has no inverse"));
}
