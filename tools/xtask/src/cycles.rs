//! An estimate of cycles from a trace of the emulator and the documented timings of the Cortex-M4.
//!
//! The image is run twice. On the way through the first run's trace the cycles are added up, and noted at each reading of the image's counter; in the second
//! run the counter gives these readings, so that the image prints cycles where it else prints ticks.
//!
//! Timings: Cortex-M4 Technical Reference Manual r0p1, tables 3-1 and 7-1. Memory without wait states; a refilled pipeline takes two cycles; a load or store next
//! to another takes one; a division takes its longest, 12.

use std::collections::HashMap;
use std::io::{BufRead, BufReader};
use std::path::Path;

use anyhow::{Context, Result, ensure};
use object::{Object, ObjectSymbol};
use xshell::{Shell, cmd};

use crate::emulator::{self, Clock, Script};
use crate::machine::Machine;

/// Where the image looks for the readings of its counter, and what tells it that they are there.
const SCRIPT: (u64, [u32; 2]) = (0x2100_0000, [0x676d_686d, 0x636f_7374]);

/// The emulator translates no stretch of code across a boundary of this many bytes.
const PAGE: u64 = 1024;

/// Cycles to refill the pipeline after a branch: 1 to 3.
const REFILL: u64 = 2;

/// The lines of the image `cost`, in cycles.
pub fn lines(shell: &Shell, image: &Path, machine: Machine) -> Result<String> {
    let elf = std::fs::read(image)?;
    let file = object::File::parse(&*elf)?;
    let reading = file.symbols().find(|symbol| symbol.name() == Ok("reading"));
    let reading = reading.with_context(|| format!("{} has no function `reading`", image.display()))?.address() & !1;
    let readings = readings(image, machine, &program(shell, image)?, reading)?;
    let (address, written) = SCRIPT;
    let words = [&written[..], &[readings.len().try_into()?], &readings].concat();
    let mut text = String::new();
    emulator::run(image, machine, Clock::Free, Some(&Script { address, words }), |line| {
        text.push_str(line);
        text.push('\n');
    })?;
    Ok(text)
}

/// Runs the image once and notes the cycles at each call of the function at `reading`.
fn readings(image: &Path, machine: Machine, program: &Program, reading: u64) -> Result<Vec<u32>> {
    let mut trace = emulator::trace(image, machine)?;
    let mut lines = BufReader::new(trace.output().context("the emulator has no trace")?);
    let (mut progress, mut before) = (Progress::default(), Progress::default());
    let (mut readings, mut line, mut known) = (Vec::new(), Vec::new(), HashMap::new());
    while lines.read_until(b'\n', &mut line)? > 0 {
        if line.starts_with(b"Trace") {
            // Trace 0: host address [flags/address/…] symbol
            let field = line.split(|&byte| byte == b'/').nth(1).context("the trace names no address")?;
            let to = u64::from_str_radix(std::str::from_utf8(field)?, 16)?;
            before = progress;
            if let Some(from) = progress.at.replace(to) {
                progress.cycles += *known.entry((from, to)).or_insert_with(|| stretch(program, from, to));
            }
            if to == reading {
                readings.truncate(progress.readings);
                readings.push(progress.cycles as u32 & 0x00ff_ffff);
                progress.readings += 1;
            }
        } else if line.starts_with(b"Stopped") {
            // The stretch was entered and left at once; it will be entered again.
            progress = before;
        }
        line.clear();
    }
    readings.truncate(progress.readings);
    ensure!(!readings.is_empty(), "the trace of {} holds no reading of its counter", image.display());
    Ok(readings)
}

/// Progress along the trace.
#[derive(Debug, Clone, Copy, Default)]
struct Progress {
    at: Option<u64>,
    cycles: u64,
    readings: usize,
}

/// The instructions of an image by their addresses.
type Program = HashMap<u64, Instruction>;

/// Cycles from where the emulator has entered a stretch of code to where it enters the next one.
fn stretch(program: &Program, from: u64, to: u64) -> u64 {
    let (mut at, mut cycles, mut follows_access) = (from, 0, false);
    while let Some(instruction) = program.get(&at) {
        cycles += instruction.cycles - u64::from(follows_access && instruction.is_access && instruction.cycles == 2);
        follows_access = instruction.is_access;
        at += instruction.bytes;
        if instruction.branches || at == to && (to.is_multiple_of(PAGE) || from / PAGE != (at - 1) / PAGE) {
            break;
        }
    }
    cycles + if at == to { 0 } else { REFILL }
}

/// An instruction and what it takes where the next one follows it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Instruction {
    bytes: u64,
    cycles: u64,
    /// One load or store of the integer unit.
    is_access: bool,
    /// It may go on elsewhere.
    branches: bool,
}

/// Every instruction of the image by its address.
fn program(shell: &Shell, image: &Path) -> Result<Program> {
    let root = cmd!(shell, "rustc --print sysroot").quiet().read()?;
    let host = cmd!(shell, "rustc --print host-tuple").quiet().read()?;
    let disassembler = format!("{root}/lib/rustlib/{host}/bin/llvm-objdump");
    let text = cmd!(shell, "{disassembler} --disassemble --no-print-imm-hex {image}")
        .quiet()
        .read()
        .with_context(|| format!("cannot run {disassembler}: run `cargo xtask setup`, which installs it"))?;
    Ok(text.lines().filter_map(parse).collect())
}

/// `     458: e92d 4ff0    push.w {r4, r5}`, tabs before the mnemonic and the operands.
fn parse(line: &str) -> Option<(u64, Instruction)> {
    let (address, rest) = line.split_once(':')?;
    let address = u64::from_str_radix(address.trim(), 16).ok()?;
    let mut fields = rest.split('\t');
    let digits = fields.next()?.chars().filter(char::is_ascii_hexdigit).count();
    let mnemonic = fields.next()?.split('.').next()?;
    let operands = fields.next().unwrap_or_default();
    let (cycles, is_access) = timing(mnemonic, operands);
    let (target, to_target) = (operands.split(',').next().unwrap_or_default(), mnemonic.starts_with("ldr"));
    let branches =
        is_branch(mnemonic) || to_target && target == "pc" || mnemonic.starts_with("pop") && operands.contains("pc");
    Some((address, Instruction { bytes: digits as u64 / 2, cycles, is_access, branches }))
}

/// Branches, and what else ends a stretch.
fn is_branch(mnemonic: &str) -> bool {
    const CONDITIONS: [&str; 15] =
        ["", "eq", "ne", "hs", "lo", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le"];
    let conditional = |name: &str| mnemonic.strip_prefix(name).is_some_and(|rest| CONDITIONS.contains(&rest));
    ["b", "bl", "bx", "blx"].into_iter().any(conditional)
        || matches!(
            mnemonic,
            "cbz" | "cbnz" | "tbb" | "tbh" | "bkpt" | "svc" | "msr" | "cpsid" | "cpsie" | "isb" | "wfi" | "wfe"
        )
}

/// Cycles, and whether it is a single load or store.
fn timing(mnemonic: &str, operands: &str) -> (u64, bool) {
    let is = |names: &[&str]| names.iter().any(|name| mnemonic.starts_with(name));
    if is(&["vdiv", "vsqrt"]) {
        (14, false)
    } else if is(&["vmla", "vmls", "vnmla", "vnmls", "vfma", "vfms", "vfnm"]) {
        (3, false)
    } else if is(&["vldr", "vstr"]) {
        (2 + u64::from(operands.starts_with('d')), false)
    } else if is(&["push", "pop", "ldm", "stm", "vpush", "vpop", "vldm", "vstm"]) {
        (1 + registers(operands), false)
    } else if mnemonic.starts_with('v') {
        // A pair of core registers takes one more.
        (1 + u64::from(is(&["vmov"]) && operands.matches(',').count() >= 2), false)
    } else if is(&["ldrd", "strd"]) {
        (3, false)
    } else if is(&["ldr"]) {
        (2, true)
    } else if is(&["str"]) {
        // Its data phase hides behind the next instruction, unless the address takes two registers.
        (
            if operands.contains('#') || !operands.contains("], ") && operands.matches(',').count() == 1 {
                1
            } else {
                2
            },
            true,
        )
    } else if is(&["sdiv", "udiv"]) {
        (12, false)
    } else if is(&["mla", "mls", "tbb", "tbh"]) {
        (2, false)
    } else {
        (1, false)
    }
}

/// Words in a list of registers: `{r4, r5, lr}` or `{d8, d9}`.
fn registers(operands: &str) -> u64 {
    let list = operands.split('{').nth(1).unwrap_or_default();
    let words = |register: &str| if register.trim_start().starts_with('d') { 2 } else { 1 };
    list.split(',').map(words).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instructions_take_what_the_manual_says() {
        let of = |line: &str| parse(line).map(|(_, instruction)| (instruction.bytes, instruction.cycles));
        assert_eq!(of("     458: e92d 43f0    \tpush.w\t{r4, r5, r6, r7, r8, r9, lr}"), Some((4, 8)));
        assert_eq!(of("     45c: ed2d 8b04    \tvpush\t{d8, d9}"), Some((4, 5)));
        assert_eq!(of("     460: ee81 0a00    \tvdiv.f32\ts0, s2, s0"), Some((4, 14)));
        assert_eq!(of("     464: ee00 1a81    \tvmla.f32\ts2, s1, s2"), Some((4, 3)));
        assert_eq!(of("     468: 6809         \tldr\tr1, [r1]"), Some((2, 2)));
        assert_eq!(of("     46a: 6009         \tstr\tr1, [r1]"), Some((2, 1)));
        assert_eq!(of("     46c: 5059         \tstr\tr1, [r3, r1]"), Some((2, 2)));
        assert_eq!(of("     46e: 4408         \tadd\tr0, r1"), Some((2, 1)));
        assert_eq!(of("00000458 <main>:"), None);
    }
}
