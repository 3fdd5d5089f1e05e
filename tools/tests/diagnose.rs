//! `gmhm diagnose`: synthetic recordings with physics hidden in them, and real ones where they are at hand.

use crate::browser::assert_works;
use crate::common::skips::real_recording;
use crate::common::{PUBLISHED, WorkDir};
use serde_json::Value;

/// A short run with both angles.
const RUNNING: &str = "simulate gear.toml --experiment running --duration 15 --sample-rate 160";

fn bench() -> WorkDir {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    dir
}

fn findings(dir: &WorkDir, recordings: &str) -> Value {
    dir.succeed(&format!("diagnose gear.toml {recordings} -o extended.toml --json findings.json"));
    serde_json::from_str(&dir.read("findings.json")).unwrap()
}

fn names(found: &Value) -> Vec<&str> {
    found["effects"].as_array().unwrap().iter().map(|e| e["name"].as_str().unwrap()).collect()
}

fn number(found: &Value, path: &[&str]) -> f64 {
    let at = path.iter().fold(found, |value, key| &value[*key]);
    at.as_f64().unwrap_or_else(|| panic!("{path:?} is {at}"))
}

#[test]
fn a_kinematic_error_is_found_named_and_modelled() {
    let dir = bench();
    // Fast enough for the fourth harmonic of the fastest run.
    let running = RUNNING.replace("160", "400");
    dir.succeed(&format!("{running} --hide kinematic_error=0.15 --seed 3 -o rec.csv --key key.toml"));
    dir.succeed("simulate gear.toml --experiment running --duration 10 --seed 3 --noise none -o plain.csv");
    let found = findings(&dir, "rec.csv");
    assert_eq!(found["mismatch"], true);
    assert_eq!(names(&found), ["kinematic_error"]);
    let key: toml::Table = dir.read("key.toml").parse().unwrap();
    let hidden = key["truth"]["term"].as_array().unwrap()[0].as_table().unwrap();
    let parameters = &found["effects"][0]["parameters"];
    for name in ["cos_rad", "sin_rad"] {
        let truth = hidden[name].as_array().unwrap();
        let orders = hidden["orders"].as_array().unwrap();
        for (order, truth) in orders.iter().zip(truth) {
            let order = order.as_float().or(order.as_integer().map(|i| i as f64)).unwrap();
            let list = |key: &str, part: &str| parameters[key][part].as_array().unwrap().clone();
            let at = list("orders", "value").iter().position(|o| (o.as_f64().unwrap() - order).abs() < 0.01);
            let at = at.unwrap_or_else(|| panic!("order {order} is not in {parameters}"));
            let (value, sd) = (list(name, "value")[at].as_f64().unwrap(), list(name, "sd")[at].as_f64().unwrap());
            let truth = truth.as_float().unwrap();
            assert!((value - truth).abs() < 5.0 * sd + 2e-8, "{name} of order {order}: {value} ± {sd}, true {truth}");
        }
    }
    let (base, extended) = (number(&found, &["rms", "refitted"]), number(&found, &["rms", "extended"]));
    assert!(extended < 0.4 * base, "{extended} N·m of {base} N·m left");
    let held = (number(&found, &["heldout", "refitted"]), number(&found, &["heldout", "extended"]));
    assert!(held.1 < 0.5 * held.0, "held out: {held:?}");
    // The extended model is a model file like any other.
    dir.succeed("predict extended.toml rec.csv -o out.csv");
    dir.succeed("predict extended.toml plain.csv -o out.csv");
}

/// The motor turns by up to a radian from row to row: sampling and smoothing take more of the error at high speed.
#[test]
fn a_kinematic_error_of_a_motor_that_turns_far_from_row_to_row_keeps_its_name() {
    let dir = bench();
    for rate in ["100", "200"] {
        let running = RUNNING.replace("160", rate);
        dir.succeed(&format!("{running} --hide kinematic_error=0.15 --seed 3 -o rec.csv"));
        assert_eq!(names(&findings(&dir, "rec.csv")), ["kinematic_error"], "{rate} Hz");
    }
}

#[test]
fn nothing_left_out_is_nothing_found() {
    let dir = bench();
    for seed in 1..=3 {
        dir.succeed(&format!("{RUNNING} --noise torque=0.1,ar=0.95,encoder_bits=24 --seed {seed} -o rec.csv"));
        let found = findings(&dir, "rec.csv");
        assert_eq!(found["mismatch"], false, "seed {seed}: {found}");
        assert!(names(&found).is_empty() && found["where"].as_array().unwrap().is_empty(), "{found}");
        let done = dir.succeed("diagnose gear.toml rec.csv -o extended.toml");
        assert!(done.stdout.contains("No structure beyond noise"), "{}", done.stdout);
    }
}

/// Writes `rec.csv`: a recording with a torque over one of its columns added.
fn add_torque(dir: &WorkDir, recording: &str, over: &str, torque_nm: impl Fn(f64) -> f64) {
    let quiet = dir.read(recording);
    let (header, rows) = quiet.split_once('\n').unwrap();
    let column = |name: &str| header.split(',').position(|c| c == name).unwrap();
    let (over, torque) = (column(over), column("torque_nm"));
    let with_torque = |row: &str| {
        let mut cells: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        cells[torque] += torque_nm(cells[over]);
        cells.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
    };
    let rows: Vec<String> = rows.lines().map(with_torque).collect();
    dir.write("rec.csv", format!("{header}\n{}\n", rows.join("\n")));
}

#[test]
fn a_tone_close_to_half_the_sample_rate_is_structure_over_frequency() {
    let dir = bench();
    dir.succeed(&format!("{RUNNING} --noise torque=0.05 --seed 4 -o quiet.csv"));
    add_torque(&dir, "quiet.csv", "time_s", |t| 0.21 * (std::f64::consts::TAU * 60.0 * t).sin());
    let found = findings(&dir, "rec.csv");
    assert_eq!(names(&found), ["unknown"], "{found}");
    assert_eq!(found["where"][0]["coordinate"], "frequency", "{found}");
}

#[test]
fn interference_for_a_while_is_structure_over_frequency() {
    let dir = bench();
    dir.succeed("simulate gear.toml --experiment cycle --cycles 4 --duration 24 --sample-rate 125 --noise torque=0.04,ar=0.9 --seed 4 -o quiet.csv");
    let tone = |t: f64| 0.475 * (std::f64::consts::TAU * 10.0946 * t).sin();
    add_torque(&dir, "quiet.csv", "time_s", |t| if (10.217..15.015).contains(&t) { tone(t) } else { 0.0 });
    let found = findings(&dir, "rec.csv");
    assert_eq!(names(&found), ["unknown"], "{found}");
    assert_eq!(found["where"][0]["coordinate"], "frequency", "{found}");
}

/// A periodic torque over the deflection is in no list. Soft windup explains most of it, and held-out blocks of cycles cannot say that it is wrong; a free function of the deflection can.
#[test]
fn a_detent_of_the_deflection_is_not_called_soft_windup() {
    let dir = bench();
    dir.succeed("simulate gear.toml --experiment cycle --cycles 4 --duration 24 --sample-rate 125 --noise torque=0.06,ar=0.8 --seed 4 -o quiet.csv");
    let turn = std::f64::consts::TAU / (0.25 * 1.168e-3);
    add_torque(&dir, "quiet.csv", "deflection_rad", |x| 0.22 * (turn * x).sin());
    let found = findings(&dir, "rec.csv");
    assert_eq!(names(&found), ["unknown"], "{found}");
}

#[test]
fn recordings_that_take_no_part_are_predicted() {
    let dir = bench();
    dir.succeed(&format!("{RUNNING} --hide viscous_friction=0.15 --seed 4 -o rec.csv --key key.toml"));
    dir.succeed(&format!("{RUNNING} --hide viscous_friction=0.15 --seed 4 --speed 0.7 -o other.csv"));
    dir.succeed("diagnose gear.toml rec.csv --holdout other.csv -o extended.toml --json findings.json");
    let found: Value = serde_json::from_str(&dir.read("findings.json")).unwrap();
    assert_eq!(found["heldout"]["from"], "recordings");
    let held = (number(&found, &["heldout", "refitted"]), number(&found, &["heldout", "extended"]));
    assert!(held.1 < 0.7 * held.0, "held out: {held:?}");
}

#[test]
fn another_simulator_is_compared_in_the_models_place() {
    let dir = bench();
    dir.succeed(&format!("{RUNNING} --hide viscous_friction=0.15 --seed 5 -o rec.csv"));
    let both_angles = ["time_s", "theta_in_rad", "theta_out_rad", "velocity_out_rad_per_s", "torque_nm"];
    with_simulation(&dir, &both_angles);
    // The model handed in is stiffer than the gear; the simulation stands in for it.
    dir.write("stiff.toml", PUBLISHED.replace("2.4737e4", "2.9e4"));
    dir.succeed("diagnose stiff.toml both.csv -o extended.toml --json findings.json");
    let found: Value = serde_json::from_str(&dir.read("findings.json")).unwrap();
    assert_eq!(names(&found), ["viscous_friction"], "{found}");
}

#[test]
fn a_memory_missing_from_a_simulation_of_a_bench_is_named() {
    let dir = bench();
    dir.succeed("simulate gear.toml --experiment amplitudes --duration 60 --sample-rate 100 --hide nonlocal_memory=0.5 --seed 8 -o rec.csv");
    with_simulation(&dir, &["time_s", "deflection_rad", "torque_nm"]);
    dir.succeed("diagnose both.csv -o extended.toml --json findings.json");
    let found: Value = serde_json::from_str(&dir.read("findings.json")).unwrap();
    assert_eq!(found["effects"][0]["family"], "memory", "{found}");
    assert!(number(&found, &["explained"]) > 0.8, "{found}");
}

/// Columns of `rec.csv` with somebody's simulation as `both.csv`: the published gear along the recorded motion, computed outside the diagnosis.
fn with_simulation(dir: &WorkDir, columns: &[&str]) {
    dir.succeed("predict gear.toml rec.csv -o predicted.csv");
    let mut all: Vec<Vec<f64>> = columns.iter().map(|name| dir.column("rec.csv", name)).collect();
    all.push(dir.column("predicted.csv", "torque_model_nm"));
    let mut rows = vec![format!("{},torque_sim_nm", columns.join(","))];
    rows.extend((0..all[0].len()).map(|row| all.iter().map(|c| c[row].to_string()).collect::<Vec<_>>().join(",")));
    dir.write("both.csv", rows.join("\n"));
}

#[test]
fn the_same_recording_gives_the_same_finding() {
    let dir = bench();
    dir.succeed(&format!("{RUNNING} --hide coulomb_friction=0.1 --seed 6 -o rec.csv"));
    let once = findings(&dir, "rec.csv");
    assert_eq!(once, findings(&dir, "rec.csv"));
}

#[test]
fn what_cannot_be_diagnosed_is_refused_with_the_mend() {
    let dir = bench();
    dir.succeed(&format!("{RUNNING} -o rec.csv"));
    dir.write("short.csv", dir.read("rec.csv").lines().take(20).collect::<Vec<_>>().join("\n"));
    let done = dir.gmhm("diagnose gear.toml short.csv -o extended.toml");
    assert_eq!(done.status, Some(1), "{}", done.stderr);
    assert!(done.stderr.contains("short.csv"), "{}", done.stderr);
    let bare: Vec<String> = dir.read("rec.csv").lines().map(|row| row.rsplit_once(',').unwrap().0.to_owned()).collect();
    dir.write("bare.csv", bare.join("\n"));
    let done = dir.gmhm("diagnose gear.toml bare.csv -o extended.toml");
    assert_eq!(done.status, Some(1), "{}", done.stderr);
    assert!(done.stderr.contains("torque_nm"), "{}", done.stderr);
    assert!(!dir.files().contains(&"extended.toml".to_owned()));
}

#[test]
fn the_report_stands_alone() {
    let dir = bench();
    dir.succeed(&format!("{RUNNING} --hide kinematic_error=0.15 --seed 3 -o rec.csv"));
    dir.succeed("diagnose gear.toml rec.csv -o extended.toml --report finding.html");
    let page = dir.read("finding.html");
    assert!(page.contains("kinematic"), "the page does not name what was found");
    assert_works(&dir.path("finding.html"));
}

#[test]
fn a_robot_joint_is_diagnosed_without_a_motor_angle() {
    let Some(recording) = real_recording("ur10e_joint2_sine.csv") else { return };
    let dir = WorkDir::new();
    let file = recording.display();
    dir.succeed(&format!("fit {file} -o joint.toml"));
    dir.succeed(&format!("diagnose joint.toml {file} -o extended.toml --json findings.json"));
    let found: Value = serde_json::from_str(&dir.read("findings.json")).unwrap();
    assert_eq!(found["unit"], "a");
    let (base, extended) = (number(&found, &["rms", "refitted"]), number(&found, &["rms", "extended"]));
    assert!(found["mismatch"] == true && extended < base, "{found}");
}
