//! Runs the images on every machine and compares what they print with the file beside each.

use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result, bail};
use xshell::{Shell, cmd};

use crate::emulator::{self, Clock};
use crate::golden;
use crate::lockstep;
use crate::machine::{self, Machine};

/// The image that must print the same on every machine, the host included.
const BITS: &str = "bits";

/// The control loop. It must print the same everywhere: `f32` and fixed point differ by less than it tells.
const CONTROL: &str = "control";

/// The torque loop of a gear that warms, with and without adaptation, in floats.
const ADAPTATION: &str = "adapt_loop";

/// Runs every image; `overwrite` accepts what they print.
pub fn run(shell: &Shell, overwrite: bool) -> Result<()> {
    let golden_file = shell.current_dir().join("src/bin/bits.out");
    println!("emulate: {BITS} on the host");
    let host = cmd!(shell, "cargo run --quiet --locked --package gmhm --features firmware --bin {BITS}")
        .quiet()
        .read()
        .context("image `bits` failed on the host")?
        + "\n";
    golden::check(&golden_file, &host, overwrite)?;
    for machine in machine::ALL {
        let lines = lines(shell, BITS, machine, Clock::Free)?;
        golden::check(&golden_file, &lines, false).context("the bits differ from those of the host")?;
    }
    for machine in machine::ALL {
        let lines = lines(shell, CONTROL, machine, Clock::Instructions)?;
        let accept = overwrite && machine.board == machine::M0.board;
        golden::check(&shell.current_dir().join("src/bin/control/control.out"), &lines, accept)?;
    }
    let warming = lines(shell, ADAPTATION, machine::M4F, Clock::Free)?;
    golden::check(&shell.current_dir().join("src/bin/adapt_loop/adapt_loop.out"), &warming, overwrite)?;
    lockstep::run(shell)
}

fn lines(shell: &Shell, image: &str, machine: Machine, clock: Clock) -> Result<String> {
    println!("emulate: {image} on {} ({})", machine.core, machine.board);
    emulator::lines(&machine.build(shell, image)?, machine, clock)
}

/// Runs one image that cargo has built, and prints its lines: the runner of `cargo run`.
pub fn run_image(image: &Path) -> Result<()> {
    let target = image.ancestors().filter_map(|folder| folder.file_name()?.to_str()).find_map(Machine::of_target);
    let Some(machine) = target else {
        bail!("{}: no folder on the way names a target that an emulated board is known for", image.display());
    };
    // Who stops reading does not stop the image.
    emulator::run(image, machine, Clock::Instructions, None, |line| drop(writeln!(std::io::stdout(), "{line}")))
}
