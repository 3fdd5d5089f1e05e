//! A recording before it is identified from.

use super::Notes;
use crate::model::Model;
use crate::number::trimmed;
use crate::recording::{self, Pace, Recording, RecordingError};

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
    notes_of_gap(recording, notes);
    recording.bridge_dropouts().iter().for_each(|bridged| notes(&bridged.to_string()));
    Ok(())
}

/// A step of so many median ones, and of such a share of the recording, is a gap that is worth a word.
const GAP: (f64, f64) = (20.0, 0.01);

fn notes_of_gap(recording: &Recording, notes: Notes<'_>) {
    let Some(pace) = Pace::of(&recording.time_s) else { return };
    let (step, at) = pace.longest;
    if step * pace.rate_hz > GAP.0 && step > GAP.1 * (pace.last_s - pace.first_s) {
        let [from, to] = [at, at + step].map(|time| trimmed(time, 6));
        notes(&format!(
            "{}: no rows between {from} and {to} s; what the gear did there is unknown: give the parts as two recordings, or crop by --from and --to",
            recording.name
        ));
    }
}
