//! Instructions a call, counted in the emulator, as a table in the repository.

use std::fmt::Write;

use anyhow::{Context, Result, bail, ensure};
use xshell::Shell;

use crate::accuracy::Accuracy;
use crate::cycles;
use crate::emulator::{self, Clock};
use crate::machine::{self, Machine};
use crate::registry;

/// The table that this command keeps.
const TABLE: &str = "docs/cost.md";

/// Counts that differ by less are the same: the code generator may place a constant differently.
pub const TOLERANCE: f64 = 1.0;

/// Nor is a change by this share one: which call is the worst of many depends on the ticks of the timer.
const SHARE: f64 = 0.01;

/// The share by which an estimate may differ where the count does not.
const CYCLES_TOLERANCE: f64 = 0.05;

/// What is counted on one machine.
struct Image {
    machine: Machine,
    /// Its heading in the table.
    target: &'static str,
    /// What a control loop there can afford, instructions. Exceeding that fails.
    limits: &'static [(&'static str, f64)],
}

/// The image whose one line is of a call among too many to be traced: no cycles are estimated for it.
const WORST_CASE: &str = "worst_case";

/// The image of the adaptation, in floats; none are estimated for it either.
const ADAPTATION: &str = "adapt_cost";

const IMAGES: [Image; 2] = [
    Image { machine: machine::M4F, target: "Cortex-M4F in `f32`", limits: &LIMITS },
    Image { machine: machine::M0, target: "Cortex-M0 in fixed point", limits: &FIXED_LIMITS },
];

const LIMITS: [(&str, f64); 14] = [
    ("law `masing`, away from a reversal", 75.0),
    ("law `masing`, reversal", 280.0),
    ("law `masing`, reversal with a full stack", 280.0),
    ("law `masing`, full stack wiped out", 280.0),
    ("law `masing`, reversal that wipes out a full stack", 280.0),
    ("inverse of law `masing`, mean of a sine", 320.0),
    ("inverse of law `masing`, across a full stack", 700.0),
    ("inverse of law `masing`, worst of 5000", 700.0),
    ("inverse of law `masing`, worst of 300 000", 700.0),
    ("law `phase`, away from a reversal", 250.0),
    ("law `phase`, reversal by a large step", 265.0),
    ("law `time`, kernel `deflection`, gate `cycle`", 77.0),
    ("law `time`, kernel `rate`, gate `none`", 75.0),
    ("adaptation of law `masing`, the worst period of 1 ms", 350.0),
];

const FIXED_LIMITS: [(&str, f64); 7] = [
    ("law `masing`, away from a reversal", 415.0),
    ("law `masing`, reversal with a full stack", 1100.0),
    ("law `masing`, full stack wiped out", 1100.0),
    ("law `masing`, reversal that wipes out a full stack", 1100.0),
    ("inverse of law `masing`, across a full stack", 5000.0),
    ("inverse of law `masing`, worst of 5000", 5000.0),
    ("inverse of law `masing`, worst of 300 000", 5000.0),
];

/// What law `masing` must beat, however it is computed.
const CLOSED_FORM: &str = "closed form of the paper";

/// One line of the table.
pub struct Call {
    /// The core and scalar that it was counted for.
    pub target: String,
    /// What is called.
    pub name: String,
    /// What a call takes.
    pub instructions: f64,
    /// The estimate, where there is one.
    cycles: Option<f64>,
}

/// Counts every call. A count above that of the table fails, unless it is accepted by `overwrite`.
pub fn run(shell: &Shell, overwrite: bool) -> Result<()> {
    let mut calls = Vec::new();
    for Image { machine, target, limits } in IMAGES {
        let counted = count(shell, machine, target)?;
        for (name, limit) in limits {
            let call =
                counted.iter().find(|call| call.name == *name).with_context(|| format!("`{name}` was not counted"))?;
            if call.instructions > *limit {
                bail!("{target}: {name}: {} instructions, and at most {limit} are allowed", call.instructions);
            }
        }
        calls.extend(counted);
    }
    let own = |call: &&Call| call.name == LIMITS[0].0 && call.target == IMAGES[0].target;
    let own = calls.iter().find(own).context("law `masing` was not counted")?.instructions;
    for call in calls.iter().filter(|call| call.name.starts_with(CLOSED_FORM)) {
        ensure!(own < call.instructions, "law `masing` takes {own} instructions and no less than {}", call.name);
    }
    let table = table(&calls, &Accuracy::measure(shell)?)?;
    print!("{table}");
    registry::check(shell, &calls, overwrite)?;
    let file = shell.current_dir().join(TABLE);
    if overwrite {
        return shell.write_file(&file, table).with_context(|| format!("cannot write {TABLE}"));
    }
    let golden = shell.read_file(&file).with_context(|| format!("write {TABLE} with the option --overwrite"))?;
    compare(&parse(&golden), &calls)
}

fn count(shell: &Shell, machine: Machine, target: &str) -> Result<Vec<Call>> {
    let image = machine.build(shell, "cost")?;
    let counted = emulator::lines(&image, machine, Clock::Instructions)?;
    let estimated = if machine.has_floats() { cycles::lines(shell, &image, machine)? } else { String::new() };
    let mut estimated = estimated.lines();
    let call = |line, estimated: Option<&str>| {
        let (name, ticks) = measurement(line)?;
        let (same_name, cycles) = estimated.map(measurement).transpose()?.unzip();
        ensure!(
            same_name.is_none_or(|same| same == name),
            "the image `cost` printed another line than `{name}` in its second run"
        );
        // No instruction takes less than a cycle.
        let fits = cycles.is_none_or(|cycles| cycles > 0.98 * ticks * machine.instructions_per_tick - TOLERANCE);
        ensure!(fits, "{name}: fewer cycles than instructions: the trace of the emulator was not understood");
        Ok(Call {
            target: target.to_owned(),
            name: name.to_owned(),
            instructions: (ticks * machine.instructions_per_tick).round(),
            cycles: cycles.map(f64::round),
        })
    };
    let mut calls = counted.lines().map(|line| call(line, estimated.next())).collect::<Result<Vec<_>>>()?;
    let worst = emulator::lines(&machine.build(shell, WORST_CASE)?, machine, Clock::Instructions)?;
    let after = calls.iter().rposition(|call| call.name.contains("worst of")).map_or(calls.len(), |at| at + 1);
    calls.insert(after, call(worst.trim_end(), None)?);
    if machine.has_floats() {
        let adaptation = emulator::lines(&machine.build(shell, ADAPTATION)?, machine, Clock::Instructions)?;
        for line in adaptation.lines() {
            calls.push(call(line, None)?);
        }
    }
    Ok(calls)
}

/// The name and the ticks a call of a line.
pub fn measurement(line: &str) -> Result<(&str, f64)> {
    let mut words = line.splitn(3, ' ');
    let mut number = || words.next()?.parse::<f64>().ok();
    let (Some(ticks), Some(calls)) = (number(), number()) else {
        bail!("the image `cost` printed `{line}`: expected ticks, calls and a name");
    };
    Ok((words.next().unwrap_or_default(), ticks / calls))
}

fn table(calls: &[Call], accuracy: &Accuracy) -> Result<String> {
    let mut text = String::from(
        "# Cost of a call\n\n\
         Instructions, call included, counted by the emulator (`-icount shift=0`). Written by `cargo xtask cost --overwrite`; `cargo xtask cost`\n\
         fails if a count has grown.\n\n\
         Cycles are an **estimate**, measured on no board: the timings of the Cortex-M4 Technical Reference Manual along a trace of the emulator, memory without wait\n\
         states, two cycles to refill the pipeline after a branch, twelve for an integer division.\n\n\
         The error is the rms that `gmhm compare` leaves on held-out blocks of the demo's recording (synthetic, of the published gear, noise 0.1 N·m). It belongs\n\
         to a model, not to a call: every call of law `masing`, forward or inverse, has the 0.1 N·m of the first row. An operator inverse has the error of its model.\n\
         The closed form describes one steady cycle: on other paths of the recording it follows the curves of that cycle. No error is stated for models that `gmhm compare`\n\
         does not fit: laws `phase` and `time`, which it fits only if the recording requires them, and terms, which that gear does not have.\n\n\
         The worst of 300 000 inverses is searched along a test path with strokes of all sizes, nested loops that fill the stack and merge, jumps across it, and torques beyond\n\
         the range. No bound is proved: a call evaluates the torque at most four times to find its branch (of the eight that sixteen turning points leave), and the steps\n\
         of the root beyond the second are rare, not impossible. Of three million calls along the same test path the worst takes 675 in `f32` and 5163 in fixed point.\n",
    );
    let (mut target, mut estimated) = ("", false);
    for call in calls {
        if call.target != target {
            (target, estimated) = (&call.target, call.cycles.is_some());
            let (more, line) =
                if estimated { (" cycles (estimate) | held-out error, N·m |", "---:|---:|") } else { ("", "") };
            write!(text, "\n{HEADING}{target}\n\n| call | instructions |{more}\n|---|---:|{line}\n")?;
        }
        write!(text, "| {} | {} |", call.name, call.instructions)?;
        if estimated {
            let or_none = |number: Option<String>| number.unwrap_or_else(|| "–".to_owned());
            let cycles = or_none(call.cycles.map(|cycles| cycles.to_string()));
            let error = or_none(accuracy.of(&call.name).map(|error| format!("{error:.3}")));
            write!(text, " {cycles} | {error} |")?;
        }
        text.push('\n');
    }
    Ok(text)
}

const HEADING: &str = "## ";

fn parse(table: &str) -> Vec<Call> {
    let mut target = "";
    let mut row = |line| {
        target = str::strip_prefix(line, HEADING).unwrap_or(target);
        let mut cells = line.trim_matches('|').split(" | ").map(str::trim);
        let (name, instructions) = (cells.next()?.to_owned(), cells.next()?.parse().ok()?);
        let cycles = cells.next().and_then(|cell| cell.parse().ok());
        Some(Call { target: target.to_owned(), name, instructions, cycles })
    };
    table.lines().filter_map(&mut row).collect()
}

fn compare(golden: &[Call], calls: &[Call]) -> Result<()> {
    let mut complaints = Vec::new();
    let same = |a: &Call, b: &Call| a.target == b.target && a.name == b.name;
    for call in calls {
        let Call { target, name, instructions, cycles } = call;
        match golden.iter().find(|known| same(known, call)) {
            None => complaints.push(format!("{target}: {name}: not in the table")),
            Some(known) if *instructions > (1.0 + SHARE) * known.instructions + TOLERANCE => complaints
                .push(format!("{target}: {name}: {instructions} instructions, {} in the table", known.instructions)),
            Some(known) if *instructions < (1.0 - SHARE) * known.instructions - TOLERANCE => {
                println!("cost: {target}: {name} fell from {}: lower the table with --overwrite", known.instructions);
            }
            Some(known) => {
                let (now, then) = (cycles.unwrap_or_default(), known.cycles.unwrap_or_default());
                if (now - then).abs() > CYCLES_TOLERANCE * then + TOLERANCE {
                    complaints.push(format!("{target}: {name}: {now} cycles, {then} in the table"));
                }
            }
        }
    }
    for known in golden.iter().filter(|known| !calls.iter().any(|call| same(known, call))) {
        complaints.push(format!("{}: {}: in the table, but no longer counted", known.target, known.name));
    }
    if complaints.is_empty() {
        return Ok(());
    }
    bail!("{TABLE}: {}\nif that is meant, accept it with --overwrite", complaints.join("\n"))
}
