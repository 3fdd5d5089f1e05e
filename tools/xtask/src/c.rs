//! The static library for C on the microcontroller: built for both ends of the range of cores, linked as firmware links it, free of panics, and used by a C program.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use object::{Object, ObjectSymbol};
use xshell::{Shell, cmd};

use crate::machine::{M0, M4F};
use crate::setup::{COMPILER, M4F_OPTIONS};
use crate::size::{held, is_double, is_panic};
use crate::{c_archive, c_program, program};

/// Functions that `gmhm.h` declares.
fn functions(header: &str) -> Vec<String> {
    let named = header.lines().filter(|line| line.starts_with("uint") || line.starts_with("void"));
    let name = |line: &str| line.split('(').next()?.split(' ').next_back().map(str::to_owned);
    named.filter_map(name).filter(|name| name.starts_with("gmhm_")).collect()
}

/// Code and constants of the whole library, with terms of every kind; a firmware links less where it calls less.
const CODE_LIMIT: u64 = 146_000;

/// Code and constants of what `gmhm_law` calls on a Cortex-M4F, with what it needs of the C library.
const LAW_CODE_LIMIT: u64 = 12_000;

/// The same of `gmhm_feed_forward`.
const FEED_FORWARD_CODE_LIMIT: u64 = 74_500;

/// The same of `gmhm_joint`, but for `gmhm_load_any`, which computes in double precision.
const JOINT_CODE_LIMIT: u64 = 87_500;

/// The same of `gmhm_gear`.
const GEAR_CODE_LIMIT: u64 = 24_000;

/// The same of `gmhm_store`.
const STORE_CODE_LIMIT: u64 = 9_000;

/// The same of `gmhm_pair`, with what reads a block.
const PAIR_CODE_LIMIT: u64 = 10_000;

/// The same of `gmhm_link`, its store included.
const LINK_CODE_LIMIT: u64 = 24_000;

/// The same with its lock.
const LOCKED_LINK_CODE_LIMIT: u64 = 35_000;

/// What a program calls of `gmhm_joint`, raw counts included, but for `gmhm_load_any`.
const JOINT: [&str; 14] = [
    "gmhm_init",
    "gmhm_init_with_terms",
    "gmhm_load",
    "gmhm_load_amperes",
    "gmhm_set_largest_step",
    "gmhm_pair_init",
    "gmhm_restart",
    "gmhm_step",
    "gmhm_pair_restart",
    "gmhm_step_counts",
    "gmhm_invert",
    "gmhm_get_status",
    "gmhm_get_diagnostics",
    "gmhm_clear_diagnostics",
];

/// What a program calls of an open link.
const LINK: [&str; 4] = ["gmhm_link_init", "gmhm_link_boot", "gmhm_link_receive", "gmhm_link_elapse"];

/// Code and constants of a C program that calls these functions of one type alone; refuses double precision in it, and more than a limit.
fn code_of(shell: &Shell, kind: &str, limit: u64, functions: &[&str], archive: &Path, linked: &Path) -> Result<()> {
    let roots: Vec<String> = functions.iter().map(|name| format!("-Wl,--undefined={name}")).collect();
    let entry = functions.first().with_context(|| format!("no function of {kind}"))?;
    let library = archive.join("lib/libgmhm.a");
    let linking = ["-nostartfiles", "--specs=nano.specs", "-Wl,--gc-sections"];
    cmd!(shell, "{COMPILER} -Os {M4F_OPTIONS...} {linking...} -Wl,--entry={entry} {roots...} {library} -o {linked}")
        .quiet()
        .run()
        .with_context(|| format!("a program that calls {kind} does not link: run `cargo xtask setup` first"))?;
    let elf = shell.read_binary_file(linked)?;
    let file = object::File::parse(&*elf)?;
    for symbol in file.symbols() {
        let name = symbol.name()?;
        ensure!(!is_double(name), "{kind} computes in double precision: `{name}`");
    }
    let code = held(&file);
    ensure!(code <= limit, "{kind} takes {code} B of code on the M4F, and at most {limit} are allowed");
    println!("c: a program that calls {kind} alone links {code} B on the M4F, library functions included");
    Ok(())
}

/// Builds and checks the library for both ends of the range of cores.
pub fn run(shell: &Shell) -> Result<()> {
    let sysroot = cmd!(shell, "rustc --print sysroot").quiet().read()?;
    let host = cmd!(shell, "rustc --print host-tuple").quiet().read()?;
    let linker = format!("{sysroot}/lib/rustlib/{host}/bin/rust-lld");
    let folder = shell.create_temp_dir()?;
    let functions = functions(&shell.read_file("c/include/gmhm.h")?);
    for machine in [M0, M4F] {
        let target = machine.target;
        cmd!(shell, "cargo build --quiet --locked --package gmhm-c --profile firmware --target {target}")
            .quiet()
            .run()
            .with_context(|| format!("the library does not build for {target}: run `cargo xtask setup` first"))?;
        let library = program::target(shell).join(target).join("firmware/libgmhm_c.a");
        let linked = folder.path().join(target);
        let roots: Vec<String> = functions.iter().map(|name| format!("--undefined={name}")).collect();
        cmd!(shell, "{linker} -flavor gnu --gc-sections --entry=gmhm_init {roots...} {library} -o {linked}")
            .quiet()
            .run()
            .with_context(|| format!("the library does not link for {target}"))?;
        let elf = shell.read_binary_file(&linked)?;
        let file = object::File::parse(&*elf).with_context(|| format!("cannot read what was linked for {target}"))?;
        let names: Vec<&str> = file.symbols().map(|symbol| symbol.name()).collect::<Result<_, _>>()?;
        for name in &functions {
            ensure!(names.contains(&name.as_str()), "the library for {target} has no {name}");
        }
        let panic = names.iter().find(|name| is_panic(name));
        ensure!(panic.is_none(), "the library for {target} can panic: it holds `{}`", panic.unwrap_or(&""));
        let code = held(&file);
        ensure!(code <= CODE_LIMIT, "the library for {target} takes {code} B, and at most {CODE_LIMIT} are allowed");
        println!("c: the library for the {} links without a panic, {code} B of code and constants", machine.core);
    }
    let archive = folder.path().join("arm");
    c_archive::write(shell, Some(M4F.target), &archive)?;
    let of =
        |kind: &str| functions.iter().map(String::as_str).filter(|name| name.starts_with(kind)).collect::<Vec<_>>();
    for (kind, limit, functions) in [
        ("gmhm_law", LAW_CODE_LIMIT, of("gmhm_law")),
        ("gmhm_gear", GEAR_CODE_LIMIT, of("gmhm_gear")),
        ("gmhm_feed_forward", FEED_FORWARD_CODE_LIMIT, of("gmhm_feed_forward")),
        ("gmhm_joint", JOINT_CODE_LIMIT, JOINT.to_vec()),
        ("gmhm_store", STORE_CODE_LIMIT, of("gmhm_store")),
        ("gmhm_pair", PAIR_CODE_LIMIT, [of("gmhm_pair"), vec!["gmhm_read_block"]].concat()),
        ("gmhm_link", LINK_CODE_LIMIT, LINK.to_vec()),
        ("gmhm_link with its lock", LOCKED_LINK_CODE_LIMIT, of("gmhm_link")),
    ] {
        code_of(shell, kind, limit, &functions, &archive, &folder.path().join(kind.replace(' ', "_")))?;
    }
    c_archive::check(shell, &archive)?;
    c_program::run(shell)
}
