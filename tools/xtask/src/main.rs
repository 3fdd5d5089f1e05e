//! `cargo xtask`: set-up and tests of this workspace, from a machine with stock Rust to the end.

mod setup;
mod test;

use clap::{Parser, Subcommand};
use xshell::Shell;

#[derive(Parser)]
#[command(name = "cargo xtask", about = "Set-up and tests of this workspace")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Install what is missing: Cortex-M targets and llvm-tools (rustup), the emulator (apt-get).
    Setup,
    /// Set up what is missing, then run every test.
    Test,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let shell = Shell::new()?;
    shell.change_dir(workspace());
    match arguments.command {
        Command::Setup => setup::run(&shell),
        Command::Test => test::run(&shell),
    }
}

/// The top of the workspace.
fn workspace() -> &'static std::path::Path {
    let here = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here)
}
