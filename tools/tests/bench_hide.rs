//! `--hide`: effects leave what was asked for after the base model is refitted, wherever they can be seen.

use crate::common;
use gmhm::elastic::basis;
use gmhm::memory::Frame;
use gmhm::memory::masing::{Path, single_valued_column};
use gmhm::terms::KINDS;
use gmhm_tools::bench::{BenchError, Experiment, Hidden, Hide, HideError, Key, Noise, Options, simulate};
use gmhm_tools::model::{self, Model, TermValue};
use gmhm_tools::physics::predict;
use gmhm_tools::recording::Recording;
use nalgebra::{DMatrix, DVector};

fn published() -> Model {
    model::parse("published", common::PUBLISHED).unwrap()
}

fn hiding(hides: &[&str]) -> Options {
    let hide = hides.iter().map(|text| text.parse().unwrap()).collect();
    Options { noise: Some(Noise::default()), hide, ..Options::new() }
}

/// An experiment in which a kind shows.
fn stage(kind: &str) -> Experiment {
    match kind {
        "viscous_damping" | "inertia" | "creep" | "time_skew" | "nonlocal_memory" | "load_dependent_memory" => {
            Experiment::Rates
        }
        "soft_windup" | "stiffness_asymmetry" | "backlash" | "wear" | "sensor_drift" => Experiment::Amplitudes,
        _ => Experiment::Running,
    }
}

/// Rms that is left beside offset, θ, θ³, θ⁵, −θg, the loop shape and the effect of an encoder's zero, by a plain least-squares solver, N·m.
fn left_by_least_squares(recording: &Recording, model: &Model) -> f64 {
    let params = model.params(model.gear.rated_deflection_rad.unwrap()).unwrap().unwrap();
    let frame = Frame::new(&params);
    let theta = recording.deflection().unwrap();
    let columns = |zero: f64| {
        let mut path = Path::<f64, 256>::start(theta[0] - zero);
        let row = |x: &f64| {
            let x = x - zero;
            let [c1, c2, c3] = basis(x);
            [1.0, c1, c2, c3, single_valued_column(&frame, x), path.step(&frame, 0.0, x), 0.0]
        };
        theta.iter().map(row).collect::<Vec<_>>()
    };
    let zero = 1e-4 * params.rated_deflection_rad();
    let (mut here, there) = (columns(0.0), columns(zero));
    let (elastic, memory) = (params.elastic(), params.memory());
    let a = params.rated_deflection_rad();
    let weights =
        [0.0, elastic.c1_nm_per_rad, elastic.c2_nm_per_rad3, elastic.c3_nm_per_rad5, memory.e(), memory.h() * a, 0.0];
    let torque = |row: &[f64; 7]| row.iter().zip(weights).map(|(x, w)| x * w).sum::<f64>();
    for (row, moved) in here.iter_mut().zip(&there) {
        row[6] = torque(moved) - torque(row);
    }
    let scale: Vec<f64> = (0..7).map(|j| here.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt()).collect();
    let matrix = DMatrix::from_fn(here.len(), 7, |i, j| here[i][j] / scale[j]);
    let target = DVector::from_column_slice(recording.torque.as_deref().unwrap());
    let solution = matrix.clone().svd(true, true).solve(&target, 1e-12).unwrap();
    (target - matrix * solution).norm() / (here.len() as f64).sqrt()
}

#[test]
fn every_kind_leaves_the_size_asked_for() {
    // A wrong scale is that of a measurement against a simulation: the bench records none, and refitted parameters would absorb it.
    for info in KINDS.iter().filter(|info| info.name != "torque_scale") {
        let name = info.name;
        let hides = if name == "thermal_friction" {
            vec!["coulomb_friction=0.5".to_owned(), format!("{name}=0.05")]
        } else {
            vec![format!("{name}=0.15")]
        };
        let hides: Vec<&str> = hides.iter().map(String::as_str).collect();
        let (recording, key) =
            simulate(&published(), stage(name), &hiding(&hides), 3).unwrap_or_else(|error| panic!("{name}: {error}"));
        let hidden = key.hidden.last().unwrap();
        let asked = key.hidden.len() as f64;
        assert_eq!((hidden.kind.as_str(), hides.len() as f64), (name, asked));
        println!("{name:<30} before {:8.4} N·m, left {:.4} N·m", hidden.before_nm, hidden.size_nm);
        let size = if name == "thermal_friction" { 0.05 } else { 0.15 };
        assert!((hidden.size_nm / size - 1.0).abs() < 2e-3, "{name}: {}", hidden.size_nm);
        assert!(hidden.before_nm >= 0.99 * hidden.size_nm, "{name}");
        // The truth predicts the recording; the base model does not.
        let predicted = predict(&key.truth, None, &recording).unwrap().torque;
        for (a, b) in predicted.iter().zip(recording.torque.as_deref().unwrap()) {
            assert!((a - b).abs() < 1e-6, "{name}: {a} {b}");
        }
    }
}

#[test]
fn a_plain_least_squares_solver_finds_the_size_left() {
    for (hide, experiment) in [
        ("kinematic_error=0.15", Experiment::Running),
        ("torque_ripple=0.15", Experiment::Running),
        ("encoder_eccentricity=0.15", Experiment::Running),
        ("coulomb_friction=0.15", Experiment::Running),
        ("soft_windup:tanh=0.15", Experiment::Amplitudes),
        ("wear:step=0.15", Experiment::Amplitudes),
        ("creep=0.15", Experiment::Rates),
    ] {
        let (recording, _) = simulate(&published(), experiment, &hiding(&[hide]), 5).unwrap();
        let left = left_by_least_squares(&recording, &published());
        assert!((left / 0.15 - 1.0).abs() < 0.02, "{hide}: {left}");
    }
}

#[test]
fn the_seed_draws_the_effect_and_the_size_does_not() {
    let make = |size: &str, seed| simulate(&published(), Experiment::Running, &hiding(&[size]), seed).unwrap().1;
    let phase = |key: &Key| match (&key.truth.terms[0].values["cos_nm"], &key.truth.terms[0].values["sin_nm"]) {
        (TermValue::Number(c), TermValue::Number(s)) => (s.atan2(*c), s.hypot(*c)),
        other => panic!("{other:?}"),
    };
    let (small, large, other) = (make("gravity_load=0.1", 1), make("gravity_load=0.3", 1), make("gravity_load=0.1", 2));
    assert!((phase(&small).0 - phase(&large).0).abs() < 1e-12);
    // Nearly: the zero of the encoders enters the refit nonlinearly.
    assert!((phase(&large).1 / phase(&small).1 - 3.0).abs() < 0.1);
    assert!((phase(&small).0 - phase(&other).0).abs() > 1e-3);
}

#[test]
fn shapes_are_taken_as_given() {
    for (hide, key, word) in [
        ("soft_windup:rational=0.1", "shape", "rational"),
        ("soft_windup:piecewise=0.1", "shape", "piecewise"),
        ("backlash:clearance=0.1", "shape", "clearance"),
        ("backlash:play=0.1", "shape", "play"),
        ("wear:ramp=0.1", "shape", "ramp"),
        ("unknown:deflection=0.1", "coordinate", "deflection"),
    ] {
        let (_, truth) = simulate(&published(), Experiment::Amplitudes, &hiding(&[hide]), 1).unwrap();
        assert_eq!(truth.truth.terms[0].values[key], TermValue::Text(word.to_owned()), "{hide}");
        assert!((truth.hidden[0].size_nm - 0.1).abs() < 2e-4);
    }
}

/// Under a prescribed load the encoders show the kinematic error while the gear carries the load.
#[test]
fn the_load_machine_holds_its_load_whatever_the_encoders_show() {
    for hide in ["kinematic_error=0.2", "backlash:clearance=0.1", "backlash:play=0.1"] {
        let (plain, _) = simulate(&published(), Experiment::Running, &hiding(&[]), 1).unwrap();
        let (hidden, _) = simulate(&published(), Experiment::Running, &hiding(&[hide]), 1).unwrap();
        let (a, b) = (plain.torque.unwrap(), hidden.torque.unwrap());
        let worst = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-6 * 30.0, "{hide}: {worst}");
        assert_ne!(plain.deflection_rad, hidden.deflection_rad);
    }
}

#[test]
fn what_the_experiment_cannot_show_is_refused() {
    let refusal =
        |experiment, options: &Options| simulate(&published(), experiment, options, 1).map(|_| ()).unwrap_err();
    let invisible = |experiment, options: &Options| {
        let error = refusal(experiment, options);
        assert!(matches!(error, BenchError::Hide(HideError::Invisible(_))), "{error}");
    };
    // Without a turn of the motor both are constants.
    invisible(Experiment::Cycle, &hiding(&["kinematic_error=0.15"]));
    invisible(Experiment::Cycle, &hiding(&["torque_ripple=0.15"]));
    invisible(Experiment::Running, &Options { warm_up_k: 0.0, ..hiding(&["thermal_stiffness=0.1"]) });
    // No friction that a temperature could change.
    invisible(Experiment::Running, &hiding(&["thermal_friction=0.1"]));
    let error = refusal(Experiment::Joint, &hiding(&["coulomb_friction=0.1"]));
    assert!(matches!(error, BenchError::NotInExperiment { .. }), "{error}");
}

#[test]
fn hides_read_back_and_wrong_ones_say_why() {
    for text in ["kinematic_error=0.15", "soft_windup:tanh=0.2"] {
        let hide: Hide = text.parse().unwrap();
        assert_eq!(hide.to_string(), text);
    }
    for (text, part) in [
        ("", "KIND=SIZE"),
        ("kinematic_error", "KIND=SIZE"),
        ("kinematic_error=x", "number of N·m"),
        ("kinematic_error=0", "number of N·m"),
        ("kinematic_error=inf", "number of N·m"),
        ("ghost=0.1", "known are kinematic_error"),
        ("soft_windup:round=0.1", "known are tanh"),
        ("inertia:round=0.1", "this kind has none"),
    ] {
        let error = text.parse::<Hide>().unwrap_err().to_string();
        assert!(error.contains(part), "{text}: {error} should say {part}");
    }
}

#[test]
fn the_key_with_hidden_effects_reads_back() {
    let hides = ["kinematic_error=0.15", "stribeck_friction=0.1"];
    let (_, key) = simulate(&published(), Experiment::Running, &hiding(&hides), 9).unwrap();
    assert_eq!(key.truth.terms.len(), 2);
    let written: toml::Table = key.to_toml().parse().unwrap();
    assert_eq!(written["hidden"].clone().try_into::<Vec<Hidden>>().unwrap(), key.hidden);
}
