//! How long a diagnosis takes and the most memory it holds: `cargo bench -p gmhm-tools --bench diagnose_speed [-- ROWS…]`, by default 18,000, 60,000 and 10 million rows.
//!
//! Published gear with the motor running to and fro under a varying load, 1 kHz, both angles and a temperature recorded, so that every kind is a candidate; torque
//! noise 0.05 N·m of first order, a kinematic error of order 2 hidden. Seconds by the clock and of all cores; memory is the largest resident set during the
//! diagnosis, the recording included (Linux only). Below each line its stages: time, and the largest resident set when they ended.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use gmhm_tools::diagnose::{Options, diagnose};
use gmhm_tools::model::Model;
use gmhm_tools::progress::Progress;
use gmhm_tools::recording::Recording;
use indicatif::{ProgressBar, ProgressStyle};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

#[path = "../tests/gears/mod.rs"]
mod gears;

const SEED: u64 = 1;

/// Rows, and what is aimed at on two cores.
const AIMS: [(usize, &str); 3] = [(18_000, "1.5 s of all cores"), (60_000, "4 s"), (10_000_000, "60 s, 4096 MiB")];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let asked: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let rows = if asked.is_empty() { AIMS.map(|a| a.0).to_vec() } else { asked };
    let cores = std::thread::available_parallelism()?;
    println!("{cores} cores, seed {SEED}");
    println!(
        "{:>10} {:>9} {:>9} {:>9} {:>12}  {:<18} named",
        "rows", "time", "all cores", "memory", "bytes a row", "aim"
    );
    for rows in rows {
        let (model, recording) = case(rows);
        forget_peak();
        let (clock, cpu) = (Instant::now(), cpu_seconds());
        let bar = Bar::new();
        let found = diagnose(&[recording], &model, &[], &Options::default(), &bar)?;
        let seconds = clock.elapsed().as_secs_f64();
        let cpu = cpu_seconds().zip(cpu).map_or("-".to_owned(), |(after, before)| format!("{:.1} s", after - before));
        let (memory, each) = peak_bytes().map_or(("-".to_owned(), "-".to_owned()), |bytes| {
            (format!("{:.0} MiB", bytes / f64::from(1 << 20)), format!("{:.0}", bytes / rows as f64))
        });
        let aim = AIMS.iter().find(|a| a.0 == rows).map_or("-", |a| a.1);
        let names: Vec<&str> = found.diagnosis.effects.iter().map(|e| e.name.as_str()).collect();
        println!("{rows:>10} {seconds:>7.1} s {cpu:>9} {memory:>9} {each:>12}  {aim:<18} {}", names.join(", "));
        for line in bar.stages() {
            println!("           {line}");
        }
    }
    Ok(())
}

/// The base model, and the recording of a gear with a kinematic error.
fn case(rows: usize) -> (Model, Recording) {
    let (model, mut recording) = gears::with_kinematic_error(rows, 1.0);
    let part = |row: usize| row as f64 / rows as f64;
    recording.temperature_c = Some((0..rows).map(|row| 22.0 + 8.0 * (1.0 - (-3.0 * part(row)).exp())).collect());
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let (carried, mut noise) = (0.9_f64, 0.0);
    for torque in recording.torque.iter_mut().flatten() {
        let normal: f64 = StandardNormal.sample(&mut random);
        noise = carried * noise + 0.05 * (1.0 - carried * carried).sqrt() * normal;
        *torque += noise;
    }
    (model, recording)
}

/// The stage and the time so far, on a terminal; when each stage began, and the most memory until then.
struct Bar {
    bar: ProgressBar,
    begun: Mutex<Vec<(String, Instant, Option<f64>)>>,
}

impl Bar {
    fn new() -> Self {
        let style = ProgressStyle::with_template("{msg} {wide_bar} {percent}% {elapsed} so far, {eta} left");
        let bar = ProgressBar::new(1000);
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.enable_steady_tick(Duration::from_secs(1));
        Self { bar, begun: Mutex::new(Vec::new()) }
    }

    /// How long each stage took, and the most memory when it ended.
    fn stages(&self) -> Vec<String> {
        self.bar.finish_and_clear();
        let Ok(begun) = self.begun.lock() else { return Vec::new() };
        let line = |pair: &[(String, Instant, Option<f64>)]| {
            let seconds = (pair[1].1 - pair[0].1).as_secs_f64();
            let memory = pair[1].2.map_or("-".to_owned(), |bytes| format!("{:.0} MiB", bytes / f64::from(1 << 20)));
            format!("{seconds:>7.1} s {memory:>19}  {}", pair[0].0)
        };
        begun.windows(2).map(line).collect()
    }
}

impl Progress for Bar {
    fn report(&self, stage: &str, done: f64) {
        self.bar.set_message(stage.to_owned());
        self.bar.set_position((1000.0 * done) as u64);
        let Ok(mut begun) = self.begun.lock() else { return };
        if begun.last().is_none_or(|(last, ..)| last != stage) {
            begun.push((stage.to_owned(), Instant::now(), peak_bytes()));
        }
    }
}

/// Lets the peak start anew from what the process holds.
fn forget_peak() {
    // Without it the peak is that of the whole run: never too small.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Most memory that the process has held.
fn peak_bytes() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kib| 1024.0 * kib)
}

/// Time that all cores have worked for the process: user and system ticks of 10 ms.
fn cpu_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    let ticks: f64 = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    Some(ticks / 100.0)
}
