//! From a recording to the torques of an emulated drive: fit, pack, flash, reset, compare, and cut the power while it stores.

use anyhow::{Context, Result};
use xshell::{Shell, cmd};

use crate::machine::{M0, M4F};
use crate::program::{self, Profile};

/// The image of a drive at the end of a serial line.
const NODE: &str = "node";

/// What the tests run with.
pub const CUTS: u32 = 8;
pub const SEED: u64 = 1;

/// Runs the chain on the Cortex-M4F and on the Cortex-M0, with at least so many power cuts in the middle of a write.
pub fn run(shell: &Shell, cuts: u32, seed: u64) -> Result<()> {
    let gmhm = program::gmhm(shell, Profile::Dev)?;
    let chain = program::example(shell, "end_to_end")?;
    for machine in [M4F, M0] {
        println!("end to end: {} ({})", machine.core, machine.board);
        let image = machine.build(shell, NODE)?;
        let (board, cuts, seed) = (machine.board, cuts.to_string(), seed.to_string());
        cmd!(shell, "{chain} {board} {image} {gmhm} {cuts} {seed}")
            .quiet()
            .run()
            .with_context(|| format!("the chain from recording to torque broke on {board}"))?;
    }
    Ok(())
}
