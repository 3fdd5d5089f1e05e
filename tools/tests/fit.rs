//! `gmhm fit`.

mod common;

use std::fmt::Write;

use common::{PUBLISHED, WorkDir};

/// Two cycles to the rated deflection, without torque.
fn cycles() -> String {
    (0..400).fold("time_s,deflection_rad\n".to_owned(), |mut text, k| {
        let phase = std::f64::consts::TAU * f64::from(k) / 200.0;
        let _ = writeln!(text, "{},{:?}", f64::from(k) * 0.05, 1.168e-3 * phase.sin());
        text
    })
}

/// The published gear's own torque as a recording.
fn recorded(dir: &WorkDir) {
    dir.write("published.toml", PUBLISHED).write("motion.csv", cycles());
    dir.succeed("predict published.toml motion.csv -o predicted.csv");
    let text = dir.read("predicted.csv").replace("torque_model_nm", "torque_nm");
    dir.write("rec.csv", text);
}

#[test]
fn a_fitted_model_predicts_its_recording() {
    let dir = WorkDir::new();
    recorded(&dir);
    let done = dir.succeed("fit rec.csv -o fitted.toml --json fit.json --seed 7");
    assert!(done.stdout.contains("Rated deflection 1.168000e-3 rad, the largest seen"), "{}", done.stdout);
    assert!(done.stdout.contains("seed 7") && done.stdout.contains("c1_nm_per_rad"), "{}", done.stdout);
    dir.succeed("predict fitted.toml rec.csv -o out.csv");
    let (was, is) = (dir.column("rec.csv", "torque_nm"), dir.column("out.csv", "torque_model_nm"));
    let worst = was.iter().zip(&is).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-6, "{worst} N·m");
    let json: serde_json::Value = serde_json::from_str(&dir.read("fit.json")).unwrap();
    assert_eq!(json["seed"], 7);
}

#[test]
fn the_same_seed_gives_the_same_files() {
    let dir = WorkDir::new();
    recorded(&dir);
    dir.succeed("fit rec.csv -o a.toml --method pso --seed 3");
    dir.succeed("fit rec.csv -o b.toml --method pso --seed 3");
    assert_eq!(dir.read("a.toml"), dir.read("b.toml"));
}

#[test]
fn a_given_model_keeps_its_gear_section_and_law() {
    let dir = WorkDir::new();
    recorded(&dir);
    let phase = PUBLISHED.replace("[memory]", "[memory]\nlaw = \"phase\"").replace("ratio = 100.0", "ratio = -51.0");
    dir.write("start.toml", phase);
    dir.succeed("fit rec.csv --model start.toml -o fitted.toml");
    let fitted = dir.read("fitted.toml");
    assert!(fitted.contains("law = \"phase\"") && fitted.contains("ratio = -51.0"), "{fitted}");
}

#[test]
fn what_cannot_be_fitted_is_refused() {
    let head = "time_s,deflection_rad,torque_nm\n";
    let dir = WorkDir::new();
    let rest = (0..50).fold(head.to_owned(), |text, k| text + &format!("{k},0.001,{k}\n"));
    dir.write("rest.csv", rest).write("motion.csv", cycles());
    dir.write("short.csv", format!("{head}0,0,0\n1,1,1\n")).write("bad.csv", format!("{head}0,0,0\n1,O.1,1\n"));
    dir.refuse("fit rest.csv -o m.toml", &["deflection is the same in every row"]);
    dir.refuse("fit short.csv -o m.toml", &["short.csv", "too few"]);
    dir.refuse("fit bad.csv -o m.toml --json f.json", &["bad.csv", "line 3", "`O.1`"]);
    dir.refuse("fit motion.csv -o m.toml", &["motion.csv", "line 1", "`torque_nm`"]);
    dir.refuse("fit missing.csv -o m.toml", &["missing.csv"]);
    recorded(&dir);
    dir.refuse("fit rec.csv -o m.toml --json ./m.toml", &["m.toml", "two outputs"]);
    assert_eq!(dir.gmhm("fit -o m.toml").status, Some(2));
    assert_eq!(dir.gmhm("fit rec.csv -o m.toml --method best").status, Some(2));
}

#[test]
fn a_real_recording_ends_with_numbers() {
    let name = "friction_damper_1Hz30lbtension1amplitude.csv";
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings").join(name);
    let Ok(text) = std::fs::read(&path) else {
        eprintln!("not run: {} is not there", path.display());
        return;
    };
    let dir = WorkDir::new();
    dir.write("damper.csv", text);
    dir.refuse("fit damper.csv -o m.toml", &["`time_s`", "--map time_s=t_s"]);
    let done = dir.succeed("fit damper.csv --map time_s=t_s,deflection_rad=disp_m,torque_nm=force_kN -o m.toml");
    assert!(done.stdout.contains("Left over"), "{}", done.stdout);
}
