//! What the program takes for many rows, many files, and to be built.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

use crate::program::{self, Profile};
use crate::time::children_s;

/// Between two looks at the memory of a process.
const EVERY: Duration = Duration::from_millis(20);
const GIB: f64 = (1_u64 << 30) as f64;

/// What a process took.
struct Taken {
    /// By the clock, s.
    clock_s: f64,
    /// All cores together, s.
    cpu_s: f64,
    /// Most memory, bytes.
    memory: f64,
}

/// What is allowed.
#[derive(Clone, Copy)]
enum Limit {
    /// By the clock, s, and of memory, bytes.
    ClockAndMemory(f64, f64),
    /// By the clock, s.
    Clock(f64),
    /// All cores together, s.
    Cores(f64),
}

impl Limit {
    fn holds(self, taken: &Taken) -> bool {
        match self {
            Self::ClockAndMemory(clock_s, memory) => taken.clock_s <= clock_s && taken.memory <= memory,
            Self::Clock(clock_s) => taken.clock_s <= clock_s,
            Self::Cores(cpu_s) => taken.cpu_s <= cpu_s,
        }
    }
}

impl std::fmt::Display for Limit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::ClockAndMemory(clock_s, memory) => write!(f, "{clock_s} s, {} GiB", memory / GIB),
            Self::Clock(clock_s) => write!(f, "{clock_s} s"),
            Self::Cores(cpu_s) => write!(f, "{cpu_s} s of all cores"),
        }
    }
}

/// Measures with the program built in release; with `build` also a release build from nothing. Fails at the end where a limit was exceeded.
pub fn run(shell: &Shell, build: bool) -> Result<()> {
    let program = program::gmhm(shell, Profile::Release)?;
    let folder = tempfile::tempdir()?;
    let gear = shell.current_dir().join("examples/bench/true_gear.toml");
    println!("{:<62} {:>8} {:>9} {:>9}  at most", "", "clock", "all cores", "memory");
    let mut exceeded = Vec::new();
    let mut report = |what: &str, taken: &Taken, limit: Limit| {
        let memory = if taken.memory > 0.0 { format!("{:.2} GiB", taken.memory / GIB) } else { String::new() };
        println!("{what:<62} {:>6.1} s {:>7.1} s {memory:>9}  {limit}", taken.clock_s, taken.cpu_s);
        if !limit.holds(taken) {
            exceeded.push(what.trim().to_owned());
        }
    };

    let simulate = "simulate GEAR --experiment cycle --cycles 250 --duration 10000 --sample-rate 999.9 -o rows.csv";
    measured(&program, folder.path(), &simulate.replace("GEAR", &gear.display().to_string()))?;
    let fit = "fit rows.csv --from 10 --to 9990 --rated-deflection 1.168e-3 -o rows.toml";
    report(
        "10 million rows: read, cropped, fitted",
        &measured(&program, folder.path(), fit)?,
        Limit::ClockAndMemory(60.0, 4.0 * GIB),
    );
    std::fs::remove_file(folder.path().join("rows.csv"))?;

    let simulated = |options: &str, seed: u32| -> Result<String> {
        let words = format!("simulate {} --experiment {options} --seed {seed} -o {seed}.csv", gear.display());
        measured(&program, folder.path(), &words)?;
        Ok(format!("{seed}.csv"))
    };
    for experiment in ["cycle --cycles 2", "amplitudes"] {
        let mut files = String::new();
        for seed in 1..=200 {
            files += &simulated(&format!("{experiment} --duration 130 --sample-rate 10"), seed)?;
            files.push(' ');
        }
        let what = format!("200 files of 1301 rows fitted together: {experiment}");
        let taken = measured(&program, folder.path(), &format!("fit {files} -o files.toml"))?;
        report(&what, &taken, Limit::Cores(10.0));
        let each = format!("fit --each {files} --ndjson files_{}.ndjson", experiment.len());
        report("  each by itself", &measured(&program, folder.path(), &each)?, Limit::Cores(10.0));
    }
    let mut list = String::new();
    for seed in 1..=2000 {
        list += &simulated("cycle --cycles 2 --duration 20 --sample-rate 100", seed)?;
        list.push('\n');
    }
    std::fs::write(folder.path().join("fleet.txt"), list)?;
    let fleet = measured(&program, folder.path(), "fit --each --files-from fleet.txt --ndjson fleet.ndjson")?;
    report("2000 files of 1999 rows, each by itself, the law chosen", &fleet, Limit::Clock(60.0));
    if build {
        let target = folder.path().join("target");
        let before = (Instant::now(), children_s()?);
        cmd!(shell, "cargo build --quiet --release --locked --package gmhm-tools --bin gmhm --target-dir {target}")
            .run()
            .context("the program does not build")?;
        let taken = Taken { clock_s: before.0.elapsed().as_secs_f64(), cpu_s: children_s()? - before.1, memory: 0.0 };
        report("a release build from nothing", &taken, Limit::Clock(240.0));
    }
    ensure!(exceeded.is_empty(), "more than is allowed, on a machine of load {}: {}", load(), exceeded.join("; "));
    Ok(())
}

/// Processes that run or wait to run, over the last minute; Linux only.
fn load() -> String {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split(' ').next().unwrap_or_default().to_owned()
}

/// Runs the program and measures it.
fn measured(program: &Path, folder: &Path, words: &str) -> Result<Taken> {
    let (began, before) = (Instant::now(), children_s()?);
    let mut child = Command::new(program)
        .args(words.split_whitespace())
        .arg("--quiet")
        .current_dir(folder)
        .stdin(Stdio::null())
        .spawn()
        .context("the program does not start")?;
    let mut memory = 0.0_f64;
    let status = loop {
        memory = memory.max(peak(child.id()).unwrap_or(0.0));
        if let Some(status) = child.try_wait()? {
            break status;
        }
        std::thread::sleep(EVERY);
    };
    ensure!(status.success(), "`gmhm {words}` fails");
    Ok(Taken { clock_s: began.elapsed().as_secs_f64(), cpu_s: children_s()? - before, memory })
}

/// Most memory that a process has held, bytes; Linux only.
fn peak(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kib| 1024.0 * kib)
}
