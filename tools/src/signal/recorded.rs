//! A motion as it was recorded, with noise, as a model sees it: to predict its torque, to fit it, to judge a fit.

use std::borrow::Cow;

use gmhm::terms::Need;

use crate::model::{Model, Term};
use crate::physics::predict::{Prediction, predict_along};
use crate::physics::{Evaluation, PredictError, Signals};
use crate::progress::Progress;
use crate::recording::Recording;
use crate::signal::acceleration::acceleration;
use crate::signal::denoise::uncounted;

/// The signals of a recording, its derivatives excepted. The second derivative of a recorded angle, or the first of a recorded velocity, is mostly noise, and an inertia fitted to
/// it comes out too small; the first derivative of a counted angle is 0 in most rows of a slow motion, and friction with it. They are those of the motion freed of its noise and of its
/// counts, as `gmhm diagnose` sees it. Deflection, angles and a recorded velocity stay as recorded, and so do the derivatives of a motion without noise.
pub fn signals<'a>(recording: &'a Recording, model: &Model) -> Signals<'a> {
    let mut signals = Signals::new(recording, model);
    let motion = uncounted(recording);
    if let Cow::Owned(motion) = &motion {
        let smooth = Signals::new(motion, model);
        let owned = |velocity: Option<Cow<'_, [f64]>>| velocity.map(|v| Cow::Owned(v.into_owned()));
        signals.velocity_rad_per_s = owned(smooth.velocity_rad_per_s);
        signals.output_velocity_rad_per_s = owned(smooth.output_velocity_rad_per_s);
        signals.motor_velocity_rad_per_s = smooth.motor_velocity_rad_per_s;
    }
    signals.acceleration_rad_per_s2 = acceleration(recording, &motion, model);
    signals
}

/// The signals of a recording freed of its noise, as `gmhm diagnose` sees them. The acceleration is that of [`signals`]: it knows the noise of the motion as it was recorded.
pub fn clean_signals<'a>(recording: &Recording, clean: &'a Recording, model: &Model) -> Signals<'a> {
    let acceleration_rad_per_s2 = acceleration(recording, &uncounted(recording), model);
    Signals { acceleration_rad_per_s2, ..Signals::new(clean, model) }
}

/// Smoothed where a term of the model needs a derivative of the motion.
fn seen<'a>(model: &Model, recording: &'a Recording) -> Signals<'a> {
    const DERIVATIVES: [Need; 4] = [Need::Velocity, Need::MotorVelocity, Need::OutputVelocity, Need::Acceleration];
    let derives = |term: &Term| term.info().is_some_and(|info| DERIVATIVES.iter().any(|d| info.needs.contains(d)));
    if model.terms.iter().any(derives) { signals(recording, model) } else { Signals::new(recording, model) }
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
