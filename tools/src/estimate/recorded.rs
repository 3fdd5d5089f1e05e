//! The torque that a model predicts for a motion as it was recorded.

use gmhm::terms::Need;

use super::denoise::smoothed_acceleration;
use crate::model::{Model, Term};
use crate::physics::predict::{Prediction, predict_along};
use crate::physics::{PredictError, Signals};
use crate::recording::Recording;

/// As [`predict`](fn@crate::physics::predict), but for the acceleration, where the model has a term that needs it: the derivative of a recorded velocity is mostly noise, so it is that
/// of the motion freed of its noise, as `gmhm diagnose` sees it. Deflection, angles and velocity stay as recorded, and so does the
/// acceleration of a motion without noise.
///
/// # Errors
/// As there.
pub fn predict(model: &Model, asked_rad: Option<f64>, recording: &Recording) -> Result<Prediction, PredictError> {
    let accelerates = |term: &Term| term.info().is_some_and(|info| info.needs.contains(&Need::Acceleration));
    let mut signals = Signals::new(recording, &model.gear);
    if model.terms.iter().any(accelerates)
        && let Some(acceleration) = smoothed_acceleration(recording, &model.gear)
    {
        signals.acceleration_rad_per_s2 = Some(acceleration);
    }
    predict_along(model, asked_rad, recording, signals)
}
