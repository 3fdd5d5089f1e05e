//! The static library for C on the microcontroller: built for both ends of the range of cores, linked as firmware links it, free of panics, and used by a C program.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind};
use xshell::{Shell, cmd};

use crate::machine::{M0, M4F};
use crate::size::{is_double, is_panic};
use crate::{c_archive, c_program};

/// What `gmhm.h` declares.
const FUNCTIONS: [&str; 18] = [
    "gmhm_init",
    "gmhm_load",
    "gmhm_restart",
    "gmhm_load_amperes",
    "gmhm_set_encoders",
    "gmhm_step_counts",
    "gmhm_set_largest_step",
    "gmhm_step",
    "gmhm_invert",
    "gmhm_get_status",
    "gmhm_get_diagnostics",
    "gmhm_clear_diagnostics",
    "gmhm_sdo_abort",
    "gmhm_version",
    "gmhm_law_init",
    "gmhm_law_load",
    "gmhm_law_restart",
    "gmhm_law_step",
];

/// Code and constants of the whole library, with terms of every kind; a firmware links less where it calls less.
const CODE_LIMIT: u64 = 110_000;

/// Code and constants of what `gmhm_law` calls, on a Cortex-M4F.
const LAW_CODE_LIMIT: u64 = 15_000;

/// Code and constants of a program that calls `gmhm_law` alone; refuses double precision in it.
fn law_code(shell: &Shell, linker: &str, library: &Path, linked: &Path) -> Result<u64> {
    let roots = FUNCTIONS.iter().filter(|name| name.starts_with("gmhm_law"));
    let roots: Vec<String> = roots.map(|name| format!("--undefined={name}")).collect();
    cmd!(shell, "{linker} -flavor gnu --gc-sections --entry=gmhm_law_init {roots...} {library} -o {linked}")
        .quiet()
        .run()?;
    let elf = shell.read_binary_file(linked)?;
    let file = object::File::parse(&*elf)?;
    for symbol in file.symbols() {
        let name = symbol.name()?;
        ensure!(
            !is_double(name) || library.to_string_lossy().contains("thumbv6m"),
            "gmhm_law computes in double precision: `{name}`"
        );
    }
    let sections = file.sections();
    let code = sections.filter(|section| matches!(section.kind(), SectionKind::Text | SectionKind::ReadOnlyData));
    Ok(code.map(|section| section.size()).sum())
}

/// Builds and checks the library for both ends of the range of cores.
pub fn run(shell: &Shell) -> Result<()> {
    let sysroot = cmd!(shell, "rustc --print sysroot").quiet().read()?;
    let host = cmd!(shell, "rustc --print host-tuple").quiet().read()?;
    let linker = format!("{sysroot}/lib/rustlib/{host}/bin/rust-lld");
    let folder = shell.create_temp_dir()?;
    let mut law = 0;
    for machine in [M0, M4F] {
        let target = machine.target;
        cmd!(shell, "cargo build --quiet --locked --package gmhm-c --profile firmware --target {target}")
            .quiet()
            .run()
            .with_context(|| format!("the library does not build for {target}: run `cargo xtask setup` first"))?;
        let library = shell.current_dir().join("target").join(target).join("firmware/libgmhm_c.a");
        let linked = folder.path().join(target);
        let roots: Vec<String> = FUNCTIONS.iter().map(|name| format!("--undefined={name}")).collect();
        cmd!(shell, "{linker} -flavor gnu --gc-sections --entry=gmhm_init {roots...} {library} -o {linked}")
            .quiet()
            .run()
            .with_context(|| format!("the library does not link for {target}"))?;
        let elf = shell.read_binary_file(&linked)?;
        let file = object::File::parse(&*elf).with_context(|| format!("cannot read what was linked for {target}"))?;
        let names: Vec<&str> = file.symbols().map(|symbol| symbol.name()).collect::<Result<_, _>>()?;
        for name in FUNCTIONS {
            ensure!(names.contains(&name), "the library for {target} has no {name}");
        }
        let panic = names.iter().find(|name| is_panic(name));
        ensure!(panic.is_none(), "the library for {target} can panic: it holds `{}`", panic.unwrap_or(&""));
        let code: u64 = file
            .sections()
            .filter(|section| matches!(section.kind(), SectionKind::Text | SectionKind::ReadOnlyData))
            .map(|section| section.size())
            .sum();
        ensure!(code <= CODE_LIMIT, "the library for {target} takes {code} B, and at most {CODE_LIMIT} are allowed");
        law = law_code(shell, &linker, &library, &folder.path().join("law"))?;
        println!("c: the library for the {} links without a panic, {code} B of code and constants", machine.core);
    }
    ensure!(
        law <= LAW_CODE_LIMIT,
        "gmhm_law takes {law} B of code on the M4F, and at most {LAW_CODE_LIMIT} are allowed"
    );
    println!("c: a program that calls gmhm_law alone links {law} B of it on the M4F");
    c_archive::check(shell)?;
    c_program::run(shell)
}
