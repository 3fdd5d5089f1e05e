//! Joint logs without a motor-side angle: gravity, inertia and friction from angle and torque or current.

use std::f64::consts::TAU;

use crate::common::WorkDir;
use crate::common::skips::real_recording;
use gmhm_tools::fit::FitOptions;
use gmhm_tools::fit::verdict::{Assessment, Cause, Grade};
use gmhm_tools::fit::{Fit, fit};
use gmhm_tools::model::TorqueSide;
use gmhm_tools::recording::{Recording, Samples, TorqueUnit};
use gmhm_tools::regression::error::EstimateError;
use gmhm_tools::regression::note::Remedy;
use gmhm_tools::signal::recorded;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What the synthetic joint has: cos and sin of gravity A, inertia A·s²/rad, Coulomb A, viscous A·s/rad, smoothing rad/s.
const TRUTH: [(&str, f64); 6] = [
    ("gravity_load.cos_a", 3.0),
    ("gravity_load.sin_a", -1.2),
    ("inertia.inertia_kgm2", 0.4),
    ("coulomb_friction.torque_a", 0.8),
    ("viscous_friction.damping_as_per_rad", 0.5),
    ("coulomb_friction.smoothing_rad_per_s", 0.03),
];

/// Currents of a joint that moves as told, with AR(1) noise.
fn joint(seconds: f64, noise_a: f64, seed: u64, motion: impl Fn(f64) -> [f64; 3]) -> Recording {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let [cos, sin, inertia, coulomb, viscous, smoothing] = TRUTH.map(|(_, value)| value);
    let time_s: Vec<f64> = (0..(seconds * 100.0) as usize).map(|k| 0.01 * k as f64).collect();
    let moved: Vec<[f64; 3]> = time_s.iter().map(|t| motion(*t)).collect();
    let mut noise = 0.0;
    let torque = moved.iter().map(|[q, v, a]| {
        let normal: f64 = StandardNormal.sample(&mut random);
        noise = 0.7 * noise + noise_a * normal;
        cos * q.cos() + sin * q.sin() + inertia * a + coulomb * (v / smoothing).tanh() + viscous * v + 0.3 + noise
    });
    Recording {
        name: "joint".into(),
        torque: Some(torque.collect()),
        torque_unit: TorqueUnit::Ampere,
        theta_out_rad: Some(moved.iter().map(|m| m[0]).collect()),
        velocity_out_rad_per_s: Some(moved.iter().map(|m| m[1]).collect()),
        time_s: time_s.into(),
        ..Recording::default()
    }
}

/// Two sines, both ways through a large range.
fn to_and_fro(t: f64) -> [f64; 3] {
    let [(a, w), (b, u)] = [(1.1, TAU * 0.1), (0.3, TAU * 0.37)];
    let (slow, fast) = ((w * t).sin_cos(), (u * t).sin_cos());
    [a * slow.0 + b * fast.0, a * w * slow.1 + b * u * fast.1, -a * w * w * slow.0 - b * u * u * fast.0]
}

fn found(recording: &Recording) -> Fit {
    fit(std::slice::from_ref(recording), &FitOptions::default(), &()).unwrap()
}

#[test]
fn gravity_inertia_and_friction_come_back_within_their_uncertainty() {
    let recording = joint(60.0, 0.05, 1, to_and_fro);
    let fit = found(&recording);
    assert_eq!((fit.model.gear.torque_side, fit.unit), (TorqueSide::Motor, "a"));
    for (name, value) in TRUTH {
        let parameter = fit.parameter(name).unwrap_or_else(|| panic!("{name} is missing"));
        let sd = parameter.sd.unwrap();
        assert!((parameter.value - value).abs() < 4.0 * sd, "{name}: {} ± {sd}, not {value}", parameter.value);
        assert!(sd < 0.1 * value.abs(), "{name}: ± {sd}");
        assert!(!parameter.undetermined && parameter.note.is_none(), "{parameter:?}");
    }
    assert_eq!(fit.parameter("inertia.inertia_kgm2").unwrap().unit, "A·s²/rad");
    assert!((fit.offsets[0] - 0.3).abs() < 0.05, "{:?}", fit.offsets);
    let assessment = Assessment::of(&fit, &[recording], &()).unwrap();
    assert_eq!(assessment.verdict.grade, Grade::Good, "{:?}", assessment.verdict);
}

/// With white noise on an angle or a velocity.
fn blurred(channel: &mut Option<Samples>, size: f64, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for value in channel.iter_mut().flatten() {
        let normal: f64 = StandardNormal.sample(&mut random);
        *value += size * normal;
    }
}

#[test]
fn noise_of_the_angle_or_the_velocity_makes_inertia_no_smaller() {
    let clean = joint(60.0, 0.05, 5, to_and_fro);
    let mut by_angle = Recording { velocity_out_rad_per_s: None, ..clean.clone() };
    blurred(&mut by_angle.theta_out_rad, 2e-4, 6);
    let mut by_velocity = clean;
    blurred(&mut by_velocity.velocity_out_rad_per_s, 0.02, 7);
    for recording in [by_angle, by_velocity] {
        let fit = found(&recording);
        // Against the second derivative as it is, gravity and inertia come out 16 % and 60 % off.
        for (name, value) in &TRUTH[..3] {
            let parameter = fit.parameter(name).unwrap();
            let sd = parameter.sd.unwrap();
            assert!((parameter.value - value).abs() < 4.0 * sd, "{name}: {} ± {sd}, not {value}", parameter.value);
        }
        // What predicts is what was fitted.
        let assessment = Assessment::of(&fit, std::slice::from_ref(&recording), &()).unwrap();
        let predicted = recorded::predict(&fit.model, None, &recording).unwrap();
        let torque = recording.torque.as_deref().unwrap();
        let left = torque.iter().zip(&predicted.torque).map(|(torque, model)| torque - fit.offsets[0] - model);
        assert!(left.zip(&fit.residuals[0]).all(|(left, fitted)| (left - fitted).abs() < 1e-9));
        assert_eq!(assessment.predictions, [predicted]);
    }
}

/// Friction of 0.8 A over a velocity whose noise is a fifth of its smoothing: rows near standstill are left with many times the noise of the current.
#[test]
fn noise_of_the_velocity_near_standstill_is_neither_smoothing_nor_physics() {
    for seed in 1..=8 {
        let mut recording = joint(60.0, 0.01, seed, to_and_fro);
        blurred(&mut recording.velocity_out_rad_per_s, 0.006, 100 + seed);
        let fit = found(&recording);
        assert!((100..1500).contains(&fit.rows_near_standstill[0]), "{:?}", fit.rows_near_standstill);
        assert!(fit.rms < 0.025 && !fit.leaves_physics(), "{} A left", fit.rms);
        for (name, value) in TRUTH {
            let parameter = fit.parameter(name).unwrap();
            let sd = parameter.sd.unwrap();
            println!("{seed} {name}: {} ± {sd}, {value}", parameter.value);
            assert!((parameter.value - value).abs() < 4.0 * sd, "{name}: {} ± {sd}, not {value}", parameter.value);
        }
    }
}

#[test]
fn a_torque_on_the_other_side_of_the_gear_is_said() {
    let recording = Recording { torque_unit: TorqueUnit::NewtonMetre, ..joint(60.0, 0.05, 8, to_and_fro) };
    let assessed = |recording: &Recording, side: TorqueSide| {
        let options = FitOptions { torque_side: Some(side), ..FitOptions::default() };
        let fit = fit(std::slice::from_ref(recording), &options, &()).unwrap();
        let assessment = Assessment::of(&fit, std::slice::from_ref(recording), &()).unwrap();
        let of_fleet = Assessment::of_model_alone(&fit, std::slice::from_ref(recording), &()).unwrap();
        assert_eq!(of_fleet.better_side, assessment.better_side);
        (assessment.better_side.map(|better| better.torque_side), assessment.verdict.grade)
    };
    assert_eq!(assessed(&recording, TorqueSide::Motor), (None, Grade::Good));
    assert_eq!(assessed(&recording, TorqueSide::Output), (Some(TorqueSide::Motor), Grade::Bad));
    // Without friction it is held at zero on either side, and inertia on the wrong one.
    let mut smooth = recording;
    let [.., coulomb, viscous, smoothing] = TRUTH.map(|(_, value)| value);
    for (torque, v) in smooth.torque.iter_mut().flatten().zip(smooth.velocity_out_rad_per_s.iter().flatten()) {
        *torque -= coulomb * (v / smoothing).tanh() + viscous * v;
    }
    assert_eq!(assessed(&smooth, TorqueSide::Motor), (None, Grade::Caution));
    assert_eq!(assessed(&smooth, TorqueSide::Output), (Some(TorqueSide::Motor), Grade::Bad));
}

#[test]
fn one_speed_one_way_tells_neither_friction_nor_inertia() {
    let fit = found(&joint(20.0, 0.05, 2, |t| [0.05 * t, 0.05, 0.0]));
    for name in ["coulomb_friction.torque_a", "viscous_friction.damping_as_per_rad", "inertia.inertia_kgm2"] {
        let parameter = fit.parameter(name).unwrap();
        assert!(parameter.undetermined || parameter.at_bound, "{parameter:?}");
        assert!(
            parameter.at_bound || parameter.note.is_some_and(|note| note.remedy() == Some(Remedy::JointMotion)),
            "{parameter:?}"
        );
    }
    assert!(fit.heldout_rms < 1.0, "blocks held out are predicted from what is known: {}", fit.heldout_rms);
}

#[test]
fn friction_that_would_push_is_held_at_zero_and_said() {
    let mut recording = joint(60.0, 0.05, 3, to_and_fro);
    for (torque, v) in recording.torque.iter_mut().flatten().zip(recording.velocity_out_rad_per_s.iter().flatten()) {
        *torque -= 2.0 * v;
    }
    let fit = found(&recording);
    let viscous = fit.parameter("viscous_friction.damping_as_per_rad").unwrap();
    assert!(viscous.value == 0.0 && viscous.at_bound, "{viscous:?}");
    let assessment = Assessment::of(&fit, &[recording], &()).unwrap();
    assert!(
        assessment.verdict.reasons.iter().any(|r| matches!(r.cause, Cause::AtBound { .. })),
        "{:?}",
        assessment.verdict
    );
}

#[test]
fn a_joint_that_stands_still_is_refused() {
    for noise_a in [0.0, 0.05] {
        let still = joint(10.0, noise_a, 4, |_| [0.3, 0.0, 0.0]);
        let recording = still.name.clone();
        let refusal = match noise_a {
            0.0 => EstimateError::NoTorqueChange { recording },
            _ => EstimateError::NoMovement { recording },
        };
        assert_eq!(fit(&[still], &FitOptions::default(), &()).unwrap_err(), refusal);
    }
}

#[test]
fn two_joints_of_a_robot_are_fitted_and_predicted() {
    for (file, left) in [("ur10e_joint1_sine.csv", 0.16), ("ur10e_joint2_sine.csv", 0.08)] {
        let Some(recording) = real_recording(file) else { return };
        let dir = WorkDir::new();
        let path = recording.display();
        dir.succeed(&format!("fit {path} -o joint.toml --json fit.json --report fit.html"));
        dir.succeed(&format!("predict joint.toml {path} -o out.csv"));
        let columns = csv_columns(&dir.read("out.csv"), &["current_a", "torque_model_a"]);
        let residual: Vec<f64> = columns[0].iter().zip(&columns[1]).map(|(i, model)| i - model).collect();
        let share = deviation(&residual) / deviation(&columns[0]);
        println!("{file}: {share:.3} of the current's deviation left");
        assert!(share < left, "{file}: {share}");
    }
}

#[test]
fn a_wrist_at_constant_speed_says_what_it_cannot_tell() {
    let Some(recording) = real_recording("kinova_gen3_joint7_0.30radps.csv") else { return };
    let dir = WorkDir::new();
    let told = dir.succeed(&format!("fit {} -o joint.toml", recording.display()));
    for expected in ["Not good enough to flash", "coulomb_friction.torque_nm: undetermined", "both ways"] {
        assert!(told.stdout.contains(expected), "{}", told.stdout);
    }
}

fn csv_columns<const N: usize>(text: &str, names: &[&str; N]) -> [Vec<f64>; N] {
    let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    names.map(|name| {
        let at = head.iter().position(|column| *column == name).unwrap();
        text.lines().skip(1).map(|line| line.split(',').nth(at).unwrap().parse().unwrap()).collect()
    })
}

fn deviation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn a_joint_with_two_angles_is_fitted_at_the_ratio_that_they_show() {
    let dir = WorkDir::new();
    let recording = joint(40.0, 0.01, 8, to_and_fro);
    let angle = recording.theta_out_rad.as_deref().unwrap();
    let rows = recording.time_s.iter().zip(angle).zip(recording.torque.as_deref().unwrap());
    let rows = rows.map(|((t, q), torque)| format!("{t},{},{q},{torque}\n", 32.0 * q));
    dir.write("joint.csv", format!("time_s,theta_in_rad,theta_out_rad,torque_nm\n{}", rows.collect::<String>()));
    let inertia = "[[term]]\nkind = \"inertia\"\ninertia_kgm2 = 0.1\n";
    dir.write("base.toml", format!("format = 1\nname = \"joint\"\n[gear]\ntorque_side = \"motor\"\n{inertia}"));
    dir.succeed("fit joint.csv --model base.toml -o fitted.toml");
    assert!(dir.read("fitted.toml").contains("\nratio = 32.0 "), "{}", dir.read("fitted.toml"));
}
