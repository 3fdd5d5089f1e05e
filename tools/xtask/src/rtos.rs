//! The examples beside an operating system: built for a Cortex-M3 and run in the emulator.

use anyhow::{Context, Result};
use xshell::{Shell, cmd};

/// A package of its own.
const FOLDER: &str = "examples/rtos";

/// Its programs.
const PROGRAMS: [&str; 3] = ["rtic", "embassy", "interrupt"];

/// Builds and runs each.
pub fn run(shell: &Shell) -> Result<()> {
    let _inside = shell.push_dir(FOLDER);
    for program in PROGRAMS {
        let output = cmd!(shell, "cargo run --quiet --locked --release --bin {program}")
            .quiet()
            .ignore_stderr()
            .read()
            .with_context(|| format!("the example `{program}` of {FOLDER} does not build, or fails in the emulator"))?;
        println!("rtos: {output}");
    }
    Ok(())
}
