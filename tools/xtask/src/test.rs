//! Every test, on the host and in the emulator.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, bail, ensure};
use clap::ValueEnum;
use xshell::{Shell, cmd};

use crate::program::Profile;
use crate::steps::{self, Beside, Step};
use crate::{
    c, canopen, cost, emulate, end_to_end, export, fleet, fuzz, install, program, python_package, rtos, semver, setup,
    size, skips, structure,
};

/// Parts of the tests that need nothing of each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// The host tests, and the program as people use it.
    Host,
    /// The core, what is made of it for microcontrollers and runs in the emulator, and what a drive has to bear; and the installation, so that both take about as long.
    Firmware,
}

const HOST: &[Step] = &[
    ("host tests", host_tests),
    ("fleet", |shell| fleet::run(shell, fleet::IN_TESTS, false)),
    ("Python package", |shell| python_package::run(shell, false)),
    ("packages", packages),
    ("examples", examples),
    ("commands of the README", |shell| readme(shell, Profile::Dev)),
];

const FIRMWARE: &[Step] = &[
    ("size of the control path", |shell| size::run(shell, false)),
    ("examples with an operating system", rtos::run),
    ("images for a board", images_for_a_board),
    ("features of the core", features),
    ("interface of the core", semver::run),
    ("instructions of a call", |shell| cost::run(shell, false)),
    ("images in the emulator", |shell| emulate::run(shell, false)),
    ("library for C", c::run),
    ("exported source and FMU", export::run),
    ("CANopen", canopen::run),
    ("installation", installation),
    ("end to end", |shell| end_to_end::run(shell, end_to_end::CUTS, end_to_end::SEED)),
    ("fuzzing", |shell| fuzz::run(shell, fuzz::IN_TESTS, 1)),
];

/// Sets up what is missing, then runs everything, or one part of it.
pub fn run(shell: &Shell, part: Option<Part>) -> Result<()> {
    match part {
        Some(Part::Host) => return steps::run(shell, HOST),
        Some(Part::Firmware) => return steps::run(shell, FIRMWARE),
        None => {}
    }
    let list = program::target(shell).join("skipped.txt");
    let _ = std::fs::remove_file(&list);
    let _list = shell.push_env(skips::LIST, &list);
    steps::run(shell, &[("set-up", setup::run), ("structure", structure::run)])?;
    let firmware = Beside::start("firmware", &["test", "--part", "firmware"], &list)?;
    let host = steps::run(shell, HOST);
    // Both results are of use where one of them is a failure.
    let firmware = firmware.end();
    host.and(firmware)?;
    let skipped = skips::all(&list);
    skipped.iter().for_each(|line| println!("{line}"));
    println!("test: all passed, {} checks skipped", skipped.len());
    Ok(())
}

/// Runs the tests of all packages, and those of this program.
fn host_tests(shell: &Shell) -> Result<()> {
    cmd!(shell, "cargo test --quiet --locked --manifest-path tools/xtask/Cargo.toml --target-dir target/xtask")
        .run()
        .context("a test of xtask failed")?;
    cmd!(shell, "cargo test --workspace --locked").run().context("a host test failed")?;
    cmd!(shell, "cargo test --package gmhm --features micromath --lib --locked")
        .run()
        .context("a test of the feature `micromath` failed")
}

/// Builds the images that log by a probe.
fn images_for_a_board(shell: &Shell) -> Result<()> {
    cmd!(
        shell,
        "cargo build --quiet --package gmhm --features rtt --profile firmware --bins --target thumbv7em-none-eabihf --locked"
    )
    .run()
    .context("the images do not build for a board")
}

/// Checks the core and its documentation with each of its features alone, and that it depends on two packages without any.
fn features(shell: &Shell) -> Result<()> {
    for feature in ["", "fixed", "terms", "adapt", "block", "store", "link", "lock", "drive", "serde", "full"] {
        cmd!(
            shell,
            "cargo clippy --quiet --package gmhm --no-default-features --features {feature} --locked -- -D warnings"
        )
        .run()
        .with_context(|| format!("the core does not build with the features `{feature}`"))?;
        cmd!(shell, "cargo doc --quiet --package gmhm --no-deps --no-default-features --features {feature} --locked")
            .env("RUSTDOCFLAGS", "-D warnings")
            .run()
            .with_context(|| format!("the documentation of the core is not whole with the features `{feature}`"))?;
    }
    let target = setup::RISC_V;
    cmd!(shell, "cargo check --quiet --package gmhm --features full,lock --target {target} --locked")
        .run()
        .with_context(|| format!("the core does not build for {target}"))?;
    let tree = cmd!(shell, "cargo tree --package gmhm --edges normal --depth 1 --prefix none --locked").read()?;
    let direct: Vec<&str> = tree.lines().skip(1).filter_map(|line| line.split(' ').next()).collect();
    ensure!(direct == ["heapless", "libm"], "without features the core needs {direct:?}");
    Ok(())
}

/// Packs both packages as they would be published; the core alone is built from its package, the tools need it in the registry first.
fn packages(shell: &Shell) -> Result<()> {
    cmd!(shell, "cargo package --quiet --locked --no-verify --allow-dirty --package gmhm --package gmhm-tools")
        .ignore_stderr()
        .run()
        .context("a package cannot be packed: run `cargo package` to see why")
}

/// Runs the examples.
fn examples(shell: &Shell) -> Result<()> {
    for name in ["fit", "firmware"] {
        let example = program::example(shell, name)?;
        cmd!(shell, "{example}").run().with_context(|| format!("the example `{name}` failed"))?;
    }
    Ok(())
}

/// Installs without optimisation, which would take minutes; the program runs for seconds.
fn installation(shell: &Shell) -> Result<()> {
    let _level = shell.push_env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "0");
    install::run(shell)
}

/// Runs every `cargo run` that the README shows: by cargo in release, else in the program that the tests have built, as cargo would build another.
pub fn readme(shell: &Shell, profile: Profile) -> Result<()> {
    let program = match profile {
        Profile::Dev => program::gmhm(shell, profile)?,
        Profile::Release => program::target(shell).join("release/gmhm"),
    };
    let text = shell.read_file("README.md")?;
    let mut running = Background::default();
    for line in text.lines() {
        let Some(words) = line.strip_prefix("cargo run") else { continue };
        let fails = || format!("the README shows `{line}`, which fails");
        let arguments = words.split_once(" -- ").map_or("", |(_, rest)| rest);
        if let Some(arguments) = arguments.strip_suffix(" &") {
            running.start(&program, arguments).with_context(fails)?;
            continue;
        }
        let command = if profile == Profile::Release {
            let words = words.split_whitespace();
            cmd!(shell, "cargo run {words...}")
        } else {
            let arguments = arguments.split_whitespace();
            cmd!(shell, "{program} {arguments...}")
        };
        command.ignore_stdout().run().with_context(fails)?;
    }
    Ok(())
}

/// Programs that run beside the others until the end.
#[derive(Default)]
struct Background(Vec<Child>);

impl Background {
    /// Starts the program itself, not cargo, which would leave it running, and waits for its first line.
    fn start(&mut self, program: &Path, arguments: &str) -> Result<()> {
        let mut child = Command::new(program)
            .args(arguments.split_whitespace())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let output = child.stdout.take().context("no output")?;
        self.0.push(child);
        let mut output = BufReader::new(output);
        let mut first = String::new();
        output.read_line(&mut first)?;
        if first.is_empty() {
            bail!("it ended at once");
        }
        std::thread::spawn(move || output.lines().for_each(drop));
        Ok(())
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        for child in &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
