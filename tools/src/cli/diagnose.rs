//! `gmhm diagnose`.

use std::path::PathBuf;

use clap::Args;

use super::Session;
use super::common::{ReadingArgs, SeedArgs, drawing, ending, json, model_file, page, provenance, with_model};
use super::each::EachArgs;
use super::failure::Failure;
use super::files::Files;
use super::progress::Progress;
use super::tables;
use crate::diagnose::Options;
use crate::fit::verdict::Grade;
use crate::jobs;
use crate::jobs::diagnose::{Diagnosed, NEEDS};
use crate::model::{self, Model};
use crate::output::Outputs;
use crate::recording::{self, RecordingFile};
use crate::report;
use crate::report::page::Input;

/// Find where recordings differ from a model and which physics is missing; write the extended model
///
/// Refits the base model together with every kind of physics in the library, against coloured noise, and names a kind only if it explains the whole
/// structure. Kinds that the recordings cannot distinguish are reported as one class; kinds that they cannot show are listed with the experiment that can.
/// With a column torque_sim_nm the recordings are compared with that simulation instead of the model.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gmhm diagnose gear.toml recording.csv -o extended.toml --json findings.json --report findings.html
  gmhm diagnose joint.csv -o extended.toml        joint.csv has the simulation's torque in torque_sim_nm
  gmhm diagnose gear.toml slow.csv fast.csv --holdout tuesday.csv -o extended.toml
  gmhm diagnose --each gear.toml --files-from joints.txt --ndjson findings.ndjson --resume")]
pub struct DiagnoseArgs {
    /// Model file (.toml) of the base, then recordings of one gear or joint; without one, recordings with torque_sim_nm
    #[arg(required = true, value_name = "M.toml|RECORDING")]
    inputs: Vec<PathBuf>,
    /// File with more recordings, one path per line; - is standard input
    #[arg(long, value_name = "FILE")]
    files_from: Option<PathBuf>,
    /// Recordings that are not used in the diagnosis; the models' errors on them are reported
    #[arg(long, value_name = "RECORDING", num_args = 1.., conflicts_with = "each")]
    holdout: Vec<PathBuf>,
    /// Estimate one encoder zero per recording: the encoders were restarted or moved
    ///
    /// Each deflection is shifted to the zero of the first recording before the comparison. A drift between recordings that looks like a zero is then not detected.
    #[arg(long, conflicts_with = "each")]
    own_zeros: bool,
    /// Where to write the extended model
    #[arg(short, long, value_name = "M2.toml", value_parser = model_file, required_unless_present = "each", conflicts_with = "each")]
    output: Option<PathBuf>,
    /// Where to write the findings as JSON
    #[arg(long, value_name = "FILE", conflicts_with = "each")]
    json: Option<PathBuf>,
    /// Where to write the report: one HTML page, the finding first
    #[arg(long, value_name = "F.html", value_parser = page, conflicts_with = "each")]
    report: Option<PathBuf>,
    /// Where to draw the torque, measured and by both models
    #[arg(long, value_name = "F.svg", value_parser = drawing, conflicts_with = "each")]
    plot: Option<PathBuf>,
    /// Where to draw the residual of both models over time
    #[arg(long, value_name = "F.svg", value_parser = drawing, conflicts_with = "each")]
    plot_residual: Option<PathBuf>,
    /// End with status 3 if there is a mismatch, for scripts; with --each, if there is one in any recording
    #[arg(long)]
    check: bool,
    /// Name of the gear in the extended model [default: the model's]
    #[arg(long, value_name = "TEXT")]
    name: Option<String>,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    seed: SeedArgs,
    #[command(flatten)]
    each: EachArgs,
}

impl DiagnoseArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        self.each.check();
        let (model_file, recordings) = match self.inputs.split_first() {
            Some((first, rest)) if self.has_model() => (Some(first), rest),
            _ => (None, &self.inputs[..]),
        };
        let model = || -> Result<Model, Failure> {
            let base = model_file.map_or_else(|| Ok(jobs::diagnose::simulation()), |file| model::load(file))?;
            let mut model = self.reading.of_gear(base);
            if let Some(name) = &self.name {
                model.name.clone_from(name);
            }
            Ok(model)
        };
        let Some(output) = &self.output else {
            let model = model()?;
            return self.each.run(recordings, self.files_from.as_deref(), session, |file, silent| {
                let Diagnosed { finding, .. } = self.find(model.clone(), std::slice::from_ref(file), &[], silent)?;
                session.check(self.check, finding.diagnosis.mismatch);
                with_model(&finding.diagnosis, &finding.model)
            });
        };
        if recordings.is_empty() && self.files_from.is_none() {
            super::wrong_usage("no recording was given: gmhm diagnose M.toml RECORDING… -o M2.toml");
        }
        let files = recording::files_and_listed(recordings, self.files_from.as_deref())?;
        let held_out = recording::files_and_listed(&self.holdout, None)?;
        let pictures = [self.plot.as_ref(), self.plot_residual.as_ref()];
        let outputs = [Some(output), self.json.as_ref(), self.report.as_ref()].into_iter().chain(pictures);
        for path in outputs.flatten() {
            Outputs::check_beside(path, &[&files[..], &held_out].concat())?;
        }
        let Diagnosed { finding, recordings, holdout } = self.find(model()?, &files, &held_out, session)?;
        finding.remarks.iter().for_each(|remark| session.note(&remark.to_string()));
        let mut files = Files::new(session);
        files.add("Model", Some(output), || Ok(finding.model.to_toml()))?;
        files.add("JSON", self.json.as_ref(), || json(&finding.diagnosis))?;
        files.add("Report", self.report.as_ref(), || {
            let mut inputs = model_file.map(|file| Input::of_file(file)).transpose()?.into_iter().collect::<Vec<_>>();
            inputs.extend(recordings.iter().chain(&holdout).map(Input::from));
            let provenance = provenance(inputs, Some(self.seed.seed));
            Ok(report::diagnosis::page(&finding, &recordings, provenance).to_html())
        })?;
        files.add("Picture", self.plot.as_ref(), || Ok(report::diagnosis::drawing(&finding, &recordings).to_file()))?;
        files.add("Picture", self.plot_residual.as_ref(), || Ok(report::diagnosis::residual(&finding).to_file()))?;
        session.check(self.check, finding.diagnosis.mismatch);
        let grade = if finding.diagnosis.mismatch { Grade::Caution } else { Grade::Good };
        let text = tables::diagnosis(&finding.diagnosis);
        let (first, rest) = text.split_once('\n').unwrap_or((&text, ""));
        files.finish(format_args!("{}\n{rest}Seed {}\n", session.graded(first, grade), self.seed.seed))
    }

    /// Whether the first input is a model file.
    fn has_model(&self) -> bool {
        self.inputs.first().is_some_and(|path| ending(path) == "toml")
    }

    /// Reads recordings of one gear or joint and diagnoses them.
    fn find(
        &self,
        model: Model,
        files: &[RecordingFile],
        held_out: &[RecordingFile],
        session: &Session,
    ) -> Result<Diagnosed, Failure> {
        let recordings = self.reading.read_needed(files, &NEEDS, Some(&model), session)?;
        if !self.has_model()
            && let Some(file) = recordings.iter().find(|recording| recording.torque_sim_nm.is_none())
        {
            return Err(Failure::NoModel(file.name.clone()));
        }
        let holdout = self.reading.read_needed(held_out, &NEEDS, Some(&model), session)?;
        let options =
            Options { rated_deflection_rad: self.reading.rated_deflection, seed: self.seed.seed, ..Options::default() };
        let progress = Progress::new("Diagnosing", Progress::WHOLE, session.quiet);
        let mut notes = |note: &str| session.note(note);
        jobs::diagnose::find(model, recordings, holdout, &options, self.own_zeros, &progress, &mut notes)
    }
}
