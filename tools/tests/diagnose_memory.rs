//! Gears whose memory is of another nature than the base model's: many sliders, after which nothing remembers beyond two fifths of the rated deflection.

use std::f64::consts::TAU;

use gmhm_tools::diagnose::suggestion::Suggestion;
use gmhm_tools::diagnose::{Finding, Options, diagnose};
use gmhm_tools::model::{Model, parse};
use gmhm_tools::physics::predict;
use gmhm_tools::recording::Recording;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const RATED_RAD: f64 = 1.3e-3;
const SLIDERS: usize = 24;
const NOISE_NM: f64 = 0.03;
const ROWS: usize = 4000;

/// The torque of springs, N·m, and of sliders that slip at radii from a hundredth to two fifths of the rated deflection, from rest along `history` and `path`, for the rows of `path`.
fn torque(history: &[f64], path: &[f64]) -> Vec<f64> {
    let radius = |k: usize| 0.4 * RATED_RAD * 0.01_f64.powf(1.0 - (k as f64 + 0.8) / SLIDERS as f64);
    let radii: Vec<f64> = (0..SLIDERS).map(radius).collect();
    let weights: Vec<f64> =
        radii.iter().enumerate().map(|(k, r)| r * (0.3 + 0.7 * (7 * k % SLIDERS) as f64 / SLIDERS as f64)).collect();
    let sum: f64 = weights.iter().sum();
    let (mut strains, mut last) = ([0.0_f64; SLIDERS], 0.0);
    let mut step = |x: &f64| {
        for (strain, r) in strains.iter_mut().zip(&radii) {
            *strain = (*strain + x - last).clamp(-r, *r);
        }
        last = *x;
        let memory: f64 = strains.iter().zip(&radii).zip(&weights).map(|((s, r), w)| 6.0 * w / sum * s / r).sum();
        15_000.0 * x + 1e9 * x.powi(3) + memory
    };
    history.iter().for_each(|x| {
        step(x);
    });
    path.iter().map(step).collect()
}

/// Five sines from rest that reach half the rated deflection, and once, after 26 of 30 s, `dip` of it.
fn recording(phase: f64, dip: f64, history: &[f64], noise_nm: f64) -> Recording {
    let time_s: Vec<f64> = (0..ROWS).map(|row| 0.0075 * row as f64).collect();
    let sines = |t: &f64| {
        let sine = |(k, hz): (usize, f64)| (TAU * hz * t + phase * ((k + 1) * (k + 1)) as f64).sin();
        [0.23, 0.41, 0.67, 1.1, 1.9].into_iter().enumerate().map(sine).sum::<f64>()
    };
    let largest = time_s.iter().map(|t| sines(t).abs()).fold(0.0, f64::max);
    let deflection = |t: &f64| {
        let rise = 1.0 - (-3.0 * t).exp();
        RATED_RAD * (0.5 * rise * sines(t) / largest - dip * (-((t - 26.0) / 0.7).powi(2)).exp())
    };
    let path: Vec<f64> = time_s.iter().map(deflection).collect();
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
    let measured: Vec<f64> = torque(history, &path).into_iter().map(|t| t + noise_nm * noise()).collect();
    Recording {
        name: "sliders".into(),
        time_s: time_s.into(),
        deflection_rad: Some(path.into()),
        torque: Some(measured.into()),
        ..Recording::default()
    }
}

fn base(law: &str) -> Model {
    let text = format!(
        "format = 1\n[gear]\ntorque_side = \"output\"\nrated_deflection_rad = {RATED_RAD}\n[elastic]\nc1_nm_per_rad = 16000\nc2_nm_per_rad3 = 1e9\nc3_nm_per_rad5 = 0\n\
         [memory]\nlaw = \"{law}\"\nkernel = \"deflection\"\nalpha = 200000.0\nbeta_per_s = 0.0\nomega_per_s = 200.0\n"
    );
    parse("gear.toml", &text).unwrap()
}

fn found(recording: Recording, law: &str) -> Finding {
    diagnose(&[recording], &base(law), &[], &Options::default(), &()).unwrap()
}

fn names(finding: &Finding) -> Vec<&str> {
    finding.diagnosis.effects.iter().map(|e| e.name.as_str()).collect()
}

/// The error of the extended model on another motion without noise, N·m (standard deviation).
fn left(finding: &Finding) -> f64 {
    let other = recording(16.0, -0.8, &[], 0.0);
    let predicted = predict(&finding.model, None, &other).unwrap().torque;
    let rest: Vec<f64> = other.torque.iter().flatten().zip(&predicted).map(|(t, p)| t - p).collect();
    let mean = rest.iter().sum::<f64>() / ROWS as f64;
    (rest.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / ROWS as f64).sqrt()
}

#[test]
fn sliders_are_followed_on_another_motion_to_less_than_the_noise() {
    for phase in [6.0, 8.0] {
        let finding = found(recording(phase, 0.9, &[], NOISE_NM), "masing");
        assert_eq!(names(&finding), ["nonlocal_memory"]);
        assert!(left(&finding) < 1.2 * NOISE_NM, "phase {phase}: {} N·m", left(&finding));
    }
}

#[test]
fn what_was_remembered_before_the_first_row_is_no_property_of_the_gear() {
    let history: Vec<f64> = (0..400).map(|k| 0.9 * RATED_RAD * (TAU * k as f64 / 800.0).sin()).collect();
    let finding = found(recording(8.0, 0.9, &history, NOISE_NM), "masing");
    assert_eq!(names(&finding), ["nonlocal_memory"]);
    assert!(left(&finding) < NOISE_NM, "{} N·m", left(&finding));
}

#[test]
fn beside_law_phase_sliders_are_searched_for_with_law_masing() {
    let finding = found(recording(8.0, 0.9, &[], NOISE_NM), "phase");
    assert_eq!(names(&finding), ["nonlocal_memory"]);
    assert!(finding.diagnosis.suggestions.iter().any(|s| matches!(s, Suggestion::Law(_))));
    assert!(left(&finding) < NOISE_NM, "{} N·m", left(&finding));
}
