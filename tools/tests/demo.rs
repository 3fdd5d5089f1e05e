//! `gmhm demo`.

use crate::common::WorkDir;

/// The first number of the first line that starts so.
fn number_after(text: &str, start: &str) -> f64 {
    let line =
        text.lines().find_map(|l| l.trim_start().strip_prefix(start)).unwrap_or_else(|| panic!("{start} in {text}"));
    line.split_whitespace().find_map(|word| word.parse().ok()).unwrap()
}

#[test]
fn no_arguments_run_the_whole_chain() {
    let dir = WorkDir::new();
    let done = dir.succeed("");
    assert!(dir.files() == ["gmhm-demo"], "{:?}", dir.files());
    // The noise is 0.1 N·m; what people use instead leaves an order of magnitude more.
    let gmhm = number_after(&done.stdout, "GMHM, core in f32");
    assert!((0.09..0.11).contains(&gmhm), "{gmhm}");
    assert!(number_after(&done.stdout, "two lines") > 10.0 * gmhm);
    assert!(number_after(&done.stdout, "linear spring") > 15.0 * gmhm);
    for words in ["Table 1", "Table 2", "Table 3", "synthetic, seed 1"] {
        assert!(done.stdout.contains(words), "{words}");
    }
    dir.succeed("predict gmhm-demo/model.toml gmhm-demo/recording.csv -o predicted.csv");
    let measured = dir.column("predicted.csv", "torque_nm");
    let model = dir.column("predicted.csv", "torque_model_nm");
    let sum: f64 = measured.iter().zip(&model).map(|(a, b)| (a - b).powi(2)).sum();
    assert!((sum / measured.len() as f64).sqrt() < 0.11);
}

#[test]
fn a_seed_is_a_recording() {
    let dir = WorkDir::new();
    dir.succeed("demo --out a --seed 2");
    dir.succeed("demo --out b --seed 2");
    dir.succeed("demo --out c --seed 3");
    assert_eq!(dir.read("a/recording.csv"), dir.read("b/recording.csv"));
    assert_eq!(dir.read("a/model.toml"), dir.read("b/model.toml"));
    assert_ne!(dir.read("a/recording.csv"), dir.read("c/recording.csv"));
}

#[test]
fn a_folder_that_cannot_be_is_refused() {
    let dir = WorkDir::new();
    dir.write("taken", "");
    dir.refuse("demo --out taken", &["taken", "is a file"]);
}

#[test]
fn files_of_others_in_the_folder_that_nobody_named_are_kept() {
    let dir = WorkDir::new();
    dir.succeed("");
    let model = dir.read("gmhm-demo/model.toml");
    // A second time there is nothing to lose.
    let again = dir.succeed("");
    assert!(again.stderr.is_empty(), "{}", again.stderr);
    dir.write("gmhm-demo/model.toml", "mine").write("gmhm-demo/loop.svg", "old");
    for words in ["", "demo", "demo --seed 2"] {
        let done = dir.succeed(words);
        assert!(done.stdout.contains("Table 2"), "{}", done.stdout);
        assert!(done.stderr.contains("gmhm demo --out gmhm-demo replaces them"), "{}", done.stderr);
        assert!(!done.stdout.contains("are in gmhm-demo"), "{}", done.stdout);
        assert_eq!([dir.read("gmhm-demo/model.toml"), dir.read("gmhm-demo/loop.svg")], ["mine", "old"]);
    }
    dir.succeed("demo --out gmhm-demo");
    assert_eq!(dir.read("gmhm-demo/model.toml"), model);
}
