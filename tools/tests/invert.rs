//! `gmhm invert`.

use crate::common::{PUBLISHED, WorkDir};

/// A seeded walk over torques, with holds and reversals.
fn torques(rows: usize, largest: f64) -> Vec<f64> {
    (0..rows)
        .map(|k| {
            let t = k as f64;
            let wave = (0.05 * t).sin() + 0.5 * (0.31 * t + 1.0).sin() + 0.2 * (1.7 * t).sin();
            largest * wave / 1.7 * if k % 7 == 0 { 0.9 } else { 1.0 }
        })
        .collect()
}

fn csv(torques: &[f64]) -> String {
    let rows = torques.iter().enumerate().map(|(k, torque)| format!("{},{torque:?}\n", 0.01 * k as f64));
    "time_s,torque_nm\n".to_owned() + &rows.collect::<String>()
}

/// Inverts, predicts, and returns the largest difference.
fn round_trip(dir: &WorkDir, model: &str, asked: &[f64]) -> f64 {
    dir.write("m.toml", model).write("torque.csv", csv(asked));
    dir.succeed("invert m.toml torque.csv -o out.csv");
    dir.succeed("predict m.toml out.csv -o check.csv");
    let found = dir.column("check.csv", "torque_model_nm");
    assert_eq!(found.len(), asked.len());
    found.iter().zip(asked).map(|(found, asked)| (found - asked).abs()).fold(0.0, f64::max)
}

fn with(law: &str, more: &str) -> String {
    PUBLISHED.replace("[memory]", &format!("[memory]\n{law}")) + more
}

#[test]
fn predict_gives_the_torque_back_under_every_law() {
    let dir = WorkDir::new();
    for (law, largest) in [
        ("law = \"masing\"", 29.0),
        ("law = \"masing\"\nreversal_play_rad = 2e-5", 28.0),
        ("law = \"phase\"", 18.0),
        ("law = \"phase\"\ngate = \"none\"", 17.0),
        ("law = \"time\"", 28.0),
        ("law = \"time\"\ngate = \"none\"", 20.0),
    ] {
        let error = round_trip(&dir, &with(law, ""), &torques(800, largest));
        println!("{law:?}: {error:e}");
        assert!(error < 1e-9, "{law}: {error:e} N·m");
        assert!(dir.column("out.csv", "saturated").iter().all(|&saturated| saturated == 0.0));
    }
}

#[test]
fn zero_and_rated_deflection_of_the_encoders_are_kept() {
    let dir = WorkDir::new();
    let shifted = PUBLISHED.replace("[elastic]", "deflection_zero_rad = 0.0007\n[elastic]");
    assert!(round_trip(&dir, &shifted, &torques(100, 25.0)) < 1e-9);
    let shifted = dir.column("out.csv", "deflection_rad");
    round_trip(&dir, PUBLISHED, &torques(100, 25.0));
    let plain = dir.column("out.csv", "deflection_rad");
    assert!(shifted.iter().zip(&plain).all(|(a, b)| (a - b - 0.0007).abs() < 1e-15));
    let header = "time_s,torque_nm,deflection_rad,saturated";
    assert_eq!(dir.read("out.csv").lines().next(), Some(header));
}

#[test]
fn terms_of_the_deflection_and_the_time_take_part() {
    let dir = WorkDir::new();
    for term in [
        "kind = \"soft_windup\"\nshape = \"tanh\"\nstiffness_drop_nm_per_rad = 6000.0\nwidth_rad = 3e-4",
        "kind = \"stiffness_asymmetry\"\nshape = \"square\"\nstiffness_nm_per_rad2 = 1e6",
        "kind = \"nonlocal_memory\"\nradius_rad = [1e-4, 4e-4]\ntorque_nm = [0.5, 0.8]",
        "kind = \"creep\"\ntau_s = [1.0]\nstiffness_nm_per_rad = [800.0]",
        "kind = \"wear\"\nshape = \"ramp\"\nstiffness_drop_nm_per_rad = 900.0\nstart_s = 1.0\nduration_s = 2.0",
    ] {
        let error = round_trip(&dir, &with("law = \"masing\"", &format!("[[term]]\n{term}\n")), &torques(300, 20.0));
        println!("{term:?}: {error:e}");
        assert!(error < 1e-9, "{term}: {error:e} N·m");
    }
}

#[test]
fn torques_beyond_the_range_are_held_at_its_edge_and_said() {
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED).write("torque.csv", "torque_nm\n0\n40\n10\n-50\n0\n");
    let done = dir.succeed("invert m.toml torque.csv -o out.csv");
    assert!(done.stderr.contains("2 of 5 torques lie beyond"), "{}", done.stderr);
    assert!(done.stderr.contains("±0.001168 rad"), "{}", done.stderr);
    assert_eq!(dir.column("out.csv", "saturated"), [0.0, 1.0, 0.0, 1.0, 0.0]);
    let theta = dir.column("out.csv", "deflection_rad");
    assert_eq!((theta[1], theta[3]), (1.168e-3, -1.168e-3));
    assert_eq!(dir.succeed("invert m.toml torque.csv -o out.csv -q").stderr, "");
}

#[test]
fn what_cannot_be_inverted_is_refused_with_the_reason() {
    let dir = WorkDir::new();
    let torque = "time_s,torque_nm\n0,0\n1,5\n2,1\n";
    dir.write("torque.csv", torque).write("current.csv", torque.replace("torque_nm", "current_a"));
    dir.write("untimed.csv", "torque_nm\n0\n5\n").write("none.csv", "time_s,deflection_rad\n0,0\n1,0\n");
    dir.write("bad.csv", "torque_nm\n0\nnan\n");
    let term = |term: &str| with("law = \"masing\"", &format!("[[term]]\n{term}\n"));
    let joint = "format = 1\n[[term]]\nkind = \"inertia\"\ninertia_kgm2 = 1.0\n".to_owned();
    let models: [(String, &str, &[&str]); 9] = [
        (
            term("kind = \"torque_ripple\"\norders = [2]\ncos_nm = [0.1]\nsin_nm = [0.0]"),
            "torque.csv",
            &["`torque_ripple`", "remove the term"],
        ),
        (term("kind = \"viscous_damping\"\ndamping_nms_per_rad = 1.0"), "torque.csv", &["`viscous_damping`"]),
        (joint, "torque.csv", &["no gear"]),
        (
            PUBLISHED.replace("rated_deflection_rad = 1.168e-3\n", ""),
            "torque.csv",
            &["rated_deflection_rad", "--rated-deflection"],
        ),
        (PUBLISHED.replace("alpha = 2.6532e6", "alpha = 2.6532e7"), "torque.csv", &["no inverse", "alpha"]),
        (PUBLISHED.to_owned(), "current.csv", &["current_a", "newton-metre", "--map"]),
        (PUBLISHED.to_owned(), "none.csv", &["torque_nm"]),
        (PUBLISHED.to_owned(), "bad.csv", &["line 3", "`NaN`"]),
        (with("law = \"time\"", ""), "untimed.csv", &["`time_s`"]),
    ];
    for (model, file, parts) in models {
        dir.write("m.toml", model);
        dir.refuse(&format!("invert m.toml {file} -o out.csv"), parts);
    } // It is the inverse that needs a range, not the model.
    dir.write("m.toml", PUBLISHED.replace("alpha = 2.6532e6", "alpha = 2.6532e7"));
    dir.write("path.csv", "time_s,deflection_rad\n0,0\n1,0.0005\n2,-0.0005\n")
        .succeed("predict m.toml path.csv -o out.csv");
}
