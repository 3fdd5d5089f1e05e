//! Whether the core's interface breaks what the last version promised.

use anyhow::{Context, Result};
use xshell::{Shell, cmd};

use crate::skips::skipped;

const WHAT: &str = "the core's interface beside its last version";

/// Compares the core with the last tagged version; says why it is skipped.
pub fn run(shell: &Shell) -> Result<()> {
    let tag = cmd!(shell, "git describe --tags --abbrev=0 --match v*").quiet().ignore_stderr().read();
    let Ok(tag) = tag else {
        skipped(WHAT, "no version is tagged yet, so there is nothing to compare with");
        return Ok(());
    };
    if cmd!(shell, "cargo semver-checks --version").quiet().ignore_stdout().ignore_stderr().run().is_err() {
        skipped(WHAT, "no cargo-semver-checks: cargo install cargo-semver-checks --locked");
        return Ok(());
    }
    cmd!(shell, "cargo semver-checks --package gmhm --features full --baseline-rev {tag}")
        .run()
        .with_context(|| format!("the core breaks what {tag} promised: raise the version, or keep the interface"))
}
