//! Why nothing was replayed.

use gmhm::ParamError;
use gmhm::adapt::AdaptError;

use crate::physics::PredictError;
use crate::recording::RecordingError;
use crate::signal::plausible::Implausible;

/// Why a recording could not be replayed through the adaptation.
#[derive(Debug, thiserror::Error)]
pub enum AdaptReplayError {
    /// A joint log has nothing to adapt.
    #[error("the model has no [elastic] and [memory]: only a gear is adapted; fit one with gmhm fit")]
    NoGear,
    /// No rated deflection.
    #[error("the model has no rated_deflection_rad in [gear]: add it, or set --rated-deflection")]
    NoRatedDeflection,
    /// The recording has no torque to learn from.
    #[error("{file}: torque_nm is missing: the adaptation learns from it")]
    NoTorque {
        /// The recording.
        file: String,
    },
    /// Too few rows for a sample period.
    #[error("{file}: has {rows} rows, and at least 2 are needed")]
    TooShort {
        /// The recording.
        file: String,
        /// Its rows.
        rows: usize,
    },
    /// The core refused the gear.
    #[error("the model's gear: {0}")]
    Params(#[from] ParamError),
    /// The core refused to adapt it.
    #[error("{0}")]
    Adapt(#[from] AdaptError),
    /// The deflection is missing.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The recording and the model cannot be of one gear.
    #[error(transparent)]
    Implausible(#[from] Implausible),
    /// The terms could not be predicted.
    #[error(transparent)]
    Predict(#[from] PredictError),
}
