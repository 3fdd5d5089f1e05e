//! `gmhm compare`.

use crate::common::WorkDir;

#[test]
fn the_gear_comes_first_and_leaves_least_on_its_own_recording() {
    let dir = WorkDir::new();
    dir.succeed("demo --out demo");
    let done = dir.succeed("compare demo/recording.csv --json compared.json");
    assert!(done.stdout.contains("two lines") && done.stdout.contains("N·m"), "{}", done.stdout);
    assert!(!done.stdout.contains("paper claims"), "{}", done.stdout);
    assert!(done.stdout.contains("Unseen recording: give several"), "{}", done.stdout);
    let json: serde_json::Value = serde_json::from_str(&dir.read("compared.json")).unwrap();
    assert_eq!((json["unit"].as_str(), json["seed"].as_u64()), (Some("nm"), Some(1)));
    let models = json["models"].as_array().unwrap();
    let ratio = &json["two_lines_over_gmhm"];
    let (measured, claimed) = (ratio["measured"].as_f64().unwrap(), ratio["claimed_by_the_paper"].as_f64().unwrap());
    assert!(
        (measured - models[2]["rss"].as_f64().unwrap() / models[0]["rss"].as_f64().unwrap()).abs() < 1e-6 * measured
    );
    assert!((claimed - 4521.5 / 17.9).abs() < 1e-9);
    let rms = |name: &str| {
        let line = models.iter().find(|m| m["model"].as_str().unwrap().starts_with(name));
        line.unwrap_or_else(|| panic!("{name} in {json}"))["rms"].as_f64().unwrap()
    };
    assert!(models[0]["model"].as_str().unwrap().starts_with("GMHM"));
    assert!((0.09..0.11).contains(&rms("GMHM")));
    assert!(rms("two lines") > 10.0 * rms("GMHM") && rms("linear spring") > rms("two lines"));
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let dir = WorkDir::new();
    dir.write("bad.csv", "time_s,deflection_rad,torque_nm\n0,0,0\n1,0\n");
    dir.refuse("compare bad.csv --json c.json", &["bad.csv", "line 3", "cut off"]);
    dir.refuse("compare missing.csv", &["missing.csv"]);
    assert_eq!(dir.gmhm("compare").status, Some(2));
}
