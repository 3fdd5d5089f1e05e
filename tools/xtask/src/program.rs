//! The program `gmhm`, as the checks run it.

use std::path::PathBuf;

use anyhow::{Context, Result};
use xshell::{Shell, cmd};

/// How cargo builds the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// As the tests have built it: nothing is built twice.
    Dev,
    /// As people build it.
    Release,
}

impl Profile {
    /// What is timed is as people build it.
    pub fn timed(timed: bool) -> Self {
        if timed { Self::Release } else { Self::Dev }
    }

    /// What cargo calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dev => "dev",
            Self::Release => "release",
        }
    }

    /// Where its programs are in the folder that cargo builds into.
    pub fn folder(self) -> &'static str {
        match self {
            Self::Dev => "debug",
            Self::Release => "release",
        }
    }
}

/// Builds the program and says where it is. Features are those that the Python package needs, too, so that both share what they are made of; and the tests (`tools/python/Cargo.toml`).
pub fn gmhm(shell: &Shell, profile: Profile) -> Result<PathBuf> {
    let name = profile.name();
    cmd!(shell, "cargo build --quiet --locked --package gmhm-tools --package gmhm-python --bin gmhm --profile {name}")
        .quiet()
        .run()
        .context("the program gmhm does not build")?;
    Ok(target(shell).join(profile.folder()).join("gmhm"))
}

/// Builds an example of the workspace and says where it is. With the whole workspace named, what it needs is what the tests have built; one package alone has other features.
pub fn example(shell: &Shell, name: &str) -> Result<PathBuf> {
    // The example of the core is for its feature `block`.
    cmd!(shell, "cargo build --quiet --locked --workspace --features gmhm/block --example {name}")
        .quiet()
        .run()
        .with_context(|| format!("the example `{name}` does not build"))?;
    Ok(target(shell).join("debug/examples").join(name))
}

/// The folder that cargo builds into.
pub fn target(shell: &Shell) -> PathBuf {
    shell.var("CARGO_TARGET_DIR").map_or_else(|_| shell.current_dir().join("target"), Into::into)
}
