//! The machines that the images run on, and how an image is built for one.

use std::path::PathBuf;

use anyhow::{Context, Result};
use xshell::{Shell, cmd};

use crate::program;

/// A board that the emulator knows.
#[derive(Debug, Clone, Copy)]
pub struct Machine {
    /// The core, as its maker calls it.
    pub core: &'static str,
    /// The emulator's name of the board.
    pub board: &'static str,
    /// What the compiler calls it.
    pub target: &'static str,
    /// Instructions a second under `-icount shift=0`, over the frequency of the core clock.
    pub instructions_per_tick: f64,
}

/// Cortex-M0, nRF51: 16 MHz, 16 KiB of RAM.
pub const M0: Machine = machine("Cortex-M0", "microbit", "thumbv6m-none-eabi", 62.5);
/// Cortex-M3.
pub const M3: Machine = machine("Cortex-M3", "mps2-an385", "thumbv7m-none-eabi", 40.0);
/// Cortex-M4F.
pub const M4F: Machine = machine("Cortex-M4F", "mps2-an386", "thumbv7em-none-eabihf", 40.0);

/// Every machine.
pub const ALL: [Machine; 5] = [
    M0,
    M3,
    M4F,
    machine("Cortex-M7", "mps2-an500", "thumbv7em-none-eabihf", 40.0),
    machine("Cortex-M33", "mps2-an505", "thumbv8m.main-none-eabihf", 50.0),
];

const fn machine(core: &'static str, board: &'static str, target: &'static str, instructions_per_tick: f64) -> Machine {
    Machine { core, board, target, instructions_per_tick }
}

impl Machine {
    /// Whether it computes floats in hardware.
    pub fn has_floats(&self) -> bool {
        self.target.ends_with("hf")
    }

    /// The machine that runs what was built for a target.
    pub fn of_target(target: &str) -> Option<Self> {
        // The Cortex-M4F comes before the M7, which shares its target.
        ALL.into_iter().find(|machine| machine.target == target)
    }

    /// Builds an image for this machine and names its file.
    pub fn build(&self, shell: &Shell, image: &str) -> Result<PathBuf> {
        let target = self.target;
        cmd!(
            shell,
            "cargo build --quiet --locked --package gmhm --features firmware --profile firmware --bin {image} --target {target}"
        )
        .quiet()
        .run()
        .with_context(|| format!("image `{image}` does not build for {target}: run `cargo xtask setup` first"))?;
        Ok(program::target(shell).join(target).join("firmware").join(image))
    }
}
