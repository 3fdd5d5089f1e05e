//! `gmhm fit`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::Session;
use super::common::{ReadingArgs, SeedArgs, json};
use super::failure::Failure;
use super::progress::Progress;
use super::tables;
use crate::estimate::{self, FitOptions};
use crate::model::{self, Model};
use crate::output::Outputs;
use crate::physics::predict;
use crate::recording::{Needs, Recording};
use crate::report::figures;
use crate::report::plot::{Drawing, Role};

/// Identify a gear from recordings, with the uncertainty of every parameter
///
/// Writes a model file. Several recordings of one gear are fitted together. With --model the gear section, law, kernel, gate and play of that
/// file are kept; without it held-out prediction chooses them.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gmhm fit recording.csv -o gear.toml
  gmhm fit slow.csv fast.csv --map deflection_rad=-twist -o gear.toml --json fit.json")]
pub struct FitArgs {
    /// Recordings of one gear
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Model file that gives ratio, law, kernel, gate and play
    #[arg(long, value_name = "M.toml")]
    model: Option<PathBuf>,
    /// How to search
    #[arg(long, value_enum, default_value_t = Method::Auto)]
    method: Method,
    /// Where to write the model file
    #[arg(short, long, value_name = "M2.toml")]
    output: PathBuf,
    /// Where to write everything that is known about the fit, as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Where to write the plot of the loop [default: beside the model, with the ending svg]
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    seed: SeedArgs,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Method {
    /// Eliminate the linear parameters exactly, search the others
    Auto,
    /// The paper's particle swarm over all six parameters
    Pso,
}

impl FitArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        for output in [Some(&self.output), self.json.as_ref(), self.plot.as_ref()].into_iter().flatten() {
            Outputs::check(output)?;
        }
        let start = self.model.as_deref().map(model::load).transpose()?;
        let recordings = self.reading.read_all(&self.recordings, &Needs::FIT, session.quiet)?;
        let options = FitOptions {
            method: match self.method {
                Method::Auto => estimate::Method::Auto,
                Method::Pso => estimate::Method::Pso,
            },
            seed: self.seed.seed,
            start,
            rated_deflection_rad: self.reading.rated_deflection,
            evaluations: None,
        };
        let mut fit = estimate::fit(&recordings, &options, &Progress::new("Fitting", Progress::WHOLE, session.quiet))?;

        if self.model.is_none() {
            fit.model.name = self.recordings[0].file_stem().unwrap_or_default().to_string_lossy().into_owned();
        }
        let mut outputs = Outputs::new();
        outputs.add_text(&self.output, &fit.model.to_toml())?;
        if let Some(path) = &self.json {
            outputs.add_text(path, &json(&fit)?)?;
        }
        let plot = self.plot.clone().unwrap_or_else(|| self.output.with_extension("svg"));
        outputs.add_text(&plot, &fit_plot(&fit.model, &fit.offsets, recordings)?.to_file())?;
        outputs.commit()?;
        print!("{}", tables::fit(&fit));
        println!("Model written to {}, plot to {}", self.output.display(), plot.display());
        Ok(())
    }
}

/// The loop of all recordings with the model's prediction, which starts each of them from rest; offsets are added.
fn fit_plot(model: &Model, offsets: &[f64], recordings: Vec<Recording>) -> Result<Drawing, Failure> {
    let unit = model.torque_unit;
    let (mut deflection, mut measured, mut modelled) = (Vec::new(), Vec::new(), Vec::new());
    for (mut recording, offset) in recordings.into_iter().zip(offsets) {
        modelled.extend(predict(model, None, &recording)?.torque.iter().map(|t| t + offset));
        recording.derive_deflection(model.gear.ratio)?;
        deflection.extend(recording.deflection_rad.unwrap_or_default());
        measured.extend(recording.torque.unwrap_or_default());
    }
    let curves = [("model, from rest", Role::Model, &modelled[..])];
    Ok(figures::hysteresis_loop(&format!("Hysteresis loop: {}", model.name), &deflection, &measured, &curves, unit))
}
