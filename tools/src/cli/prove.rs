//! `gmhm prove`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use clap::Args;

use super::Session;
use super::common::{SeedArgs, json};
use super::failure::Failure;
use super::progress::Progress;
use crate::discover::Diagnostician;
use crate::output::{OutputError, Outputs};
use crate::prove::{self, Progress as Step, QUICK_CASES, answers, export, generator};

/// Prove the diagnosis on recordings whose missing physics only a key knows
///
/// Makes each case from the seed by a generator that shares no code with the diagnosis, seals its key by a hash, hands over the noisy recordings and a
/// base model, and only then opens the key. Prints what was seen, named, located and predicted, with 95 % Wilson intervals, beside the aims. 150 cases take
/// minutes, 1500 hold 500 nulls; case n is the same whatever the number of cases. All cases are synthetic, but for the noise of the block "real noise".
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gmhm prove
  gmhm prove --seed 7 --cases 1500 --keys keys.sha256 --json proof.json
  gmhm prove --seed 7 --cases 150 --export cases        the same cases for another program
  gmhm prove --seed 7 --cases 150 --answers answers     the score of what that program said")]
pub struct ProveArgs {
    /// Number of cases
    #[arg(long, value_name = "N", default_value_t = QUICK_CASES, value_parser = at_least_one)]
    cases: usize,
    /// Where to write the table and every case as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Where to write the hash of each key, line by line, before its case is diagnosed
    #[arg(long, value_name = "FILE.sha256")]
    keys: Option<PathBuf>,
    /// Folder of real recordings whose residual serves as noise
    #[arg(long, value_name = "FOLDER", default_value = "../shared/recordings")]
    recordings: PathBuf,
    /// Write the cases and their keys into this folder instead of diagnosing them
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["answers", "json", "keys"])]
    export: Option<PathBuf>,
    /// Score the answers of another program: case_0007.json as diagnose --json writes it, case_0007_unseen_1.csv as predict writes it
    #[arg(long, value_name = "FOLDER")]
    answers: Option<PathBuf>,
    #[command(flatten)]
    seed: SeedArgs,
}

impl ProveArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        for output in [self.json.as_ref(), self.keys.as_ref()].into_iter().flatten() {
            Outputs::check(output)?;
        }
        let seed = self.seed.seed;
        let real = generator::real_residuals(&self.recordings);
        if let Some(folder) = &self.export {
            let progress = Progress::new("Writing cases", self.cases as u64, session.quiet);
            export::write(folder, seed, self.cases, &real, &mut |done, _| progress.at(done as u64))?;
            drop(progress);
            println!("Cases of seed {seed} and their keys written to {}", folder.display());
            return Ok(());
        }
        let sealed = self.keys.as_deref().map(Sealed::create).transpose()?;
        let progress = Progress::new("Proving", self.cases as u64, session.quiet);
        let tell = |step: Step<'_>| match step {
            Step::Sealed { index, key_sha256 } => sealed.iter().for_each(|s| s.add(index, key_sha256)),
            Step::Scored { done, .. } => progress.at(done as u64),
        };
        let report = match &self.answers {
            None => prove::run(seed, self.cases, &real, &Diagnostician, &tell),
            Some(folder) => {
                prove::score(seed, self.cases, &real, &|index, case| answers::read(folder, index, case), &tell)
            }
        };
        drop(progress);
        if let Some(sealed) = sealed {
            sealed.finish()?;
        }
        if let Some(path) = &self.json {
            let mut outputs = Outputs::new();
            outputs.add_text(path, &json(&report)?)?;
            outputs.commit()?;
        }
        print!("{report}");
        Ok(())
    }
}

/// Hashes of keys, on disk before the diagnosis starts: the one output that grows in place, for that is its point.
struct Sealed {
    path: PathBuf,
    file: Mutex<std::io::Result<std::fs::File>>,
}

impl Sealed {
    fn create(path: &Path) -> Result<Self, OutputError> {
        let file = std::fs::File::create(path);
        let file = file.map_err(|source| OutputError::System { path: path.to_owned(), source })?;
        Ok(Self { path: path.to_owned(), file: Mutex::new(Ok(file)) })
    }

    /// Adds a line in the format of `sha256sum`, for the keys of `--export`. The first failure stays.
    fn add(&self, index: usize, sha256: &str) {
        let Ok(mut file) = self.file.lock() else { return };
        let written = file.as_mut().map(|file| writeln!(file, "{sha256}  keys/case_{index:04}.toml"));
        if let Ok(Err(error)) = written {
            *file = Err(error);
        }
    }

    fn finish(self) -> Result<(), OutputError> {
        let file = self.file.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        file.map(drop).map_err(|source| OutputError::System { path: self.path, source })
    }
}

fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| "must be a whole number greater than zero".to_owned())
}
