//! `gmhm adapt`, and `gmhm simulate --experiment drift`.

use crate::browser::assert_works;
use crate::common::{PUBLISHED, WorkDir};
use serde_json::Value;

fn simulated(options: &str) -> WorkDir {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    dir.succeed(&format!("simulate gear.toml --experiment drift {options} -o rec.csv --key key.toml"));
    dir
}

fn adapt(dir: &WorkDir) -> Value {
    dir.succeed("adapt gear.toml rec.csv -o adapted.toml --json adapted.json");
    serde_json::from_str(&dir.read("adapted.json")).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn a_gear_that_warms_is_followed() {
    let dir = simulated("--sample-rate 200 --seed 5");
    let found = adapt(&dir);
    let (block, adapted) = (number(&found["rms"]["block"]), number(&found["rms"]["adapted"]));
    // Noise of 1 % of 30.23 N·m, white.
    let noise = 0.3023;
    let feed_forward = |rms: f64| (rms * rms - noise * noise).max(0.0).sqrt();
    assert!(feed_forward(adapted) < 0.35 * feed_forward(block), "{adapted} for {block}");
    assert!(adapted < 1.3 * noise, "{adapted}");
    assert!(!found["taken_over_s"].as_array().unwrap().is_empty());
    let warnings: Vec<&str> = found["warnings"].as_array().unwrap().iter().map(|w| w.as_str().unwrap()).collect();
    assert!(warnings.contains(&"torque scale or gear"), "{warnings:?}");
    let trace = found["trace"].as_array().unwrap();
    assert!(trace.len() > 500 && trace[0]["sd"].as_array().unwrap().len() == 5);
    assert!(number(&trace[0]["time_s"]) < number(&trace[1]["time_s"]));

    // What is in force at the end predicts the warm gear.
    let key: toml::Table = dir.read("key.toml").parse().unwrap();
    let c1 = |table: &toml::Value| table["elastic"]["c1_nm_per_rad"].as_float().unwrap();
    let warm = c1(&key["truth"]);
    assert!((warm / (0.9 * 2.4737e4) - 1.0).abs() < 1e-9);
    dir.succeed("predict adapted.toml rec.csv -o adapted.csv");
    dir.succeed("predict gear.toml rec.csv -o fixed.csv");
    let measured = dir.column("rec.csv", "torque_nm");
    let late = |file: &str| {
        let model = dir.column(file, "torque_model_nm");
        let from = model.len() * 19 / 20;
        let sum: f64 = measured[from..].iter().zip(&model[from..]).map(|(a, b)| (a - b).powi(2)).sum();
        (sum / (model.len() - from) as f64).sqrt()
    };
    assert!(late("adapted.csv") < 0.35 * late("fixed.csv"), "{} for {}", late("adapted.csv"), late("fixed.csv"));
}

#[test]
fn a_gear_of_another_nature_is_predicted_no_worse_than_by_its_block() {
    let dir = simulated("--plant maxwell-slip --sample-rate 200 --duration 200 --seed 5");
    let found = adapt(&dir);
    let (block, adapted) = (number(&found["rms"]["block"]), number(&found["rms"]["adapted"]));
    assert!(adapted <= block, "{adapted} for {block}");
    assert!(!found["taken_over_s"].as_array().unwrap().is_empty());
    let key: toml::Table = dir.read("key.toml").parse().unwrap();
    assert_eq!(key["simulation"]["plant"].as_str(), Some("maxwell-slip"));
}

#[test]
fn a_gear_that_stays_keeps_its_model() {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    dir.succeed("simulate gear.toml --experiment dynamic --rate 1 --noise torque=0.3 -o rec.csv");
    let found = adapt(&dir);
    assert_eq!(found["rms"]["block"], found["rms"]["adapted"]);
    assert_eq!(found["taken_over_s"].as_array().unwrap().len(), 0);
    assert_eq!(found["warnings"].as_array().unwrap().len(), 0);
    dir.succeed("predict adapted.toml rec.csv -o a.csv");
    dir.succeed("predict gear.toml rec.csv -o b.csv");
    assert_eq!(dir.read("a.csv"), dir.read("b.csv"));
}

#[test]
fn the_offset_of_the_torque_signal_is_told() {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    dir.succeed("simulate gear.toml --experiment dynamic --rate 1 --noise torque=0.3 -o true.csv");
    let text = dir.read("true.csv");
    let mut lines = text.lines();
    let head = lines.next().unwrap();
    let torque = head.split(',').position(|name| name == "torque_nm").unwrap();
    let off = |line: &str| {
        let mut fields: Vec<String> = line.split(',').map(str::to_string).collect();
        fields[torque] = (fields[torque].parse::<f64>().unwrap() + 1.0).to_string();
        fields.join(",")
    };
    dir.write("rec.csv", [head.to_string()].into_iter().chain(lines.map(off)).collect::<Vec<_>>().join("\n"));
    let found = adapt(&dir);
    let last = found["trace"].as_array().unwrap().last().unwrap();
    let [offset, sd] = ["torque_offset", "torque_offset_sd"].map(|name| number(&last[name]));
    assert!((offset - 1.0).abs() < 3.0 * sd && sd < 0.1, "{offset} ± {sd}");
    assert_eq!(found["taken_over_s"].as_array().unwrap().len(), 0);
    assert!(found["warnings"].as_array().unwrap().contains(&"torque offset".into()), "{}", found["warnings"]);
}

#[test]
fn terms_are_taken_off_the_torque() {
    let dir = WorkDir::new();
    let gravity = "[[term]]\nkind = \"gravity_load\"\ncos_nm = 4.0\nsin_nm = 1.0\n";
    dir.write("gear.toml", format!("{PUBLISHED}{gravity}"));
    dir.succeed("simulate gear.toml --experiment running --noise torque=0.1 -o rec.csv");
    let found = adapt(&dir);
    assert!((number(&found["rms"]["adapted"]) - 0.1).abs() < 0.01, "{}", found["rms"]);
    assert!(dir.read("adapted.toml").contains("gravity_load"));
}

#[test]
fn the_report_is_one_page() {
    let dir = simulated("--duration 60 --sample-rate 100");
    dir.succeed("adapt gear.toml rec.csv -o adapted.toml --report adapted.html");
    let page = dir.read("adapted.html");
    assert!(page.contains("Torque error one step ahead"));
    assert_works(&dir.path("adapted.html"));
}

#[test]
fn what_cannot_be_adapted_is_refused() {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    dir.write("time.toml", PUBLISHED.replace("[memory]", "[memory]\nlaw = \"time\""));
    dir.write(
        "joint.toml",
        "format = 1\nname = \"joint\"\n[[term]]\nkind = \"gravity_load\"\ncos_nm = 4.0\nsin_nm = 1.0\n",
    );
    dir.write("rec.csv", "time_s,deflection_rad,torque_nm\n0,0,0\n0.01,1e-4,2.4\n0.02,2e-4,4.8\n");
    dir.write("no-torque.csv", "time_s,deflection_rad\n0,0\n0.01,1e-4\n0.02,2e-4\n");
    dir.refuse("adapt time.toml rec.csv -o out.toml", &["law time cannot be adapted", "masing"]);
    dir.refuse("adapt joint.toml rec.csv -o out.toml", &["rated_deflection_rad"]);
    dir.refuse("adapt gear.toml no-torque.csv -o out.toml", &["torque_nm"]);
    dir.refuse("adapt gear.toml rec.csv -o out.toml --json rec.csv", &["rec.csv", "not written over"]);
    dir.succeed("adapt gear.toml rec.csv -o out.toml");
}
