//! The help texts, as people see them.

use crate::common::WorkDir;

#[test]
fn help_of_every_command() {
    let dir = WorkDir::new();
    insta::assert_snapshot!("gmhm", dir.succeed("--help").stdout);
    for command in [
        "adapt",
        "columns",
        "compare",
        "completions",
        "demo",
        "diagnose",
        "drive",
        "export",
        "fit",
        "flash",
        "health",
        "inspect",
        "invert",
        "man",
        "pack",
        "plot",
        "predict",
        "prove",
        "simulate",
        "virtual-drive",
    ] {
        insta::assert_snapshot!(command, dir.succeed(&format!("{command} --help")).stdout);
    }
}
