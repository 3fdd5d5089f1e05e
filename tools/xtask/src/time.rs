//! Time that work takes: by the clock, and of all processors together.

use std::fmt;
use std::time::Instant;

use anyhow::{Context, Result};

/// What some work took.
#[derive(Debug, Clone, Copy)]
pub struct Taken {
    /// By the clock, s.
    pub clock_s: f64,
    /// All processors together, s; `None` where it is not known.
    pub cpu_s: Option<f64>,
}

impl fmt::Display for Taken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.0} s", self.clock_s)?;
        self.cpu_s.map_or(Ok(()), |cpu_s| write!(f, ", {cpu_s:.0} s of processor time"))
    }
}

/// Measures from its creation on.
pub struct Stopwatch {
    began: Instant,
    before_s: Option<f64>,
}

impl Stopwatch {
    /// Begins now.
    pub fn start() -> Self {
        Self { began: Instant::now(), before_s: children_s().ok() }
    }

    /// What it took so far: of processor time that of the processes that were started and have ended.
    pub fn taken(&self) -> Taken {
        let cpu_s = self.before_s.and_then(|before| Some(children_s().ok()? - before));
        Taken { clock_s: self.began.elapsed().as_secs_f64(), cpu_s }
    }
}

/// Processor time of all processes that were started and have ended, s; Linux only.
pub fn children_s() -> Result<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").context("the times of processes are read on Linux only")?;
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |at: usize| fields.get(at).and_then(|field| field.parse::<f64>().ok()).unwrap_or(0.0);
    Ok((ticks(13) + ticks(14)) / 100.0)
}
