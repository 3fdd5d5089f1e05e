//! Exported C source on the microcontroller and under static checks, and the FMU in FMPy.

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use xshell::{Shell, cmd};

use crate::fmu;
use crate::program;
use crate::setup::{COMPILER, M4F_OPTIONS};
use crate::size::held;

/// Flash for forward and inverse of law `masing` on the Cortex-M4F, with what they need of the C library.
const CODE_LIMIT: u64 = 4608;

/// The published gear.
const GEAR: &str = "examples/bench/true_gear.toml";

/// A gear with terms of every kind of the plant.
const EVERY_TERM: &str = "tools/tests/exported/every_term.toml";

/// Rules that exported source does not follow, with reasons.
const DEVIATIONS: &str = "tools/templates/export/deviations.txt";

/// Checks of clang-tidy.
const TIDY: &str = "-*,bugprone-*,cert-*,clang-analyzer-*,misc-*,performance-*,portability-*";

/// Exports, weighs and checks.
pub fn run(shell: &Shell) -> Result<()> {
    let folder = shell.create_temp_dir()?;
    let folder = folder.path();
    let gmhm = program::gmhm(shell, false)?;
    for (model, prefix) in [(GEAR, "gear"), (EVERY_TERM, "terms")] {
        let output = folder.join(prefix);
        cmd!(shell, "{gmhm} export {model} --to c --self-test --prefix {prefix} -o {output}")
            .quiet()
            .ignore_stdout()
            .ignore_stderr()
            .run()
            .with_context(|| format!("{model} is not exported"))?;
    }
    weigh(shell, folder)?;
    let deviations = shell.read_file(DEVIATIONS)?;
    let of = |tool: &str| -> Vec<String> {
        let lines = deviations.lines().filter_map(|line| line.strip_prefix(tool)?.strip_prefix(' '));
        lines.filter_map(|line| line.split(' ').next()).map(str::to_owned).collect()
    };
    cppcheck(shell, folder, &of("cppcheck"))?;
    clang_tidy(shell, folder, &of("clang-tidy"))?;
    fmu::run(shell)
}

/// Links what a control loop calls, and compares its size with what is allowed.
fn weigh(shell: &Shell, folder: &Path) -> Result<()> {
    let (source, linked) = (folder.join("gear/gear.c"), folder.join("linked"));
    let link = [
        "-ffunction-sections",
        "-fdata-sections",
        "-nostartfiles",
        "--specs=nano.specs",
        "-Wl,--gc-sections,--entry=gear_start,--undefined=gear_step,--undefined=gear_invert,--undefined=gear_gear",
    ];
    cmd!(shell, "{COMPILER} -Os -std=c99 {M4F_OPTIONS...} {link...} {source} -lm -o {linked}")
        .quiet()
        .run()
        .context("the exported source does not link: run `cargo xtask setup` first")?;
    let elf = shell.read_binary_file(&linked)?;
    let file = object::File::parse(&*elf)?;
    let code = held(&file);
    ensure!(code <= CODE_LIMIT, "the exported source takes {code} B on the M4F, and at most {CODE_LIMIT} are allowed");
    println!(
        "export: law masing, forward and inverse, takes {code} B on the M4F with -Os, library functions included (at most {CODE_LIMIT})"
    );
    Ok(())
}

fn is_there(shell: &Shell, program: &str) -> bool {
    let there = cmd!(shell, "{program} --version").quiet().ignore_stdout().ignore_stderr().run().is_ok();
    if !there {
        println!("export: skipped: no {program}");
    }
    there
}

fn cppcheck(shell: &Shell, folder: &Path, deviations: &[String]) -> Result<()> {
    if !is_there(shell, "cppcheck") {
        return Ok(());
    }
    let suppressed: &Vec<String> = &deviations.iter().map(|rule| format!("--suppress={rule}")).collect();
    let template = "--template={id}:{file}:{line}:{message}";
    // One by one: each file is a program's part of its own, and two exports share names of static functions.
    for source in [folder.join("gear/gear.c"), folder.join("terms/terms.c")] {
        let output = cmd!(
            shell,
            "cppcheck --addon=misra --enable=all --std=c99 --quiet {template} --suppress=unmatchedSuppression {suppressed...} {source}"
        )
        .quiet()
        .ignore_status()
        .output()?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
        if !said.trim().is_empty() {
            bail!("cppcheck: list these in {DEVIATIONS} with a reason, or follow the rule:\n{said}");
        }
    }
    println!(
        "export: cppcheck with MISRA C:2012 finds nothing beyond the {} deviations of {DEVIATIONS}",
        deviations.len()
    );
    Ok(())
}

fn clang_tidy(shell: &Shell, folder: &Path, deviations: &[String]) -> Result<()> {
    if !is_there(shell, "clang-tidy") {
        return Ok(());
    }
    let without: String = deviations.iter().map(|check| format!(",-{check}")).collect();
    let checks = format!("--checks={TIDY}{without}");
    for source in [folder.join("gear/gear.c"), folder.join("gear/gear_self_test.c"), folder.join("terms/terms.c")] {
        let output = cmd!(shell, "clang-tidy --quiet {checks} --warnings-as-errors=* {source} -- -std=c99")
            .quiet()
            .ignore_status()
            .output()?;
        ensure!(
            output.status.success(),
            "clang-tidy: list these in {DEVIATIONS} with a reason, or follow the rule:\n{}",
            String::from_utf8_lossy(&output.stdout)
        );
    }
    println!("export: clang-tidy finds nothing beyond the {} deviations of {DEVIATIONS}", deviations.len());
    Ok(())
}
