//! The object dictionary on a virtual CAN bus: python canopen reads the data sheet that `gmhm pack --eds` writes and speaks SDO to a simulated drive.

use anyhow::{Context, Result};
use xshell::{Shell, cmd};

use crate::program::{self, Profile};
use crate::python::environment;

const FOLDER: &str = "host-tests/examples/canopen";

/// Runs the check; says why it is skipped where Python or its packages are not to be had.
pub fn run(shell: &Shell) -> Result<()> {
    let requirements = format!("{FOLDER}/requirements.txt");
    let Some(python) = environment(shell, "canopen", &["-r", &requirements], "canopen")? else { return Ok(()) };
    let gmhm = program::gmhm(shell, Profile::Dev)?;
    let folder = shell.create_temp_dir()?;
    let [eds, block] = ["drive.eds", "params.bin"].map(|name| folder.path().join(name));
    cmd!(shell, "{gmhm} --quiet pack examples/bench/true_gear.toml --eds {eds} -o {block}").run()?;
    let drive = program::example(shell, "canopen")?;
    let output = cmd!(shell, "{python} {FOLDER}/check.py {drive} {eds} {block}")
        .quiet()
        .read()
        .context("the object dictionary does not hold on a CAN bus")?;
    println!("canopen: {output}, by python canopen over a virtual bus");
    Ok(())
}
