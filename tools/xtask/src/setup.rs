//! What the firmware needs beside stock Rust: the Cortex-M targets, the LLVM tools and the emulator.

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

/// Every core that images are built for.
pub const TARGETS: [&str; 4] =
    ["thumbv6m-none-eabi", "thumbv7m-none-eabi", "thumbv7em-none-eabihf", "thumbv8m.main-none-eabihf"];

/// The emulator of all boards.
pub const EMULATOR: &str = "qemu-system-arm";

/// Installs what is missing, and says so.
pub fn run(shell: &Shell) -> Result<()> {
    let installed = cmd!(shell, "rustup target list --installed")
        .quiet()
        .read()
        .context("asking rustup for its targets failed: install Rust by rustup (https://rustup.rs)")?;
    let missing: Vec<&str> =
        TARGETS.into_iter().filter(|target| !installed.lines().any(|line| line == *target)).collect();
    if missing.is_empty() {
        println!("setup: targets are there: {}", TARGETS.join(", "));
    } else {
        println!("setup: adding targets {}", missing.join(", "));
        cmd!(shell, "rustup target add {missing...}").run().context("rustup could not add the targets")?;
    }

    let components = cmd!(shell, "rustup component list --installed").quiet().read()?;
    if components.lines().any(|line| line.starts_with("llvm-tools")) {
        println!("setup: llvm-tools are there");
    } else {
        println!("setup: adding component llvm-tools");
        cmd!(shell, "rustup component add llvm-tools").run().context("rustup could not add llvm-tools")?;
    }

    match emulator_version(shell) {
        Some(version) => println!("setup: emulator is there: {version}"),
        None => install_emulator(shell)?,
    }
    Ok(())
}

fn emulator_version(shell: &Shell) -> Option<String> {
    let text = cmd!(shell, "{EMULATOR} --version").quiet().ignore_stderr().read().ok()?;
    text.lines().next().map(str::to_owned)
}

fn install_emulator(shell: &Shell) -> Result<()> {
    ensure!(
        cmd!(shell, "apt-get --version").quiet().ignore_stdout().ignore_stderr().run().is_ok(),
        "{EMULATOR} is missing and there is no apt-get here: install QEMU 7.2 or later for Arm, so that `{EMULATOR}` is on the path, and run this again"
    );
    println!("setup: installing {EMULATOR} through apt-get");
    let root = cmd!(shell, "id -u").quiet().read()?.trim() == "0";
    let become_root: &[&str] = if root { &[] } else { &["sudo"] };
    let environment = ["env", "DEBIAN_FRONTEND=noninteractive"];
    let apt_get = |arguments: &[&str]| {
        let words = [become_root, &environment, &["apt-get", "-q"], arguments].concat();
        let (program, arguments) = (words[0], &words[1..]);
        cmd!(shell, "{program} {arguments...}").run()
    };
    apt_get(&["update"]).context("apt-get update failed: is the network there?")?;
    apt_get(&["install", "-y", "--no-install-recommends", EMULATOR])
        .with_context(|| format!("apt-get could not install {EMULATOR}: install it by hand and run this again"))?;
    ensure!(emulator_version(shell).is_some(), "{EMULATOR} was installed but does not run");
    Ok(())
}
