//! The Dask example on synthetic joints.

use anyhow::{Context, Result};
use xshell::{Shell, cmd};

use crate::program::{self, Profile};
use crate::python::environment;

/// From the package index.
const PACKAGES: [&str; 3] = ["dask[distributed]==2026.8.0", "numpy==2.4.6", "pyarrow==26.0.1"];

/// Joints, rows and damaged recordings in every test.
pub const IN_TESTS: [u32; 3] = [20, 400, 3];

/// Runs the check of the example; with `timed` against a plain loop, with the program built in release.
pub fn run(shell: &Shell, [joints, rows, damaged]: [u32; 3], timed: bool) -> Result<()> {
    let Some(python) = environment(shell, "dask", &PACKAGES, "dask.distributed, numpy, pyarrow")? else {
        return Ok(());
    };
    let words: &[&str] = if timed { &["--loop"] } else { &[] };
    let program = program::gmhm(shell, Profile::timed(timed))?;
    let [joints, rows, damaged] = [joints, rows, damaged].map(|count| count.to_string());
    let output = cmd!(
        shell,
        "{python} examples/fleet/check.py {program} --joints {joints} --rows {rows} --damaged {damaged} {words...}"
    )
    .quiet()
    .read()
    .context("the Dask example fails")?;
    for line in output.lines() {
        println!("fleet: {line}");
    }
    Ok(())
}
