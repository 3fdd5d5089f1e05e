//! `gmhm prove`: the same cases for the diagnosis of this program and, as files, for any other.

use crate::common::WorkDir;

/// The second case of any seed hides one effect.
const CASE: usize = 1;

#[test]
fn answers_from_files_score_as_the_same_diagnosis_from_memory() {
    let dir = WorkDir::new();
    let none = dir.path("no-recordings").display().to_string();
    let common = format!("prove --cases 2 --seed 3 --recordings {none}");
    let done = dir.succeed(&format!("{common} --json direct.json --keys direct.sha256"));
    for part in ["2 cases of seed 3", "false alarms", "aims"] {
        assert!(done.stdout.contains(part), "{part} in {}", done.stdout);
    }

    // One number fixes every key: that of the file with their hashes.
    let fixed = gmhm_tools::prove::key::sha256(dir.read("direct.sha256").as_bytes());
    let told = done.stdout.find(&fixed).unwrap_or_else(|| panic!("{fixed} in {}", done.stdout));
    assert!(told < done.stdout.find("false alarms").unwrap(), "the keys are fixed before the diagnosis");
    assert!(done.stdout.contains("a full run, --cases 1875 with 500 nulls, takes about"), "{}", done.stdout);

    dir.succeed(&format!("{common} --export cases"));
    assert_eq!(dir.read("direct.sha256"), dir.read("cases/keys.sha256"));

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
    let unknown = dir.gmhm("prove --only nulls");
    assert!(unknown.status == Some(2) && unknown.stderr.contains("real-noise"), "{}", unknown.stderr);
    dir.refuse("prove --only real-noise --recordings nowhere", &["nowhere", "--recordings"]);
}

#[test]
fn a_joint_log_beside_a_simulation_is_exported_with_the_simulation() {
    let dir = WorkDir::new();
    dir.succeed("prove --only simulation --cases 2 --seed 7 --export cases");
    for case in ["case_100000", "case_100002"] {
        let header = dir.read(&format!("cases/{case}/recording_1.csv")).lines().next().unwrap_or_default().to_owned();
        assert!(header.contains("torque_nm") && header.contains("torque_sim_nm"), "{header}");
        let unseen = dir.read(&format!("cases/{case}/unseen_1.csv")).lines().next().unwrap_or_default().to_owned();
        assert!(!unseen.contains("torque_nm") && unseen.contains("torque_sim_nm"), "{unseen}");
        assert!(dir.read(&format!("cases/keys/{case}.toml")).contains("share = "));
    }
}

#[test]
fn blocks_can_be_proved_alone() {
    let dir = WorkDir::new();
    dir.succeed("prove --only left-out,pair --cases 4 --seed 3 --export cases");
    let mut cases: Vec<String> = std::fs::read_dir(dir.path("cases/keys"))
        .unwrap()
        .map(|entry| std::fs::read_to_string(entry.unwrap().path()).unwrap())
        .filter_map(|text| gmhm_tools::prove::key::Key::from_toml(&text).ok())
        .map(|key| key.block)
        .collect();
    cases.sort();
    assert_eq!(cases, ["left out", "left out", "pair", "pair"]);
}
