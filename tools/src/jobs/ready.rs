//! A recording before it is identified from.

use super::Notes;
use crate::model::Model;
use crate::recording::{self, Recording, RecordingError};

/// Compares the ratio given, else the model's, with that of the angles; derives the deflection where a ratio is given; interpolates and reports dropouts of the angles.
///
/// # Errors
/// Angles without a ratio, or that show another one.
pub fn ready(
    recording: &mut Recording,
    ratio: Option<f64>,
    model: Option<&Model>,
    notes: Notes<'_>,
) -> Result<(), RecordingError> {
    let known = ratio.or(model.and_then(|model| model.gear.ratio));
    // Of a joint log the two angles are one, and their ratio is seen.
    if known.is_some() || model.is_none_or(|model| model.elastic.is_some()) {
        recording::ratio::check(recording, known)?;
    }
    if ratio.is_some() {
        recording.derive_deflection(ratio)?;
    }
    recording.bridge_dropouts().iter().for_each(|bridged| notes(&bridged.to_string()));
    Ok(())
}
