//! The static library for C on the microcontroller: built for both ends of the range of cores, linked as firmware links it, free of panics, and used by a C program.

use anyhow::{Context, Result, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind};
use xshell::{Shell, cmd};

use crate::c_program;
use crate::machine::{M0, M4F};
use crate::size::is_panic;

/// What `gmhm.h` declares.
const FUNCTIONS: [&str; 13] = [
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
];

/// Code and constants of the whole library, with terms of every kind; a firmware links less where it calls less.
const CODE_LIMIT: u64 = 110_000;

/// Builds and checks the library for both ends of the range of cores.
pub fn run(shell: &Shell) -> Result<()> {
    let sysroot = cmd!(shell, "rustc --print sysroot").quiet().read()?;
    let host = cmd!(shell, "rustc --print host-tuple").quiet().read()?;
    let linker = format!("{sysroot}/lib/rustlib/{host}/bin/rust-lld");
    let folder = shell.create_temp_dir()?;
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
        println!("c: the library for the {} links without a panic, {code} B of code and constants", machine.core);
    }
    c_program::run(shell)
}
