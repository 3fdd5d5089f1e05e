//! How long a fit takes and what it allocates: `cargo bench -p gmhm-tools --bench fit_speed`.
//!
//! Published gear, σ = 0.1 N·m, uncertainty included. `given` keeps law masing, `chosen` tries every structure. Best of several runs.

use std::time::Instant;

use gmhm_tools::estimate::{FitOptions, fit};
use gmhm_tools::model::Model;

#[path = "../tests/gears/mod.rs"]
mod gears;

use gears::{Path, cycle, published, record};

const A: f64 = 1.168e-3;

fn main() {
    let (elastic, memory) = published();
    let mut start = Model { elastic: Some(elastic), memory: Some(memory), ..Model::default() };
    start.gear.rated_deflection_rad = Some(A);
    let given = FitOptions { start: Some(start), ..FitOptions::default() };
    let chosen = FitOptions { rated_deflection_rad: Some(A), ..FitOptions::default() };
    println!("{:>10} {:>8} {:>12} {:>12} {:>12}", "rows", "method", "time", "ns a row", "bytes a row");
    for (rows, cycles, runs) in [(64, 1.0, 20), (2000, 1.0, 10), (100_000, 20.0, 3), (1_000_000, 200.0, 2)] {
        let recording = record(A, elastic, memory, &Path { theta: cycle(A, rows, cycles), period_s: 1e-3 }, 0.1, 1);
        for (name, options) in [("given", &given), ("chosen", &chosen)] {
            let mut best = f64::INFINITY;
            let before = peak_bytes();
            for _ in 0..runs {
                let clock = Instant::now();
                let found = fit(std::slice::from_ref(&recording), options, &());
                best = best.min(clock.elapsed().as_secs_f64());
                assert!(found.is_ok_and(|f| (f.rms - 0.1).abs() < 0.03));
            }
            // The recording itself is time, deflection, torque. The peak of the process is only pushed up by the first run of the largest recording.
            let bytes = peak_bytes().zip(before).map(|(after, before)| (after - before) / rows as f64 + 24.0);
            let memory =
                bytes.filter(|_| rows == 1_000_000 && name == "given").map_or("-".to_owned(), |b| format!("{b:.0}"));
            println!("{rows:>10} {name:>8} {:>9.2} ms {:>12.0} {memory:>12}", 1e3 * best, 1e9 * best / rows as f64);
        }
    }
}

/// Most memory that the process has held so far; Linux only.
fn peak_bytes() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kib| 1024.0 * kib)
}
