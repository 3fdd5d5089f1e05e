//! Discovery: where recording and simulation differ, what physics was left out, and the fit with it.
//!
//! | file | what |
//! |---|---|
//! | [`subject`], [`parameters`], [`fit`] | recordings, the free numbers of a model, its fit against coloured noise |
//! | [`projection`] | the way down: what is linear eliminated, the rest moved |
//! | [`library`], `prototypes` | what could have been left out, as columns over a grid of shapes |
//! | `ranges`, [`spectrum`] | what the recordings span; orders of a turn |
//! | `kinds` | what makes a term of its kind, beyond its equation |
//! | [`explain`] | every kind beside a fitted model, refitted together |
//! | [`mod@search`] | forward, with swaps, and backward |
//! | `shapes` | the shapes of what was found, by the swarm |
//! | [`flexible`] | curves without physics over every coordinate |
//! | `tones` | what comes at a frequency of its own |
//! | `heldout` | blocks predicted by a fit to the others |
//! | [`judge`] | classes that cannot be told apart, names only where they explain all there is |
//! | [`experiment`] | what could not have been seen, and the experiment that would show it |
//! | [`scene`] | what a report shows |
//! | [`mod@diagnose`] | the whole, as `gmhm diagnose` writes it |

mod detector;
pub mod diagnose;
pub mod experiment;
pub mod explain;
pub mod fit;
pub mod flexible;
mod heldout;
pub mod judge;
mod jumps;
mod kinds;
pub mod library;
pub mod parameters;
pub mod projection;
mod prototypes;
mod ranges;
pub mod scene;
pub mod search;
mod shapes;
mod shares;
pub mod spectrum;
pub mod subject;
mod tones;

pub use detector::Diagnostician;
pub use diagnose::{Finding, Options, diagnose};

use crate::estimate::EstimateError;
use crate::estimate::plausible::Implausible;
use crate::physics::PredictError;

/// Why nothing was diagnosed.
#[derive(Debug, thiserror::Error)]
pub enum DiscoverError {
    /// No recording.
    #[error("no recording was given")]
    NoRecording,
    /// No torque to explain.
    #[error(
        "{0}: column torque_nm (or current_a) is missing; name it, or map another column to it with --map torque_nm=…"
    )]
    NoTorque(String),
    /// Too little to tell anything.
    #[error("{recording}: {rows} rows are too few for a diagnosis, at least 64 are needed")]
    TooFewRows {
        /// The recording.
        recording: String,
        /// Its rows.
        rows: usize,
    },
    /// Newton-metres and amperes.
    #[error("{first} and {other} hold torque in different units: diagnose them apart")]
    MixedUnits {
        /// The first recording.
        first: String,
        /// The one that differs.
        other: String,
    },
    /// A simulation of some recordings only.
    #[error("some recordings have a column torque_sim_nm and others have none: give it for all or for none")]
    SomeSimulated,
    /// The model cannot be evaluated.
    #[error(transparent)]
    Predict(#[from] PredictError),
    /// Recordings and model cannot be of one gear.
    #[error(transparent)]
    Implausible(#[from] Implausible),
    /// The recordings cannot be prepared.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    /// The caller asked for it.
    #[error("stopped before the diagnosis was done; nothing was written")]
    Cancelled,
}
