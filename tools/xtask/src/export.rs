//! Exported C source on the microcontroller and under static checks, and the FMU in FMPy.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use anyhow::{Context, Result, bail, ensure};
use xshell::{Shell, cmd};

use crate::fmu;
use crate::program::{self, Profile};
use crate::setup::{COMPILER, M4F_OPTIONS};
use crate::size::held;
use crate::skips::skipped;

/// Flash for forward and inverse of law `masing` on the Cortex-M4F, with what they need of the C library.
const CODE_LIMIT: u64 = 4608;

/// The published gear.
const GEAR: &str = "examples/bench/true_gear.toml";

/// A gear with terms of every kind of the plant.
const EVERY_TERM: &str = "tools/tests/exported/every_term.toml";

/// Law, kernel and gate; the first of each law is checked with terms, too.
const LAWS: [[&str; 3]; 9] = [
    ["masing", "deflection", "cycle"],
    ["phase", "deflection", "cycle"],
    ["phase", "deflection", "none"],
    ["phase", "rate", "cycle"],
    ["phase", "rate", "none"],
    ["time", "deflection", "cycle"],
    ["time", "deflection", "none"],
    ["time", "rate", "cycle"],
    ["time", "rate", "none"],
];

/// Rules that exported source does not follow, with reasons.
const DEVIATIONS: &str = "tools/templates/export/deviations.txt";

/// Checks of clang-tidy.
const TIDY: &str = "-*,bugprone-*,cert-*,misc-*,performance-*,portability-*";

/// Those that follow paths, which take most of the time. The paths are those of single precision in double precision, too.
const TIDY_PATHS: &str = ",clang-analyzer-*";

/// Exports, weighs and checks.
pub fn run(shell: &Shell) -> Result<()> {
    let folder = shell.create_temp_dir()?;
    let folder = folder.path();
    let gmhm = program::gmhm(shell, Profile::Dev)?;
    let gear = folder.join("gear");
    export(shell, &gmhm, Path::new(GEAR), "gear", "f32", &gear)?;
    weigh(shell, folder)?;
    let sources = sources(shell, &gmhm, folder)?;
    static_checks(shell, &gear.join("gear_self_test.c"), &sources)?;
    fmu::run(shell)
}

/// Writes a model as source with a prefix.
fn export(shell: &Shell, gmhm: &Path, model: &Path, prefix: &str, scalar: &str, output: &Path) -> Result<()> {
    let options = ["--to", "c", "--self-test", "--period", "0.001", "--scalar", scalar, "--prefix", prefix, "-o"];
    cmd!(shell, "{gmhm} --quiet export {model} {options...} {output}")
        .quiet()
        .ignore_stderr()
        .run()
        .with_context(|| format!("{} is not exported", model.display()))
}

/// Exported source, in single and in double precision: every law, and each law with terms of every kind.
fn sources(shell: &Shell, gmhm: &Path, folder: &Path) -> Result<[Vec<PathBuf>; 2]> {
    let (model, output) = (folder.join("model.toml"), folder.join("sources"));
    let texts = [(GEAR, "base"), (EVERY_TERM, "terms")].map(|(path, name)| (shell.read_file(path), name));
    let [mut single, mut double] = [Vec::new(), Vec::new()];
    for (text, name) in texts {
        let text = text?.replace("law = \"masing\"\n", "");
        for (number, [law, kernel, gate]) in LAWS.into_iter().enumerate() {
            if name == "terms" && [kernel, gate] != ["deflection", "cycle"] {
                continue;
            }
            let alpha = if kernel == "rate" { "4.0e3" } else { "2.6532e6" };
            let keys = format!("law = \"{law}\"\nkernel = \"{kernel}\"\ngate = \"{gate}\"\nalpha = {alpha}");
            let of_law = text.replace("alpha = 2.6532e6", &keys);
            ensure!(of_law != text, "the model of the static checks has another alpha");
            shell.write_file(&model, of_law)?;
            for (scalar, sources) in [("f32", &mut single), ("f64", &mut double)] {
                let prefix = format!("{law}_{number}_{name}_{scalar}");
                export(shell, gmhm, &model, &prefix, scalar, &output)?;
                sources.push(output.join(format!("{prefix}.c")));
            }
        }
    }
    Ok([single, double])
}

/// Checks source by the tools that are here, all at once.
fn static_checks(shell: &Shell, self_test: &Path, [single, double]: &[Vec<PathBuf>; 2]) -> Result<()> {
    let deviations = shell.read_file(DEVIATIONS)?;
    let of = |tool: &str| -> Vec<String> {
        let lines = deviations.lines().filter_map(|line| line.strip_prefix(tool)?.strip_prefix(' '));
        lines.filter_map(|line| line.split(' ').next()).map(str::to_owned).collect()
    };
    let (not_followed, not_checked) = (of("cppcheck"), of("clang-tidy"));
    let mut runs: Vec<(&str, Command)> = Vec::new();
    if is_there(shell, "cppcheck") {
        let mut command = Command::new("cppcheck");
        command.args(["--addon=misra", "--enable=all", "--std=c99", "--quiet", "--suppress=unmatchedSuppression"]);
        command.arg("--template={id}:{file}:{line}:{message}");
        command.args(not_followed.iter().map(|rule| format!("--suppress={rule}"))).args(single).args(double);
        runs.push(("cppcheck", command));
    }
    if is_there(shell, "clang-tidy") {
        let without: String = not_checked.iter().map(|check| format!(",-{check}")).collect();
        // In parts, for the cores.
        let (some, others) = single.split_at(single.len() / 2);
        let (paths, names) = (format!("{TIDY}{TIDY_PATHS}{without}"), format!("{TIDY}{without}"));
        for (checks, sources) in [(&paths, some), (&paths, others), (&names, double)] {
            let mut command = Command::new("clang-tidy");
            command.args(["--quiet", "--warnings-as-errors=*"]).arg(format!("--checks={checks}"));
            command.args(sources).arg(self_test).args(["--", "-std=c99"]);
            runs.push(("clang-tidy", command));
        }
    }
    let outputs = std::thread::scope(|scope| {
        let running = runs.iter_mut().map(|(tool, command)| (*tool, scope.spawn(|| command.output())));
        let running: Vec<_> = running.collect();
        running.into_iter().map(|(tool, run)| (tool, run.join())).collect::<Vec<_>>()
    });
    for (tool, output) in outputs {
        let Ok(output) = output else { bail!("{tool}: its thread ended") };
        let Output { status, stdout, stderr } = output.with_context(|| format!("{tool} does not run"))?;
        let findings = String::from_utf8_lossy(&stdout).into_owned();
        // clang-tidy counts on standard error what it did not show; cppcheck reports there.
        let findings = if tool == "cppcheck" { findings + &String::from_utf8_lossy(&stderr) } else { findings };
        ensure!(
            status.success() && findings.trim().is_empty(),
            "{tool}: list these in {DEVIATIONS} with a reason, or follow the rule:\n{findings}"
        );
    }
    let files = single.len() + double.len();
    for (tool, count) in [("cppcheck with MISRA C:2012", not_followed.len()), ("clang-tidy", not_checked.len())] {
        if runs.iter().any(|(of, _)| tool.starts_with(of)) {
            println!("export: {tool} finds nothing in {files} sources beyond the {count} deviations of {DEVIATIONS}");
        }
    }
    Ok(())
}

fn is_there(shell: &Shell, program: &str) -> bool {
    let there = cmd!(shell, "{program} --version").quiet().ignore_stdout().ignore_stderr().run().is_ok();
    if !there {
        skipped(&format!("exported source by {program}"), &format!("no {program} on the PATH"));
    }
    there
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
