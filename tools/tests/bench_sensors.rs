//! The bench's sensors and its key: noise as ordered, the same from the same seed.

use crate::common;
use gmhm_tools::bench::{Experiment, Noise, Options, simulate};
use gmhm_tools::model::{self, Model};
use gmhm_tools::recording::Recording;

fn published() -> Model {
    model::parse("published", common::PUBLISHED).unwrap()
}

fn run(experiment: Experiment, noise: &str, seed: u64) -> Recording {
    let options = Options { noise: Some(noise.parse().unwrap()), ..Options::new() };
    simulate(&published(), experiment, &options, seed).unwrap().0
}

/// What the torque sensor added.
fn torque_noise(experiment: Experiment, noise: &str) -> Vec<f64> {
    let (noisy, quiet) = (run(experiment, noise, 5), run(experiment, "none", 5));
    noisy.torque.unwrap().iter().zip(quiet.torque.unwrap()).map(|(a, b)| a - b).collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn a_seed_fixes_everything() {
    for experiment in [Experiment::Rates, Experiment::Running, Experiment::Dynamic] {
        let make = |seed| simulate(&published(), experiment, &Options::new(), seed).unwrap();
        let (first, again, other) = (make(11), make(11), make(12));
        assert!(first == again, "{experiment}");
        assert!(first.0.torque != other.0.torque, "{experiment}");
    }
}

#[test]
fn noise_leaves_the_motion_as_it_was() {
    let (quiet, noisy) = (run(Experiment::Running, "none", 4), run(Experiment::Running, "torque=1,velocity=0.1", 4));
    assert_eq!(quiet.deflection_rad, noisy.deflection_rad);
    assert_ne!(quiet.torque, noisy.torque);
}

#[test]
fn torque_noise_has_the_rms_and_the_colour_ordered() {
    for (noise, rms_nm, a) in [("torque=0.1,ar=0.95", 0.1, 0.95), ("torque=0.2", 0.2, 0.0)] {
        let added = torque_noise(Experiment::Rates, noise);
        let n = added.len() as f64;
        let lag = added.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / added.iter().map(|x| x * x).sum::<f64>();
        // Four standard deviations of the estimates: of a, √((1 − a²)/n); of the rms, √((1 + a²)/(1 − a²)/2n).
        assert!((lag - a).abs() < 4.0 * ((1.0 - a * a) / n).sqrt(), "{noise}: a = {lag}");
        let spread = 4.0 * ((1.0 + a * a) / (1.0 - a * a) / (2.0 * n)).sqrt();
        assert!((rms(&added) / rms_nm - 1.0).abs() < spread, "{noise}: {} N·m", rms(&added));
    }
}

#[test]
fn outliers_come_at_their_rate_and_size() {
    let added = torque_noise(Experiment::Running, "outliers=0.01:5");
    let outliers: Vec<f64> = added.iter().copied().filter(|x| *x != 0.0).collect();
    assert!(outliers.iter().all(|x| (x.abs() - 5.0).abs() < 1e-9));
    let expected = 0.01 * added.len() as f64;
    assert!((outliers.len() as f64 - expected).abs() < 4.0 * expected.sqrt(), "{} of {expected}", outliers.len());
    assert!(outliers.iter().any(|x| *x > 0.0) && outliers.iter().any(|x| *x < 0.0));
}

#[test]
fn torque_is_a_multiple_of_its_step() {
    let recording = run(Experiment::Cycle, "torque=0.1,torque_step=0.05", 1);
    for torque in recording.torque.unwrap() {
        assert!((torque / 0.05 - (torque / 0.05).round()).abs() < 1e-9, "{torque}");
    }
}

#[test]
fn encoders_count_apart_and_the_deflection_follows() {
    let recording = run(Experiment::Running, "encoder_bits=20", 2);
    let truth = run(Experiment::Running, "none", 2);
    let count = std::f64::consts::TAU / f64::from(1 << 20);
    let angles = [&recording.theta_in_rad, &recording.theta_out_rad].map(|a| a.as_deref().unwrap());
    for angle in angles {
        assert!(angle.iter().all(|q| (q / count - (q / count).round()).abs() < 1e-6));
    }
    let mut errors = Vec::new();
    for (k, theta) in recording.deflection().unwrap().iter().enumerate() {
        assert!((angles[0][k] / 100.0 - angles[1][k] - theta).abs() < 1e-15);
        errors.push(theta - truth.deflection().unwrap()[k]);
    }
    // Quantisation: uniform within half a count of the output encoder, and of the hundredth of one of the input encoder.
    let largest = errors.iter().fold(0.0, |a: f64, e| a.max(e.abs()));
    assert!(largest <= 0.505 * count, "{largest}");
    assert!((rms(&errors) / (count / 12.0_f64.sqrt()) - 1.0).abs() < 0.02, "{}", rms(&errors));
}

#[test]
fn the_gear_warms_up_by_what_is_asked() {
    let options = Options { warm_up_k: 8.0, noise: Some(Noise::default()), ..Options::new() };
    let (recording, _) = simulate(&published(), Experiment::Cycle, &options, 1).unwrap();
    let temperature = recording.temperature_c.unwrap();
    assert!((temperature[temperature.len() - 1] - temperature[0] - 8.0).abs() < 1e-9);
    let middle = temperature[temperature.len() / 2] - temperature[0];
    assert!(middle > 5.0 && middle < 6.5, "{middle}: faster at first");
    assert!(temperature.windows(2).all(|w| w[1] > w[0]));
}

#[test]
fn noise_reads_back_what_it_writes() {
    for text in [
        "none",
        "torque=0.1,ar=0.95,encoder_bits=20,outliers=0.001:5.0",
        "torque_step=0.01,velocity=1e-5,temperature=0.02",
    ] {
        let noise: Noise = text.parse().unwrap();
        assert_eq!(noise.to_string().parse::<Noise>().unwrap(), noise);
    }
    assert_eq!(Noise::default().to_string(), "none");
    for (text, part) in [
        ("", "KEY=VALUE"),
        ("torque", "KEY=VALUE"),
        ("torque=x", "number"),
        ("torque=-1", "at least 0"),
        ("torque=nan", "number"),
        ("torque=inf", "number"),
        ("ar=1", "below 1"),
        ("bits=20", "no such key"),
        ("encoder_bits=20.5", "whole number"),
        ("encoder_bits=60", "8 to 40"),
        ("outliers=0.1", "RATE:SIZE"),
        ("outliers=2:1", "0 to 1"),
        ("torque=1,torque=2", "twice"),
        ("torque=1,", "KEY=VALUE"),
    ] {
        let error = text.parse::<Noise>().unwrap_err().to_string();
        assert!(error.contains(part), "{text}: {error} should say {part}");
    }
}

#[test]
fn the_key_states_what_was_simulated() {
    for seed in [0, 42, u64::MAX] {
        let (_, mut key) = simulate(&published(), Experiment::Dynamic, &Options::new(), seed).unwrap();
        key.command = "gmhm simulate \"a b.toml\" --experiment dynamic".to_owned();
        let written: toml::Table = key.to_toml().parse().unwrap();
        let field = |name: &str| &written["simulation"][name];
        assert_eq!(field("seed").as_str(), Some(seed.to_string().as_str()));
        assert_eq!(field("experiment").as_str(), Some("dynamic"));
        assert_eq!(field("command").as_str(), Some(key.command.as_str()));
        assert_eq!(field("noise").as_str().unwrap().parse(), Ok(key.noise));
        assert_eq!(model::parse("truth", &written["truth"].as_table().unwrap().to_string()).unwrap(), key.truth);
    }
}
