//! Why no condition was found.

use std::path::PathBuf;

use crate::number::{number, trimmed};
use crate::physics::PredictError;
use crate::regression::error::EstimateError;

/// Why there is no finding.
#[derive(Debug, thiserror::Error)]
pub enum HealthError {
    /// Nothing to compare.
    #[error("no recording and no model given")]
    Nothing,
    /// A recording could not be fitted.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    /// A model could not be evaluated.
    #[error(transparent)]
    Predict(#[from] PredictError),
    /// A model without a gear.
    #[error("{0}: the model has no [elastic] and [memory]: there is no stiffness to follow")]
    NoGear(String),
    /// Models that do not compare.
    #[error("{name}: {what} differs from that of {first}: parameters of different structures do not compare")]
    Differs {
        /// The model.
        name: String,
        /// The first model.
        first: String,
        /// What differs.
        what: &'static str,
    },
    /// The rating is beyond the model.
    #[error(
        "{name}: the rated torque {} {unit} is beyond the {} {unit} of the rated deflection, where the model is not calibrated",
        trimmed(*rated_torque, 6), number(*reached, 4)
    )]
    BeyondRated {
        /// The model.
        name: String,
        /// The rated torque.
        rated_torque: f64,
        /// Torque at the rated deflection.
        reached: f64,
        /// Unit of both.
        unit: &'static str,
    },
    /// A fit that is no spring.
    #[error("{name}: the fitted torque at the rated deflection is {} {unit}: this is not a loaded gear", number(*torque, 3))]
    NoSpring {
        /// The recording or model.
        name: String,
        /// Torque at the rated deflection.
        torque: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// A fit whose torque does not grow with its deflection.
    #[error("{name}: no closed cycle of the gear as fitted, within its uncertainty, reaches {} {unit}: this is not a loaded gear", number(*torque, 3))]
    NoCycle {
        /// The recording or model.
        name: String,
        /// The torque.
        torque: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The breakpoints are out of order.
    #[error("the torques have to rise from T1 over T2 to the rated one: {} < {} < {} does not hold", trimmed(*t1, 5), trimmed(*t2, 5), trimmed(*rated, 5))]
    Breakpoints {
        /// T1.
        t1: f64,
        /// T2.
        t2: f64,
        /// Rated torque.
        rated: f64,
    },
    /// No such property.
    #[error("--against {asked}: {problem}")]
    Against {
        /// What was asked.
        asked: String,
        /// What is wrong.
        problem: String,
    },
    /// The uncertainty beside a model could not be read.
    #[error("{}: {problem}", path.display())]
    Uncertainty {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
}

impl HealthError {
    /// How to fix it, where there is more to say than the message does.
    pub fn fix(&self) -> Option<String> {
        let text = match self {
            HealthError::Predict(error) => return error.fix(),
            HealthError::Estimate(error) => return error.fix(),
            HealthError::NoSpring { .. } | HealthError::NoCycle { .. } => {
                "leave it out, or check that the gear was loaded and that the deflection is not counted against the torque"
            }
            HealthError::BeyondRated { .. } => "give a smaller --rated-torque",
            HealthError::Breakpoints { .. } => "give --t1, --t2 and --rated-torque as the catalogue does",
            HealthError::Differs { .. } => "fit all recordings with one --model, or give the recordings to gmhm health",
            HealthError::Against { .. } => {
                "name temperature_c, or a table as TABLE.csv:COLUMN whose first column names the recordings or models"
            }
            HealthError::Uncertainty { .. } => "write it by `gmhm fit --json`, or remove the file",
            _ => return None,
        };
        Some(text.to_owned())
    }
}
