//! `gmhm prove`: the same cases for the diagnosis of this program and, as files, for any other.

mod common;

use common::WorkDir;

/// The second case of any seed hides one effect.
const CASE: usize = 1;

#[test]
fn answers_from_files_score_as_the_same_diagnosis_from_memory() {
    let dir = WorkDir::new();
    let none = dir.path("no-recordings").display().to_string();
    let common = format!("prove --cases 2 --seed 3 --recordings {none}");
    let done = dir.succeed(&format!("{common} --json direct.json --keys direct.sha256"));
    for part in ["seed 3", "false alarms", "aims", "no real recordings at hand"] {
        assert!(done.stdout.contains(part), "{part} in {}", done.stdout);
    }

    dir.succeed(&format!("{common} --export cases"));
    let sorted = |file: &str| {
        let mut lines: Vec<String> = dir.read(file).lines().map(str::to_owned).collect();
        lines.sort();
        lines
    };
    assert_eq!(sorted("direct.sha256"), sorted("cases/keys.sha256"));

    std::fs::create_dir(dir.path("answers")).unwrap();
    let (case, answer) = (format!("cases/case_{CASE:04}"), format!("answers/case_{CASE:04}"));
    let names =
        std::fs::read_dir(dir.path(&case)).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut recordings: Vec<String> =
        names.filter(|n| n.starts_with("recording_")).map(|n| format!("{case}/{n}")).collect();
    recordings.sort();
    let recordings = recordings.join(" ");
    dir.succeed(&format!("diagnose {case}/model.toml {recordings} -o extended.toml --json {answer}.json"));
    dir.succeed(&format!("predict extended.toml {case}/unseen_1.csv -o {answer}_unseen_1.csv"));
    dir.succeed(&format!("{common} --answers answers --json files.json"));

    let report = |file: &str| -> serde_json::Value { serde_json::from_str(&dir.read(file)).unwrap() };
    let (direct, files) = (report("direct.json"), report("files.json"));
    let (direct_case, files_case) = (&direct["cases"][CASE], &files["cases"][CASE]);
    assert!(!direct_case["hidden"].as_array().unwrap().is_empty(), "{direct_case}");
    for key in ["key_sha256", "hidden", "named", "wrong_names", "class_sizes", "location_hits", "failed"] {
        assert_eq!(direct_case[key], files_case[key], "{key}");
    }
    let error = |case: &serde_json::Value| case["unseen_error_nm"].as_f64().unwrap();
    assert!((error(direct_case) - error(files_case)).abs() < 1e-6);
    // A case without an answer is one in which the detector refused.
    assert!(files["cases"][0]["failed"].as_str().unwrap().contains("case_0000.json"));
}

#[test]
fn what_cannot_be_proved_is_refused() {
    let dir = WorkDir::new();
    dir.refuse("prove --cases 1 --json nowhere/report.json", &["nowhere"]);
    assert_eq!(dir.gmhm("prove --cases 0").status, Some(2));
    assert_eq!(dir.gmhm("prove --export a --answers b").status, Some(2));
}
