//! What the firmware needs beside stock Rust: the targets, the LLVM tools, the emulator and a C compiler; and what checks exported source and reports.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

/// Every core that is built or checked for.
pub const TARGETS: [&str; 5] =
    ["thumbv6m-none-eabi", "thumbv7m-none-eabi", "thumbv7em-none-eabihf", "thumbv8m.main-none-eabihf", RISC_V];

/// The core is checked for this one; no image is built.
pub const RISC_V: &str = "riscv32imafc-unknown-none-elf";

/// The emulator of all boards.
pub const EMULATOR: &str = "qemu-system-arm";

/// The C compiler of the static library's example.
pub const COMPILER: &str = "arm-none-eabi-gcc";

/// Its options for a Cortex-M4F.
pub const M4F_OPTIONS: [&str; 4] = ["-mthumb", "-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"];

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

    install(
        shell,
        "emulator",
        emulator_version,
        &[EMULATOR],
        "QEMU 7.2 or later for Arm, so that `qemu-system-arm` is on the path",
    )?;
    install(
        shell,
        "C compiler",
        compiler_version,
        &["gcc-arm-none-eabi", "libnewlib-arm-none-eabi"],
        "the GNU compiler for Arm with newlib, so that `arm-none-eabi-gcc` is on the path",
    )?;
    checkers(shell);
    Ok(())
}

/// Programs that check exported source, and the browser that opens reports: the Debian package of each.
const CHECKERS: [(&str, &str); 4] =
    [("clang", "clang"), ("clang-tidy", "clang-tidy"), ("cppcheck", "cppcheck"), ("chromium", "chromium")];

/// Installs the checkers that are missing. Where that fails the checks that need them are skipped.
fn checkers(shell: &Shell) {
    let missing = || -> Vec<&str> {
        let is_there = |program: &str| cmd!(shell, "{program} --version").quiet().ignore_stdout().ignore_stderr().run();
        CHECKERS.into_iter().filter(|(program, _)| is_there(program).is_err()).map(|(_, package)| package).collect()
    };
    let packages = missing();
    if packages.is_empty() {
        println!("setup: checkers are there: {}", CHECKERS.map(|(program, _)| program).join(", "));
    } else if let Err(error) = apt_get(shell, &packages) {
        println!("setup: {} are missing, and checks that need them are skipped: {error:#}", missing().join(", "));
    }
}

fn emulator_version(shell: &Shell) -> Option<String> {
    let text = cmd!(shell, "{EMULATOR} --version").quiet().ignore_stderr().read().ok()?;
    text.lines().next().map(str::to_owned)
}

/// The compiler counts as there where its C library is.
fn compiler_version(shell: &Shell) -> Option<String> {
    let specs = cmd!(shell, "{COMPILER} -print-file-name=rdimon.specs").quiet().ignore_stderr().read().ok()?;
    if !Path::new(&specs).is_absolute() {
        return None;
    }
    let text = cmd!(shell, "{COMPILER} --version").quiet().ignore_stderr().read().ok()?;
    text.lines().next().map(str::to_owned)
}

/// Installs Debian packages where what they bring is missing; `otherwise` says what to install where there is no apt-get.
fn install(
    shell: &Shell,
    what: &str,
    version: fn(&Shell) -> Option<String>,
    packages: &[&str],
    otherwise: &str,
) -> Result<()> {
    if let Some(version) = version(shell) {
        println!("setup: {what} is there: {version}");
        return Ok(());
    }
    apt_get(shell, packages)
        .with_context(|| format!("the {what} is missing: install {otherwise}, and run this again"))?;
    ensure!(version(shell).is_some(), "{} was installed but does not run", packages.join(", "));
    Ok(())
}

/// Installs Debian packages.
fn apt_get(shell: &Shell, packages: &[&str]) -> Result<()> {
    ensure!(
        cmd!(shell, "apt-get --version").quiet().ignore_stdout().ignore_stderr().run().is_ok(),
        "there is no apt-get here"
    );
    let names = packages.join(", ");
    println!("setup: installing {names} through apt-get");
    let root = cmd!(shell, "id -u").quiet().read()?.trim() == "0";
    let become_root: &[&str] = if root { &[] } else { &["sudo"] };
    let environment = ["env", "DEBIAN_FRONTEND=noninteractive"];
    let apt_get = |arguments: &[&str]| {
        let words = [become_root, &environment, &["apt-get", "-q"], arguments].concat();
        let (program, arguments) = (words[0], &words[1..]);
        cmd!(shell, "{program} {arguments...}").run()
    };
    apt_get(&["update"]).context("apt-get update failed: is the network there?")?;
    apt_get(&[&["install", "-y", "--no-install-recommends"], packages].concat())
        .with_context(|| format!("apt-get could not install {names}"))
}
