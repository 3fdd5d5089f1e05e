//! Error messages: the place, what is wrong, and the fix.

use std::fmt::Display;
use std::io::IsTerminal;
use std::path::PathBuf;

use miette::{Diagnostic, GraphicalReportHandler, LabeledSpan, SourceCode};

use gmhm::adapt::AdaptError;

use crate::adapt::AdaptReplayError;
use crate::bench::BenchError;
use crate::block::{FileError, PackError};
use crate::device::DeviceError;
use crate::diagnose::DiagnoseError;
use crate::export::ExportError;
use crate::fit::verdict::AssessError;
use crate::fleet::FleetError;
use crate::health::HealthError;
use crate::model::ModelError;
use crate::output::OutputError;
use crate::physics::PredictError;
use crate::physics::invert::InvertError;
use crate::prove::real::RealError;
use crate::recording::{CopyError, RecordingError};
use crate::regression::error::EstimateError;

/// Whatever may end a command.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A recording was refused.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A model file was refused.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// An output could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Rows could not be copied.
    #[error(transparent)]
    Copy(#[from] CopyError),
    /// Nothing could be simulated.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// Nothing could be predicted.
    #[error(transparent)]
    Predict(#[from] PredictError),
    /// Nothing could be replayed through the adaptation.
    #[error(transparent)]
    Adapt(#[from] AdaptReplayError),
    /// Nothing could be inverted.
    #[error(transparent)]
    Invert(#[from] InvertError),
    /// Nothing could be fitted.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    /// A fit could not be judged.
    #[error(transparent)]
    Assess(#[from] AssessError),
    /// Nothing could be diagnosed.
    #[error(transparent)]
    Discover(#[from] DiagnoseError),
    /// No block was made.
    #[error(transparent)]
    Pack(#[from] PackError),
    /// A fleet was not gone through.
    #[error(transparent)]
    Fleet(#[from] FleetError),
    /// No source was made.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// The file of a block was refused.
    #[error(transparent)]
    BlockFile(#[from] FileError),
    /// Nothing could be said of a series.
    #[error(transparent)]
    Health(#[from] HealthError),
    /// A proof on real noise only, without any.
    #[error("{}: has none of the real recordings that block real-noise takes its noise from", .0.display())]
    NoRealNoise(PathBuf),
    /// A real recording that is known and cannot be read.
    #[error(transparent)]
    RealRecording(#[from] RealError),
    /// A folder without any real recording that is known.
    #[error("{}: holds none of the real recordings whose answers are known", .0.display())]
    NoRealRecordings(PathBuf),
    /// A folder that is not there.
    #[error("{}: there is no such folder", .0.display())]
    NoFolder(PathBuf),
    /// A folder without any answer to a proof.
    #[error("{}: holds no answer to any case of this seed", .0.display())]
    NoAnswers(PathBuf),
    /// A diagnosis without anything to compare a recording with.
    #[error("{0}: there is nothing to compare it with: no model file is given, and column torque_sim_nm is missing")]
    NoModel(String),
    /// No block got into a drive.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The system refused.
    #[error(transparent)]
    System(#[from] std::io::Error),
}

impl Failure {
    /// Whether the command line is to blame, whatever the files hold.
    pub fn is_wrong_usage(&self) -> bool {
        matches!(
            self,
            Failure::Bench(BenchError::NotInExperiment { .. } | BenchError::Value { .. })
                | Failure::Output(OutputError::Twice(_))
        )
    }

    /// How to fix it.
    pub fn fix(&self) -> Option<String> {
        match self {
            Failure::Recording(e) | Failure::Copy(CopyError::Recording(e)) => e.fix(),
            Failure::Model(e) => e.fix(),
            Failure::Output(e) => e.fix().map(str::to_owned),
            Failure::Health(e) => e.fix(),
            Failure::Bench(e) => e.fix(),
            Failure::Device(e) => e.fix(),
            Failure::Pack(e) => e.fix(),
            Failure::Export(e) => e.fix(),
            Failure::Fleet(e) => e.fix(),
            Failure::BlockFile(e) => e.fix(),
            Failure::Predict(e) | Failure::Assess(AssessError::Predict(e)) => e.fix(),
            Failure::Invert(e) => e.fix(),
            Failure::Discover(DiagnoseError::Implausible(e)) => Some(e.fix()),
            Failure::Estimate(e) | Failure::Assess(AssessError::Estimate(e)) => e.fix(),
            Failure::NoFolder(_) => Some("check the path".to_owned()),
            Failure::NoAnswers(_) => Some(
                "write the answer to case 7 as case_0007.json in this folder; the cases are written by --export with the same --seed and --cases"
                    .to_owned(),
            ),
            Failure::NoModel(_) => Some(
                "name a model file first, as in gmhm diagnose M.toml RECORDING -o M2.toml (gmhm fit makes one); or add the simulated torque as torque_sim_nm"
                    .to_owned(),
            ),
            Failure::Discover(DiagnoseError::Estimate(e)) => e.fix(),
            Failure::Adapt(AdaptReplayError::Implausible(e)) => Some(e.fix()),
            Failure::NoRealNoise(_) => {
                Some("name their folder with --recordings FOLDER, or prove other blocks".to_owned())
            }
            Failure::NoRealRecordings(_) => {
                Some("name the folder that holds them with --real FOLDER; docs/proof.md lists their files".to_owned())
            }
            Failure::Adapt(AdaptReplayError::Predict(e)) => e.fix(),
            Failure::Adapt(AdaptReplayError::Recording(e)) => e.fix(),
            Failure::Adapt(AdaptReplayError::Adapt(AdaptError::Setting { setting: "period_s", .. })) => {
                Some("check the unit of the time: --map scales it, such as time_ms=COLUMN".to_owned())
            }
            Failure::Adapt(_)
            | Failure::RealRecording(_)
            | Failure::Copy(_)
            | Failure::Discover(_)
            | Failure::System(_) => None,
        }
    }

    /// Tells it on standard error: with the lines of a model file on a terminal, as two plain lines into a pipe or a log.
    pub fn tell(&self) {
        if std::io::stderr().is_terminal() {
            let mut text = String::new();
            if GraphicalReportHandler::new().render_report(&mut text, self).is_ok() {
                eprintln!("{text}");
                return;
            }
        }
        eprintln!("error: {self}");
        if let Some(fix) = self.fix() {
            eprintln!("help: {fix}");
        }
    }
}

impl Diagnostic for Failure {
    fn help<'a>(&'a self) -> Option<Box<dyn Display + 'a>> {
        Some(Box::new(self.fix()?))
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        match self {
            Failure::Model(e) if e.span.is_some() => Some(&e.text),
            _ => None,
        }
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let Failure::Model(e) = self else { return None };
        let label = LabeledSpan::new_with_span(None, e.span.clone()?);
        Some(Box::new(std::iter::once(label)))
    }
}
