//! How long a fit takes and what it allocates.
//!
//! Published gear, σ = 0.1 N·m, uncertainty included. `given` keeps law masing, `chosen` tries every structure on two threads or more. Shortest wall time
//! of several runs; the CPU time is their mean, counts all threads and holds on a busy machine too.

use std::time::Instant;

use gmhm_tools::fit::FitOptions;
use gmhm_tools::fit::fit;
use gmhm_tools::recording::Recording;
use gmhm_tools::regression::error::EstimateError;

use super::gears::{Path, cycle, given, published, record};
use super::{A, COUNT_RAD, Line};

pub fn measure() -> Result<Vec<Line>, EstimateError> {
    let (elastic, memory) = published();
    let chosen = FitOptions { rated_deflection_rad: Some(A), ..FitOptions::default() };
    let mut lines = Vec::new();
    println!("{:>10} {:>8} {:>12} {:>12} {:>12}", "rows", "method", "time", "of CPU", "CPU a row");
    for (rows, cycles, runs, aim) in [
        (64, 1.0, 400, "≤ 5 ms"),
        (2000, 1.0, 40, "≤ 50 ms"),
        (100_000, 20.0, 3, "as many ns a row"),
        (1_000_000, 200.0, 2, "≤ 3 s"),
    ] {
        let recording = record(A, elastic, memory, &Path { theta: cycle(A, rows, cycles), period_s: 1e-3 }, 0.1, 1);
        let before = peak_bytes();
        let of_given = best(&recording, &given(A, memory), runs)?;
        // The recording itself is time, deflection, torque. Only the first run of the largest recording pushes the peak of the process up.
        let grown = peak_bytes().zip(before).map(|(after, before)| (after - before) / rows as f64 + 24.0);
        let of_chosen = best(&recording, &chosen, runs)?;
        for (name, (wall_s, cpu_s)) in [("given", of_given), ("chosen", of_chosen)] {
            let a_row = 1e9 * cpu_s / rows as f64;
            println!("{rows:>10} {name:>8} {:>9.2} ms {:>9.2} ms {a_row:>9.0} ns", 1e3 * wall_s, 1e3 * cpu_s);
        }
        let told = |(wall_s, cpu_s): (f64, f64)| format!("{} (CPU {})", seconds(wall_s), seconds(cpu_s));
        lines.push(Line::new(
            format!("{rows} rows: law given; law chosen among 10"),
            aim,
            format!("{}, {:.0} ns a row; {}", told(of_given), 1e9 * of_given.1 / rows as f64, told(of_chosen)),
        ));
        if rows == 1_000_000 {
            let bytes = grown.map_or("not known on this system".to_owned(), |bytes| format!("{bytes:.0} bytes a row"));
            lines.push(Line::new("memory of that, the recording included", "≤ 200 bytes a row", bytes));
        }
    }
    for (rows, cycles, runs, aim) in [(2000, 2.3, 20, "≤ 50 ms"), (1_000_000, 200.3, 2, "≤ 3 s")] {
        let mut counted = record(A, elastic, memory, &Path { theta: cycle(A, rows, cycles), period_s: 1e-3 }, 0.1, 1);
        counted.deflection_rad.iter_mut().flatten().for_each(|theta| *theta = (*theta / COUNT_RAD).round() * COUNT_RAD);
        let (wall_s, cpu_s) = best(&counted, &given(A, memory), runs)?;
        println!("{rows:>10} {:>8} {:>9.2} ms {:>9.2} ms", "counted", 1e3 * wall_s, 1e3 * cpu_s);
        lines.push(Line::new(
            format!("{rows} rows, law given, the deflection counted in steps of {:.0} µrad", 1e6 * COUNT_RAD),
            aim,
            format!("{} (CPU {})", seconds(wall_s), seconds(cpu_s)),
        ));
    }
    Ok(lines)
}

/// The shortest wall time and the mean CPU time of several fits, s.
fn best(recording: &Recording, options: &FitOptions, runs: usize) -> Result<(f64, f64), EstimateError> {
    let (mut best, cpu) = (f64::INFINITY, cpu_seconds());
    for _ in 0..runs {
        let clock = Instant::now();
        let found = fit(std::slice::from_ref(recording), options, &())?;
        best = best.min(clock.elapsed().as_secs_f64());
        assert!((found.rms - 0.1).abs() < 0.03, "{} N·m left", found.rms);
    }
    Ok((best, (cpu_seconds() - cpu) / runs as f64))
}

fn seconds(s: f64) -> String {
    if s < 1.0 { format!("{:.2} ms", 1e3 * s) } else { format!("{s:.2} s") }
}

/// What all threads of the process have computed so far, s; Linux only, else 0.
fn cpu_seconds() -> f64 {
    let of_thread = |entry: std::io::Result<std::fs::DirEntry>| {
        let text = std::fs::read_to_string(entry.ok()?.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    };
    std::fs::read_dir("/proc/self/task").map_or(0.0, |tasks| 1e-9 * tasks.filter_map(of_thread).sum::<f64>())
}

/// Most memory that the process has held so far; Linux only.
fn peak_bytes() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kib| 1024.0 * kib)
}
