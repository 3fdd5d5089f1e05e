//! Every test, on the host and in the emulator.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, bail, ensure};
use xshell::{Shell, cmd};

use crate::{
    c, canopen, cost, emulate, end_to_end, export, fleet, fuzz, install, program, python_package, rtos, semver, setup,
    size, skips, structure,
};

/// Sets up what is missing, then runs everything.
pub fn run(shell: &Shell) -> Result<()> {
    let list = program::target(shell).join("skipped.txt");
    let _ = std::fs::remove_file(&list);
    let _list = shell.push_env(skips::LIST, &list);
    setup::run(shell)?;
    structure::run(shell)?;
    cmd!(shell, "cargo test --workspace --locked").run().context("a host test failed")?;
    features(shell)?;
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
    export::run(shell)?;
    fleet::run(shell, fleet::IN_TESTS, false)?;
    python_package::run(shell, false)?;
    canopen::run(shell)?;
    rtos::run(shell)?;
    semver::run(shell)?;
    packages(shell)?;
    end_to_end::run(shell, end_to_end::CUTS, end_to_end::SEED)?;
    fuzz::run(shell, fuzz::IN_TESTS, 1)?;
    examples(shell)?;
    readme(shell)?;
    install::run(shell)?;
    let skipped = skips::all(&list);
    skipped.iter().for_each(|line| println!("{line}"));
    println!("test: all passed, {} checks skipped", skipped.len());
    Ok(())
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
        .context("a package cannot be packed: `cargo package` tells why")
}

/// Runs the examples.
fn examples(shell: &Shell) -> Result<()> {
    for name in ["fit", "firmware"] {
        let example = program::example(shell, name)?;
        cmd!(shell, "{example}").run().with_context(|| format!("the example `{name}` failed"))?;
    }
    Ok(())
}

/// Runs every `cargo run` that the README shows.
pub fn readme(shell: &Shell) -> Result<()> {
    let text = shell.read_file("README.md")?;
    let mut running = Background::default();
    for line in text.lines() {
        let Some(arguments) = line.strip_prefix("cargo run") else { continue };
        let fails = || format!("the README shows `{line}`, which fails");
        if let Some(arguments) = arguments.strip_suffix(" &") {
            running.start(shell, arguments).with_context(fails)?;
            continue;
        }
        let arguments = arguments.split_whitespace();
        cmd!(shell, "cargo run {arguments...}").ignore_stdout().run().with_context(fails)?;
    }
    Ok(())
}

/// Programs that run beside the others until the end.
#[derive(Default)]
struct Background(Vec<Child>);

impl Background {
    /// Starts the program of `cargo run ARGUMENTS` and waits for its first line.
    fn start(&mut self, shell: &Shell, arguments: &str) -> Result<()> {
        let arguments = arguments.split_once(" -- ").map_or("", |(_, rest)| rest);
        // The program itself, not cargo, which would leave it running.
        let program = shell.current_dir().join("target/release/gmhm");
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
