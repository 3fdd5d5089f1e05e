//! Recordings replayed through the adaptation of the drive, [`gmhm::adapt`]: the very code, in `f32`, sample by sample; and what a drive has learnt by itself.

mod error;
mod learnt;
mod replay;

pub use error::AdaptReplayError;
pub use learnt::{Coefficient, Learnt};
pub use replay::{Replay, Rms, TracePoint, replay};

use gmhm::adapt::Coefficients;

use crate::model::Model;

/// Names of the coefficients, in the order of the core.
pub const NAMES: [&str; 5] = ["c1", "c2", "c3", "e", "h"];

/// What a normalised coefficient is multiplied by to give its SI unit.
fn units(rated_deflection_rad: f64, torque_scale: f64) -> Coefficients<f64> {
    let unit = torque_scale / rated_deflection_rad;
    let square = rated_deflection_rad * rated_deflection_rad;
    [unit, unit / square, unit / (square * square), unit, unit]
}

/// The coefficients of a model file, SI units.
fn coefficients(elastic: &gmhm::Elastic, memory: &gmhm::Memory) -> Coefficients<f64> {
    [elastic.c1_nm_per_rad, elastic.c2_nm_per_rad3, elastic.c3_nm_per_rad5, memory.e(), memory.h()]
}

/// The model with other parameters of its gear.
fn with_params(model: &Model, params: &gmhm::Params) -> Model {
    Model { elastic: Some(params.elastic()), memory: Some(params.memory()), ..model.clone() }
}
