//! `gmhm compare`.

use std::path::PathBuf;

use clap::Args;

use super::Session;
use super::common::{ReadingArgs, RecordingArgs, SeedArgs, drawing, json};
use super::failure::Failure;
use super::files::Files;
use super::progress::Progress;
use super::tables;
use crate::fit::FitOptions;
use crate::fit::comparison::compare;
use crate::fit::paper;
use crate::output::Outputs;
use crate::report::figures;

/// Compare the hysteresis model with lines, a polynomial, Dahl, Bouc-Wen and Maxwell slip on the same recordings
///
/// Every model is fitted by the same estimator. Prints the error of each: in the rows that it was fitted to, in blocks held out and,
/// with two recordings or more, in recordings held out whole.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  gmhm compare small-amplitude.csv large-amplitude.csv --json compared.json")]
pub struct CompareArgs {
    #[command(flatten)]
    files: RecordingArgs,
    /// Where to write the table as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Where to write the plot of the errors
    #[arg(long, value_name = "F.svg", value_parser = drawing)]
    plot: Option<PathBuf>,
    /// Estimate one encoder zero per recording: the encoders were restarted or moved [default: only if the recordings do not fit together otherwise]
    #[arg(long)]
    own_zeros: bool,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    seed: SeedArgs,
}

impl CompareArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let files = self.files.files()?;
        for output in [self.plot.as_ref(), self.json.as_ref()].into_iter().flatten() {
            Outputs::check_beside(output, &files)?;
        }
        let recordings = self.reading.read_all(&files, None, session)?;
        let options = FitOptions {
            seed: self.seed.seed,
            rated_deflection_rad: self.reading.rated_deflection,
            ratio: self.reading.ratio,
            torque_side: self.reading.torque_side,
            own_zeros: self.own_zeros,
            ..FitOptions::default()
        };
        let progress = Progress::new("Comparing", Progress::WHOLE, session.quiet);
        let lines = compare(&recordings, &options, &progress)?;
        drop(progress);
        let unit = recordings[0].torque_unit;
        let mut files = Files::new(session);
        files.add("Plot", self.plot.as_ref(), || Ok(figures::comparison(&lines, unit).to_file()))?;
        files.add("JSON", self.json.as_ref(), || {
            json(&serde_json::json!({
                "seed": self.seed.seed,
                "unit": unit.suffix(),
                "models": lines,
                "two_lines_over_gmhm": paper::two_lines_over_model(&lines).map(|(measured, claimed)| {
                    serde_json::json!({ "measured": measured, "claimed_by_the_paper": claimed })
                }),
            }))
        })?;
        files.finish(tables::comparison(&lines, unit, self.seed.seed))
    }
}
