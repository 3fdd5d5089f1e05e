//! `gmhm adapt`.

use std::path::PathBuf;

use clap::Args;

use super::Session;
use super::common::{ReadingArgs, json, model_file, page, provenance};
use super::failure::Failure;
use super::files::Files;
use super::progress::Working;
use super::tables;
use crate::adapt::{self, AdaptReplayError};
use crate::model;
use crate::output::Outputs;
use crate::recording::{self, Need, Needs};
use crate::report;
use crate::signal::plausible;

/// Replay a recording through the adaptation of the drive: the firmware's own code, sample by sample, in f32
///
/// Each row is predicted first, then used for the adaptation. The new model file holds the parameters in force at the end: the old ones if no adapted ones were taken over, or if they
/// were given back. Terms of the model are subtracted from the torque and do not change. Only law masing can be adapted.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gmhm adapt gear.toml recording.csv -o adapted.toml --json adapted.json
  gmhm adapt gear.toml recording.csv -o adapted.toml --report adapted.html")]
pub struct AdaptArgs {
    /// Model file: the block in force at the start
    #[arg(value_name = "M.toml")]
    model: PathBuf,
    /// Recording
    recording: PathBuf,
    /// Where to write the model with the parameters in force at the end
    #[arg(short, long, value_name = "M2.toml", value_parser = model_file)]
    output: PathBuf,
    /// Where to write errors, takeovers, trace and warnings as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Where to write the report: one HTML page
    #[arg(long, value_name = "F.html", value_parser = page)]
    report: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
}

impl AdaptArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let file = recording::file(&self.recording)?;
        for output in [Some(&self.output), self.json.as_ref(), self.report.as_ref()].into_iter().flatten() {
            Outputs::check_beside(output, std::slice::from_ref(&file))?;
        }
        let model = self.reading.of_gear(model::load(&self.model)?);
        let needs = Needs { torque: Need::Required, ..crate::physics::predict::needs(&model) };
        let recording = self.reading.read(&file, &needs, session)?;
        recording::turns::check(&recording)?;
        if recording.theta_in_rad.is_some() {
            recording::ratio::check(&recording, model.gear.ratio)?;
        }
        let working = Working::new("Adapting", session.quiet);
        let replay = adapt::replay(&model, self.reading.rated_deflection, &recording, &working)?;
        let mut compared = model.clone();
        compared.gear.rated_deflection_rad = self.reading.rated_deflection.or(model.gear.rated_deflection_rad);
        let remarks = plausible::examine(std::slice::from_ref(&recording), &[], &compared);
        let remarks = remarks.map_err(AdaptReplayError::from)?;
        remarks.iter().for_each(|remark| working.aside(|| session.note(&remark.to_string())));
        let mut files = Files::new(session);
        files.add("Model", Some(&self.output), || Ok(replay.model.to_toml()))?;
        files.add("JSON", self.json.as_ref(), || json(&replay))?;
        files.add("Report", self.report.as_ref(), || {
            Ok(report::adapt::page(&replay, provenance(vec![(&recording).into()], None)).to_html())
        })?;
        drop(working);
        files.finish(tables::adapt(&replay))
    }
}
