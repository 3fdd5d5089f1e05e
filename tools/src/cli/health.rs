//! `gmhm health`.

use std::path::PathBuf;

use clap::Args;

use super::Session;
use super::common::{ReadingArgs, SeedArgs, json, page, positive, provenance};
use super::each::EachArgs;
use super::failure::Failure;
use super::files::Files;
use super::progress::Progress;
use super::tables;
use crate::health::catalogue::Asked;
use crate::health::{self, Health, HealthOptions};
use crate::model;
use crate::output::Outputs;
use crate::recording::{self, RecordingFile};
use crate::report;
use crate::report::page::Input;

/// Report what changed in a gear between recordings or fits, with its uncertainty; for one of them, its catalogue figures
///
/// Fits every recording with one law and rated deflection and reports which parameters changed, and the stiffness K1, K2, K3, the hysteresis loss and
/// the lost motion as catalogues quote them. For a single one it prints the figures with their uncertainty.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gmhm health today.csv
  gmhm health 2024.csv 2025.csv 2026.csv --report health.html
  gmhm health cold.csv warm.csv hot.csv --against temperature_c --json health.json
  gmhm health --models 2024.toml 2026.toml --against service.csv:hours
  gmhm health --each --model gear.toml --files-from joints.txt --ndjson states.ndjson --shard 1/2")]
pub struct HealthArgs {
    /// Recordings of one gear, in order: CSV (.gz, .zst), Parquet, MAT, MDF4 or MCAP; a folder means the recordings in it, - is standard input
    #[arg(required_unless_present_any = ["models", "files_from"], value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// File with more recordings, one path per line; - is standard input
    #[arg(long, value_name = "FILE", conflicts_with = "models")]
    files_from: Option<PathBuf>,
    /// Model files of one gear, in order; uncertainties are read from the output of fit --json beside each (gear.json for gear.toml)
    #[arg(long, num_args = 1.., value_name = "M.toml", conflicts_with_all = ["recordings", "model", "rated_deflection", "each"])]
    models: Vec<PathBuf>,
    /// Model file whose law, kernel, gate and rated deflection all recordings are fitted with [default: chosen by all of them]
    #[arg(long, value_name = "M.toml")]
    model: Option<PathBuf>,
    /// Property that the parameters are regressed on: temperature_c, or TABLE.csv:COLUMN
    ///
    /// The first column of the table names the recordings or models, by path, file name, or name without ending.
    #[arg(long, value_name = "COLUMN")]
    against: Option<String>,
    /// Estimate one encoder zero per recording [default: only if it differs significantly from 0]
    #[arg(long, conflicts_with = "models")]
    own_zeros: bool,
    /// Rated torque in N·m (A per ampere) [default: the smallest one at the rated deflection]
    #[arg(long, value_name = "NM", allow_negative_numbers = true, value_parser = positive)]
    rated_torque: Option<f64>,
    /// Torque up to which the catalogue states K1 [default: 0.2 of the rated torque]
    #[arg(long, value_name = "NM", allow_negative_numbers = true, value_parser = positive)]
    t1: Option<f64>,
    /// Torque up to which the catalogue states K2 [default: 0.7 of the rated torque]
    #[arg(long, value_name = "NM", allow_negative_numbers = true, value_parser = positive)]
    t2: Option<f64>,
    /// Where to write the finding as JSON
    #[arg(long, value_name = "FILE", conflicts_with = "each")]
    json: Option<PathBuf>,
    /// Where to write the report: one HTML page with trends
    #[arg(long, value_name = "F.html", value_parser = page, conflicts_with = "each")]
    report: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    seed: SeedArgs,
    #[command(flatten)]
    each: EachArgs,
}

impl HealthArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let options = HealthOptions {
            seed: self.seed.seed,
            start: self.model.as_deref().map(model::load).transpose()?.map(|model| self.reading.of_gear(model)),
            ratio: self.reading.ratio,
            torque_side: self.reading.torque_side,
            rated_deflection_rad: self.reading.rated_deflection,
            own_zeros: self.own_zeros,
            rating: Asked { rated_torque: self.rated_torque, t1: self.t1, t2: self.t2 },
            against: self.against.clone(),
        };
        if self.each.each {
            return self.each.run(&self.recordings, self.files_from.as_deref(), session, |file, silent| {
                let (found, _) = self.of_recordings(std::slice::from_ref(file), &options, silent)?;
                Ok(serde_json::to_value(&found).map_err(std::io::Error::other)?)
            });
        }
        let files = recording::files_and_listed(&self.recordings, self.files_from.as_deref())?;
        for output in [self.json.as_ref(), self.report.as_ref()].into_iter().flatten() {
            Outputs::check_beside(output, &files)?;
        }
        let (found, inputs) = if self.models.is_empty() {
            self.of_recordings(&files, &options, session)?
        } else {
            self.of_models(&options)?
        };
        let mut files = Files::new(session);
        files.add("JSON", self.json.as_ref(), || json(&found))?;
        files.add("Report", self.report.as_ref(), || {
            Ok(report::health::page(&found, provenance(inputs, Some(found.seed))).to_html())
        })?;
        files.finish(tables::health(&found))
    }

    fn of_recordings(
        &self,
        files: &[RecordingFile],
        options: &HealthOptions,
        session: &Session,
    ) -> Result<(Health, Vec<Input>), Failure> {
        let recordings = self.reading.read_all(files, options.start.as_ref(), session)?;
        let progress = Progress::new("Fitting", Progress::WHOLE, session.quiet);
        let found = health::of_recordings(&recordings, options, &progress)?;
        Ok((found, recordings.iter().map(Into::into).collect()))
    }

    fn of_models(&self, options: &HealthOptions) -> Result<(Health, Vec<Input>), Failure> {
        let models = self.models.iter().map(|path| Ok((path.clone(), model::load(path)?)));
        let models = models.collect::<Result<Vec<_>, Failure>>()?;
        let inputs = self.models.iter().map(|path| Input::of_file(path)).collect::<Result<_, _>>()?;
        Ok((health::of_models(&models, options)?, inputs))
    }
}
