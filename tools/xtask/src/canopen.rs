//! The object dictionary on a virtual CAN bus: python canopen reads the data sheet that `gmhm pack --eds` writes and speaks SDO to a simulated drive.

use std::path::PathBuf;

use anyhow::{Context, Result};
use xshell::{Shell, cmd};

const FOLDER: &str = "host-tests/examples/canopen";

/// Runs the check; says why it is skipped where Python or its packages are not to be had.
pub fn run(shell: &Shell) -> Result<()> {
    let python = match environment(shell) {
        Ok(python) => python,
        Err(why) => {
            println!("canopen: skipped: {why:#}");
            return Ok(());
        }
    };
    let folder = shell.create_temp_dir()?;
    let [eds, block] = ["drive.eds", "params.bin"].map(|name| folder.path().join(name));
    cmd!(
        shell,
        "cargo run --quiet --locked --package gmhm-tools --bin gmhm -- --quiet pack examples/bench/true_gear.toml --eds {eds} -o {block}"
    )
    .run()?;
    cmd!(shell, "cargo build --quiet --locked --package gmhm-host-tests --example canopen").run()?;
    let drive = shell.current_dir().join("target/debug/examples/canopen");
    let told = cmd!(shell, "{python} {FOLDER}/check.py {drive} {eds} {block}")
        .quiet()
        .read()
        .context("the object dictionary does not hold on a CAN bus")?;
    println!("canopen: {told}, by python canopen over a virtual bus");
    Ok(())
}

/// The Python of a virtual environment under the target folder that holds the pinned packages.
fn environment(shell: &Shell) -> Result<PathBuf> {
    let folder = shell.current_dir().join("target/canopen-venv");
    let python = folder.join("bin/python");
    if !python.exists() {
        cmd!(shell, "python3 -m venv {folder}").quiet().ignore_stdout().run().context("no python3 with venv")?;
    }
    cmd!(shell, "{python} -m pip install --quiet --disable-pip-version-check -r {FOLDER}/requirements.txt")
        .quiet()
        .run()
        .context("python canopen cannot be installed")?;
    Ok(python)
}
