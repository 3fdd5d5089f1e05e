//! Experiment `joint`: what compensating the gear gains under a drive, on the model's gear and on one that it does not describe.

mod common;

use std::sync::OnceLock;

use gmhm_tools::bench::joint::{self, Compensation, JointReport, Plant};
use gmhm_tools::bench::{BenchError, Experiment, Noise, Options, simulate};
use gmhm_tools::model::{self, Model};

fn published() -> Model {
    model::parse("published", common::PUBLISHED).unwrap()
}

fn report() -> &'static JointReport {
    static REPORT: OnceLock<JointReport> = OnceLock::new();
    REPORT.get_or_init(|| joint::run(&published(), 1).unwrap())
}

/// How many times less position and torque error than with another compensation.
fn gain(plant: Plant, parameters: &str, compensation: Compensation, other: Compensation) -> (f64, f64) {
    let line = |kind| report().line(plant, parameters, kind).unwrap();
    let (it, other) = (line(compensation), line(other));
    (other.position_error_rad / it.position_error_rad, other.torque_error_nm / it.torque_error_nm)
}

#[test]
fn on_a_foreign_gear_the_inverse_leaves_a_third_of_none_and_half_of_a_spring() {
    println!("{}", report());
    for compensation in [Compensation::Reference, Compensation::Measurement] {
        for parameters in ["fitted", "memory 10 % off"] {
            let (position, torque) = gain(Plant::MaxwellSlip, parameters, compensation, Compensation::Off);
            assert!(position >= 3.0 && torque >= 3.0, "{compensation:?}, {parameters}: {position}, {torque}");
            let (position, torque) = gain(Plant::MaxwellSlip, parameters, compensation, Compensation::Spring);
            assert!(position >= 2.0 && torque >= 2.0, "{compensation:?}, {parameters}: {position}, {torque}");
        }
    }
}

#[test]
fn on_its_own_gear_the_inverse_leaves_a_tenth() {
    for compensation in [Compensation::Reference, Compensation::Measurement] {
        for other in [Compensation::Off, Compensation::Spring] {
            let (position, torque) = gain(Plant::Model, "fitted", compensation, other);
            assert!(position >= 10.0 && torque >= 10.0, "{compensation:?} beside {other:?}: {position}, {torque}");
        }
    }
}

#[test]
fn a_stiffness_off_by_a_tenth_costs_a_tenth_of_the_deflection() {
    for plant in [Plant::Model, Plant::MaxwellSlip] {
        let (position, torque) = gain(plant, "all 10 % off", Compensation::Reference, Compensation::Off);
        assert!((8.0..13.0).contains(&position) && (8.0..13.0).contains(&torque), "{plant:?}: {position}, {torque}");
    }
}

#[test]
fn the_joint_is_recorded_while_it_tracks() {
    let options = Options { noise: Some(Noise::NONE), ..Options::new() };
    let (recording, key) = simulate(&published(), Experiment::Joint, &options, 1).unwrap();
    assert_eq!((recording.len(), key.plant), (12_000, Plant::Model));
    let (input, output) = (recording.theta_in_rad.as_deref().unwrap(), recording.theta_out_rad.as_deref().unwrap());
    let theta = recording.deflection().unwrap();
    for k in 0..recording.len() {
        assert!((input[k] / 100.0 - output[k] - theta[k]).abs() < 1e-14, "row {k}");
    }
    let swing = output.iter().fold(0.0, |a: f64, q| a.max(q.abs()));
    assert!(swing > 1.0 && swing < 1.3, "{swing} rad");

    let foreign = Options { plant: Some(Plant::MaxwellSlip), compensation: Some(Compensation::Reference), ..options };
    let (other, key) = simulate(&published(), Experiment::Joint, &foreign, 1).unwrap();
    assert_eq!(key.plant, Plant::MaxwellSlip);
    assert_ne!(other.torque, recording.torque);
    assert!(simulate(&published(), Experiment::Joint, &foreign, 1).unwrap().0 == other);
}

#[test]
fn what_the_joint_does_not_have_is_refused() {
    for options in [
        Options { duration_s: Some(1.0), ..Options::new() },
        Options { amplitudes: vec![1.0], ..Options::new() },
        Options { speed_rad_per_s: Some(1.0), ..Options::new() },
    ] {
        let refused = simulate(&published(), Experiment::Joint, &options, 1);
        assert!(matches!(refused, Err(BenchError::NotInExperiment { .. })));
    }
    for rate in [300.0, 4000.0, 1e-3] {
        let options = Options { sample_rate_hz: Some(rate), ..Options::new() };
        assert!(
            matches!(simulate(&published(), Experiment::Joint, &options, 1), Err(BenchError::Value { .. })),
            "{rate}"
        );
    }
    let options = Options { plant: Some(Plant::MaxwellSlip), ..Options::new() };
    assert!(matches!(simulate(&published(), Experiment::Cycle, &options, 1), Err(BenchError::NotInExperiment { .. })));
}
