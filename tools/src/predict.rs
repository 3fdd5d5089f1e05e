//! The torque that a model predicts for a recording's motion, by the core's own code in `f64`.

use gmhm::{Gear, ParamError, Params};

use crate::model::Model;
use crate::recording::{Recording, RecordingError};

/// Turning points that host commands remember.
pub const CAPACITY: usize = 256;

/// Why nothing could be predicted.
#[derive(Debug, thiserror::Error)]
pub enum PredictError {
    /// The recording lacks what the model needs.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The parameters are refused at the rated deflection in use.
    #[error("the model at the rated deflection {rated_deflection_rad:?} rad: {error}")]
    Params {
        /// The rated deflection in use, rad.
        rated_deflection_rad: f64,
        /// Why the core refuses them.
        error: ParamError,
    },
    /// The model holds neither gear nor terms.
    #[error("the model has neither [elastic] and [memory] nor any [[term]]: it predicts nothing")]
    EmptyModel,
    /// A term that cannot be evaluated.
    #[error("the model holds the term `{0}`, which this program cannot evaluate")]
    UnknownTerm(String),
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
}

impl PredictError {
    /// How to mend it, where there is more to say than the message does.
    pub fn mend(&self) -> Option<String> {
        let text = match self {
            PredictError::Recording(error) => return error.mend(),
            PredictError::Params { .. } => "correct the model, or give --rated-deflection",
            PredictError::EmptyModel => "identify one by `gmhm fit`",
            PredictError::UnknownTerm(_) => "remove the term",
            PredictError::Absurd { .. } => {
                "check the column's unit and the model's deflection_zero_rad; --map scales and shifts columns"
            }
        };
        Some(text.to_owned())
    }
}

/// Torques of every row of a recording, in the model's unit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Prediction {
    /// Elastic + hysteresis + terms.
    pub torque: Vec<f64>,
    /// f(θ).
    pub elastic: Vec<f64>,
    /// z.
    pub hysteresis: Vec<f64>,
    /// Rows outside the rated deflection, where the model is not calibrated.
    pub rows_out_of_range: usize,
    /// Pairs of turning points given up because more than [`CAPACITY`] were open.
    pub merged_pairs: u32,
}

/// The rated deflection in use: the one asked for, else the model's, else the largest seen in the recordings.
pub fn rated_deflection_rad(asked: Option<f64>, model: Option<&Model>, recordings: &[&Recording]) -> Option<f64> {
    let zero = model.map_or(0.0, |m| m.gear.deflection_zero_rad);
    let seen = || recordings.iter().filter_map(|r| r.largest_deflection_rad(zero)).reduce(f64::max);
    asked.or(model.and_then(|m| m.gear.rated_deflection_rad)).or_else(seen)
}

/// Predicts the torque of every row. The first row is the start: y = 0, m = 0 there (MODEL.md sections 3 and 4). `deflection_zero_rad` is
/// subtracted first; the deflection is computed from the angles where none is recorded.
///
/// # Errors
/// [`PredictError`].
pub fn predict(model: &Model, asked_rad: Option<f64>, recording: &mut Recording) -> Result<Prediction, PredictError> {
    if let Some(term) = model.terms.first() {
        return Err(PredictError::UnknownTerm(term.kind.clone()));
    }
    recording.derive_deflection(model.gear.ratio)?;
    let rated = rated_deflection_rad(asked_rad, Some(model), &[recording]).unwrap_or(f64::NAN);
    let params = model.params(rated).ok_or(PredictError::EmptyModel)?;
    let params = params.map_err(|error| PredictError::Params { rated_deflection_rad: rated, error })?;
    follow(&params, model.gear.deflection_zero_rad, recording)
}

fn follow(params: &Params, zero_rad: f64, recording: &Recording) -> Result<Prediction, PredictError> {
    let gear = Gear::<f64>::new(params);
    let deflection = recording.deflection()?;
    let rows = deflection.len();
    let mut prediction = Prediction {
        torque: Vec::with_capacity(rows),
        elastic: Vec::with_capacity(rows),
        hysteresis: Vec::with_capacity(rows),
        ..Prediction::default()
    };
    let mut state = gear.start::<CAPACITY>(deflection.first().map_or(0.0, |theta| theta - zero_rad));
    for (row, theta) in deflection.iter().enumerate() {
        let out = match row.checked_sub(1) {
            None => gear.output(&state),
            Some(before) => {
                gear.step_after(&mut state, theta - zero_rad, recording.time_s[row] - recording.time_s[before])
            }
        };
        if state.status().refused {
            return Err(PredictError::Absurd {
                file: recording.name.clone(),
                row: row + 1,
                deflection_rad: *theta,
                rated_deflection_rad: params.rated_deflection_rad(),
            });
        }
        prediction.rows_out_of_range += usize::from(state.status().out_of_range);
        prediction.torque.push(out.elastic + out.hysteresis);
        prediction.elastic.push(out.elastic);
        prediction.hysteresis.push(out.hysteresis);
    }
    prediction.merged_pairs = gear.merged_pairs(&state);
    Ok(prediction)
}
