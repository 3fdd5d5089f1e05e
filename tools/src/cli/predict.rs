//! `gmhm predict`.

use std::path::PathBuf;

use clap::Args;

use super::Session;
use super::common::{ReadingArgs, rows_file};
use super::failure::Failure;
use super::files::Files;
use super::progress::Working;
use crate::jobs;
use crate::model;
use crate::output::Outputs;
use crate::physics::predict::needs;
use crate::recording::{self, copy_with_columns};

/// Predict the torque of a recording's motion, row by row
///
/// Writes the recording's rows plus torque_model_nm, elastic_nm, hysteresis_nm and one column per term (_a instead of _nm if the model is per ampere).
/// The first row is the start, with an empty hysteresis memory. The measured torque is never read. The motion is used as recorded. Only the acceleration is computed
/// from the smoothed motion, if a term needs it, as in gmhm diagnose.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  gmhm predict gear.toml recording.csv -o predicted.csv")]
pub struct PredictArgs {
    /// Model file
    model: PathBuf,
    /// Recording
    recording: PathBuf,
    /// Where to write the rows
    #[arg(short, long, value_name = "OUT.csv", value_parser = rows_file)]
    output: PathBuf,
    #[command(flatten)]
    reading: ReadingArgs,
}

impl PredictArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let file = recording::file(&self.recording)?;
        Outputs::check_beside(&self.output, std::slice::from_ref(&file))?;
        let model = self.reading.of_gear(model::load(&self.model)?);
        let needs = needs(&model);
        let recording = self.reading.read(&file, &needs, session)?;
        let working = Working::new("Predicting", session.quiet);
        let prediction = jobs::predict::predict(
            &model,
            self.reading.rated_deflection,
            &recording,
            &mut working.notes(session),
            &working,
        )?;
        let suffix = model.torque_unit.suffix();
        let base = [&prediction.torque, &prediction.elastic, &prediction.hysteresis];
        let base = ["torque_model", "elastic", "hysteresis"].into_iter().zip(base);
        let terms = prediction.terms.iter().map(|(name, values)| (name.as_str(), values));
        let named: Vec<(String, &[f64])> =
            base.chain(terms).map(|(name, values)| (format!("{name}_{suffix}"), values.as_slice())).collect();
        let columns: Vec<_> = named.iter().map(|(name, values)| (name.as_str(), *values)).collect();

        let mut files = Files::new(session);
        files.stream("Rows", &self.output, |out| {
            Ok(copy_with_columns(&file, &self.reading.reading(&needs), &columns, out, &working)?)
        })?;
        drop(working);
        files.finish("")
    }
}
