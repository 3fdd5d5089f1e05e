//! Every test, on the host and in the emulator.

use anyhow::{Context, Result};
use xshell::{Shell, cmd};

use crate::{c, cost, emulate, end_to_end, fuzz, setup, size, structure};

/// Sets up what is missing, then runs everything.
pub fn run(shell: &Shell) -> Result<()> {
    setup::run(shell)?;
    structure::run(shell)?;
    cmd!(shell, "cargo test --workspace --locked").run().context("a host test failed")?;
    cmd!(shell, "cargo test --package gmhm --features micromath --lib --locked")
        .run()
        .context("a test of the feature `micromath` failed")?;
    cmd!(
        shell,
        "cargo build --package gmhm --features rtt --profile firmware --bins --target thumbv7em-none-eabihf --locked"
    )
    .run()
    .context("the images do not build for a board")?;
    emulate::run(shell, false)?;
    cost::run(shell, false)?;
    size::run(shell, false)?;
    c::run(shell)?;
    end_to_end::run(shell, end_to_end::CUTS, end_to_end::SEED)?;
    fuzz::run(shell, fuzz::IN_TESTS, 1)?;
    readme(shell)?;
    println!("test: all passed");
    Ok(())
}

/// Runs every `cargo run` that the README shows, with its model file in place.
fn readme(shell: &Shell) -> Result<()> {
    let text = shell.read_file("README.md")?;
    let model = text.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next());
    shell.write_file("gear.toml", model.context("the README shows no model file")?)?;
    for line in text.lines() {
        if let Some(arguments) = line.strip_prefix("cargo run ") {
            let arguments = arguments.split_whitespace();
            cmd!(shell, "cargo run {arguments...}")
                .ignore_stdout()
                .run()
                .with_context(|| format!("the README shows `{line}`, which fails"))?;
        }
    }
    Ok(())
}
