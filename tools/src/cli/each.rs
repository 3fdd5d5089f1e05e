//! `--each`: every recording by itself, for fleets.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::Value;

use super::Session;
use super::failure::Failure;
use super::progress::Progress;
use crate::fleet::{self, Fleet, Refusal, Resume, Shard, Tally};
use crate::output::Outputs;
use crate::recording::{self, RecordingFile};

/// How a fleet is gone through.
#[derive(Debug, Args)]
pub struct EachArgs {
    /// Process each recording separately, several at a time: one line of JSON per recording, failures included
    #[arg(long, requires = "ndjson", help_heading = "Fleets")]
    pub each: bool,
    /// Where to write the lines; each line is written as soon as its recording is done
    #[arg(long, value_name = "FILE", requires = "each", help_heading = "Fleets")]
    ndjson: Option<PathBuf>,
    /// Continue a stopped run: skip recordings that have a line in the file, failed ones included
    #[arg(long, requires = "each", help_heading = "Fleets")]
    resume: bool,
    /// With --resume: process failed recordings again and replace their lines
    #[arg(long, requires = "resume", help_heading = "Fleets")]
    retry_failed: bool,
    /// Process only part I of N, for several runs at once; each run needs its own file
    #[arg(long, value_name = "I/N", requires = "each", help_heading = "Fleets")]
    shard: Option<Shard>,
}

impl EachArgs {
    /// Ends as wrong usage where only `--each` is missing: clap asks for it too, but not beside an output that it excludes.
    pub fn check(&self) {
        if !self.each && (self.ndjson.is_some() || self.resume || self.shard.is_some()) {
            super::wrong_usage("--ndjson, --resume and --shard need --each");
        }
    }

    /// Does `work` on each recording, without words, and says how many were done.
    pub fn run<W>(&self, paths: &[PathBuf], list: Option<&Path>, session: &Session, work: W) -> Result<(), Failure>
    where
        W: Fn(&RecordingFile, &Session) -> Result<Value, Failure> + Sync,
    {
        let Some(output) = &self.ndjson else { return Ok(()) };
        let paths = recording::paths_and_listed(paths, list)?;
        Outputs::check(output)?;
        let resume = match (self.resume, self.retry_failed) {
            (false, _) => Resume::No,
            (true, false) => Resume::Continue,
            (true, true) => Resume::RetryFailed,
        };
        let fleet = Fleet { paths: &paths, output, resume, shard: self.shard };
        let progress = Progress::new("Recordings", Progress::WHOLE, session.quiet);
        let silent = Session::silent();
        let one = |path: &Path| {
            let done = recording::file(path).map_err(Failure::from).and_then(|file| work(&file, &silent));
            done.map_err(|failure| Refusal { error: failure.to_string(), help: failure.fix() })
        };
        let Tally { done, failed, done_before, failed_before } = fleet::run(&fleet, one, &progress)?;
        drop(progress);
        let before = |count: usize, what: &str| if count > 0 { format!(", {count} {what}") } else { String::new() };
        let done_before = before(done_before, "done before");
        let failed_before = before(failed_before, "failed before (--retry-failed tries them again)");
        session.say(format_args!("{done} recordings done, {failed} failed{done_before}{failed_before}\n"))?;
        session.written("Lines", output)
    }
}
