//! The Python that the peers run in.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The Python of a virtual environment under the target folder that holds what a pinned requirements file beside this one asks for.
///
/// # Errors
/// No python3 with venv, or no package index.
pub fn environment(name: &str, requirements: &str) -> Result<PathBuf, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let python = folder.join("bin/python");
    let requirements = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers").join(requirements);
    let run = |command: &mut Command| {
        let out = command.output().map_err(|e| format!("{command:?}: {e}"))?;
        let message = String::from_utf8_lossy(&out.stderr).into_owned();
        if out.status.success() { Ok(()) } else { Err(format!("{command:?}: {message}")) }
    };
    if !python.exists() {
        run(Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
    }
    run(Command::new(&python).args(["-m", "pip", "install", "-q", "-r"]).arg(requirements))?;
    Ok(python)
}
