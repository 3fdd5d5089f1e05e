//! `gmhm compare`.

use std::path::PathBuf;

use clap::Args;

use super::Session;
use super::common::{ReadingArgs, SeedArgs, json, say};
use super::failure::Failure;
use super::progress::Progress;
use super::tables;
use crate::fit::FitOptions;
use crate::fit::comparison::compare;
use crate::fit::paper;
use crate::output::Outputs;
use crate::report::figures;

/// Compare the hysteresis model with lines, a polynomial, Dahl, Bouc-Wen and Maxwell slip on the same recordings
///
/// Every model is fitted by the same estimator. Prints what each leaves of the torque: in the rows that it was fitted to, in blocks held out and,
/// with two recordings or more, in recordings held out whole.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  gmhm compare small-amplitude.csv large-amplitude.csv --json compared.json")]
pub struct CompareArgs {
    /// Recordings of one gear
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Where to write the table as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Where to write the plot of the errors
    #[arg(long, value_name = "FILE.svg", default_value = "gmhm-compare.svg")]
    plot: PathBuf,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    seed: SeedArgs,
}

impl CompareArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        for output in [Some(&self.plot), self.json.as_ref()].into_iter().flatten() {
            Outputs::check_beside(output, &self.recordings)?;
        }
        let recordings = self.reading.read_all(&self.recordings, session)?;
        let options = FitOptions {
            seed: self.seed.seed,
            rated_deflection_rad: self.reading.rated_deflection,
            ..FitOptions::default()
        };
        let progress = Progress::new("Comparing", Progress::WHOLE, session.quiet);
        let lines = compare(&recordings, &options, &progress)?;
        drop(progress);
        let mut outputs = Outputs::new();
        outputs.add_text(&self.plot, &figures::comparison(&lines, recordings[0].torque_unit).to_file())?;
        if let Some(path) = &self.json {
            let unit = recordings[0].torque_unit.suffix();
            let page = serde_json::json!({
                "seed": self.seed.seed,
                "unit": unit,
                "models": lines,
                "two_lines_over_gmhm": paper::two_lines_over_model(&lines).map(|(measured, claimed)| {
                    serde_json::json!({ "measured": measured, "claimed_by_the_paper": claimed })
                }),
            });
            outputs.add_text(path, &json(&page)?)?;
        }
        outputs.commit()?;
        say(format_args!("{}", tables::comparison(&lines, recordings[0].torque_unit, self.seed.seed)))?;
        say(format_args!("Plot written to {}\n", self.plot.display()))?;
        Ok(())
    }
}
