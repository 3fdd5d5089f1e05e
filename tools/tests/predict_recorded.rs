//! A prediction for a motion recorded with noise, and what a diagnosis says of the same rows.

use std::f64::consts::PI;

use gmhm_tools::diagnose::{Options, diagnose};
use gmhm_tools::model::{Model, parse};
use gmhm_tools::physics::{Prediction, predict};
use gmhm_tools::recording::Recording;
use gmhm_tools::signal::recorded;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const JOINT: &str = r#"format = 1
[gear]
ratio = 100.0
torque_side = "motor"
[[term]]
kind = "gravity_load"
cos_nm = 7.0
sin_nm = 34.0
[[term]]
kind = "inertia"
inertia_kgm2 = 5.0
[[term]]
kind = "viscous_friction"
damping_nms_per_rad = 5.0
"#;

fn joint() -> Model {
    parse("joint.toml", JOINT).unwrap()
}

/// A joint that swings; velocity and torque with so much noise.
fn swinging(phase: f64, velocity_noise: f64, torque_noise: f64) -> Recording {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1 + phase.to_bits());
    let mut noise = |size: f64| -> f64 { size * Distribution::<f64>::sample(&StandardNormal, &mut random) };
    let waves = [(0.5, 0.13), (0.3, 0.27), (0.1, 0.7)].map(|(size, hertz)| (size, 2.0 * PI * hertz));
    let sum = |t: f64, order: i32, shift: f64| -> f64 {
        waves.iter().map(|(size, w)| size * w.powi(order) * (w * t + phase * w + shift).sin()).sum()
    };
    let time_s: Vec<f64> = (0..4000).map(|k| 0.005 * f64::from(k)).collect();
    let angle: Vec<f64> = time_s.iter().map(|t| sum(*t, 0, 0.0)).collect();
    let velocity: Vec<f64> = time_s.iter().map(|t| sum(*t, 1, 0.5 * PI)).collect();
    let torque = |(t, (q, v)): (&f64, (&f64, &f64))| {
        6.0 * sum(*t, 2, PI) + 8.0 * q.cos() + 40.0 * q.sin() + 6.0 * v + noise(torque_noise)
    };
    let torque = time_s.iter().zip(angle.iter().zip(&velocity)).map(torque).collect();
    Recording {
        name: "swinging.csv".into(),
        torque: Some(torque),
        velocity_out_rad_per_s: Some(velocity.iter().map(|v| v + noise(velocity_noise)).collect()),
        theta_out_rad: Some(angle.into()),
        time_s: time_s.into(),
        ..Recording::default()
    }
}

fn rms(recording: &Recording, prediction: &Prediction) -> f64 {
    let torque = recording.torque.as_deref().unwrap();
    let left: Vec<f64> = torque.iter().zip(&prediction.torque).map(|(t, p)| t - p).collect();
    let mean = left.iter().sum::<f64>() / left.len() as f64;
    (left.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / left.len() as f64).sqrt()
}

#[test]
fn a_prediction_leaves_what_the_diagnosis_says() {
    let (seen, unseen) = (swinging(0.0, 1e-3, 0.3), swinging(3.0, 1e-3, 0.0));
    let found = diagnose(&[seen], &joint(), std::slice::from_ref(&unseen), &Options::default(), &()).unwrap();
    let said = found.diagnosis.heldout.rms.extended;
    let left = rms(&unseen, &recorded::predict(&found.model, None, &unseen).unwrap());
    let raw = rms(&unseen, &predict(&found.model, None, &unseen).unwrap());
    assert!(
        left < 1.3 * said + 0.01 && raw > 5.0 * left,
        "said {said}, predicted {left}, by the velocity as recorded {raw}"
    );
}

#[test]
fn a_motion_without_noise_is_predicted_as_it_is() {
    let clean = swinging(0.0, 0.0, 0.3);
    let angle_only = Recording { velocity_out_rad_per_s: None, ..clean.clone() };
    // A trapezoidal profile has corners.
    let mut corners = clean.clone();
    corners.velocity_out_rad_per_s =
        Some(clean.time_s.iter().map(|t| ((t % 4.0) - 2.0).abs().clamp(0.5, 1.5)).collect());
    for recording in [clean, angle_only, corners] {
        let plain = predict(&joint(), None, &recording).unwrap();
        assert!(recorded::predict(&joint(), None, &recording).unwrap() == plain);
    }
}

#[test]
fn friction_along_a_counted_angle_is_that_of_the_motion() {
    let joint = parse(
        "joint.toml",
        &format!("{JOINT}[[term]]\nkind = \"coulomb_friction\"\ntorque_nm = 8.0\nsmoothing_rad_per_s = 0.002\n"),
    )
    .unwrap();
    // 14 bits: at 0.02 rad/s one row of four has a count.
    let count = 2.0 * PI / 16384.0;
    let smooth = Recording { velocity_out_rad_per_s: None, ..swinging(0.0, 0.0, 0.0) };
    let counted = |x: &f64| (x / count).round() * count;
    let angle = smooth.theta_out_rad.as_deref().map(|q| q.iter().map(counted).collect());
    let counted = Recording { theta_out_rad: angle, ..smooth.clone() };
    let torque = recorded::predict(&joint, None, &smooth).unwrap().torque;
    let truth = Recording { torque: Some(torque.into()), ..smooth };
    let left = rms(&truth, &recorded::predict(&joint, None, &counted).unwrap());
    assert!(left < 0.7, "{left} N·m");
    // By differences of the counts it is no friction at all in most rows about a reversal, and no inertia in any.
    let left = rms(&truth, &predict(&joint, None, &counted).unwrap());
    assert!(left > 3.0, "{left} N·m");
}
