//! Environments of Python for tests that need packages.

use std::path::PathBuf;

use anyhow::Result;
use xshell::{Shell, cmd};

use crate::skips::skipped;

/// A Python in `target/NAME` that has packages, made where it is missing; none, with words, without Python or package index.
pub fn environment(shell: &Shell, name: &str, packages: &[&str], import: &str) -> Result<Option<PathBuf>> {
    let folder = shell.current_dir().join("target").join(name);
    let python = folder.join("bin/python");
    let imports = format!("import {import}");
    if cmd!(shell, "{python} -c {imports}").quiet().ignore_stderr().run().is_ok() {
        return Ok(Some(python));
    }
    let what = format!("what runs in the Python environment target/{name}");
    if cmd!(shell, "python3 --version").quiet().ignore_stdout().ignore_stderr().run().is_err() {
        skipped(&what, "no python3 on the PATH");
        return Ok(None);
    }
    println!("{name}: installing {} into {}", packages.join(", "), folder.display());
    let made = cmd!(shell, "python3 -m venv {folder}").quiet().run();
    let installed = made.and_then(|()| cmd!(shell, "{python} -m pip --quiet install {packages...}").quiet().run());
    if let Err(error) = installed {
        skipped(&what, &format!("pip does not install {}: {error}", packages.join(", ")));
        return Ok(None);
    }
    Ok(Some(python))
}
