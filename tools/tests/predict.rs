//! `gmhm predict`.

use crate::common::{PUBLISHED, WorkDir};
use crate::gears::walk;
use gmhm_tools::model::parse;
use gmhm_tools::physics::predict;
use gmhm_tools::recording::Recording;

const A: f64 = 1.168e-3;
const LOOP: &str = "time_s,deflection_rad\n0,0\n1,1.168e-3\n2,0.5e-3\n3,0\n4,-0.5e-3\n5,-1.168e-3\n6,0\n";

fn elastic(x: f64) -> f64 {
    2.4737e4 * x + 1.0e9 * x.powi(3) - 1.1774e14 * x.powi(5)
}

/// The steady cycle of MODEL.md section 3, written out by hand: z = −e·θ·g ± hA(1 − θ²/A²).
fn hysteresis(x: f64, direction: f64) -> f64 {
    let (alpha, beta, omega) = (2.6532e6, 422.68, 226.31);
    let squares = beta * beta + omega * omega;
    let (e, h) = (alpha * beta / squares, alpha * omega / squares);
    let u = x / A;
    -e * x * ((1.0 - u) * (1.0 + u)).sqrt() + direction * h * A * (1.0 - u) * (1.0 + u)
}

#[test]
fn the_published_loop_comes_out() {
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED).write("rec.csv", LOOP);
    dir.succeed("predict m.toml rec.csv -o out.csv");
    let header = "time_s,deflection_rad,torque_model_nm,elastic_nm,hysteresis_nm";
    assert_eq!(dir.read("out.csv").lines().next(), Some(header));
    let path = [(A, 1.0), (0.5e-3, -1.0), (0.0, -1.0), (-0.5e-3, -1.0), (-A, -1.0), (0.0, 1.0)];
    let f = dir.column("out.csv", "elastic_nm");
    let z = dir.column("out.csv", "hysteresis_nm");
    let t = dir.column("out.csv", "torque_model_nm");
    assert_eq!((f[0], z[0], t[0]), (0.0, 0.0, 0.0));
    for (row, (x, direction)) in path.into_iter().enumerate().map(|(i, p)| (i + 1, p)) {
        let rated = elastic(A);
        assert!((f[row] - elastic(x)).abs() < 1e-12 * rated, "row {row}: {} for {}", f[row], elastic(x));
        assert!((z[row] - hysteresis(x, direction)).abs() < 1e-9 * rated, "row {row}: {}", z[row]);
        assert_eq!(t[row], f[row] + z[row]);
    }
}

#[test]
fn published_signs_give_the_same_torque() {
    let dir = WorkDir::new();
    let signs = PUBLISHED.replace("422.68", "-422.68").replace("226.31", "-226.31");
    dir.write("m.toml", PUBLISHED).write("signs.toml", signs).write("rec.csv", LOOP);
    dir.succeed("predict m.toml rec.csv -o a.csv");
    dir.succeed("predict signs.toml rec.csv -o b.csv");
    assert_eq!(dir.read("a.csv"), dir.read("b.csv"));
}

#[test]
fn deflection_comes_from_angles_and_the_zero_is_subtracted_first() {
    let dir = WorkDir::new();
    let angles = "time_s,theta_in_rad,theta_out_rad\n0,0,-0.001\n1,0.2,0.001\n2,0,-0.0015\n";
    let same = "time_s,deflection_rad\n0,0.001\n1,0.001\n2,0.0015\n";
    let zero = PUBLISHED.replace("[elastic]", "deflection_zero_rad = 0.0007\n[elastic]");
    dir.write("m.toml", &zero).write("angles.csv", angles).write("same.csv", same);
    dir.write("plain.toml", PUBLISHED).write("shifted.csv", same);
    dir.succeed("predict m.toml angles.csv -o a.csv");
    dir.succeed("predict m.toml same.csv -o b.csv");
    dir.succeed("predict plain.toml same.csv --map deflection_rad=deflection_rad-0.0007 -o c.csv");
    assert_eq!(dir.column("a.csv", "torque_model_nm"), dir.column("b.csv", "torque_model_nm"));
    assert_eq!(dir.column("b.csv", "torque_model_nm"), dir.column("c.csv", "torque_model_nm"));
    assert!((dir.column("a.csv", "elastic_nm")[0] - elastic(0.0003)).abs() < 1e-9);
}

#[test]
fn rows_are_kept_as_they_stand_and_torque_is_never_read() {
    let dir = WorkDir::new();
    let rec = "torque_nm,time_s,note,deflection_mrad\nNaN,0.10,\"a, b\",0\n,1e0,,1.0\n";
    dir.write("m.toml", PUBLISHED).write("rec.csv", rec);
    dir.succeed("predict m.toml rec.csv -o out.csv");
    let out = dir.read("out.csv");
    let lines: Vec<&str> = out.lines().collect();
    assert!(lines[1].starts_with("NaN,0.10,\"a, b\",0,0.0,"), "{out}");
    assert!(lines[2].starts_with(",1e0,,1.0,"), "{out}");
}

#[test]
fn a_model_per_ampere_says_so() {
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED.replace("_nm_per", "_a_per")).write("rec.csv", LOOP);
    dir.succeed("predict m.toml rec.csv -o out.csv");
    assert!(dir.read("out.csv").starts_with("time_s,deflection_rad,torque_model_a,elastic_a,hysteresis_a\n"));
}

#[test]
fn outside_the_rated_deflection_is_said() {
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED).write("rec.csv", LOOP);
    let done = dir.succeed("predict m.toml rec.csv -o out.csv --rated-deflection 1e-3");
    assert!(done.stderr.contains("2 of 7 rows lie outside the rated deflection"), "{}", done.stderr);
    let quiet = dir.succeed("predict m.toml rec.csv -o out.csv --rated-deflection 1e-3 -q");
    assert_eq!(quiet.stderr, "");
    let unrated = PUBLISHED.replace("rated_deflection_rad = 1.168e-3\n", "");
    dir.write("unrated.toml", unrated);
    dir.succeed("predict unrated.toml rec.csv -o largest.csv");
    dir.succeed("predict m.toml rec.csv -o out.csv");
    assert_eq!(dir.read("largest.csv"), dir.read("out.csv"));
}

#[test]
fn law_time_follows_the_time_stamps() {
    let dir = WorkDir::new();
    let time = PUBLISHED.replace("[memory]", "[memory]\nlaw = \"time\"\nkernel = \"rate\"\ngate = \"none\"");
    let time = time.replace("422.68", "2.0").replace("2.6532e6", "1000");
    dir.write("m.toml", time).write("rec.csv", "time_s,deflection_rad\n0,0\n0.5,0.001\n1.75,0.001\n");
    dir.succeed("predict m.toml rec.csv -o out.csv");
    let z = dir.column("out.csv", "hysteresis_nm");
    // A ramp over 0.5 s, then a rest of 1.25 s: m = αΔθ(1 − e^(−βΔ))/(βΔ), then m·e^(−β·1.25).
    let ramp = 1000.0 * 0.001 * (1.0 - f64::exp(-1.0)) / 1.0;
    assert!((z[1] - ramp).abs() < 1e-12 && (z[2] - ramp * f64::exp(-2.5)).abs() < 1e-12, "{z:?}");
}

#[test]
fn malformed_recordings_are_refused_at_their_place() {
    let head = "time_s,deflection_rad,torque_nm\n";
    let cases: [(String, &[&str]); 21] = [
        (String::new(), &["is empty"]),
        (head.into(), &["no row"]),
        (format!("{head}0,0,0\n"), &["a single row"]),
        ("0,0,0\n1,1,1\n".into(), &["line 1", "header"]),
        ("time_s,torque_nm\n0,0\n1,0\n".into(), &["line 1", "`deflection_rad`", "`torque_nm`", "--map"]),
        ("t,deflection_rad\n0,0\n1,0\n".into(), &["`time_s`", "--map time_s=t"]),
        (format!("{head}0,0,0\n1,x1,0\n"), &["line 3", "column 2 `deflection_rad`", "`x1` is not a number"]),
        (format!("{head}ms,rad,Nm\n0,0,0\n1,0,0\n"), &["line 1", "column 1 `time_s`", "says s, the unit beside it ms"]),
        (format!("{head}0,0,0\n1,,0\n"), &["line 3", "`deflection_rad`", "empty"]),
        (format!("{head}0,nan,0\n1,0,0\n"), &["line 2", "`deflection_rad`", "`NaN`"]),
        (format!("{head}0,inf,0\n1,0,0\n"), &["line 2", "`inf`"]),
        (format!("{head}0,0,0\n1,0,0\n0.9,0,0\n"), &["line 4", "`time_s`", "decreases: 0.9 s after 1 s"]),
        (format!("{head}0,0,0\n1,0,0\n1,0,0\n"), &["line 4", "`time_s`", "does not increase"]),
        (format!("{head}0,0,0\n1,0,0\n2,0.1"), &["line 4", "cut off", "2 of 3"]),
        (format!("{head}0,0,0\n1,0\n2,0,0\n"), &["line 3", "2 of 3"]),
        (format!("{head}0,0,0\n1,0,0,0\n"), &["line 3", "4 fields"]),
        ("time_s,deflection_furlong\n0,0\n1,0\n".into(), &["line 1", "column 2", "`_furlong`", "_mrad", "_arcmin"]),
        ("time_d,deflection_rad\n0,0\n1,0\n".into(), &["line 1", "column 1", "`_d`", "_ms"]),
        ("time_s,deflection_rad,deflection_rad\n0,0,0\n".into(), &["line 1", "column 3", "twice"]),
        ("time_s;deflection_rad\n0;0,1\n1;0.2\n".into(), &["line 3", "decimal mark", "line 2"]),
        (format!("{head}0,1e300,0\n1,1e301,0\n"), &["row 1", "absurd"]),
    ];
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED);
    for (text, parts) in cases {
        dir.write("rec.csv", text);
        dir.refuse("predict m.toml rec.csv -o out.csv", &[parts, &["rec.csv"]].concat());
    }
    dir.write("rec.csv", "time_s,theta_in_rad,theta_out_rad\n0,0,0\n1,0,0\n");
    dir.write("noratio.toml", PUBLISHED.replace("ratio = 100.0\n", ""));
    dir.refuse("predict noratio.toml rec.csv -o out.csv", &["rec.csv", "no ratio", "`ratio`"]);
    dir.write("rec.csv", b"\xff\xfet\0i\0m\0e\0");
    dir.refuse("predict m.toml rec.csv -o out.csv", &["UTF-16", "UTF-8"]);
    dir.refuse("predict m.toml missing.csv -o out.csv", &["missing.csv"]);
}

#[test]
fn malformed_models_are_refused_at_their_place() {
    let swap = |from: &str, to: &str| PUBLISHED.replace(from, to);
    let cases: [(String, &[&str]); 14] = [
        (String::new(), &["format = 1"]),
        (swap("format = 1", "format = 7"), &["line 1", "format 7"]),
        (swap("1.168e-3", "1,168e-3"), &["line 5"]),
        (swap("[elastic]", "[elastics]"), &["line 6", "did you mean `elastic`"]),
        (swap("alpha", "alhpa"), &["line 11", "[memory] alhpa", "did you mean `alpha`"]),
        (swap("2.4737e4", "nan"), &["line 7", "c1_nm_per_rad", "finite"]),
        (swap("2.4737e4", "\"big\""), &["line 7", "c1_nm_per_rad", "a number, not a text"]),
        (swap("1.168e-3", "0"), &["line 5", "rated_deflection_rad"]),
        (swap("2.6532e6", "-2.6532e6"), &["line 11", "alpha"]),
        (swap("alpha = 2.6532e6\n", ""), &["line 10", "`alpha` is missing"]),
        (swap("[memory]", "[memory]\nkernel = \"rate\""), &["line 11", "kernel"]),
        (swap("[memory]", "[memory]\nlaw = \"mazing\""), &["line 11", "\"mazing\"", "\"masing\""]),
        (PUBLISHED[..PUBLISHED.find("[memory]").unwrap()].to_owned(), &["[memory]", "missing"]),
        ("format = 1\n".into(), &["predicts nothing"]),
    ];
    let dir = WorkDir::new();
    dir.write("rec.csv", LOOP);
    for (text, parts) in cases {
        dir.write("m.toml", text);
        dir.refuse("predict m.toml rec.csv -o out.csv", parts);
    }
    dir.refuse("predict missing.toml rec.csv -o out.csv", &["missing.toml"]);
}

#[test]
fn outputs_that_cannot_appear_are_refused() {
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED).write("rec.csv", LOOP);
    dir.refuse("predict m.toml rec.csv -o no/such/out.csv", &["no/such", "create the folder"]);
    dir.refuse("predict m.toml rec.csv -o .", &["folder"]);
}

#[test]
fn wrong_usage_is_status_2() {
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED).write("rec.csv", LOOP);
    for words in [
        "predict m.toml rec.csv",
        "predict m.toml rec.csv -o out.csv --map zeit=t",
        "predict m.toml rec.csv -o out.csv --map time_s=t,time_ms=u",
        "predict m.toml rec.csv -o out.csv --rated-deflection 0",
        "predikt",
    ] {
        let done = dir.gmhm(words);
        assert_eq!(done.status, Some(2), "gmhm {words}\n{}", done.stderr);
        assert_eq!(dir.files(), ["m.toml", "rec.csv"]);
    }
}

/// Gear and slip elements remember turning points.
#[test]
fn a_stretch_with_its_past_is_predicted_as_the_whole_is() {
    let terms = "[[term]]\nkind = \"nonlocal_memory\"\nradius_rad = [1e-4, 6e-4]\ntorque_nm = [1.0, 3.0]\n";
    let model = parse("m.toml", &(PUBLISHED.to_owned() + terms)).unwrap();
    let deflection_rad = walk(A, 20_000, 5);
    let whole = Recording {
        time_s: (0..deflection_rad.len()).map(|k| 1e-3 * k as f64).collect(),
        deflection_rad: Some(deflection_rad.into()),
        ..Recording::default()
    };
    let of_whole = predict(&model, None, &whole).unwrap();
    for start in [0, 1, 4321, 15_000] {
        let rows = start..start + 5000;
        let difference = |stretch: &Recording| {
            let torque = predict(&model, None, stretch).unwrap().torque;
            let apart = torque.iter().zip(&of_whole.torque[rows.clone()]).map(|(a, b)| (a - b).abs());
            apart.fold(0.0, f64::max)
        };
        let with_past = difference(&whole.part_with_past(rows.clone()));
        assert!(with_past < 1e-9, "from row {start}: {with_past} N·m");
        assert!(start < 2 || difference(&whole.part(rows.clone())) > 0.5, "from row {start}");
    }
}
