//! Recordings of a fleet, each by itself: one line of JSON a recording, failures included, in a file that a run that was stopped can go on with.

mod error;
mod lines;
mod shard;

use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde_json::{Value, json};

use crate::progress::Progress;
pub use error::FleetError;
use lines::Lines;
pub use shard::Shard;

/// What a run is asked for.
#[derive(Debug)]
pub struct Fleet<'a> {
    /// Recordings, in order.
    pub paths: &'a [PathBuf],
    /// The file of lines.
    pub output: &'a Path,
    /// What becomes of recordings that the file holds already.
    pub resume: Resume,
    /// The part of the recordings that this run takes; all by default.
    pub shard: Option<Shard>,
}

/// What becomes of recordings that the file of lines holds already.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Resume {
    /// There must be no such file.
    #[default]
    No,
    /// They are left out, those that failed too.
    Continue,
    /// They are left out; those that failed are tried again, and their lines replaced.
    RetryFailed,
}

/// Why one recording failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// What is wrong.
    pub error: String,
    /// How to fix it.
    pub help: Option<String>,
}

/// What a run did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Recordings with a result.
    pub done: usize,
    /// Recordings that failed.
    pub failed: usize,
    /// Recordings that the file held a result of.
    pub done_before: usize,
    /// Recordings that the file held as failed, and that were left out.
    pub failed_before: usize,
}

/// Does `work` on each recording, several at a time, and writes a line as soon as one is done: `{"recording", "ok", "result"}` or `{"recording", "ok", "error", "help"}`.
///
/// # Errors
/// [`FleetError`]: the file of lines. What concerns a single recording is a line.
pub fn run<W>(fleet: &Fleet, work: W, progress: &dyn Progress) -> Result<Tally, FleetError>
where
    W: Fn(&Path) -> Result<Value, Refusal> + Sync,
{
    let lines = Lines::open(fleet.output, fleet.resume)?;
    let mut seen = HashSet::new();
    let mine = fleet.paths.iter().filter(|path| seen.insert(path.as_path())).enumerate();
    let mine = mine.filter(|(number, _)| fleet.shard.is_none_or(|shard| shard.holds(*number)));
    let mut tally = Tally::default();
    let mut open = Vec::new();
    for (_, path) in mine {
        match lines.held(&name(path)) {
            Some(true) => tally.done_before += 1,
            Some(false) => tally.failed_before += 1,
            None => open.push(path),
        }
    }
    let (done, failed) = (AtomicUsize::new(0), AtomicUsize::new(0));
    open.par_iter().try_for_each(|path| {
        let line = match catch_unwind(AssertUnwindSafe(|| work(path))) {
            Ok(Ok(result)) => {
                done.fetch_add(1, Ordering::Relaxed);
                json!({ "recording": name(path), "ok": true, "result": result })
            }
            Ok(Err(Refusal { error, help })) => {
                failed.fetch_add(1, Ordering::Relaxed);
                json!({ "recording": name(path), "ok": false, "error": error, "help": help })
            }
            Err(_) => {
                failed.fetch_add(1, Ordering::Relaxed);
                let help = "report it with the recording; the message is on standard error";
                json!({ "recording": name(path), "ok": false, "error": "an error in this program", "help": help })
            }
        };
        let count = done.load(Ordering::Relaxed) + failed.load(Ordering::Relaxed);
        progress.report("recordings", count as f64 / open.len() as f64);
        lines.add(&line)
    })?;
    Ok(Tally { done: done.into_inner(), failed: failed.into_inner(), ..tally })
}

/// A recording as its line names it.
fn name(path: &Path) -> String {
    path.display().to_string()
}
