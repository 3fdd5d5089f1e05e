//! `fit` with a model that has terms.

use crate::common::{PUBLISHED, WorkDir};
use gmhm_tools::bench::{Experiment, Noise, Options, simulate};
use gmhm_tools::fit::verdict::Assessment;
use gmhm_tools::fit::{Fit, FitOptions, fit};
use gmhm_tools::model::{Model, TermValue, parse};
use gmhm_tools::recording::Recording;
use gmhm_tools::signal::recorded;

const TERMS: &str = r#"[[term]]
kind = "kinematic_error"
orders = [2.0, 4.0]
cos_rad = [5.8e-6, 1.1e-6]
sin_rad = [0.0, -4.0e-6]
[[term]]
kind = "coulomb_friction"
torque_nm = 0.4
smoothing_rad_per_s = 0.02
"#;

/// The published gear with these terms.
fn gear() -> String {
    format!("{PUBLISHED}{TERMS}")
}

/// The same structure with every number off.
fn start() -> String {
    gear()
        .replace("2.4737e4", "2.6e4")
        .replace("2.6532e6", "2.2e6")
        .replace("[5.8e-6, 1.1e-6]", "[3.0e-6, 0.0]")
        .replace("[0.0, -4.0e-6]", "[1.0e-6, 0.0]")
        .replace("torque_nm = 0.4", "torque_nm = 0.1")
}

fn recording(seed: u64) -> Recording {
    let model = parse("gear.toml", &gear()).unwrap();
    let noise = "torque=0.05,ar=0.5".parse::<Noise>().unwrap();
    let options = Options { noise: Some(noise), duration_s: Some(40.0), sample_rate_hz: Some(200.0), ..Options::new() };
    simulate(&model, Experiment::Running, &options, seed).unwrap().0
}

fn refitted(recordings: &[Recording]) -> Fit {
    let start: Model = parse("start.toml", &start()).unwrap();
    fit(recordings, &FitOptions { start: Some(start), ..FitOptions::default() }, &()).unwrap()
}

#[test]
fn gear_and_terms_are_refitted_together_with_standard_deviations() {
    let recordings = [recording(1)];
    let found = refitted(&recordings);
    let truths = [
        ("c1_nm_per_rad", 2.4737e4),
        ("kinematic_error.cos_rad[0]", 5.8e-6),
        ("kinematic_error.cos_rad[1]", 1.1e-6),
        ("kinematic_error.sin_rad[0]", 0.0),
        ("kinematic_error.sin_rad[1]", -4.0e-6),
        ("coulomb_friction.torque_nm", 0.4),
    ];
    for (name, truth) in truths {
        let parameter = found.parameter(name).unwrap_or_else(|| panic!("{name} is missing"));
        let sd = parameter.sd.unwrap_or_else(|| panic!("{name} has no standard deviation"));
        assert!((parameter.value - truth).abs() < 4.0 * sd, "{name}: {} ± {sd}, in truth {truth}", parameter.value);
    }
    assert_eq!(found.model.terms.len(), 2);
    assert!(found.rms < 0.08, "{}", found.rms);
    let count = found.uncertainty.correlated.len();
    assert!(count >= truths.len() && found.uncertainty.correlation.iter().all(|row| row.len() == count));
    let assessment = Assessment::of(&found, &recordings, &()).unwrap();
    assert_eq!(assessment.residuals[0].len(), recordings[0].len());
}

/// A joint with a curve over the velocity and one over the angle: a constant of either is that of the recording.
#[test]
fn curves_are_refitted_with_standard_deviations_but_for_a_constant() {
    let curve = |coordinate: &str, knots: &str, values: &str| {
        format!("[[term]]\nkind = \"unknown\"\ncoordinate = \"{coordinate}\"\nknots = {knots}\nvalues_nm = {values}\n")
    };
    let joint = |over_velocity: &str, over_angle: &str| {
        let curves = [
            curve("output_velocity", "[-0.4, 0.0, 0.4]", over_velocity),
            curve("output_angle", "[-0.6, 0.2, 0.6]", over_angle),
        ];
        parse("joint.toml", &format!("format = 1\n[gear]\ntorque_side = \"motor\"\n{}", curves.concat())).unwrap()
    };
    let time_s: Vec<f64> = (0..4000).map(|row| 0.01 * f64::from(row)).collect();
    let angle = |t: f64| 0.5 * (0.6 * t).sin() + 0.1 * (1.7 * t).sin();
    let mut recording = Recording {
        name: "joint".into(),
        torque: Some(vec![0.0; time_s.len()].into()),
        theta_out_rad: Some(time_s.iter().map(|t| angle(*t)).collect()),
        velocity_out_rad_per_s: Some(time_s.iter().map(|t| 0.3 * (0.6 * t).cos() + 0.17 * (1.7 * t).cos()).collect()),
        time_s: time_s.into(),
        ..Recording::default()
    };
    let truth = joint("[1.0, 0.0, 2.0]", "[0.5, 0.0, -0.7]");
    let torque = recorded::predict(&truth, None, &recording).unwrap().torque;
    let noise = |row: usize| 0.05 * ((row * row * 7919) % 1009) as f64 / 1009.0;
    recording.torque = Some(torque.iter().enumerate().map(|(row, torque)| torque + 3.0 + noise(row)).collect());
    let start = joint("[0.0, 0.0, 2.0]", "[0.0, 0.0, -0.7]");
    let found = fit(&[recording], &FitOptions { start: Some(start), ..FitOptions::default() }, &()).unwrap();
    for (name, truth) in [
        ("unknown.values_nm[0]", 1.0),
        ("unknown.values_nm[1]", 0.0),
        ("unknown_2.values_nm[0]", 0.5),
        ("unknown_2.values_nm[1]", 0.0),
    ] {
        let parameter = found.parameter(name).unwrap();
        let sd = parameter.sd.unwrap_or_else(|| panic!("{name} has no standard deviation"));
        assert!((parameter.value - truth).abs() < 4.0 * sd && sd < 0.02, "{name}: {} ± {sd}", parameter.value);
    }
    assert!(found.parameter("unknown.values_nm[2]").is_none() && (found.offsets[0] - 3.025).abs() < 0.01);
}

#[test]
fn the_command_writes_the_refitted_model() {
    let dir = WorkDir::new();
    dir.write("gear.toml", gear());
    dir.write("start.toml", start());
    dir.succeed(
        "simulate gear.toml --experiment running --duration 40 --sample-rate 200 --noise torque=0.05 --seed 3 -o r.csv",
    );
    dir.succeed("fit r.csv --model start.toml -o fitted.toml --json fit.json --report fit.html");
    let fitted = parse("fitted.toml", &dir.read("fitted.toml")).unwrap();
    assert_eq!(
        fitted.terms.iter().map(|term| term.kind.as_str()).collect::<Vec<_>>(),
        ["kinematic_error", "coulomb_friction"]
    );
    let json: serde_json::Value = serde_json::from_str(&dir.read("fit.json")).unwrap();
    let parameters = json["parameters"].as_array().unwrap();
    let friction = parameters.iter().find(|p| p["name"] == "coulomb_friction.torque_nm").unwrap();
    assert!((friction["value"].as_f64().unwrap() - 0.4).abs() < 0.1, "{friction}");
    assert!(friction["sd"].is_number());
}

#[test]
fn a_model_of_the_difference_to_a_simulation_is_refitted_beside_it() {
    let time_s: Vec<f64> = (0..4000).map(|row| 0.005 * f64::from(row)).collect();
    let velocity = |t: f64| 0.5 * t.cos() + 0.3 * (2.3 * t).cos();
    let simulated = |t: f64| 8.0 * (0.7 * t).sin();
    let noise = |t: f64| 0.02 * (t * 1298.98).sin() * (t * t * 782.33).cos();
    let friction = |t: f64| 2.0 * (velocity(t) / 0.02).tanh() + 3.0 * velocity(t);
    let recording = Recording {
        name: "joint".into(),
        torque: Some(time_s.iter().map(|t| simulated(*t) + friction(*t) + noise(*t)).collect()),
        torque_sim_nm: Some(time_s.iter().map(|t| simulated(*t)).collect()),
        theta_out_rad: Some(time_s.iter().map(|t| 0.5 * t.sin() + 0.3 / 2.3 * (2.3 * t).sin()).collect()),
        velocity_out_rad_per_s: Some(time_s.iter().map(|t| velocity(*t)).collect()),
        time_s: time_s.into(),
        ..Recording::default()
    };
    let text = "format = 1\n[gear]\ntorque_side = \"motor\"\nbase = \"simulation\"\n\
                [[term]]\nkind = \"coulomb_friction\"\ntorque_nm = 1.0\nsmoothing_rad_per_s = 0.01\n\
                [[term]]\nkind = \"viscous_friction\"\ndamping_nms_per_rad = 1.0\n";
    let start = parse("start.toml", text).unwrap();
    let found = fit(&[recording], &FitOptions { start: Some(start), ..FitOptions::default() }, &()).unwrap();
    for (kind, key, truth) in [("coulomb_friction", "torque_nm", 2.0), ("viscous_friction", "damping_nms_per_rad", 3.0)]
    {
        let value = found.model.terms.iter().find(|t| t.kind == kind).and_then(|t| t.values.get(key));
        assert!(matches!(value, Some(TermValue::Number(x)) if (x - truth).abs() < 0.02), "{kind}: {value:?}");
    }
    assert!(found.rms < 0.02, "{}", found.rms);
}
