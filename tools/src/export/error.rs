//! Why a model is not exported.

use gmhm::ParamError;
use gmhm::terms::TermError;

use crate::model::refusal;
use crate::number::trimmed;

/// Why a model is not exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A joint log's model, or one on top of a simulation.
    #[error("the model has no [elastic] and [memory]: it contains no gear torque to export")]
    NoGear,
    /// The terms are added to another simulator's torque.
    #[error("the model's base is another simulation, whose torque is not in the model")]
    OnSimulation,
    /// The model does not say where it is calibrated.
    #[error("the model has no rated_deflection_rad in [gear]")]
    NoRatedDeflection,
    /// The parameters are refused at the rated deflection in use.
    #[error("the model at the rated deflection {} rad: {}", trimmed(*rated_deflection_rad, 6), refusal::of_parameters(error))]
    Params {
        /// The rated deflection in use, rad.
        rated_deflection_rad: f64,
        /// Why the core refuses them.
        error: ParamError,
    },
    /// Law `time` without a sample period.
    #[error("law time requires the longest sample period")]
    NoPeriod,
    /// A term that is refused.
    #[error("the model's term `{kind}`: {error}")]
    Term {
        /// Its kind.
        kind: String,
        /// Why the core refuses it.
        error: TermError,
    },
    /// A kind that has no source.
    #[error("the model's term `{0}` cannot be exported: there is no C source of this kind")]
    Kind(String),
    /// Two angles without a ratio.
    #[error("the model has no ratio in [gear], which is required for two angles")]
    NoRatio,
    /// The archive cannot be made.
    #[error("the FMU cannot be packed: {0}")]
    Archive(String),
    /// No name of C.
    #[error("`{0}` is not a valid name in C")]
    Prefix(String),
}

impl ExportError {
    /// How to fix it.
    pub fn fix(&self) -> Option<String> {
        let text = match self {
            Self::NoRatedDeflection => "add rated_deflection_rad to [gear], or give --rated-deflection RAD",
            Self::NoPeriod => "give it with --period SECONDS",
            Self::NoGear | Self::OnSimulation => {
                "export a model with [elastic] and [memory], as written by gmhm fit for recordings of a gear"
            }
            Self::Kind(_) => "remove the term from the model, or use the Rust crate or the C library (c/)",
            Self::Prefix(_) => "use at most 24 letters, digits and _, beginning with a letter",
            Self::NoRatio => "add ratio to [gear], or take the deflection as input",
            Self::Params { .. } => "correct the model, fit the gear again, or give --rated-deflection",
            Self::Term { .. } => "correct the term, or remove it",
            Self::Archive(_) => return None,
        };
        Some(text.to_owned())
    }
}
