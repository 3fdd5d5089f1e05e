//! Recordings of one gear whose encoders count from different zeros.

use crate::gears;
use crate::gears::{
    Path, band_limited, cycle, deflections, foreign, given, off_over_reported, published, record,
    scatter_over_reported, walk, with_rate,
};
use gmhm::{Law, Memory};
use gmhm_tools::fit::FitOptions;
use gmhm_tools::fit::{Fit, fit};
use gmhm_tools::model::{GearSection, Model};
use gmhm_tools::recording::Recording;
use rayon::prelude::*;

const A: f64 = 1.168e-3;

fn with_zero(mut recording: Recording, zero_rad: f64) -> Recording {
    recording.deflection_rad.iter_mut().flatten().for_each(|theta| *theta += zero_rad);
    recording
}

/// Two amplitudes and a walk, each with its zero.
fn recordings(memory: Memory, zeros_rad: [f64; 3], seed: u64) -> Vec<Recording> {
    let paths = [cycle(0.6 * A, 800, 2.0), cycle(A, 800, 2.0), walk(A, 1200, 7)];
    let of = |(k, (theta, zero)): (u64, (Vec<f64>, f64))| {
        with_zero(record(A, published().0, memory, &Path { theta, period_s: 1e-2 }, 0.1, 3 * seed + k), zero)
    };
    (0..).zip(paths.into_iter().zip(zeros_rad)).map(of).collect()
}

fn zeros(found: &Fit) -> Vec<f64> {
    found.deflection_zeros.iter().map(|zero| zero.rad).collect()
}

#[test]
fn each_recording_gets_the_zero_that_it_has() {
    let phase = Memory { law: Law::Phase, ..published().1 };
    for memory in [published().1, phase, with_rate()] {
        for apart in [[0.0, 0.05 * A, -0.02 * A], [0.3 * A, 0.0, -0.5 * A], [0.0, 3.0 * A, 0.1], [-2.0, 5.0, 0.01 * A]]
        {
            let recordings = recordings(memory, apart, 1);
            let found = fit(&recordings, &given(A, memory), &()).unwrap();
            let wrong = zeros(&found).iter().zip(apart).map(|(found, zero)| (found - zero).abs()).fold(0.0, f64::max);
            assert!(
                found.zeros_apart_rad().is_some() && wrong < 0.005 * A,
                "{:?}: {apart:?} -> {:?}",
                memory.law,
                zeros(&found)
            );
            assert!((found.rms - 0.1).abs() < 0.005, "{:?} {apart:?}: {}", memory.law, found.rms);
            let stored = found.model.gear.deflection_zero_rad;
            assert!(stored == found.deflection_zeros[0].rad);

            let mut aligned = recordings.clone();
            found.align(&mut aligned).unwrap();
            let again = fit(&aligned, &given(A, memory), &()).unwrap();
            assert!(
                again.zeros_apart_rad().is_none() || zeros(&again).iter().all(|zero| (zero - stored).abs() < 0.005 * A)
            );
        }
    }
}

#[test]
fn a_rated_deflection_that_is_the_largest_seen_is_so_beside_the_zeros() {
    let (_, memory) = published();
    let options = FitOptions { rated_deflection_rad: None, ..given(A, memory) };
    let options =
        FitOptions { start: options.start.map(|model| Model { gear: GearSection::default(), ..model }), ..options };
    let loops = |zeros: &[f64]| -> Vec<Recording> {
        let of = |(k, zero): (u64, &f64)| {
            let path = Path { theta: cycle(A, 2000, 2.25), period_s: 1e-2 };
            with_zero(record(A, published().0, memory, &path, 0.02, k), *zero)
        };
        (0..).zip(zeros).map(of).collect()
    };
    for apart in [&[0.0, 0.003 * A][..], &[0.0, 0.5 * A], &[0.4 * A, -0.2 * A, 0.0], &[0.003 * A], &[0.1 * A], &[7.0]] {
        let found = fit(&loops(apart), &options, &()).unwrap();
        let rated = found.model.gear.rated_deflection_rad.unwrap();
        assert!((rated / A - 1.0).abs() < 2e-5, "{apart:?}: {rated:e}");
        let e = found.parameter("e").unwrap();
        assert!((e.value - memory.e()).abs() < 4.0 * e.sd.unwrap(), "{apart:?}: {e:?}");
    }
}

#[test]
fn the_parameters_are_as_good_as_their_standard_deviations() {
    let (elastic, memory) = published();
    let refit = |seed: u64| {
        let apart = [0.414, 0.618, 0.755].map(|g| A * ((g * seed as f64).fract() - 0.5));
        let noisy = recordings(memory, apart, seed);
        fit(&noisy, &given(A, memory), &()).unwrap()
    };
    let fits: Vec<Fit> = (1..=300).into_par_iter().map(refit).collect();
    for (name, truth) in [("c1_nm_per_rad", elastic.c1_nm_per_rad), ("e", memory.e()), ("h", memory.h())] {
        let (ratio, off) = (scatter_over_reported(&fits, name), off_over_reported(&fits, name, truth));
        assert!((0.85..1.15).contains(&ratio) && off.abs() < 0.3, "{name}: {ratio} {off}");
    }
}

#[test]
fn recordings_of_one_zero_keep_it() {
    let (_, memory) = published();
    for zero in [0.0, 0.1 * A, 0.7 * A, -3.0 * A] {
        let found = fit(&recordings(memory, [zero; 3], 2), &given(A, memory), &()).unwrap();
        assert!(found.zeros_apart_rad().is_none(), "{:?}", zeros(&found));
        assert!((found.model.gear.deflection_zero_rad - zero).abs() < 1e-3 * A, "{zero}: {:?}", zeros(&found));
    }
    // Loads to one side, and to the other.
    let one_sided = |sign: f64, seed: u64| {
        let theta: Vec<f64> = cycle(A, 600, 1.5).iter().map(|x| sign * x.abs()).collect();
        record(A, published().0, memory, &Path { theta, period_s: 1e-2 }, 0.1, seed)
    };
    let found = fit(&[one_sided(1.0, 1), one_sided(-1.0, 2)], &given(A, memory), &()).unwrap();
    assert!(found.zeros_apart_rad().is_none(), "{:?}", zeros(&found));
    // Another nature than the model's at several amplitudes, and coloured noise.
    let options = FitOptions { rated_deflection_rad: Some(A), ..FitOptions::default() };
    let found = fit(&[foreign(A, 0.4, 1), foreign(A, 0.7, 2), foreign(A, 1.0, 3)], &options, &()).unwrap();
    assert!(found.zeros_apart_rad().is_none(), "{:?}", zeros(&found));
    let slow = |seed: u64| {
        let path = Path { theta: band_limited(A, 1500, seed), period_s: 1e-2 };
        gears::with_coloured_noise(&record(A, published().0, memory, &path, 0.0, seed), 0.95, 0.1, seed)
    };
    for seed in 0..20 {
        let found = fit(&[slow(2 * seed), slow(2 * seed + 1)], &given(A, memory), &()).unwrap();
        assert!(found.zeros_apart_rad().is_none(), "{seed}: {:?}", zeros(&found));
    }
}

#[test]
fn a_single_recording_has_a_zero_of_its_own_where_asked_for() {
    let (elastic, memory) = published();
    let path = Path { theta: cycle(A, 2000, 2.25), period_s: 1e-2 };
    let recording = with_zero(record(A, elastic, memory, &path, 0.1, 5), 2e-4 * A);
    let options = given(A, memory);
    let found = fit(std::slice::from_ref(&recording), &options, &()).unwrap();
    assert_eq!((zeros(&found), found.deflection_zeros[0].sd_rad), (vec![0.0], None));
    let options = FitOptions { own_zeros: true, ..options };
    let found = fit(std::slice::from_ref(&recording), &options, &()).unwrap();
    let zero = &found.deflection_zeros[0];
    let sd = zero.sd_rad.unwrap();
    assert!((zero.rad - 2e-4 * A).abs() < 4.0 * sd && sd < 5e-4 * A, "{zero:?}");
}

#[test]
fn recordings_that_no_zero_makes_go_together_are_refused() {
    let (elastic, memory) = published();
    let theta = cycle(A, 800, 2.0);
    let torque = deflections(A, elastic, memory, &theta, 1e-2).iter().map(|t| -t).collect();
    let one = record(A, elastic, memory, &Path { theta, period_s: 1e-2 }, 0.1, 1);
    let other = Recording { name: "other".to_owned(), torque: Some(torque), ..with_zero(one.clone(), 1.0) };
    let refused = fit(&[one, other], &given(A, memory), &()).unwrap_err();
    assert!(refused.to_string().contains("other"), "{refused}");
}
