//! Bytes of the control path of one joint, and what must not be in it.

use std::fmt::Write;

use anyhow::{Context, Result, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind};
use rustc_demangle::demangle;
use xshell::Shell;

use crate::{golden, machine};

const TABLE: &str = "docs/size.md";

/// Flash for the code, and RAM for one joint with 16 turning points.
const CODE_LIMIT: u64 = 4096;
const JOINT_LIMIT: u64 = 256;

/// Weighs the image `core_path` on the Cortex-M4F; `overwrite` accepts its sizes.
pub fn run(shell: &Shell, overwrite: bool) -> Result<()> {
    let image = machine::M4F.build(shell, "core_path")?;
    let elf = shell.read_binary_file(&image)?;
    let file = object::File::parse(&*elf).with_context(|| format!("cannot read {}", image.display()))?;

    let mut names = Vec::new();
    let (mut gear, mut joint) = (None, None);
    for symbol in file.symbols().filter(|symbol| symbol.size() > 0) {
        let name = format!("{:#}", demangle(symbol.name()?));
        match name.as_str() {
            "core_path::GEAR" => gear = Some(symbol.size()),
            "core_path::JOINT" => joint = Some(symbol.size()),
            _ => {}
        }
        names.push(name);
    }
    for name in &names {
        ensure!(!is_panic(name), "the control path can panic: the image `core_path` holds `{name}`");
        ensure!(!is_double(name), "the f32 path computes in double precision: the image `core_path` holds `{name}`");
    }
    let gear = gear.context("the image `core_path` has no GEAR")?;
    let joint = joint.context("the image `core_path` has no JOINT")?;
    let code: u64 = file
        .sections()
        .filter(|section| section.kind() == SectionKind::Text || section.name() == Ok(".rodata"))
        .map(|section| section.size())
        .sum();
    ensure!(code <= CODE_LIMIT, "the control path takes {code} B of flash, and at most {CODE_LIMIT} are allowed");
    ensure!(joint <= JOINT_LIMIT, "a joint takes {joint} B of RAM, and at most {JOINT_LIMIT} are allowed");

    let mut table = String::from(
        "# Size of the control path\n\n\
         Bytes on a Cortex-M4F, law `masing` in `f32`, 16 turning points, start-up code included. Written by `cargo xtask size --overwrite`; the command\n\
         fails where they change, and on any panic or double-precision arithmetic left in the image.\n\n\
         | what | bytes |\n|---|---:|\n",
    );
    writeln!(table, "| code and constants, flash | {code} |")?;
    writeln!(table, "| coefficients of a gear | {gear} |")?;
    writeln!(table, "| state of a joint, RAM | {joint} |")?;
    print!("{table}");
    golden::check(&shell.current_dir().join(TABLE), &table, overwrite)
}

fn is_panic(name: &str) -> bool {
    name.contains("panic") || name.contains("unwind")
}

/// The run-time routines of double-precision arithmetic, by their names in the ABI of Arm and in the compiler.
fn is_double(name: &str) -> bool {
    name.starts_with("__aeabi_d")
        || matches!(name, "__aeabi_f2d" | "__aeabi_i2d" | "__aeabi_ui2d" | "__aeabi_l2d" | "__aeabi_ul2d")
        || (name.starts_with("__") && name.contains("df") && name.ends_with(|c: char| c.is_ascii_digit()))
}
