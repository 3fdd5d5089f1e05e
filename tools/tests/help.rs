//! The help texts, as people see them.

mod common;

use common::WorkDir;

#[test]
fn help_of_every_command() {
    let dir = WorkDir::new();
    insta::assert_snapshot!("gmhm", dir.succeed("--help").stdout);
    insta::assert_snapshot!("predict", dir.succeed("predict --help").stdout);
}
