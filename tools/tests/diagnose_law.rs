//! A gear whose hysteresis is of another nature than the law of the model given. Synthetic recordings.

use gmhm::Law;
use gmhm_tools::diagnose::suggestion::Suggestion;
use gmhm_tools::diagnose::{Options, diagnose};
use gmhm_tools::model::parse;
use gmhm_tools::recording::Recording;

/// As `gmhm fit` finds it for such gears: no law predicts better, and none has a worse inverse.
const PHASE: &str = r#"format = 1
[gear]
ratio = 100.0
torque_side = "output"
rated_deflection_rad = 1.168e-3
[elastic]
c1_nm_per_rad = 2.2e4
c2_nm_per_rad3 = -4.0e8
c3_nm_per_rad5 = 1.2e14
[memory]
law = "phase"
kernel = "deflection"
gate = "none"
alpha = 1.7e5
beta_per_s = 10.0
omega_per_s = 1.0
"#;

const RATED_RAD: f64 = 1.168e-3;

/// Sliders in parallel, their radii a factor of 1.3 apart, and a spring, along a deflection.
fn torque_of_sliders(deflection: &[f64]) -> Vec<f64> {
    let radii: Vec<f64> = (0..16).map(|k| 3e-5 * 1.3_f64.powi(k)).collect();
    let mut stretched = vec![0.0_f64; radii.len()];
    let mut last = 0.0;
    let at = |theta: &f64| {
        let step = theta - last;
        last = *theta;
        let sliders = stretched.iter_mut().zip(&radii).map(|(y, r)| {
            *y = (*y + step).clamp(-r, *r);
            0.25 * *y / r
        });
        1.1e4 * theta + 3e8 * theta.powi(3) + sliders.sum::<f64>()
    };
    deflection.iter().map(at).collect()
}

#[test]
fn slip_elements_behind_a_memory_that_runs_on_are_found_beside_law_masing() {
    let time_s: Vec<f64> = (0..5000).map(|row| 0.01 * f64::from(row)).collect();
    let swing = |t: f64| (0.35 + 0.65 * (0.06 * t).cos().powi(2)) * (0.9 * t).sin() * (0.83 + 0.17 * (0.37 * t).cos());
    let deflection: Vec<f64> = time_s.iter().map(|t| RATED_RAD * swing(*t)).collect();
    let turning = |t: f64| 0.7 * (0.21 * t).sin() + 0.4 * (0.57 * t).cos();
    let noise = |row: u32| 0.1 * (f64::from(row) * 12.9898).sin() * (f64::from(row * row % 7919) * 0.078_233).cos();
    let gravity = time_s.iter().map(|t| 0.8 * turning(*t).sin());
    let torque =
        torque_of_sliders(&deflection).into_iter().zip(gravity).zip(0..).map(|((z, g), row)| z + g + noise(row));
    let recording = Recording {
        name: "sliders".into(),
        torque: Some(torque.collect()),
        deflection_rad: Some(deflection.clone().into()),
        theta_out_rad: Some(time_s.iter().map(|t| turning(*t)).collect()),
        time_s: time_s.into(),
        ..Recording::default()
    };
    let base = parse("phase.toml", PHASE).unwrap();
    let found = diagnose(&[recording], &base, &[], &Options::default(), &()).unwrap();
    let mut names: Vec<&str> = found.diagnosis.effects.iter().map(|e| e.name.as_str()).collect();
    names.sort_unstable();
    assert_eq!(names, ["gravity_load", "nonlocal_memory"]);
    assert_eq!(found.model.memory.map(|memory| memory.law), Some(Law::Masing));
    assert!(found.diagnosis.suggestions.contains(&Suggestion::Law(Law::Masing)));
    // What is left is told beside the law given.
    assert_eq!(found.verdict.base.model.memory.map(|memory| memory.law), Some(Law::Phase));
    let rms = found.diagnosis.rms;
    assert!(rms.extended < 0.4 * rms.refitted, "{rms:?}");
}
