//! `cargo xtask`: set-up, tests, emulator runs and tables of this workspace, from a machine with stock Rust to the end.

mod accuracy;
mod c;
mod c_archive;
mod c_program;
mod canopen;
mod cost;
mod cycles;
mod emulate;
mod emulator;
mod end_to_end;
mod export;
mod fleet;
mod fmu;
mod fuzz;
mod golden;
mod install;
mod large;
mod lockstep;
mod machine;
mod program;
mod python;
mod python_package;
mod registry;
mod rtos;
mod semver;
mod setup;
mod size;
mod skips;
mod steps;
mod structure;
mod test;
mod time;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use xshell::Shell;

use crate::program::Profile;

#[derive(Parser)]
#[command(name = "cargo xtask", about = "Set-up, tests, emulator runs and tables of this workspace")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Install what is missing: Cortex-M targets and llvm-tools (rustup), the emulator, a C compiler, and the tools that check exported source and reports (apt-get).
    Setup,
    /// Run the images on every emulated board and compare their output with the stored files.
    Emulate {
        /// Accept the output.
        #[arg(long)]
        overwrite: bool,
    },
    /// Count the instructions of each call of the core; fails if a count has grown.
    Cost {
        /// Accept the counts.
        #[arg(long)]
        overwrite: bool,
    },
    /// Measure the size of the control path of one joint; fails if it has grown, or contains a panic or double-precision arithmetic.
    Size {
        /// Accept the sizes.
        #[arg(long)]
        overwrite: bool,
    },
    /// Export source for C, measure its size on the Cortex-M4F, check it by cppcheck and clang-tidy if they are installed; run FMUs in FMPy and libcosim.
    Export,
    /// Build the static library for C for the microcontrollers, free of panics, and run a C program with it on the host and in the emulator.
    C {
        /// Only write the archive of the library into this folder.
        #[arg(long, value_name = "DIR")]
        archive: Option<PathBuf>,
        /// Its target; by default this computer.
        #[arg(long, requires = "archive")]
        target: Option<String>,
    },
    /// Read and write the object dictionary of a simulated drive over a virtual CAN bus, with python canopen.
    Canopen,
    /// Build the examples under RTIC, under embassy and with a shared interrupt, and run them in the emulator.
    Rtos,
    /// Compare the core's interface with that of the last tagged version, by cargo-semver-checks.
    Semver,
    /// Fit, pack and flash into emulated drives, compare their torques with the host's, and cut their power during writes.
    EndToEnd {
        /// Least number of power cuts during a write.
        #[arg(long, default_value_t = end_to_end::CUTS)]
        cuts: u32,
        /// Seed of the noise and of the times of the cuts.
        #[arg(long, default_value_t = end_to_end::SEED)]
        seed: u64,
    },
    /// Run the Dask example on synthetic joints, some of them damaged; one worker is killed during the run.
    Fleet {
        /// Joints, two recordings each.
        #[arg(long, default_value_t = 20)]
        joints: u32,
        /// Rows of each recording.
        #[arg(long, default_value_t = 400)]
        rows: u32,
        /// Damaged recordings among them.
        #[arg(long, default_value_t = 3)]
        damaged: u32,
        /// Also time a plain loop, with the program built in release.
        #[arg(long)]
        timed: bool,
    },
    /// Fuzz the block parser, the link, the store, the control path and the library for C.
    Fuzz {
        /// Executions of each fuzzer.
        #[arg(long, default_value_t = 10_000_000)]
        executions: u64,
        /// Seed of the inputs.
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
    /// Install the program into a temporary folder and use it, its completions and its manual pages from an empty environment.
    Install,
    /// Measure the program on 10 million rows and on 200 files.
    Large {
        /// Also measure a release build from an empty folder.
        #[arg(long)]
        build: bool,
    },
    /// Run one built image in the emulator: the runner of `cargo run`.
    #[command(hide = true)]
    RunImage {
        /// The image.
        image: PathBuf,
    },
    /// Print the structure of tools/src: lines per folder, import cycles, files outside kinds/ that name a kind; fails if a limit is exceeded.
    Structure,
    /// Install the Python package into a separate environment, test it, check its types, run its notebook.
    Python {
        /// Instead build it in release and measure what it adds to the program's own time.
        #[arg(long)]
        timed: bool,
    },
    /// Run every command that the README shows.
    Readme,
    /// Set up what is missing, then run every test.
    Test {
        /// Only this part, without the set-up.
        #[arg(long)]
        part: Option<test::Part>,
    },
}

fn main() -> ExitCode {
    match run(Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: Arguments) -> anyhow::Result<()> {
    let shell = Shell::new()?;
    shell.change_dir(workspace());
    match arguments.command {
        Command::Setup => setup::run(&shell),
        Command::Emulate { overwrite } => emulate::run(&shell, overwrite),
        Command::Cost { overwrite } => cost::run(&shell, overwrite),
        Command::Size { overwrite } => size::run(&shell, overwrite),
        Command::Export => export::run(&shell),
        Command::C { archive: Some(folder), target } => c_archive::write(&shell, target.as_deref(), &folder),
        Command::C { archive: None, .. } => c::run(&shell),
        Command::Canopen => canopen::run(&shell),
        Command::Rtos => rtos::run(&shell),
        Command::Semver => semver::run(&shell),
        Command::EndToEnd { cuts, seed } => end_to_end::run(&shell, cuts, seed),
        Command::Fleet { joints, rows, damaged, timed } => fleet::run(&shell, [joints, rows, damaged], timed),
        Command::Fuzz { executions, seed } => fuzz::run(&shell, executions, seed),
        Command::Install => install::run(&shell),
        Command::Large { build } => large::run(&shell, build),
        Command::RunImage { image } => emulate::run_image(&image),
        Command::Structure => structure::run(&shell),
        Command::Python { timed } => python_package::run(&shell, timed),
        Command::Readme => test::readme(&shell, Profile::Release),
        Command::Test { part } => test::run(&shell, part),
    }
}

/// The top of the workspace.
fn workspace() -> &'static std::path::Path {
    let here = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here)
}
