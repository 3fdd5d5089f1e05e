//! `--each`: recordings of a fleet, each by itself.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{PUBLISHED, WorkDir};
use gmhm::{Elastic, Gear, Memory, Params};
use serde_json::Value;

/// A recording of a gear of its own: a load cycle with noise.
fn recording(seed: u64, rows: u32) -> String {
    let mut chance = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = || {
        chance = chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (chance >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    };
    let c1_nm_per_rad = 2.4e4 * (1.0 + 0.1 * next());
    let elastic = Elastic { c1_nm_per_rad, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
    let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
    let gear = Gear::<f64>::new(&Params::new(1.168e-3, elastic, memory).unwrap());
    let mut state = gear.start::<16>(0.0);
    let mut text = String::from("time_s,deflection_rad,torque_nm\n");
    for k in 0..rows {
        let t = f64::from(k) * 0.01;
        let theta = 1.168e-3 * (0.02 * f64::from(k)).sin();
        let torque = gear.step(&mut state, theta).torque + 0.05 * next();
        let _ = writeln!(text, "{t:.2},{theta:?},{torque:?}");
    }
    text
}

/// A folder with so many recordings, some damaged, one missing, and the list of all.
fn fleet(count: u64, rows: u32) -> (WorkDir, BTreeSet<String>) {
    let dir = WorkDir::new();
    let mut list = String::new();
    for joint in 0..count {
        let text = match joint {
            3 => String::new(),
            5 => "time_s,deflection_rad,torque_nm\n0.0,abc,1.0\n".to_owned(),
            7 => "\u{0}\u{1}\u{2}no recording".to_owned(),
            _ => recording(joint, rows),
        };
        let name = format!("joint-{joint}.csv");
        dir.write(&name, text);
        let _ = writeln!(list, "{name}");
    }
    list.push_str("missing.csv\n");
    dir.write("list.txt", &list);
    let names = list.lines().map(str::to_owned).collect();
    (dir, names)
}

fn lines(dir: &WorkDir, name: &str) -> Vec<Value> {
    dir.read(name).lines().map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"))).collect()
}

fn names(lines: &[Value]) -> BTreeSet<String> {
    let names: BTreeSet<String> = lines.iter().map(|line| line["recording"].as_str().unwrap().to_owned()).collect();
    assert_eq!(names.len(), lines.len(), "a recording has two lines");
    names
}

#[test]
fn every_recording_has_its_line() {
    let (dir, all) = fleet(12, 400);
    let done = dir.succeed("fit --each --files-from list.txt --ndjson fits.ndjson");
    assert!(done.stdout.starts_with("9 recordings done, 4 failed\n"), "{}", done.stdout);
    let fits = lines(&dir, "fits.ndjson");
    assert_eq!(names(&fits), all);
    for line in &fits {
        let name = line["recording"].as_str().unwrap();
        let bad = ["joint-3.csv", "joint-5.csv", "joint-7.csv", "missing.csv"].contains(&name);
        assert_eq!(line["ok"], !bad, "{line}");
        if bad {
            assert!(line["error"].as_str().unwrap().contains(name), "{line}");
        } else {
            assert!(line["result"]["verdict"].is_object(), "{line}");
        }
    }
    // The same as of one recording alone, but for the comparison with other models, and the model file whole.
    dir.succeed("fit joint-4.csv -o m.toml --json fit.json");
    let alone: Value = serde_json::from_str(&dir.read("fit.json")).unwrap();
    let line = fits.iter().find(|line| line["recording"] == "joint-4.csv").unwrap();
    for key in ["parameters", "selection", "catalogue", "heldout_rms", "noise"] {
        assert_eq!(line["result"][key], alone[key], "{key}");
    }
    assert_eq!(line["result"]["model_toml"], dir.read("m.toml"));
    assert!(line["result"]["comparison"].as_array().unwrap().is_empty());

    let done = dir.succeed("fit --each --files-from list.txt --ndjson fits.ndjson --resume");
    let before = "0 recordings done, 0 failed, 9 done before, 4 failed before (--retry-failed tries them again)\n";
    assert!(done.stdout.starts_with(before), "{}", done.stdout);
    assert_eq!(lines(&dir, "fits.ndjson"), fits);
}

#[test]
fn failures_are_tried_again_when_asked() {
    let (dir, all) = fleet(9, 400);
    dir.succeed("fit --each --files-from list.txt --ndjson fits.ndjson");
    // One was repaired, and one was done only now; three stay as they are.
    dir.write("joint-3.csv", recording(3, 400));
    let text = dir.read("fits.ndjson");
    let kept: Vec<&str> = text.lines().filter(|line| !line.contains("joint-8.csv")).collect();
    dir.write("fits.ndjson", kept.join("\n") + "\n");
    let again = "fit --each --files-from list.txt --ndjson fits.ndjson --resume --retry-failed";
    let done = dir.succeed(again);
    assert!(done.stdout.starts_with("2 recordings done, 3 failed, 5 done before\n"), "{}", done.stdout);
    let fits = lines(&dir, "fits.ndjson");
    assert_eq!(names(&fits), all);
    let failed: Vec<&str> =
        fits.iter().filter(|line| line["ok"] == false).map(|line| line["recording"].as_str().unwrap()).collect();
    assert_eq!(BTreeSet::from_iter(failed), BTreeSet::from(["joint-5.csv", "joint-7.csv", "missing.csv"]));
    // Results are kept as they were, byte for byte and in their order.
    let results = |text: &str| -> Vec<String> {
        text.lines().filter(|line| line.contains("\"ok\":true")).map(str::to_owned).collect()
    };
    assert!(results(&dir.read("fits.ndjson")).starts_with(&results(&(kept.join("\n") + "\n"))));
    assert!(dir.files().iter().all(|name| !name.starts_with('.')), "{:?}", dir.files());
    // Two runs do not write to the file at once, also where it is replaced.
    let held = std::fs::File::options().append(true).open(dir.path("fits.ndjson")).unwrap();
    held.lock().unwrap();
    dir.refuse(again, &["another run writes to it"]);
    dir.misuse("fit --each joint-1.csv --ndjson x.ndjson --retry-failed", &["--resume"]);
}

#[test]
fn a_run_that_was_cut_off_goes_on() {
    let (dir, all) = fleet(8, 400);
    dir.succeed("fit --each --files-from list.txt --ndjson fits.ndjson");
    let text = dir.read("fits.ndjson");
    // In the middle of the fourth line.
    let end = text.match_indices('\n').nth(2).unwrap().0 + 100;
    dir.write("fits.ndjson", &text[..end]);
    let failed = text.lines().take(3).filter(|line| line.contains("\"ok\":false")).count();
    let done = dir.succeed("fit --each --files-from list.txt --ndjson fits.ndjson --resume");
    let before = |count: usize, what: &str| count == 0 || done.stdout.contains(&format!(", {count} {what} before"));
    assert!(before(3 - failed, "done") && before(failed, "failed"), "{}", done.stdout);
    assert_eq!(names(&lines(&dir, "fits.ndjson")), all);
}

#[test]
fn a_run_that_was_killed_goes_on() {
    let (dir, all) = fleet(24, 2000);
    let words = ["fit", "--each", "--files-from", "list.txt", "--ndjson", "fits.ndjson"];
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("gmhm"))
        .args(words)
        .current_dir(dir.path(""))
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let began = Instant::now();
    let some = || dir.path("fits.ndjson").exists() && dir.read("fits.ndjson").lines().count() >= 2;
    while !some() && began.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    dir.succeed("fit --each --files-from list.txt --ndjson fits.ndjson --resume");
    assert_eq!(names(&lines(&dir, "fits.ndjson")), all);
}

#[test]
fn shards_share_the_recordings() {
    let (dir, all) = fleet(9, 400);
    let mut together = Vec::new();
    for shard in 1..=3 {
        dir.succeed(&format!("fit --each --files-from list.txt --ndjson part-{shard}.ndjson --shard {shard}/3"));
        let part = lines(&dir, &format!("part-{shard}.ndjson"));
        assert!((3..=4).contains(&part.len()));
        together.extend(part);
    }
    assert_eq!(names(&together), all);
}

#[test]
fn diagnose_and_health_take_each_recording_too() {
    let (dir, _) = fleet(4, 400);
    dir.write("m.toml", PUBLISHED);
    dir.succeed("health --each --model m.toml --files-from list.txt --ndjson states.ndjson");
    let states = lines(&dir, "states.ndjson");
    let good = states.iter().find(|line| line["recording"] == "joint-1.csv").unwrap();
    assert_eq!((states.len(), good["result"]["conditions"].as_array().unwrap().len()), (5, 1));

    dir.succeed("diagnose --each m.toml joint-1.csv joint-3.csv --ndjson findings.ndjson");
    let findings = lines(&dir, "findings.ndjson");
    assert_eq!(names(&findings), BTreeSet::from(["joint-1.csv".to_owned(), "joint-3.csv".to_owned()]));
    let found = findings.iter().find(|line| line["ok"] == true).unwrap();
    assert!(found["result"]["mismatch"].is_boolean() && found["result"]["model_toml"].is_string(), "{found}");
}

#[test]
fn results_are_never_lost_nor_mixed() {
    let (dir, _) = fleet(2, 400);
    dir.succeed("fit --each joint-0.csv --ndjson fits.ndjson");
    let before = dir.read("fits.ndjson");
    dir.refuse("fit --each joint-1.csv --ndjson fits.ndjson", &["fits.ndjson: exists already", "--resume"]);
    dir.refuse("fit --each joint-1.csv --ndjson joint-0.csv --resume", &["joint-0.csv: line 1 is not the result"]);
    assert_eq!(dir.read("fits.ndjson"), before);

    let held = std::fs::File::options().append(true).open(dir.path("fits.ndjson")).unwrap();
    held.lock().unwrap();
    let words = "fit --each joint-1.csv --ndjson fits.ndjson --resume";
    dir.refuse(words, &["another run writes to it", "--shard"]);
    drop(held);
    dir.succeed(words);
    assert_eq!(lines(&dir, "fits.ndjson").len(), 2);

    dir.misuse("fit --each joint-1.csv", &["--ndjson"]);
    dir.misuse("fit joint-1.csv --ndjson x.ndjson -o m.toml", &["--each"]);
    dir.misuse("fit --each joint-1.csv --ndjson x.ndjson -o m.toml", &["cannot be used with"]);
    dir.misuse("fit --each joint-1.csv --ndjson x.ndjson --shard 3/2", &["I from 1 to N"]);
    dir.misuse("fit joint-1.csv", &["--output"]);
}
