//! `gmhm fit`.

use std::fmt::Write;

use crate::common::skips::real_recording;
use crate::common::{PUBLISHED, WorkDir};

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
    assert!(done.stdout.contains("using the largest recorded, 0.00116800 rad"), "{}", done.stdout);
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
    dir.misuse("fit rec.csv -o m.toml --json ./m.toml", &["m.toml", "two outputs"]);
    assert_eq!(dir.gmhm("fit -o m.toml").status, Some(2));
    assert_eq!(dir.gmhm("fit rec.csv -o m.toml --method best").status, Some(2));
}

#[test]
fn a_recording_is_never_written_over() {
    let dir = WorkDir::new();
    dir.succeed("demo --out demo");
    let before = dir.read("demo/recording.csv");
    dir.succeed("fit demo/recording.csv -o gear.toml");
    for command in [
        "fit demo/recording.csv -o gear.toml --json ./demo/../demo/recording.csv",
        "fit demo/recording.csv -o gear.toml --json demo/recording.csv",
        "predict gear.toml demo/recording.csv -o demo/../demo/recording.csv",
        "invert gear.toml demo/recording.csv -o demo/recording.csv",
        "compare demo/recording.csv --plot demo/recording.csv",
        "health demo/recording.csv demo/recording.csv --json demo/recording.csv",
        "diagnose gear.toml demo/recording.csv -o found.toml --json demo/recording.csv",
    ] {
        dir.refuse(command, &["recording.csv", "not written over", "another file"]);
    }
    assert_eq!(dir.read("demo/recording.csv"), before);
}

#[test]
fn what_no_gear_does_is_refused_and_the_mend_is_named() {
    let dir = WorkDir::new();
    dir.succeed("demo --out demo");
    let scaled = |factor: &str| format!("demo/recording.csv --map deflection_rad=deflection_rad*{factor}");
    let refusal = &["varies by", "which no gear does", "--map"];
    dir.refuse(&format!("fit {} -o far.toml", scaled("1e200")), refusal);
    dir.refuse(&format!("fit {} --method pso -o far.toml", scaled("1e200")), refusal);
    dir.refuse(&format!("compare {}", scaled("1e-300")), refusal);

    let mut joint = "time_s,theta_out_rad,torque_nm\n".to_owned();
    (0..200).for_each(|k| joint += &format!("{},{},{}\n", 0.01 * f64::from(k), (0.1 * f64::from(k)).sin(), k % 9));
    dir.write("joint.csv", &joint);
    for command in ["compare joint.csv", "health joint.csv demo/recording.csv", "fit joint.csv --method pso -o j.toml"]
    {
        dir.refuse(command, &["joint.csv is a joint log", "theta_in_rad"]);
    }
}

#[test]
fn recordings_that_do_not_go_together_are_told_apart() {
    let dir = WorkDir::new();
    dir.succeed("demo --out demo");
    let text = dir.read("demo/recording.csv");
    let head = text.lines().next().unwrap();
    let column = |name: &str| head.split(',').position(|n| n == name).unwrap();
    let changed = |name: &str, by: &dyn Fn(f64) -> f64| {
        let row = |line: &str| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            cells[column(name)] = by(cells[column(name)].parse().unwrap()).to_string();
            cells.join(",")
        };
        text.lines().skip(1).fold(head.to_owned() + "\n", |all, line| all + &row(line) + "\n")
    };
    type Case<'c> = (&'c str, &'c dyn Fn(f64) -> f64, &'c [&'c str]);
    let cases: [Case<'_>; 4] = [
        ("torque_nm", &|t| 1000.0 * t, &["other.csv", "torque_nm times 0.001", "--map"]),
        ("deflection_rad", &|x| -x, &["other.csv", "opposite directions", "--map"]),
        ("deflection_rad", &|_| 1e-4, &["other.csv", "the deflection is the same", "leave it out"]),
        ("torque_nm", &|_| 2.0, &["other.csv", "the torque is the same", "leave it out"]),
    ];
    for (name, by, told) in cases {
        dir.write("other.csv", changed(name, by));
        dir.refuse("fit demo/recording.csv other.csv -o both.toml", told);
    }
    dir.write("other.csv", changed("torque_nm", &|t| t + 3.0));
    dir.succeed("fit demo/recording.csv other.csv -o both.toml");
    dir.write("other.csv", changed("deflection_rad", &|x| x + 0.1));
    let told = dir.succeed("fit demo/recording.csv other.csv -o both.toml --report both.html").stdout;
    assert!(told.contains("its own deflection zero"), "{told}");
    assert!(told.contains("other.csv  0.1") || told.contains("other.csv  0.0999"), "{told}");
}

#[test]
fn lost_words_of_an_encoder_are_bridged_and_told() {
    let dir = WorkDir::new();
    dir.succeed("demo --out demo");
    let text = dir.read("demo/recording.csv");
    let column = text.lines().next().unwrap().split(',').position(|name| name == "deflection_rad").unwrap();
    let lost = |(number, line): (usize, &str)| {
        let mut cells: Vec<&str> = line.split(',').collect();
        if number % 400 == 210 {
            cells[column] = "0.0031";
        }
        cells.join(",") + "\n"
    };
    dir.write("lost.csv", text.lines().enumerate().map(lost).collect::<String>());
    let told = dir.succeed("fit lost.csv -o lost.toml --json lost.json").stderr;
    assert!(told.contains("lost.csv: deflection_rad has dropouts of at most 3 rows, 7 rows in all"), "{told}");
    dir.succeed("fit demo/recording.csv -o gear.toml --json gear.json");
    let e = |file: &str| {
        let fit: serde_json::Value = serde_json::from_str(&dir.read(file)).unwrap();
        let of = |p: &&serde_json::Value| p["name"] == "e";
        fit["parameters"].as_array().unwrap().iter().find(of).unwrap()["value"].as_f64().unwrap()
    };
    assert!((e("lost.json") / e("gear.json") - 1.0).abs() < 1e-3, "{} {}", e("lost.json"), e("gear.json"));
    for command in ["compare lost.csv", "diagnose gear.toml lost.csv -o x.toml", "health lost.csv demo/recording.csv"] {
        let told = dir.succeed(command).stderr;
        assert!(told.contains("7 rows in all"), "{command}: {told}");
    }
}

#[test]
fn a_zero_of_the_encoders_far_from_the_gears_is_found_beside_a_given_model() {
    let dir = WorkDir::new();
    dir.succeed("demo --out demo");
    dir.succeed("fit demo/recording.csv -o gear.toml --json gear.json");
    let far = "demo/recording.csv --map deflection_rad=deflection_rad+1";
    dir.succeed(&format!("fit {far} --model gear.toml -o far.toml --json far.json"));
    let rms = |file: &str| serde_json::from_str::<serde_json::Value>(&dir.read(file)).unwrap()["rms"].as_f64().unwrap();
    assert!((rms("far.json") / rms("gear.json") - 1.0).abs() < 0.01, "{} {}", rms("far.json"), rms("gear.json"));
    let far_toml: toml::Table = dir.read("far.toml").parse().unwrap();
    let zero = far_toml["gear"]["deflection_zero_rad"].as_float().unwrap();
    assert!((zero - 1.0).abs() < 1e-7, "{zero}");
    let told = dir.succeed(&format!("health demo/recording.csv {far}"));
    // The rated torque is that about the zero.
    assert!(told.stdout.contains("rated torque 30."), "{}", told.stdout);
}

#[test]
fn a_real_recording_ends_with_numbers() {
    let name = "friction_damper_1Hz30lbtension1amplitude.csv";
    let Some(path) = real_recording(name) else { return };
    let dir = WorkDir::new();
    dir.write("damper.csv", std::fs::read(path).unwrap());
    dir.refuse("fit damper.csv -o m.toml", &["`time_s`", "--map time_s=t_s"]);
    let done = dir.succeed("fit damper.csv --map time_s=t_s,deflection_rad=disp_m,torque_nm=force_kN -o m.toml");
    assert!(done.stdout.contains("Residual: "), "{}", done.stdout);
}
