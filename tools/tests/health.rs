//! `gmhm health`: catalogue figures against closed forms, changes against the truth.

use crate::common;
use std::fmt::Write;

use crate::browser::{assert_self_contained, assert_works};
use crate::common::WorkDir;
use crate::gears::{Path, cycle, published, record};
use gmhm::{Elastic, Law, Memory};
use gmhm_tools::health::catalogue::{Catalogue, Rating, catalogue};
use gmhm_tools::health::{Health, HealthOptions, of_recordings};
use gmhm_tools::model::{Model, Term, TermValue};
use gmhm_tools::recording::Recording;

const A: f64 = 1.168e-3;

fn model(elastic: Elastic, memory: Memory) -> Model {
    let mut model = Model { elastic: Some(elastic), memory: Some(memory), ..Model::default() };
    model.gear.rated_deflection_rad = Some(A);
    model
}

fn spring(c1: f64) -> Elastic {
    Elastic { c1_nm_per_rad: c1, c2_nm_per_rad3: 0.0, c3_nm_per_rad5: 0.0 }
}

fn rating(rated_torque: f64) -> Rating {
    Rating { rated_torque, t1: 0.2 * rated_torque, t2: 0.7 * rated_torque }
}

fn near(is: f64, should: f64, relative: f64, what: &str) {
    assert!((is - should).abs() <= relative * should.abs(), "{what}: {is} for {should}");
}

#[test]
fn a_spring_has_its_own_stiffness_and_no_loss() {
    let c1 = 2.0e4;
    let figures = catalogue(&model(spring(c1), Memory { alpha: 0.0, ..published().1 }), &rating(20.0)).unwrap();
    for (is, what) in [(figures.k1, "K1"), (figures.k2, "K2"), (figures.k3, "K3")] {
        near(is, c1, 1e-9, what);
    }
    assert!(figures.hysteresis_loss_rad.abs() < 1e-15);
    near(figures.lost_motion_rad, 2.0 * 0.04 * 20.0 / c1, 1e-9, "lost motion");
}

#[test]
fn a_loop_without_e_has_the_roots_of_its_parabolas() {
    // T = c1 θ ± hA(1 − u²) on the rated cycle, u = θ/A; α = hω, β = 0.
    let (c1, h) = (2.0e4, 3.0e3);
    let memory = Memory { alpha: h, beta_per_s: 0.0, omega_per_s: 1.0, ..Memory::default() };
    let rated = c1 * A;
    let figures = catalogue(&model(spring(c1), memory), &rating(rated)).unwrap();
    // Rising: −h u² + c1 u + h − T/A = 0; falling: h u² + c1 u − h − T/A = 0.
    let rising = |t: f64| A * (c1 - (c1 * c1 + 4.0 * h * (h - t / A)).sqrt()) / (2.0 * h);
    let falling = |t: f64| A * (-c1 + (c1 * c1 + 4.0 * h * (h + t / A)).sqrt()) / (2.0 * h);
    let middle = |t: f64| 0.5 * (rising(t) + falling(t));
    let (t1, t2) = (0.2 * rated, 0.7 * rated);
    near(figures.k1, t1 / middle(t1), 1e-7, "K1");
    near(figures.k2, (t2 - t1) / (middle(t2) - middle(t1)), 1e-7, "K2");
    near(figures.k3, (rated - t2) / (A - middle(t2)), 1e-7, "K3");
    near(figures.hysteresis_loss_rad, falling(0.0) - rising(0.0), 2e-7, "hysteresis loss");
    // The tips of symmetric cycles lie on the initial curve: T(a) = c1 a + 2h a(1 − a/A).
    let t = 0.04 * rated;
    let b = c1 + 2.0 * h;
    let a = A * (b - (b * b - 8.0 * h * t / A).sqrt()) / (4.0 * h);
    near(figures.lost_motion_rad, 2.0 * a, 1e-9, "lost motion");
}

#[test]
fn the_law_phase_has_the_rated_cycle_of_masing() {
    let (elastic, masing) = published();
    let figures = |law: Law| -> Catalogue {
        let model = model(elastic, Memory { law, ..masing });
        // The torque at A: the memory adds nothing there.
        catalogue(&model, &rating(elastic.c1_nm_per_rad * A + 1.0e9 * A.powi(3) - 1.1774e14 * A.powi(5))).unwrap()
    };
    let (a, b) = (figures(Law::Masing), figures(Law::Phase));
    near(b.k1, a.k1, 1e-6, "K1");
    near(b.k2, a.k2, 1e-6, "K2");
    near(b.hysteresis_loss_rad, a.hysteresis_loss_rad, 1e-6, "hysteresis loss");
}

#[test]
fn terms_of_the_deflection_take_part_and_others_are_left_out() {
    let mut windup = model(spring(2.0e4), Memory { alpha: 0.0, ..published().1 });
    let number = |name: &str, value: f64| (name.to_owned(), TermValue::Number(value));
    let shape = ("shape".to_owned(), TermValue::Text("tanh".to_owned()));
    let values = [shape, number("stiffness_drop_nm_per_rad", 5.0e3), number("width_rad", 0.2e-3)];
    windup.terms.push(Term { kind: "soft_windup".to_owned(), values: values.into() });
    let ripple = [("orders", 2.0), ("cos_nm", 1.0), ("sin_nm", 0.0)];
    let values = ripple.map(|(name, value)| (name.to_owned(), TermValue::List(vec![value])));
    windup.terms.push(Term { kind: "torque_ripple".to_owned(), values: values.into() });
    let figures = catalogue(&windup, &rating(18.0)).unwrap();
    assert!(figures.k1 < 0.9 * figures.k3 && figures.k3 < 2.0e4 * 1.01, "{figures:?}");
}

/// A gear whose c1 is this share of the published one, three cycles from rest.
fn state(share: f64, noise_nm: f64, seed: u64) -> Recording {
    let (elastic, memory) = published();
    let worn = Elastic { c1_nm_per_rad: share * elastic.c1_nm_per_rad, ..elastic };
    let path = Path { theta: cycle(A, 900, 3.0), period_s: 1e-2 };
    Recording { name: format!("state {seed}"), ..record(A, worn, memory, &path, noise_nm, seed) }
}

/// What is found with the law given.
fn followed(recordings: &[Recording]) -> Health {
    let (elastic, memory) = published();
    let options = HealthOptions { start: Some(model(elastic, memory)), ..HealthOptions::default() };
    of_recordings(recordings, &options, &()).unwrap()
}

#[test]
fn a_tenth_of_the_stiffness_is_found() {
    let recordings = [state(1.0, 0.1, 1), state(0.97, 0.1, 2), state(0.9, 0.1, 3)];
    let health = of_recordings(&recordings, &HealthOptions::default(), &()).unwrap();
    let of = |name: &str| health.changes.iter().find(|c| c.name == name).unwrap();
    let c1 = of("c1_nm_per_rad");
    assert!(c1.moved && of("K1").moved && of("hysteresis_loss_arcmin").moved, "{:#?}", health.changes);
    assert!((c1.change + 0.1 * 2.4737e4).abs() < 3.5 * c1.sd.unwrap(), "{c1:?}");
    assert!(c1.sd.unwrap() < 0.01 * 2.4737e4);
    assert!(!of("h").moved && !of("e").moved, "{:#?}", health.changes);
    assert!(health.sentence().contains("c1 fell by"), "{}", health.sentence());
    assert_eq!((health.structure.as_str(), health.widened), ("masing", 1.0));
}

#[test]
fn the_same_gear_raises_false_alarms_at_the_stated_rate() {
    let alarms = (0..100)
        .filter(|series| {
            let recordings = [0, 1, 2].map(|k| state(1.0, 0.1, 1000 + 3 * series + k));
            followed(&recordings).changes.iter().any(|c| c.moved)
        })
        .count();
    // One in a hundred is meant; six would be met once in 1900 runs.
    assert!(alarms <= 5, "{alarms} of 100");
    let health = followed(&[state(1.0, 0.1, 1), state(1.0, 0.1, 2)]);
    assert!(health.sentence().starts_with("No change beyond the uncertainty. A change"), "{}", health.sentence());
    let k2 = health.changes.iter().find(|c| c.name == "K2").unwrap();
    assert!(k2.detectable.unwrap() > 3.0 * k2.sd.unwrap());
}

#[test]
fn reported_standard_deviations_are_the_scatter_of_refits() {
    let recordings: Vec<Recording> = (0..60).map(|k| state(1.0, 0.1, 5000 + k)).collect();
    let health = followed(&recordings);
    for index in 0..health.changes.len() {
        let values: Vec<f64> = health.conditions.iter().map(|c| c.quantities[index].value).collect();
        let mean = values.iter().sum::<f64>() / 60.0;
        let scatter = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 59.0).sqrt();
        let sds: f64 = health.conditions.iter().map(|c| c.quantities[index].sd.unwrap()).sum();
        let ratio = sds / 60.0 / scatter;
        // Three standard errors of a standard deviation of 60 are 28 %.
        assert!((0.75..1.35).contains(&ratio), "{}: {ratio}", health.changes[index].name);
    }
}

#[test]
fn a_recording_that_changes_within_widens_all() {
    let changing = |seed: u64| {
        let (first, second) = (state(1.0, 0.1, seed), state(0.97, 0.1, seed + 100));
        let torque = first.torque.iter().flatten().take(450).chain(second.torque.iter().flatten().skip(450));
        Recording { torque: Some(torque.copied().collect()), ..first }
    };
    let health = followed(&[changing(1), changing(2)]);
    assert!(health.widened > 3.0, "{}", health.widened);
    assert!(health.reasons().iter().any(|r| r.contains("Halves of one recording")), "{:?}", health.reasons());
}

#[test]
fn a_stiffness_that_falls_with_the_temperature_is_regressed() {
    let recordings: Vec<Recording> = (0..8)
        .map(|k| {
            let temperature = 20.0 + 5.0 * f64::from(k);
            let mut recording = state(1.0 - 1e-3 * (temperature - 20.0), 0.1, 40 + u64::from(k as u32));
            recording.temperature_c = Some(vec![temperature; recording.len()].into());
            recording
        })
        .collect();
    let (elastic, memory) = published();
    let options = HealthOptions {
        start: Some(model(elastic, memory)),
        against: Some("temperature_c".to_owned()),
        ..HealthOptions::default()
    };
    let against = of_recordings(&recordings, &options, &()).unwrap().against.unwrap();
    let of = |name: &str| against.regressions.iter().find(|r| r.name == name).unwrap();
    let c1 = of("c1_nm_per_rad");
    assert!(c1.significant && (c1.slope + 24.737).abs() < 3.5 * c1.sd.unwrap(), "{c1:?}");
    assert!(!of("h").significant, "{:?}", of("h"));
}

fn csv(recording: &Recording) -> String {
    let (theta, torque) = (recording.deflection_rad.as_ref().unwrap(), recording.torque.as_ref().unwrap());
    let mut text = "time_s,deflection_rad,torque_nm\n".to_owned();
    for (row, time) in recording.time_s.iter().enumerate() {
        let _ = writeln!(text, "{time:?},{:?},{:?}", theta[row], torque[row]);
    }
    text
}

#[test]
fn the_command_reports_recordings_and_fits() {
    let dir = WorkDir::new();
    for (name, share, seed) in [("a", 1.0, 1), ("b", 1.0, 2), ("c", 0.9, 3)] {
        dir.write(&format!("{name}.csv"), csv(&state(share, 0.1, seed)));
    }
    let done = dir.succeed("health a.csv b.csv c.csv --json health.json --report health.html");
    assert!(done.stdout.starts_with("From a.csv to c.csv: c1 fell by"), "{}", done.stdout);
    assert_works(&dir.path("health.html"));
    let html = dir.read("health.html");
    for part in ["c1 fell by", "K1 in N·m/rad", "lost motion in arcmin", "SHA-256", "± 4 % of the rated torque"] {
        assert!(html.contains(part), "{part}");
    }
    let json: serde_json::Value = serde_json::from_str(&dir.read("health.json")).unwrap();
    assert_eq!((json["unit"].as_str(), json["conditions"].as_array().map(Vec::len)), (Some("nm"), Some(3)));

    dir.succeed("health a.csv b.csv --json same.json");
    let done = dir.succeed("health a.csv b.csv");
    assert!(done.stdout.starts_with("No change beyond the uncertainty"), "{}", done.stdout);

    let done = dir.succeed("health a.csv c.csv --own-zeros");
    assert!(done.stdout.starts_with("From a.csv to c.csv: c1 fell by"), "{}", done.stdout);

    dir.write("start.toml", common::PUBLISHED);
    dir.succeed("fit a.csv --model start.toml -o a.toml --json a.json");
    dir.succeed("fit c.csv --model start.toml -o c.toml --json c.json");
    let done = dir.succeed("health --models a.toml c.toml");
    assert!(done.stdout.contains("c1 fell by"), "{}", done.stdout);
    std::fs::remove_file(dir.path("c.json")).unwrap();
    let done = dir.succeed("health --models a.toml c.toml");
    assert!(done.stdout.contains("without standard deviations"), "{}", done.stdout);
    dir.write("service.csv", "gear,hours\na,0\nb.csv,100\nc,1000\n");
    let done = dir.succeed("health a.csv b.csv c.csv --against service.csv:hours --report against.html");
    assert!(done.stdout.contains("hours"), "{}", done.stdout);
    assert_self_contained(&dir.read("against.html"));
}

#[test]
fn one_recording_has_catalogue_figures() {
    let dir = WorkDir::new();
    dir.write("a.csv", csv(&state(1.0, 0.1, 1)));
    let text = dir.succeed("health a.csv --json a.json --report a.html").stdout;
    for part in ["a.csv: K1 ", "K3", "hysteresis loss", "lost motion", "± two standard deviations", "a.json"] {
        assert!(text.contains(part), "{text}\nshould say {part}");
    }
    let found: serde_json::Value = serde_json::from_str(&dir.read("a.json")).unwrap();
    assert!(found["changes"].as_array().unwrap().is_empty());
    assert_self_contained(&dir.read("a.html"));
    dir.succeed("fit a.csv -o gear.toml --json fit.json");
    let fit: serde_json::Value = serde_json::from_str(&dir.read("fit.json")).unwrap();
    let figures = fit["catalogue"]["quantities"].as_array().unwrap();
    assert!(figures.iter().any(|figure| figure["name"] == "K2" && figure["value"].as_f64().unwrap() > 0.0));
}

#[test]
fn what_does_not_compare_is_refused() {
    let dir = WorkDir::new();
    dir.write("a.csv", csv(&state(1.0, 0.1, 1))).write("b.csv", csv(&state(1.0, 0.1, 2)));
    dir.write("a.toml", common::PUBLISHED);
    dir.write("time.toml", common::PUBLISHED.replace("[memory]", "[memory]\nlaw = \"phase\""));
    dir.write("smaller.toml", common::PUBLISHED.replace("1.168e-3", "1.1e-3"));
    dir.write("broken.toml", common::PUBLISHED).write("broken.json", "{}");
    dir.write("service.csv", "gear,hours\na,0\n").write("words.csv", "gear,hours\na,0\nb,new\n");
    dir.refuse("health --models a.toml time.toml", &["time.toml", "law, kernel or gate"]);
    dir.refuse("health --models a.toml smaller.toml", &["smaller.toml", "rated deflection"]);
    dir.refuse("health --models a.toml broken.toml", &["broken.json", "gmhm fit --json"]);
    dir.refuse("health a.csv b.csv --against temperature_c", &["a.csv", "no such column"]);
    dir.refuse("health a.csv b.csv --against age", &["age", "temperature_c", "TABLE.csv:COLUMN"]);
    dir.refuse("health a.csv b.csv --against service.csv:hours", &["no row for b.csv"]);
    dir.refuse("health a.csv b.csv --against words.csv:hours", &["words.csv, line 3", "not a number"]);
    dir.refuse("health a.csv b.csv --rated-torque 300", &["300", "beyond", "--rated-torque"]);
    dir.refuse("health a.csv b.csv --t1 20 --t2 10", &["20 < 10", "--t1"]);
    assert_eq!(dir.gmhm("health").status, Some(2));
    assert_eq!(dir.gmhm("health a.csv --models a.toml").status, Some(2));
}
