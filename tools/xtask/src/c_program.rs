//! The C program of `c/tests`, compiled for the host and for Cortex-M against the static library: it must print the same everywhere.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

use crate::machine::{M3, M4F, Machine};
use crate::setup::{COMPILER, M4F_OPTIONS};
use crate::{emulator, program};

/// Golden blocks of single precision: each law, and terms of every kind that fit; then the same with the words of their set-up, which a feed-forward needs.
const BLOCKS: [&str; 14] = [
    "masing",
    "phase",
    "time",
    "terms-1",
    "terms-9",
    "terms-17",
    "shapes",
    "prepared",
    "phase-prepared-tested",
    "time-prepared-tested",
    "prepared-terms-1",
    "prepared-terms-9",
    "prepared-terms-17",
    "prepared-shapes",
];

/// Cores, the target of the library, and the options of the compiler. The Cortex-M3 runs the code of the Cortex-M0, which has no emulated board with room for the program.
const CORES: [(Machine, &str, &[&str]); 2] =
    [(M3, "thumbv6m-none-eabi", &["-mthumb", "-mcpu=cortex-m0"]), (M4F, "thumbv7em-none-eabihf", &M4F_OPTIONS)];

const WARNINGS: [&str; 6] = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Werror"];

/// Stack that the deepest call may take: main, `gmhm_init` and what it calls.
const STACK_LIMIT: u64 = 5700;

/// Runs the program on the host and on every core.
pub fn run(shell: &Shell) -> Result<()> {
    let folder = shell.create_temp_dir()?;
    let folder = folder.path();
    for name in BLOCKS {
        shell.copy_file(format!("host-tests/golden/block-1-{name}.bin"), folder.join(format!("{name}.bin")))?;
    }
    let expected = on_the_host(shell, folder)?;
    for (machine, target, options) in CORES {
        let program = compile(shell, folder, target, options)?;
        let mut deepest = 0;
        for (name, expected) in BLOCKS.iter().zip(&expected) {
            let words = files(name);
            let [printed, errors] = emulator::output(&program, machine, folder, &[&words[0], &words[1]])?;
            ensure!(
                printed == *expected,
                "the C program prints otherwise on the {} than on the host, for block {name}",
                machine.core
            );
            let stack = errors.trim().strip_prefix("stack: ").and_then(|text| text.strip_suffix(" B"));
            let stack: u64 =
                stack.and_then(|text| text.parse().ok()).with_context(|| format!("no stack in `{errors}`"))?;
            deepest = deepest.max(stack);
        }
        ensure!(
            deepest <= STACK_LIMIT,
            "the C program takes {deepest} B of stack, and at most {STACK_LIMIT} are allowed"
        );
        println!(
            "c: the program prints on the {} ({target}) what it prints on the host, {} lines for {} blocks, {deepest} B of stack",
            machine.core,
            expected.iter().map(|text| text.lines().count()).sum::<usize>(),
            BLOCKS.len(),
        );
    }
    Ok(())
}

/// The block that the program walks with, and the one that replaces it.
fn files(name: &str) -> [String; 2] {
    let other = if name == BLOCKS[0] { BLOCKS[1] } else { BLOCKS[0] };
    [name, other].map(|name| format!("{name}.bin"))
}

/// What the program prints on the host, block by block.
fn on_the_host(shell: &Shell, folder: &Path) -> Result<Vec<String>> {
    cmd!(shell, "cargo build --quiet --locked --package gmhm-c --profile firmware")
        .quiet()
        .run()
        .context("the library does not build for the host")?;
    let (program, library) = (folder.join("host"), program::target(shell).join("firmware/libgmhm_c.a"));
    cmd!(shell, "cc {WARNINGS...} -O1 -I c/include c/tests/program.c {library} -lm -lpthread -ldl -o {program}")
        .quiet()
        .run()
        .context("the C program does not compile for the host: is there a C compiler named `cc`?")?;
    let _inside = shell.push_dir(folder);
    let outputs = BLOCKS.map(|name| {
        let words = files(name);
        let printed = cmd!(shell, "{program} {words...}").quiet().read();
        Ok(printed.with_context(|| format!("the C program failed on the host, for block {name}"))? + "\n")
    });
    outputs.into_iter().collect()
}

/// The program for a target, with its start-up file and linker script.
fn compile(shell: &Shell, folder: &Path, target: &str, options: &[&str]) -> Result<PathBuf> {
    let (program, library) = (folder.join(target), program::target(shell).join(target).join("firmware/libgmhm_c.a"));
    let sections =
        ["-Os", "-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections,--fatal-warnings,-z,noexecstack"];
    let start =
        ["--specs=nano.specs", "--specs=rdimon.specs", "-nostartfiles", "-T", "c/arm/program.ld", "c/arm/start.c"];
    cmd!(
        shell,
        "{COMPILER} {options...} {WARNINGS...} {sections...} {start...} -I c/include c/tests/program.c {library} -o {program}"
    )
    .quiet()
    .run()
    .with_context(|| format!("the C program does not compile for {target}: run `cargo xtask setup` first"))?;
    Ok(program)
}
