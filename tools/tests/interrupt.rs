//! Ctrl-C leaves nothing half-written.

use std::fmt::Write;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::common::{PUBLISHED, WorkDir};

#[test]
fn an_interrupted_command_leaves_the_folder_as_it_was() {
    let dir = WorkDir::new();
    let rows = (0..400_000).fold("time_s,deflection_mrad\n".to_owned(), |mut text, k| {
        let _ = writeln!(text, "{k},{}", f64::from(k % 1000) * 1e-3);
        text
    });
    dir.write("m.toml", PUBLISHED).write("rec.csv", rows).write("out.csv", "before");
    let mut child = Command::new(env!("CARGO_BIN_EXE_gmhm"))
        .current_dir(dir.path("."))
        .args(["predict", "m.toml", "rec.csv", "-o", "out.csv"])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while dir.files().len() == 3 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(dir.files().len(), 4, "the command ended before it could be interrupted");
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(dir.files(), ["m.toml", "out.csv", "rec.csv"]);
    assert_eq!(dir.read("out.csv"), "before");
}
