//! Why nothing was simulated.

use gmhm::ParamError;

use crate::bench::hide::HideError;
use crate::bench::options::Experiment;
use crate::device::DeviceError;
use crate::model::refusal;
use crate::number::trimmed;
use crate::physics::PredictError;
use crate::regression::error::EstimateError;

/// Why nothing was simulated.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A joint log has no gear to put on the bench.
    #[error("the model has no [elastic] and [memory]: the bench needs a gear; fit one with gmhm fit")]
    NoGear,
    /// No rated deflection.
    #[error("the model has no rated_deflection_rad in [gear]: the bench scales its experiments by it")]
    NoRatedDeflection,
    /// The motor cannot run without a ratio.
    #[error("experiment {0} turns the motor: the model needs ratio in [gear]")]
    NoRatio(Experiment),
    /// The core refused the gear.
    #[error("no gear has the parameters of this model: {}", refusal::of_parameters(.0))]
    Params(#[from] ParamError),
    /// The experiment has no such option.
    #[error("{option} has no meaning in experiment {experiment}")]
    NotInExperiment {
        /// The option.
        option: &'static str,
        /// The experiment.
        experiment: Experiment,
    },
    /// A value that cannot be.
    #[error("{option} {value}: must be {must}")]
    Value {
        /// The option.
        option: &'static str,
        /// What was given.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// Too few samples for the motion.
    #[error("--sample-rate {}: too slow for this motion, at least {} Hz are needed", trimmed(*sample_rate_hz, 6), trimmed(*needed_hz, 6))]
    TooSlow {
        /// What was given, Hz.
        sample_rate_hz: f64,
        /// What is needed, Hz.
        needed_hz: f64,
    },
    /// Hardly any rows, or too many.
    #[error(
        "these options make {rows:.0} rows, 8 to {most:.0} are possible: change --duration, --rate or --sample-rate"
    )]
    Rows {
        /// Rows asked for.
        rows: f64,
        /// Most rows.
        most: f64,
    },
    /// The gear cannot carry the load within its rated deflection.
    #[error(
        "at {time_s} s the gear does not carry {load_nm} N·m within its rated deflection (laws phase and time are not invertible there): lower --amplitude"
    )]
    LoadNotReached {
        /// When, s.
        time_s: f64,
        /// The load, N·m.
        load_nm: f64,
    },
    /// The torque could not be computed.
    #[error(transparent)]
    Predict(#[from] PredictError),
    /// The joint has no servo.
    #[error("servo of the joint: {0}")]
    Servo(#[from] gmhm::drive::ServoError),
    /// The drive at the end of the line did not answer.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// It answered that it cannot.
    #[error("the drive refused the joint: its firmware is of another version")]
    DriveRefused,
    /// An effect could not be hidden.
    #[error(transparent)]
    Hide(#[from] HideError),
    /// The gear of the joint could not be identified.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
}

impl BenchError {
    /// How to fix it, where there is more to say than the message does.
    pub fn fix(&self) -> Option<String> {
        let text = match self {
            BenchError::Params(_) => "correct the model, or fit the gear again",
            BenchError::NoRatedDeflection => "add rated_deflection_rad to [gear]",
            BenchError::NoRatio(_) => "add ratio to [gear]",
            BenchError::Predict(error) => return error.fix(),
            BenchError::Device(error) => return error.fix(),
            BenchError::Estimate(error) => return error.fix(),
            _ => return None,
        };
        Some(text.to_owned())
    }
}
