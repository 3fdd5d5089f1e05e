//! Bytes of the control path of one joint, and what must not be in it.

use std::collections::BTreeMap;
use std::fmt::Write;

use anyhow::{Context, Result, bail, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind};
use rustc_demangle::demangle;
use xshell::Shell;

use crate::cost;
use crate::emulator::{self, Clock};
use crate::golden;
use crate::machine::{self, Machine};

const TABLE: &str = "docs/size.md";

/// An image that is nothing but a control path.
struct Path {
    image: &'static str,
    machine: Machine,
    title: &'static str,
    /// Flash for the code and constants, start-up code included.
    code_limit: u64,
    /// RAM for one joint.
    joint_limit: u64,
}

const PATHS: [Path; 9] = [
    Path {
        image: "core_path",
        machine: machine::M0,
        title: "in fixed point on a Cortex-M0: law `masing`, forward and inverse, 16 turning points",
        code_limit: 15_360,
        joint_limit: 256,
    },
    Path {
        image: "core_path",
        machine: machine::M4F,
        title: "law `masing`, forward and inverse, 16 turning points",
        code_limit: 4_500,
        joint_limit: 256,
    },
    Path {
        image: "adapt_path",
        machine: machine::M4F,
        title: "law `masing`, forward and inverse, 16 turning points, with its adaptation",
        code_limit: 7_566,
        // With the 112 B of its coefficients the adaptation takes 508 B beside the path.
        joint_limit: 600,
    },
    Path {
        image: "loader_path",
        machine: machine::M4F,
        title: "law `masing`, forward and inverse, with the loader of a prepared block and its self-test",
        code_limit: 10_000,
        joint_limit: 256,
    },
    Path {
        image: "feedforward_path",
        machine: machine::M4F,
        title: "feed-forward of a joint, law `masing`, to the position of the motor",
        code_limit: 8192,
        joint_limit: 512,
    },
    Path {
        image: "servo_path",
        machine: machine::M4F,
        title: "servo of a joint, law chosen at run time",
        code_limit: 16_384,
        joint_limit: 512,
    },
    Path {
        image: "stored_servo_path",
        machine: machine::M4F,
        title: "servo of a joint with terms of every kind, set up from the bytes of its block",
        code_limit: 90_000,
        joint_limit: 1280,
    },
    Path {
        image: "varying_path",
        machine: machine::M4F,
        title: "law chosen at run time, forward and inverse, samples at uneven periods",
        code_limit: 12_800,
        joint_limit: 256,
    },
    Path {
        image: "terms_path",
        machine: machine::M4F,
        title: "law `masing`, forward, with room for eight terms of every kind",
        code_limit: 21_504,
        joint_limit: 1024,
    },
];

/// The image that paints its stack.
const STACK: &str = "stack";

/// Stack of a call, B.
const STACK_LIMIT: u64 = 512;
/// Stack of a loader, once at boot, B.
const LOADER_STACK_LIMIT: u64 = 1024;

/// The image that counts what set-up takes.
const BOOT: &str = "boot";

/// Instructions from a prepared block to the first torque.
const BOOT_LIMIT: f64 = 12_000.0;

/// Test instruments that set up every law from SI units and compute references in double precision, and what for.
const INSTRUMENTS: [(&str, &str); 6] = [
    ("bits", "the bits of every law and its set-up, beside the host's"),
    ("boot", "instructions of set-ups, including that from SI units"),
    ("cost", "instructions of every law, beside peers"),
    ("joint", "a joint that a host simulates: the host sends SI units"),
    ("stack", "stack of every law and term"),
    ("worst_case", "the costliest torques of many gears"),
];

/// Images that a core without floating point runs, too.
const FIXED_POINT: [&str; 3] = ["control", "core_path", "node"];

/// What a control path weighs.
struct Weight {
    code: u64,
    gear: u64,
    joint: u64,
}

/// Weighs the control paths on the Cortex-M4F; `overwrite` accepts their sizes.
pub fn run(shell: &Shell, overwrite: bool) -> Result<()> {
    let mut table = String::from(
        "# Size of the control path\n\n\
         Bytes on a Cortex-M4F in `f32` unless said otherwise, start-up code included. Written by `cargo xtask size --overwrite`; the command fails\n\
         if a control path contains a panic, if an image contains double-precision arithmetic, if an image in fixed point contains floating-point arithmetic or wide multiplication, if a size exceeds\n\
         its limit, or if a number changes. Flash, stack and set-up may change by 1 %, or by eight bytes, because another patch version of the compiler may change\n\
         them by that much. Law `masing` alone, forward and inverse, is closer to its limit than that; it may grow only up to the limit.\n\n\
         | control path of a joint | code and constants, flash | allowed | coefficients of a gear | state of a joint, RAM |\n|---|---:|---:|---:|---:|\n",
    );
    for path in PATHS {
        let Weight { code, gear, joint } = weigh(shell, &path)?;
        let Path { image, title, code_limit, joint_limit, .. } = path;
        ensure!(code <= code_limit, "`{image}` takes {code} B of flash, and at most {code_limit} are allowed");
        ensure!(
            joint <= joint_limit,
            "a joint of `{image}` takes {joint} B of RAM, and at most {joint_limit} are allowed"
        );
        writeln!(table, "| {title} | {code} | {code_limit} | {gear} | {joint} |")?;
    }
    table.push_str(
        "\nRAM of terms: each place for a term has room for the largest kind. That is 264 B of coefficients (`unknown`, a curve of 32 knots) and 76 B of state\n\
         (`nonlocal_memory`, 16 slip elements), so eight places take 2.7 kB. `Stack<S, K>` has `K` places, by default eight; in C the program provides as many places as it needs (c/README.md).\n",
    );
    table.push_str(
        "\nLargest stack below the caller, on paths that reach every branch, measured by painting the stack.\n\n\
         | call | stack |\n|---|---:|\n",
    );
    let image = machine::M4F.build(shell, STACK)?;
    for line in emulator::lines(&image, machine::M4F, Clock::Free)?.lines() {
        let Some((Ok(bytes), name)) = line.split_once(' ').map(|(bytes, name)| (bytes.parse::<u64>(), name)) else {
            bail!("the image `{STACK}` printed `{line}`: expected bytes and a name");
        };
        ensure!(bytes > 0, "the image `{STACK}` says: {name}");
        let limit = if name.starts_with("loading") { LOADER_STACK_LIMIT } else { STACK_LIMIT };
        ensure!(bytes <= limit, "{name} takes {bytes} B of stack, and at most {limit} are allowed");
        writeln!(table, "| {name} | {bytes} |")?;
    }
    table.push_str(
        "\nInstructions from the bytes of a stored block to the first torque, counted by the emulator: the checks of the block, the set-up of law and inverse, the self-test and a step. `gmhm pack` writes the\n\
         words of the set-up into every block with an inverse. Blocks without them are set up on the drive in `f64` (`Parameters::load_any`, in C `gmhm_load_any`), and for parameters in SI units the drive also searches the invertible range.\n\n\
         | set-up | instructions |\n|---|---:|\n",
    );
    let image = machine::M4F.build(shell, BOOT)?;
    for line in emulator::lines(&image, machine::M4F, Clock::Instructions)?.lines() {
        let (name, ticks) = cost::measurement(line)?;
        ensure!(ticks > 0.0, "the image `{BOOT}` says: {name}");
        let instructions = (ticks * machine::M4F.instructions_per_tick).round();
        let is_prepared = !name.contains(", from");
        ensure!(
            !is_prepared || instructions <= BOOT_LIMIT,
            "set-up of {name} takes {instructions} instructions, and at most {BOOT_LIMIT} are allowed"
        );
        writeln!(table, "| {name} | {instructions} |")?;
    }
    no_double(shell)?;
    table.push_str(
        "\nNo other image holds a routine of double-precision arithmetic, also none of `control`, `node` and `core_path` on a Cortex-M0: a stored block drives everything. The exceptions are\n\
         test instruments that compute references in it.\n\n| image | double precision for |\n|---|---|\n",
    );
    for (image, purpose) in INSTRUMENTS {
        writeln!(table, "| `{image}` | {purpose} |")?;
    }
    print!("{table}");
    let file = shell.current_dir().join(TABLE);
    let golden = if overwrite { None } else { shell.read_file(&file).ok() };
    if golden.is_some_and(|golden| table != golden && is_close(&table, &golden)) {
        println!(
            "size: {TABLE} says a little else, as after another version of the compiler: take this over with --overwrite"
        );
        return Ok(());
    }
    golden::check(&file, &table, overwrite)
}

/// Whether two tables differ in flash, stack and set-up alone, and there by little.
fn is_close(table: &str, golden: &str) -> bool {
    let close = |now: &str, then: &str| {
        let [Ok(now), Ok(then)] = [now, then].map(str::parse::<u64>) else { return false };
        now.abs_diff(then) <= (then / 100).max(8)
    };
    // The second cell of a row, behind its name.
    let same_row = |(now, then): (&str, &str)| {
        let cells = |row: &str| row.split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
        let (now, then) = (cells(now), cells(then));
        let same = |(column, (now, then)): (usize, (&String, &String))| now == then || column == 2 && close(now, then);
        now.len() == then.len() && now.iter().zip(&then).enumerate().all(same)
    };
    table.lines().count() == golden.lines().count() && table.lines().zip(golden.lines()).all(same_row)
}

/// Refuses an image with double-precision arithmetic that is not one of [`INSTRUMENTS`], and an instrument without.
fn no_double(shell: &Shell) -> Result<()> {
    let manifest = shell.read_file("Cargo.toml")?;
    let images =
        manifest.split("[[bin]]").skip(1).filter_map(|bin| bin.split('"').nth(1)).map(|image| (image, machine::M4F));
    for (image, machine) in images.chain(FIXED_POINT.map(|image| (image, machine::M0))) {
        let elf = shell.read_binary_file(machine.build(shell, image)?)?;
        let file = object::File::parse(&*elf).with_context(|| format!("cannot read the image `{image}`"))?;
        let names = file.symbols().map(|symbol| Ok(format!("{:#}", demangle(symbol.name()?))));
        let names = names.collect::<Result<Vec<_>>>()?;
        let double = names.iter().find(|name| is_double(name));
        let is_instrument = INSTRUMENTS.iter().any(|(instrument, _)| *instrument == image);
        match double {
            Some(double) => ensure!(
                is_instrument,
                "the image `{image}` for the {} computes in double precision: it holds `{double}`",
                machine.core
            ),
            None => {
                ensure!(!is_instrument, "the image `{image}` needs no double precision: it is no exception any more")
            }
        }
    }
    Ok(())
}

/// Reads the sections and symbols of an image; refuses it if something is in it that must not be.
fn weigh(shell: &Shell, path: &Path) -> Result<Weight> {
    let image = path.image;
    let elf = shell.read_binary_file(path.machine.build(shell, image)?)?;
    let file = object::File::parse(&*elf).with_context(|| format!("cannot read the image `{image}`"))?;
    let (mut gear, mut joint) = (None, None);
    // By its symbols: the gaps between them depend on the folder that it is built in.
    let mut code = BTreeMap::new();
    for symbol in file.symbols() {
        let name = format!("{:#}", demangle(symbol.name()?));
        ensure!(!is_panic(&name), "the control path can panic: the image `{image}` holds `{name}`");
        ensure!(!is_double(&name), "the f32 path computes in double precision: the image `{image}` holds `{name}`");
        ensure!(
            path.machine.has_floats() || !is_soft(&name),
            "fixed point needs no `{name}`, and the image `{image}` for the {} holds it",
            path.machine.core
        );
        match name.rsplit_once("::") {
            Some((_, "GEAR")) => gear = Some(symbol.size()),
            Some((_, "JOINT")) => joint = Some(symbol.size()),
            _ => {}
        }
        let section = symbol.section_index().and_then(|index| file.section_by_index(index).ok());
        if section.is_some_and(|section| section.kind() == SectionKind::Text || section.name() == Ok(".rodata")) {
            let size = code.entry(symbol.address() & !1).or_default();
            *size = symbol.size().max(*size);
        }
    }
    let code = code.values().sum();
    let gear = gear.with_context(|| format!("the image `{image}` has no GEAR"))?;
    let joint = joint.with_context(|| format!("the image `{image}` has no JOINT"))?;
    Ok(Weight { code, gear, joint })
}

/// Bytes of code, constants and initial values of a linked program.
pub fn held(file: &object::File<'_>) -> u64 {
    let is_held = |kind: SectionKind| matches!(kind, SectionKind::Text | SectionKind::ReadOnlyData | SectionKind::Data);
    file.sections().filter(|section| is_held(section.kind())).map(|section| section.size()).sum()
}

pub fn is_panic(name: &str) -> bool {
    name.contains("panic") || name.contains("unwind")
}

/// The run-time routines of floating-point arithmetic and of the multiplication of 64-bit words.
fn is_soft(name: &str) -> bool {
    name.starts_with("__aeabi_f")
        || matches!(name, "__aeabi_i2f" | "__aeabi_ui2f" | "__aeabi_l2f" | "__aeabi_ul2f" | "__aeabi_lmul" | "__muldi3")
        || (name.starts_with("__") && name.contains("sf") && name.ends_with(|c: char| c.is_ascii_digit()))
}

/// The run-time routines of double-precision arithmetic, by their names in the ABI of Arm and in the compiler.
pub fn is_double(name: &str) -> bool {
    name.starts_with("__aeabi_d")
        || matches!(name, "__aeabi_f2d" | "__aeabi_i2d" | "__aeabi_ui2d" | "__aeabi_l2d" | "__aeabi_ul2d")
        || (name.starts_with("__") && name.contains("df") && name.ends_with(|c: char| c.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::is_close;

    #[test]
    fn another_compiler_may_move_a_little_flash_and_nothing_else() {
        let golden = "# Size\n| a path | 4000 | 112 | 196 |\n| a call | 288 |\n";
        assert!(is_close(golden, golden));
        assert!(is_close("# Size\n| a path | 4040 | 112 | 196 |\n| a call | 296 |\n", golden));
        for other in [
            "# Size\n| a path | 4041 | 112 | 196 |\n| a call | 288 |\n",
            "# Size\n| a path | 4000 | 116 | 196 |\n| a call | 288 |\n",
            "# Size\n| a path | 4000 | 112 | 200 |\n| a call | 288 |\n",
            "# Size\n| a path | 4000 | 112 | 196 |\n| a call | 297 |\n",
            "# Size\n| another path | 4000 | 112 | 196 |\n| a call | 288 |\n",
            "# Size\n| a path | 4000 | 112 | 196 |\n",
        ] {
            assert!(!is_close(other, golden), "{other}");
        }
    }
}
