//! `gmhm plot`.

use std::path::PathBuf;

use clap::Args;

use super::Session;
use super::common::{ReadingArgs, provenance};
use super::failure::Failure;
use super::files::Files;
use super::progress::Progress;
use crate::model;
use crate::output::Outputs;
use crate::recording::{self, Need, Needs};
use crate::report::page::Input;
use crate::report::pictures::{self, Shown};

/// Draw recordings and models: the loop, every channel over time
///
/// Models are drawn as the loop at their rated deflection. An .svg holds the loop (without a deflection, the torque over time), an .html all figures.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gmhm plot recording.csv -o recording.html
  gmhm plot before.csv after.csv gear.toml -o loops.svg")]
pub struct PlotArgs {
    /// Recordings, and model files (.toml)
    #[arg(required_unless_present = "files_from", value_name = "RECORDING|M.toml")]
    inputs: Vec<PathBuf>,
    /// File with more recordings, one path per line; - is standard input
    #[arg(long, value_name = "FILE")]
    files_from: Option<PathBuf>,
    /// Where to draw: .html or .svg
    #[arg(short, long, value_name = "F.html|F.svg", value_parser = picture)]
    output: PathBuf,
    #[command(flatten)]
    reading: ReadingArgs,
}

/// What is drawn of a recording: all that it has.
const ANYTHING: Needs =
    Needs { time: Need::Required, torque: Need::IfPresent, motion: Need::IfPresent, simulation: Need::IfPresent };

impl PlotArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let is_model = |path: &&PathBuf| path.extension().is_some_and(|ending| ending == "toml");
        let (models, recordings): (Vec<&PathBuf>, Vec<&PathBuf>) = self.inputs.iter().partition(is_model);
        let recordings: Vec<PathBuf> = recordings.into_iter().cloned().collect();
        let files = recording::files_and_listed(&recordings, self.files_from.as_deref())?;
        Outputs::check_beside(&self.output, &files)?;
        let (mut shown, mut inputs) = (Vec::new(), Vec::new());
        for path in models {
            shown.push(Shown::model(path, &model::load(path)?, self.reading.rated_deflection)?);
            inputs.push(Input::of_file(path)?);
        }
        for file in &files {
            let bytes = file.path.metadata().map_or(0, |m| m.len());
            let progress = Progress::new(&format!("Reading {}", file.name), bytes, session.quiet);
            let mut recording = self.reading.reading(&ANYTHING).read(file, &|done| progress.at(done))?;
            // Two angles without a ratio are drawn as they are.
            let _ = recording.derive_deflection(self.reading.ratio);
            inputs.push((&recording).into());
            shown.push(Shown::recording(recording));
        }
        let text = match self.output.extension().is_some_and(|ending| ending == "svg") {
            true => pictures::drawing(&shown).to_file(),
            false => pictures::page(&shown, provenance(inputs, None)).to_html(),
        };
        let mut written = Files::new(session);
        written.add("Picture", Some(&self.output), || Ok(text))?;
        written.finish("")
    }
}

fn picture(text: &str) -> Result<PathBuf, String> {
    match PathBuf::from(text).extension().and_then(|ending| ending.to_str()) {
        Some("html" | "svg") => Ok(text.into()),
        _ => Err("must end in .html or .svg".to_owned()),
    }
}
