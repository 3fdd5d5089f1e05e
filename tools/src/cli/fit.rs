//! `gmhm fit`.

use std::path::PathBuf;

use clap::Args;
use serde_json::Value;

use super::Session;
use super::common::{ReadingArgs, RecordingArgs, SeedArgs, drawing, json, model_file, page, provenance, with_model};
use super::each::EachArgs;
use super::failure::Failure;
use super::files::Files;
use super::progress::Progress;
use super::tables;
use crate::fit::verdict::Grade;
use crate::fit::{FitOptions, Method};
use crate::jobs::{self, fit::Identified};
use crate::model::{self, Model};
use crate::output::Outputs;
use crate::recording::RecordingFile;
use crate::report;

/// Identify a gear from recordings, with the uncertainty of every parameter
///
/// Writes a model file. Several recordings of one gear are fitted together. With --model the gear section, law, kernel, gate and play of that
/// file are kept; without it held-out prediction chooses them.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gmhm fit recording.csv -o gear.toml
  gmhm fit slow.csv fast.csv --map deflection_rad=-twist -o gear.toml --json fit.json --report fit.html
  gmhm fit --each --files-from joints.txt --ndjson fits.ndjson --resume")]
pub struct FitArgs {
    #[command(flatten)]
    files: RecordingArgs,
    /// Model file that gives ratio, law, kernel, gate and play
    #[arg(long, value_name = "M.toml")]
    model: Option<PathBuf>,
    /// How to search
    #[arg(long, value_enum, default_value_t = Method::Auto)]
    method: Method,
    /// Where to write the model file
    #[arg(short, long, value_name = "M2.toml", value_parser = model_file, required_unless_present = "each", conflicts_with = "each")]
    output: Option<PathBuf>,
    /// Where to write all results of the fit as JSON
    #[arg(long, value_name = "FILE", conflicts_with = "each")]
    json: Option<PathBuf>,
    /// Where to write the report: one HTML page, verdict first
    #[arg(long, value_name = "F.html", value_parser = page, conflicts_with = "each")]
    report: Option<PathBuf>,
    /// Where to write the plot of the loop [default: beside the model, with the ending svg]
    #[arg(long, value_name = "F.svg", value_parser = drawing, conflicts_with = "each")]
    plot: Option<PathBuf>,
    /// End with status 3 if the verdict is "not good enough", for scripts; with --each, if that of any recording is
    #[arg(long)]
    check: bool,
    /// Estimate one encoder zero per recording: the encoders were restarted or moved [default: only if the recordings do not fit together otherwise]
    #[arg(long)]
    own_zeros: bool,
    /// Name of the gear in the model file [default: that of the first recording]
    #[arg(long, value_name = "TEXT")]
    name: Option<String>,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    seed: SeedArgs,
    #[command(flatten)]
    each: EachArgs,
}

impl FitArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        self.each.check();
        let start = self.model.as_deref().map(model::load).transpose()?.map(|model| self.reading.of_gear(model));
        let Some(output) = &self.output else {
            return self.each.run(self.files.paths(), self.files.list(), session, |file, silent| {
                self.one(file, start.as_ref(), silent, session)
            });
        };
        let files = self.files.files()?;
        for path in [Some(output), self.json.as_ref(), self.report.as_ref(), self.plot.as_ref()].into_iter().flatten() {
            Outputs::check_beside(path, &files)?;
        }
        let identified = self.identify(&files, start.as_ref(), session)?;
        self.write(output, &identified, session)
    }

    /// Reads recordings of one gear, fits them and judges the fit.
    fn identify(
        &self,
        files: &[RecordingFile],
        start: Option<&Model>,
        session: &Session,
    ) -> Result<Identified, Failure> {
        let recordings = self.reading.read_all(files, start, session)?;
        let options = FitOptions {
            method: self.method,
            seed: self.seed.seed,
            start: start.cloned(),
            rated_deflection_rad: self.reading.rated_deflection,
            evaluations: None,
            ratio: self.reading.ratio,
            torque_side: self.reading.torque_side,
            own_zeros: self.own_zeros,
        };
        let name = self.name.clone().or_else(|| self.model.is_none().then(|| files[0].stem()));
        let progress = Progress::new("Fitting", Progress::WHOLE, session.quiet);
        jobs::fit::identify(recordings, &options, name, !self.each.each, &progress, &mut |note| session.note(note))
    }

    /// A recording of a fleet: what `--json` writes, and the model file.
    fn one(
        &self,
        file: &RecordingFile,
        start: Option<&Model>,
        silent: &Session,
        session: &Session,
    ) -> Result<Value, Failure> {
        let identified = self.identify(std::slice::from_ref(file), start, silent)?;
        session.check(self.check, identified.assessment.verdict.grade == Grade::Bad);
        with_model(&identified.results(), &identified.fit.model)
    }

    /// Writes all outputs.
    fn write(&self, output: &PathBuf, identified: &Identified, session: &Session) -> Result<(), Failure> {
        let Identified { fit, recordings, assessment } = identified;
        let everything = identified.results();
        let verdict = &everything.verdict;
        let plot = self.plot.clone().or_else(|| session.side_file(&output.with_extension("svg"), "--plot"));
        let mut files = Files::new(session);
        files.add("Model", Some(output), || Ok(fit.model.to_toml()))?;
        files.add("Plot", plot.as_ref(), || Ok(report::fit::loop_figure(fit, assessment, recordings).to_file()))?;
        files.add("JSON", self.json.as_ref(), || json(&everything))?;
        files.add("Report", self.report.as_ref(), || {
            let provenance = provenance(recordings.iter().map(Into::into).collect(), Some(fit.seed));
            Ok(report::fit::page(fit, assessment, recordings, provenance).to_html())
        })?;
        session.check(self.check, verdict.grade == Grade::Bad);
        let reasons = verdict.reasons.iter().skip(1).filter(|reason| reason.grade != Grade::Good);
        let reasons: String = reasons.map(|reason| format!("  {}\n", reason.words)).collect();
        let verdict = session.graded(&verdict.sentence, verdict.grade);
        files.finish(format_args!("{verdict}\n{reasons}{}", tables::fit(fit)))
    }
}
