//! Why nothing was fitted, and the fix.

use gmhm::ParamError;

use crate::model::refusal;
use crate::number::number;
use crate::physics::PredictError;
use crate::signal::plausible::Implausible;

/// Why nothing was fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EstimateError {
    /// No recording.
    #[error("no recording was given")]
    NoRecording,
    /// Too little to fit.
    #[error("{recording}: {rows} rows are too few, at least {needed} are needed")]
    TooFewRows {
        /// The recording.
        recording: String,
        /// Its rows.
        rows: usize,
        /// Rows needed.
        needed: usize,
    },
    /// No torque to explain.
    #[error(
        "{recording}: column torque_nm (or current_a) is missing; name it, or map another column to it with --map torque_nm=…"
    )]
    NoTorque {
        /// The recording.
        recording: String,
    },
    /// No deflection.
    #[error(
        "{recording}: column deflection_rad is missing, and so is theta_in_rad or theta_out_rad; map a column with --map deflection_rad=…"
    )]
    NoDeflection {
        /// The recording.
        recording: String,
    },
    /// A joint log where a gear is asked for.
    #[error(
        "{recording} is a joint log: without deflection_rad or theta_in_rad it shows no deflection, and so no stiffness and no hysteresis"
    )]
    JointLog {
        /// The recording.
        recording: String,
    },
    /// Numbers that no gear has.
    #[error("{recording}: the {what} varies by {} {unit}, which no gear does", number(*size, 2))]
    Absurd {
        /// The recording.
        recording: String,
        /// The channel.
        what: &'static str,
        /// Its range.
        size: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// One of several recordings that tells nothing.
    #[error("{recording}: the {what} is the same in every row: nothing can be identified from it")]
    Still {
        /// The recording.
        recording: String,
        /// The channel.
        what: &'static str,
    },
    /// Recordings with other zeros of the encoders.
    #[error(
        "the deflections of {first} and {other} lie about {} rad from each other, more than either moves, and separate zeros do not reconcile them",
        number(*apart_rad, 4)
    )]
    OtherZero {
        /// The first recording.
        first: String,
        /// The other.
        other: String,
        /// Distance of their middles, rad.
        apart_rad: f64,
    },
    /// Angles without a ratio.
    #[error(
        "{recording}: the deflection follows from theta_in_rad and theta_out_rad only with the ratio: give [gear] ratio in --model"
    )]
    NoRatio {
        /// The recording.
        recording: String,
    },
    /// The gear does not move.
    #[error(
        "{recording}: the deflection is the same in every row, or the joint of a joint log stands still: nothing can be fitted"
    )]
    NoMovement {
        /// The first recording.
        recording: String,
    },
    /// The torque does not change.
    #[error("{recording}: the torque is the same in every row: nothing can be fitted")]
    NoTorqueChange {
        /// The first recording.
        recording: String,
    },
    /// Newton-metres and amperes.
    #[error("{first} and {other} hold torque in different units: take them apart")]
    MixedUnits {
        /// The first recording.
        first: String,
        /// The one that differs.
        other: String,
    },
    /// A term that cannot be fitted.
    #[error("the model has a term {kind}, and only a base model can be fitted here")]
    HasTerms {
        /// Its kind.
        kind: String,
    },
    /// A simulation of some recordings only.
    #[error("some recordings have a column torque_sim_nm and others have none: give it for all or for none")]
    SomeSimulated,
    /// The model cannot be evaluated on a recording.
    #[error("{why}")]
    Unpredictable {
        /// Why.
        why: String,
        /// How to fix it.
        fix: Option<String>,
    },
    /// A recording and the model given cannot be of one gear.
    #[error(transparent)]
    Implausible(#[from] Implausible),
    /// The core refused the gear.
    #[error("the fitted parameters are not those of a gear: {}", refusal::of_parameters(.0))]
    Refused(#[from] ParamError),
    /// The caller asked for it.
    #[error("stopped before the fit was done; nothing was written")]
    Cancelled,
}

impl EstimateError {
    /// How to fix it, where there is more to say than the message does.
    pub fn fix(&self) -> Option<String> {
        let text = match self {
            Self::Implausible(error) => return Some(error.fix()),
            Self::Unpredictable { fix, .. } => return fix.clone(),
            Self::TooFewRows { .. } => "record for longer, or at a higher rate",
            Self::NoMovement { .. } => {
                "check that the column is the right one (--map deflection_rad=COLUMN), and record while the gear is loaded"
            }
            Self::NoTorqueChange { .. } => {
                "check that the sensor is connected and that the column is the right one (--map torque_nm=COLUMN)"
            }
            Self::JointLog { .. } => {
                "map the motor-side angle with --map theta_in_rad=COLUMN; gmhm fit without --method pso, and gmhm diagnose, take a joint log for gravity, inertia and friction"
            }
            Self::Still { .. } => {
                "leave it out, or check that its sensor was connected and that the column is the right one"
            }
            Self::OtherZero { .. } => {
                "check that they are of one gear, in the same units and of the same sign; or fit them apart"
            }
            Self::Absurd { what, unit, .. } => {
                let column = match (*what, *unit) {
                    ("deflection", _) => "deflection_rad",
                    (_, "A") => "current_a",
                    _ => "torque_nm",
                };
                return Some(format!("check its unit: --map scales a column, as in {column}=COLUMN*1e-3"));
            }
            Self::HasTerms { .. } => {
                "remove its [[term]] from the file given by --model; gmhm fit without --method pso refits terms"
            }
            _ => return None,
        };
        Some(text.to_owned())
    }
}

impl From<PredictError> for EstimateError {
    fn from(error: PredictError) -> Self {
        Self::Unpredictable { why: error.to_string(), fix: error.fix() }
    }
}
