//! The program `gmhm`, as the checks run it.

use std::path::PathBuf;

use anyhow::{Context, Result};
use xshell::{Shell, cmd};

/// Builds the program and says where it is. Features are those that the Python package needs, too, so that both share what they are made of.
pub fn gmhm(shell: &Shell, release: bool) -> Result<PathBuf> {
    let (options, folder): (&[&str], _) = if release { (&["--release"], "release") } else { (&[], "debug") };
    cmd!(shell, "cargo build --quiet --locked --package gmhm-tools --package gmhm-python --bin gmhm {options...}")
        .quiet()
        .run()
        .context("the program gmhm does not build")?;
    Ok(target(shell).join(folder).join("gmhm"))
}

/// The folder that cargo builds into.
pub fn target(shell: &Shell) -> PathBuf {
    shell.var("CARGO_TARGET_DIR").map_or_else(|_| shell.current_dir().join("target"), Into::into)
}
