//! `gmhm invert`.

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
use crate::physics::invert;
use crate::recording::{self, copy_with_columns};

/// Compute the deflection for each torque, row by row
///
/// Writes the rows plus deflection_rad, and saturated: 1 where the torque lies beyond the range in which the model can be inverted (the deflection is then
/// the edge of the range), else 0. The order of the rows is the path of the gear. The first row is the start, with an empty hysteresis memory:
/// gmhm predict of the result returns the same torques. Law time, and models with terms, need the column time_s.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  gmhm invert gear.toml torque.csv -o deflection.csv\n  gmhm predict gear.toml deflection.csv -o check.csv"
)]
pub struct InvertArgs {
    /// Model file
    #[arg(value_name = "M.toml")]
    model: PathBuf,
    /// Torques, in order
    #[arg(value_name = "TORQUE.csv")]
    torque: PathBuf,
    /// Where to write the rows
    #[arg(short, long, value_name = "OUT.csv", value_parser = rows_file)]
    output: PathBuf,
    #[command(flatten)]
    reading: ReadingArgs,
}

impl InvertArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let file = recording::file(&self.torque)?;
        Outputs::check_beside(&self.output, std::slice::from_ref(&file))?;
        let model = self.reading.of_gear(model::load(&self.model)?);
        let needs = invert::needs(&model);
        let recording = self.reading.read(&file, &needs, session)?;
        let working = Working::new("Inverting", session.quiet);
        let found = jobs::predict::invert(
            &model,
            self.reading.rated_deflection,
            &recording,
            &mut working.notes(session),
            &working,
        )?;
        let saturated: Vec<f64> = found.saturated.iter().map(|&saturated| f64::from(u8::from(saturated))).collect();
        let columns = [("deflection_rad", found.deflection_rad.as_slice()), ("saturated", saturated.as_slice())];

        let mut files = Files::new(session);
        files.stream("Rows", &self.output, |out| {
            Ok(copy_with_columns(&file, &self.reading.reading(&needs), &columns, out, &working)?)
        })?;
        drop(working);
        files.finish("")
    }
}
