//! Experiment `joint`: what compensating the gear gains under a drive, on the model's gear and on one that it does not describe.

use crate::common;
use std::sync::OnceLock;

use clap::ValueEnum;
use gmhm_tools::bench::joint::{self, Compensation, Errors, JointReport, Knows, Line, Plant};
use gmhm_tools::bench::{BenchError, Experiment, Noise, Options, simulate};
use gmhm_tools::model::{self, Model};

fn published() -> Model {
    model::parse("published", common::PUBLISHED).unwrap()
}

fn report() -> &'static JointReport {
    static REPORT: OnceLock<JointReport> = OnceLock::new();
    REPORT.get_or_init(|| joint::run(&published(), Plant::value_variants(), 1, &()).unwrap())
}

const INVERSES: [Compensation; 2] = [Compensation::Reference, Compensation::Measurement];

fn foreign() -> impl Iterator<Item = Plant> {
    Plant::value_variants().iter().copied().filter(|plant| *plant != Plant::Model)
}

/// How many times less error than with another compensation: position and torque.
fn gain(plant: Plant, knows: Knows, kind: Compensation, other: Compensation, of: fn(&Line) -> &Errors) -> [f64; 2] {
    let errors = |kind| of(report().line(plant, knows, kind).unwrap());
    errors(kind).beside(errors(other))
}

fn all(line: &Line) -> &Errors {
    &line.all
}

fn by_hysteresis(line: &Line) -> &Errors {
    &line.by_hysteresis
}

#[test]
fn on_the_foreign_gear_the_inverse_leaves_a_third_of_none_and_half_of_a_spring() {
    println!("{}", report());
    for kind in INVERSES {
        for knows in [Knows::Fitted, Knows::MemoryOff] {
            let [position, torque] = gain(Plant::MaxwellSlip, knows, kind, Compensation::Off, all);
            assert!(position >= 3.0 && torque >= 3.0, "{kind:?}, {knows:?}: {position}, {torque}");
            let [position, torque] = gain(Plant::MaxwellSlip, knows, kind, Compensation::Spring, all);
            assert!(position >= 2.0 && torque >= 2.0, "{kind:?}, {knows:?}: {position}, {torque}");
        }
        // Also where stiffness and hysteresis are 10 % off, it is the hysteresis that is made up for.
        for knows in Knows::ALL {
            let [position, torque] = gain(Plant::MaxwellSlip, knows, kind, Compensation::Spring, by_hysteresis);
            assert!(position >= 3.0 && torque >= 3.0, "{kind:?}, {knows:?}: {position}, {torque}");
        }
    }
}

#[test]
fn on_every_foreign_gear_the_inverse_beats_none_threefold_and_the_spring_as_far_as_its_loop_allows() {
    let mut twice = Vec::new();
    for plant in foreign() {
        for kind in INVERSES {
            for knows in Knows::ALL {
                let [position, torque] = gain(plant, knows, kind, Compensation::Off, all);
                assert!(position >= 3.0 && torque >= 3.0, "{plant:?}, {kind:?}, {knows:?}: {position}, {torque}");
            }
            let [position, torque] = gain(plant, Knows::Fitted, kind, Compensation::Spring, all);
            assert!(position >= 1.3 && torque >= 1.4, "{plant:?}, {kind:?}: {position}, {torque}");
        }
        let [position, torque] = gain(plant, Knows::Fitted, Compensation::Reference, Compensation::Spring, all);
        if position >= 2.0 && torque >= 2.0 {
            twice.push(plant);
        }
    }
    assert_eq!(twice, [Plant::MaxwellSlip, Plant::Late, Plant::Windup], "the gears that the README names");
}

#[test]
fn what_is_left_on_a_foreign_gear_is_what_the_law_cannot_say_of_its_loop() {
    for gear in report().identified.iter().filter(|gear| gear.plant != Plant::Model) {
        let line = report().line(gear.plant, Knows::Fitted, Compensation::Reference).unwrap();
        let (position, torque) = (line.all.position_rad / gear.left_rad, line.all.torque_nm / gear.left_nm);
        println!("{:?}: {position:.2} and {torque:.2} of what the fit left", gear.plant);
        assert!((0.5..2.0).contains(&position) && (0.5..2.0).contains(&torque), "{gear:?}: {position}, {torque}");
    }
}

#[test]
fn on_its_own_gear_the_inverse_leaves_a_tenth() {
    for kind in INVERSES {
        for other in [Compensation::Off, Compensation::Spring] {
            let [position, torque] = gain(Plant::Model, Knows::Fitted, kind, other, all);
            assert!(position >= 10.0 && torque >= 10.0, "{kind:?} beside {other:?}: {position}, {torque}");
        }
        let [position, torque] = gain(Plant::Model, Knows::Fitted, kind, Compensation::Spring, by_hysteresis);
        assert!(position >= 10.0 && torque >= 10.0, "{kind:?}: {position}, {torque}");
    }
}

#[test]
fn a_stiffness_off_by_a_tenth_costs_a_tenth_of_the_deflection() {
    for plant in [Plant::Model, Plant::MaxwellSlip] {
        let [position, torque] = gain(plant, Knows::AllOff, Compensation::Reference, Compensation::Off, all);
        assert!((8.0..14.0).contains(&position) && (8.0..14.0).contains(&torque), "{plant:?}: {position}, {torque}");
    }
}

#[test]
fn the_figure_shows_the_compensations() {
    let svg = joint::figure(&published(), Plant::MaxwellSlip, 1).unwrap().to_file();
    for part in ["linear spring: ", "inverse on the reference: ", "inverse on the measurement: ", "off: ", "synthetic"]
    {
        assert!(svg.contains(part), "{part}");
    }
    assert!(svg.len() < 400_000);
}

#[test]
fn the_joint_is_recorded_while_it_tracks() {
    let options = Options { noise: Some(Noise::default()), ..Options::new() };
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
