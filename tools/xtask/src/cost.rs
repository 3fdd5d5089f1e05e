//! Instructions a call, counted in the emulator, as a table in the repository.

use std::fmt::Write;

use anyhow::{Context, Result, bail};
use xshell::Shell;

use crate::emulator::{self, Clock};
use crate::machine::{self, Machine};
use crate::registry;

/// The table that this command keeps.
const TABLE: &str = "docs/cost.md";

/// Counts that differ by less are the same: the code generator may place a constant differently.
pub const TOLERANCE: f64 = 1.0;

/// What a control loop can afford, instructions on the Cortex-M4F. Exceeding one fails.
const LIMITS: [(&str, f64); 6] = [
    ("law `masing`, away from a reversal", 60.0),
    ("inverse of law `masing`, mean of a sine", 350.0),
    ("inverse of law `masing`, across a full stack", 700.0),
    ("law `phase`, away from a reversal", 250.0),
    ("law `time`, kernel `deflection`, gate `cycle`", 60.0),
    ("law `time`, kernel `rate`, gate `none`", 60.0),
];

/// One line of the table.
pub struct Call {
    /// What is called.
    pub name: String,
    /// What a call takes.
    pub instructions: f64,
}

/// Counts every call. A count above that of the table fails, unless it is accepted by `overwrite`.
pub fn run(shell: &Shell, overwrite: bool) -> Result<()> {
    let calls = count(shell, machine::M4F)?;
    for (name, limit) in LIMITS {
        let call = calls.iter().find(|call| call.name == name).with_context(|| format!("`{name}` was not counted"))?;
        if call.instructions > limit {
            bail!("{name}: {} instructions, and at most {limit} are allowed", call.instructions);
        }
    }
    let table = table(&calls)?;
    print!("{table}");
    registry::check(shell, &calls, overwrite)?;
    let file = shell.current_dir().join(TABLE);
    if overwrite {
        return shell.write_file(&file, table).with_context(|| format!("cannot write {TABLE}"));
    }
    let golden = shell.read_file(&file).with_context(|| format!("write {TABLE} with the option --overwrite"))?;
    compare(&parse(&golden), &calls)
}

fn count(shell: &Shell, machine: Machine) -> Result<Vec<Call>> {
    let image = machine.build(shell, "cost")?;
    let lines = emulator::lines(&image, machine, Clock::Instructions)?;
    lines
        .lines()
        .map(|line| {
            let mut words = line.splitn(3, ' ');
            let mut number = || words.next()?.parse::<f64>().ok();
            let (Some(ticks), Some(calls)) = (number(), number()) else {
                bail!("the image `cost` printed `{line}`: expected ticks, calls and a name");
            };
            let name = words.next().unwrap_or_default().to_owned();
            Ok(Call { name, instructions: (ticks * machine.instructions_per_tick / calls).round() })
        })
        .collect()
}

fn table(calls: &[Call]) -> Result<String> {
    let mut text = String::from(
        "# Cost of a call\n\n\
         Instructions on a Cortex-M4F in `f32`, call included, counted by the emulator (`-icount shift=0`). Written by\n\
         `cargo xtask cost --overwrite`; `cargo xtask cost` fails where a count has grown. An instruction is not a cycle: a division or a square\n\
         root takes 14, a taken branch 2 to 4, most others 1, flash wait states aside.\n\n\
         | call | instructions |\n|---|---:|\n",
    );
    for call in calls {
        writeln!(text, "| {} | {} |", call.name, call.instructions)?;
    }
    Ok(text)
}

fn parse(table: &str) -> Vec<Call> {
    let row = |line: &str| {
        let mut cells = line.trim_matches('|').split(" | ").map(str::trim);
        let (name, instructions) = (cells.next()?.to_owned(), cells.next()?.parse().ok()?);
        Some(Call { name, instructions })
    };
    table.lines().filter_map(row).collect()
}

fn compare(golden: &[Call], calls: &[Call]) -> Result<()> {
    let mut complaints = Vec::new();
    for call in calls {
        match golden.iter().find(|known| known.name == call.name) {
            None => complaints.push(format!("{}: not in the table", call.name)),
            Some(known) if call.instructions > known.instructions + TOLERANCE => complaints.push(format!(
                "{}: {} instructions, {} in the table",
                call.name, call.instructions, known.instructions
            )),
            Some(known) if call.instructions < known.instructions - TOLERANCE => {
                println!("cost: {} fell from {}: lower the table with --overwrite", call.name, known.instructions);
            }
            Some(_) => {}
        }
    }
    for known in golden.iter().filter(|known| !calls.iter().any(|call| call.name == known.name)) {
        complaints.push(format!("{}: in the table, but no longer counted", known.name));
    }
    if complaints.is_empty() {
        return Ok(());
    }
    bail!("{TABLE}: {}\nif that is meant, accept it with --overwrite", complaints.join("\n"))
}
