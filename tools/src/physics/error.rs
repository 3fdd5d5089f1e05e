//! Why nothing was predicted.

use gmhm::ParamError;
use gmhm::terms::{Need, TermError};

use crate::model::refusal;
use crate::number::trimmed;
use crate::recording::RecordingError;

/// Why nothing could be predicted.
#[derive(Debug, thiserror::Error)]
pub enum PredictError {
    /// The recording lacks what the model needs.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The parameters are refused at the rated deflection in use.
    #[error("the model at the rated deflection {} rad: {}", trimmed(*rated_deflection_rad, 6), refusal::of_parameters(error))]
    Params {
        /// The rated deflection in use, rad.
        rated_deflection_rad: f64,
        /// Why the core refuses them.
        error: ParamError,
    },
    /// The model holds neither gear nor terms.
    #[error("the model has neither [elastic] and [memory] nor any [[term]]: it predicts nothing")]
    EmptyModel,
    /// A term that is refused.
    #[error("the model's term `{kind}`: {error}")]
    Term {
        /// Its kind.
        kind: String,
        /// Why the core refuses it.
        error: TermError,
    },
    /// A signal that a term cannot do without.
    #[error("{file}: the term `{kind}` needs {}, which the recording does not have: {} is missing", need.words(), column(*need))]
    MissingSignal {
        /// The recording.
        file: String,
        /// The term's kind.
        kind: String,
        /// What it needs.
        need: Need,
    },
    /// A model whose terms are added to a simulation, and a recording without one.
    #[error(
        "{0}: the model's terms are added to a simulation's torque (base = \"simulation\"), and column torque_sim_nm is missing"
    )]
    NoSimulation(String),
    /// A term of a gear in the model of a joint.
    #[error("the term `{0}` needs a gear: the model has no [elastic] and [memory]")]
    NoGear(String),
    /// A deflection beyond anything that the model can extrapolate to.
    #[error(
        "{file}, row {row}: the deflection {deflection_rad:?} rad is absurd for a rated deflection of {rated_deflection_rad:?} rad"
    )]
    Absurd {
        /// The recording.
        file: String,
        /// Row of numbers, counted from 1.
        row: usize,
        /// Its deflection, rad.
        deflection_rad: f64,
        /// The rated deflection in use, rad.
        rated_deflection_rad: f64,
    },
    /// A torque beyond numbers.
    #[error("{file}, row {row}: the torque of the term `{kind}` is not a finite number")]
    NotFinite {
        /// The recording.
        file: String,
        /// Row of numbers, counted from 1.
        row: usize,
        /// The term's kind.
        kind: String,
    },
}

/// The columns that tell a signal.
fn column(need: Need) -> &'static str {
    match need {
        Need::MotorAngle => "column theta_in_rad (or theta_out_rad with ratio in [gear])",
        Need::OutputAngle => "column theta_out_rad (or theta_in_rad with ratio in [gear])",
        Need::Velocity | Need::Acceleration => {
            "column velocity_out_rad_per_s or theta_out_rad (or theta_in_rad with ratio in [gear])"
        }
        Need::Deflection | Need::DeflectionRate => {
            "column deflection_rad (or theta_in_rad and theta_out_rad with ratio in [gear])"
        }
        Need::Temperature => "column temperature_c",
        Need::MotorVelocity => "column theta_in_rad (or theta_out_rad with ratio in [gear])",
        Need::OutputVelocity => "column velocity_out_rad_per_s or theta_out_rad (or theta_in_rad with ratio in [gear])",
        Need::SimulatedTorque => "column torque_sim_nm",
        Need::Gear => "a gear",
    }
}

impl PredictError {
    /// How to fix it, where there is more to say than the message does.
    pub fn fix(&self) -> Option<String> {
        let text = match self {
            PredictError::Recording(error) => return error.fix(),
            PredictError::Params { error: ParamError::Negative { parameter: "c1_nm_per_rad", .. }, .. } => {
                "the torque falls while the deflection rises, so one of them is counted backwards: flip it with --map deflection_rad=-COLUMN"
            }
            PredictError::Params { .. } => "correct the model, or give --rated-deflection",
            PredictError::EmptyModel => "identify one by `gmhm fit`",
            PredictError::Term { .. } => "correct the term, or remove it",
            PredictError::MissingSignal { .. } => {
                "name the column, or map another to it with --map; or remove the term"
            }
            PredictError::NoSimulation(_) => "add the column, or map another to it with --map torque_sim_nm=…",
            PredictError::NoGear(_) => "remove the term, or add the gear's sections",
            PredictError::Absurd { .. } => {
                "check the column's unit and the model's deflection_zero_rad; --map scales and shifts columns"
            }
            PredictError::NotFinite { .. } => "correct the term's parameters",
        };
        Some(text.to_owned())
    }
}
