//! `gmhm prove`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use indicatif::HumanDuration;

use super::Session;
use super::common::{SeedArgs, json};
use super::failure::Failure;
use super::progress::Progress;
use crate::output::Outputs;
use crate::prove::Diagnostician;
use crate::prove::mix::{self, BLOCKS};
use crate::prove::real::{self, Part, RealReport, Split};
use crate::prove::{FULL_CASES, QUICK_CASES, Sealed, answers, export, generator};

/// Test the diagnosis on recordings with concealed physics
///
/// A generator that shares no code with the diagnosis makes each case from the seed. The key of a case states what is hidden. A hash fixes all keys before the
/// first diagnosis. The diagnosis gets the noisy recordings and a base model; its answers are then compared with the keys. Prints the shares of effects that were
/// detected, named, located and predicted, with 95 % Wilson intervals and the aims. 60 cases take minutes; 1875 cases contain 500 nulls (nothing hidden). Case n is
/// the same for every number of cases. All cases are synthetic, except the noise of the block real-noise.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gmhm prove
  gmhm prove --seed 7 --cases 1875 --keys keys.sha256 --json proof.json
  gmhm prove --only null --cases 500                    false alarms in 500 cases with nothing hidden
  gmhm prove --only left-out --cases 22                 each kind once, removed from the library
  gmhm prove --only pair-left-out --cases 60            two kinds, one of them not in the library
  gmhm prove --only simulation --cases 12               joint logs with the torque of a simulation
  gmhm prove --seed 7 --cases 150 --export cases        the same cases for another program
  gmhm prove --real recordings --split development      known answers of real recordings
  gmhm prove --seed 7 --cases 150 --answers answers     score the answers of that program")]
pub struct ProveArgs {
    /// Number of cases
    #[arg(long, value_name = "N", default_value_t = QUICK_CASES, allow_negative_numbers = true, value_parser = at_least_one)]
    cases: usize,
    /// Only cases of these blocks: null, single-0.15, single-0.05, pair, open-world, maxwell-slip, left-out, real-noise, simulation, loud, pair-left-out; the last only if chosen
    #[arg(long, value_name = "BLOCK,...", value_delimiter = ',', value_parser = block)]
    only: Vec<&'static str>,
    /// Where to write the table and every case as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Where to write the hash of each key before the first case is diagnosed
    #[arg(long, value_name = "FILE.sha256")]
    keys: Option<PathBuf>,
    /// Folder of real recordings whose residual serves as noise of the block real-noise; without them that block is left out
    #[arg(long, value_name = "FOLDER", default_value = "../shared/recordings", hide_default_value = true)]
    recordings: PathBuf,
    /// Write the cases and their keys into this folder instead of diagnosing them
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["answers", "json", "keys"])]
    export: Option<PathBuf>,
    /// Score the answers of another program: case_0007.json as diagnose --json writes it, case_0007_unseen_1.csv as predict writes it
    #[arg(long, value_name = "FOLDER")]
    answers: Option<PathBuf>,
    /// Diagnose the real recordings in this folder instead of synthetic cases; their known answers are part of this program
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["cases", "only", "keys", "recordings", "export", "answers", "seed"])]
    real: Option<PathBuf>,
    /// Only one half of the machines: development, used to develop the diagnosis, or heldout, which is reported
    #[arg(long, value_name = "HALF", requires = "real", value_parser = half)]
    split: Option<Split>,
    /// Questions about real recordings: answers that are known, terms dropped from a textbook base, effects added, pairs of one machine before and after a known change
    #[arg(long, value_name = "PART,...", requires = "real", value_delimiter = ',', value_parser = part)]
    ask: Vec<Part>,
    #[command(flatten)]
    seed: SeedArgs,
}

impl ProveArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        for output in [self.json.as_ref(), self.keys.as_ref()].into_iter().flatten() {
            Outputs::check(output)?;
        }
        if let Some(folder) = self.real.as_ref().or(self.answers.as_ref()).filter(|folder| !folder.is_dir()) {
            return Err(Failure::NoFolder(folder.clone()));
        }
        if let Some(folder) = &self.real {
            return self.ask_real(folder, session);
        }
        let seed = self.seed.seed;
        let blocks = if self.only.is_empty() { mix::SUITE } else { &self.only[..] };
        let cases = mix::only(blocks, seed, self.cases, &generator::real_residuals(&self.recordings));
        let left_out = self.cases - cases.len();
        if cases.is_empty() {
            return Err(Failure::NoRealNoise(self.recordings.clone()));
        }
        if let Some(folder) = &self.export {
            Outputs::make_folder(folder)?;
            let progress = Progress::new("Writing cases", cases.len() as u64, session.quiet);
            export::write(folder, seed, &cases, &mut |done| progress.at(done as u64))?;
            drop(progress);
            session.say(format_args!(
                "{} cases of seed {seed} and their keys written to {}\n",
                cases.len(),
                folder.display()
            ))?;
            return Ok(());
        }
        if let Some(folder) = &self.answers
            && !cases.iter().any(|(index, _)| answers::path(folder, *index).exists())
        {
            return Err(Failure::NoAnswers(folder.clone()));
        }
        let sealed = Sealed::new(seed, cases);
        session.say(format_args!(
            "{} cases of seed {seed}; SHA-256 of the hashes of their keys:\n{}\n\n",
            sealed.len(),
            sealed.sha256()
        ))?;
        if let Some(path) = &self.keys {
            write(path, &sealed.hashes())?;
        }
        let progress = Progress::new("Proving", sealed.len() as u64, session.quiet);
        let tell = |done: usize| progress.at(done as u64);
        let began = Instant::now();
        let mut report = match &self.answers {
            None => sealed.run(&Diagnostician, &tell),
            Some(folder) => sealed.score(&|index, case| answers::read(folder, index, case), &tell),
        };
        let full = began.elapsed().mul_f64(FULL_CASES as f64 / sealed.len() as f64);
        drop(progress);
        report.note_left_out(left_out);
        if let Some(path) = &self.json {
            write(path, &json(&report)?)?;
        }
        session.say(format_args!("{report}"))?;
        if self.answers.is_none() && self.only.is_empty() && self.cases < FULL_CASES {
            let time = HumanDuration(full);
            session.say(format_args!(
                "a full run, --cases {FULL_CASES} with {} nulls, takes about {time} here\n",
                FULL_CASES * 4 / 15
            ))?;
        }
        Ok(())
    }

    fn ask_real(&self, folder: &Path, session: &Session) -> Result<(), Failure> {
        let parts = if self.ask.is_empty() { &Part::ALL[..] } else { &self.ask };
        let (questions, missing) = real::questions(folder, self.split, parts)?;
        if questions.is_empty() {
            return Err(Failure::NoRealRecordings(folder.to_owned()));
        }
        let progress = Progress::new("Asking", questions.len() as u64, session.quiet);
        let scores = real::run(&questions, &Diagnostician, &|done| progress.at(done as u64));
        drop(progress);
        let report = RealReport::new(scores, missing);
        if let Some(path) = &self.json {
            write(path, &json(&report)?)?;
        }
        session.say(format_args!("{report}"))
    }
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    let mut outputs = Outputs::new();
    outputs.add_contents(path, text)?;
    Ok(outputs.commit()?)
}

fn half(text: &str) -> Result<Split, String> {
    match text {
        "development" => Ok(Split::Development),
        "heldout" => Ok(Split::Heldout),
        _ => Err("must be development or heldout".to_owned()),
    }
}

fn part(text: &str) -> Result<Part, String> {
    let known = Part::ALL.map(Part::name).join(", ");
    Part::ALL.into_iter().find(|p| p.name() == text).ok_or_else(|| format!("must be one of {known}"))
}

fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| "must be a whole number greater than zero".to_owned())
}

fn block(text: &str) -> Result<&'static str, String> {
    let known = BLOCKS.map(|block| block.replace(' ', "-"));
    let found = known.iter().position(|block| block == text);
    found.map(|at| BLOCKS[at]).ok_or_else(|| format!("must be one of {}", known.join(", ")))
}
