//! `gmhm predict` and `gmhm invert` on a recording that is read.

use super::Notes;
use crate::failure::Failure;
use crate::model::{Model, refusal};
use crate::number::trimmed;
use crate::numerics::extremes;
use crate::physics::invert::{self, Inversion};
use crate::physics::{Prediction, Signals};
use crate::progress::Progress;
use crate::recording::{self, Recording};
use crate::signal::{plausible, recorded};

/// Predicts the torque of every row, after the ratio of the model is compared with that of the angles.
///
/// # Errors
/// Angles of another ratio, a recording or a model that cannot be evaluated.
pub fn predict(
    model: &Model,
    rated_deflection_rad: Option<f64>,
    recording: &Recording,
    notes: Notes<'_>,
    progress: &dyn Progress,
) -> Result<Prediction, Failure> {
    recording::turns::check(recording)?;
    if recording.theta_in_rad.is_some() && model.has_gear() {
        recording::ratio::check(recording, model.gear.ratio)?;
    }
    let prediction = recorded::predict_under(model, rated_deflection_rad, recording, progress)?;
    let theta = Signals::new(recording, model).deflection_rad;
    let mut far = None;
    let largest = || theta.as_deref().map(extremes::largest);
    if let Some(rated_rad) = rated_deflection_rad.or(model.gear.rated_deflection_rad).or_else(largest) {
        if let Some(Err(refusal)) = model.drive_params(rated_rad) {
            notes(&format!("no gear has the parameters of this model: {}", refusal::of_parameters(&refusal)));
        }
        let within = theta
            .as_deref()
            .map(|theta| plausible::within(&recording.name, theta, rated_rad, model.gear.deflection_zero_rad));
        far = within.and_then(Result::err);
    }
    if let Some(far) = far {
        notes(&format!("{far}: {}", far.fix()));
    } else if prediction.rows_out_of_range > 0 {
        notes(&format!(
            "{} of {} rows lie outside the rated deflection, where the model is not calibrated",
            prediction.rows_out_of_range,
            prediction.torque.len()
        ));
    }
    merged(prediction.merged_pairs, notes);
    Ok(prediction)
}

/// Finds the deflection of every torque.
///
/// # Errors
/// A model that cannot be inverted, or torques in another unit.
pub fn invert(
    model: &Model,
    rated_deflection_rad: Option<f64>,
    recording: &Recording,
    notes: Notes<'_>,
    progress: &dyn Progress,
) -> Result<Inversion, Failure> {
    let found = invert::invert(model, rated_deflection_rad, recording, progress)?;
    let beyond = found.saturated.iter().filter(|&&saturated| saturated).count();
    if beyond > 0 {
        notes(&format!(
            "{beyond} of {} torques lie beyond the range of the model, ±{} rad: the deflection is held at its edge there{}",
            found.saturated.len(),
            trimmed(found.range_rad, 5),
            if 2 * beyond > found.saturated.len() {
                "; check the unit of the torque (--map scales columns)"
            } else {
                ""
            }
        ));
    }
    merged(found.merged_pairs, notes);
    Ok(found)
}

fn merged(pairs: u32, notes: Notes<'_>) {
    if pairs > 0 {
        notes(&format!(
            "{pairs} pairs of turning points were merged: the path has more open loops than are remembered"
        ));
    }
}
