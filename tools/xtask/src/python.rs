//! Environments of Python for tests that need packages.

use std::path::PathBuf;

use anyhow::Result;
use xshell::{Shell, cmd};

/// A Python in `target/NAME` that has packages, made where it is missing; none, with words, without Python or package index.
pub fn environment(shell: &Shell, name: &str, packages: &[&str], import: &str) -> Result<Option<PathBuf>> {
    let folder = shell.current_dir().join("target").join(name);
    let python = folder.join("bin/python");
    let imports = format!("import {import}");
    if cmd!(shell, "{python} -c {imports}").quiet().ignore_stderr().run().is_ok() {
        return Ok(Some(python));
    }
    if cmd!(shell, "python3 --version").quiet().ignore_stdout().ignore_stderr().run().is_err() {
        println!("{name}: skipped: no python3");
        return Ok(None);
    }
    println!("{name}: installing {} into {}", packages.join(", "), folder.display());
    let made = cmd!(shell, "python3 -m venv {folder}").quiet().run();
    let installed = made.and_then(|()| cmd!(shell, "{python} -m pip --quiet install {packages...}").quiet().run());
    if let Err(error) = installed {
        println!("{name}: skipped: no {}: {error}", packages.join(", "));
        return Ok(None);
    }
    Ok(Some(python))
}
