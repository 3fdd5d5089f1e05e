//! A motion as it was recorded, with noise, as a model sees it: to predict its torque, to fit it, to judge a fit.

use gmhm::terms::Need;

use crate::model::{GearSection, Model, Term};
use crate::physics::predict::{Prediction, predict_along};
use crate::physics::{Evaluation, PredictError, Signals};
use crate::progress::Progress;
use crate::recording::Recording;
use crate::signal::acceleration::acceleration;

/// The signals of a recording, the acceleration excepted: the second derivative of a recorded angle, or the first of a recorded velocity, is mostly noise, and an inertia fitted to
/// it comes out too small. It is that of the motion freed of its noise, as `gmhm diagnose` sees it. Deflection, angles and velocity stay as recorded, and so does
/// the acceleration of a motion without noise.
pub fn signals<'a>(recording: &'a Recording, gear: &GearSection) -> Signals<'a> {
    let mut signals = Signals::new(recording, gear);
    signals.acceleration_rad_per_s2 = acceleration(recording, gear);
    signals
}

/// Smoothed where a term of the model needs the acceleration.
fn seen<'a>(model: &Model, recording: &'a Recording) -> Signals<'a> {
    let accelerates = |term: &Term| term.info().is_some_and(|info| info.needs.contains(&Need::Acceleration));
    if model.terms.iter().any(accelerates) {
        signals(recording, &model.gear)
    } else {
        Signals::new(recording, &model.gear)
    }
}

/// As [`predict`](fn@crate::physics::predict), along [`signals`].
///
/// # Errors
/// As there.
pub fn predict(model: &Model, asked_rad: Option<f64>, recording: &Recording) -> Result<Prediction, PredictError> {
    predict_under(model, asked_rad, recording, &())
}

/// [`predict`] with its progress.
///
/// # Errors
/// As there.
pub fn predict_under(
    model: &Model,
    asked_rad: Option<f64>,
    recording: &Recording,
    progress: &dyn Progress,
) -> Result<Prediction, PredictError> {
    predict_along(model, asked_rad, recording, seen(model, recording), progress)
}

/// As [`Evaluation::new`], along [`signals`].
///
/// # Errors
/// As there.
pub fn evaluate<'a>(model: &Model, recording: &'a Recording) -> Result<Evaluation<'a>, PredictError> {
    Evaluation::along(model, None, recording, seen(model, recording), None)
}
