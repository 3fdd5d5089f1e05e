//! `gmhm simulate`.

use crate::common::{PUBLISHED, WorkDir};

#[test]
fn every_experiment_gives_a_recording_that_can_be_fitted() {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    for experiment in ["cycle", "amplitudes", "rates", "running", "dynamic"] {
        let done = dir.succeed(&format!("simulate gear.toml --experiment {experiment} --seed 5 -o rec.csv"));
        assert!(done.stdout.contains("Synthetic") && done.stdout.contains("seed 5"), "{}", done.stdout);
        dir.succeed("fit rec.csv --model gear.toml -o fitted.toml");
        // Perfect sensors on the same motion tell how good the fit is.
        dir.succeed(&format!("simulate gear.toml --experiment {experiment} --seed 5 --noise none -o truth.csv"));
        dir.succeed("predict fitted.toml truth.csv -o out.csv");
        let (is, was) = (dir.column("out.csv", "torque_model_nm"), dir.column("truth.csv", "torque_nm"));
        let worst = is.iter().zip(&was).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 0.1, "{experiment}: {worst} N·m off");
    }
}

#[test]
fn the_seed_makes_the_recording_and_the_key_tells_it() {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    let command = "simulate gear.toml --experiment dynamic --duration 2";
    dir.succeed(&format!("{command} --seed 1 -o a.csv --key a.toml"));
    dir.succeed(&format!("{command} --seed 1 -o b.csv"));
    dir.succeed(&format!("{command} --seed 2 -o c.csv"));
    assert_eq!(dir.read("a.csv"), dir.read("b.csv"));
    assert_ne!(dir.read("a.csv"), dir.read("c.csv"));
    let key: toml::Table = dir.read("a.toml").parse().unwrap();
    assert_eq!(key["simulation"]["seed"].as_str(), Some("1"));
    assert_eq!(key["truth"]["memory"]["alpha"].as_float(), Some(2.6532e6));
}

#[test]
fn the_joint_tells_what_each_compensation_leaves() {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    let files = "-o joint.csv --key key.toml --plot joint.svg --json joint.json";
    let done = dir.succeed(&format!("simulate gear.toml --experiment joint --plant maxwell-slip {files}"));
    for part in ["maxwell-slip", "reference", "measurement", "pressing: torque in N·m", "10 % too large"] {
        assert!(done.stdout.contains(part), "{}", done.stdout);
    }
    assert_eq!(dir.column("joint.csv", "torque_nm").len(), 12_000);
    assert!(dir.read("key.toml").contains("plant = \"maxwell-slip\""));
    assert!(dir.read("joint.svg").contains("maxwell-slip"));
    let report: serde_json::Value = serde_json::from_str(&dir.read("joint.json")).unwrap();
    assert_eq!(report["lines"].as_array().unwrap().len(), 9);
    assert!(report["lines"][2]["by_hysteresis"]["position_rad"].as_f64().unwrap() > 0.0);
}

#[test]
fn what_cannot_be_simulated_is_refused_and_leaves_nothing() {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    dir.misuse("simulate gear.toml --experiment cycle --rate=-1 -o rec.csv", &["rate"]);
    dir.misuse("simulate gear.toml --experiment running --cycles 3 -o rec.csv", &["cycles", "running"]);
    dir.misuse("simulate gear.toml --experiment cycle -o rec.csv --plot p.svg", &["--plot", "cycle"]);
    dir.refuse("simulate none.toml --experiment cycle -o rec.csv", &["none.toml"]);
    dir.refuse("simulate gear.toml --experiment cycle -o nowhere/rec.csv", &["nowhere"]);
    assert_eq!(dir.gmhm("simulate gear.toml --experiment fly -o rec.csv").status, Some(2));
    assert!(!dir.files().iter().any(|file| file == "rec.csv"));
}
