//! A recording before it is identified from.

use super::Notes;
use crate::model::Model;
use crate::number::trimmed;
use crate::recording::{self, Recording, RecordingError, Timing};

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
    recording::turns::check(recording)?;
    let known = ratio.or(model.and_then(|model| model.gear.ratio));
    // Of a joint log the two angles are one, and their ratio is seen.
    if known.is_some() || model.is_none_or(Model::has_gear) {
        recording::ratio::check(recording, known)?;
    }
    if ratio.is_some() {
        recording.derive_deflection(ratio)?;
    }
    notes_of_pace(recording, notes);
    notes_of_spikes(recording, notes);
    recording.bridge_dropouts().iter().for_each(|bridged| notes(&bridged.to_string()));
    Ok(())
}

/// The ratio of a joint's model; where it states none, the one that the two angles of a recording show, and a note of it.
pub fn ratio_of_joint(model: &Model, recordings: &[Recording], notes: Notes<'_>) -> Option<f64> {
    if model.has_gear() || model.gear.ratio.is_some() {
        return model.gear.ratio;
    }
    let shown = recordings.iter().find_map(recording::ratio::shown_rounded);
    if let Some(ratio) = shown {
        notes(&format!("ratio {ratio}: the slope of theta_in_rad over theta_out_rad"));
    }
    shown
}

/// Values so many times farther from the middle than 98 % of all, and of at most such a share of the rows, are perhaps no measurement.
const SPIKE: (f64, f64) = (20.0, 0.01);

/// Values of a channel that its range is judged by.
const JUDGED_BY: usize = 10_000;

fn notes_of_spikes(recording: &Recording, notes: Notes<'_>) {
    let unit = recording.torque_unit;
    let channels =
        [(unit.quantity(), unit.symbol(), &recording.torque), ("deflection", "rad", &recording.deflection_rad)];
    for (what, unit, values) in channels {
        let Some(values) = values.as_deref().filter(|values| !values.is_empty()) else { continue };
        let mut some: Vec<f64> = values.iter().step_by(values.len().div_ceil(JUDGED_BY)).copied().collect();
        some.sort_by(f64::total_cmp);
        let outer = some.len() / 100;
        let (low, high) = (some[outer], some[some.len() - 1 - outer]);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let mut spikes = (0..values.len()).filter(|&row| (values[row] - middle).abs() > SPIKE.0 * half);
        let Some(first) = spikes.next() else { continue };
        let count = 1 + spikes.count();
        if half > 0.0 && count as f64 <= SPIKE.1 * values.len() as f64 {
            let rows = if count == 1 { "row holds" } else { "rows hold" };
            notes(&format!(
                "{}: {count} {rows} a {what} far beyond all others, the first {} {unit} at {} s: remove what is no measurement",
                recording.name,
                trimmed(values[first], 5),
                trimmed(recording.time_s[first], 6)
            ));
        }
    }
}

/// A step of so many median ones, and of such a share of the recording, is a gap that is worth a word.
const GAP: (f64, f64) = (20.0, 0.01);

/// Rows that follow each other more slowly are perhaps timed in another unit.
const SLOWEST_HZ: f64 = 0.05;

fn notes_of_pace(recording: &Recording, notes: Notes<'_>) {
    let Some(timing) = Timing::of(&recording.time_s) else { return };
    if timing.rate_hz < SLOWEST_HZ {
        notes(&format!(
            "{}: its rows are {} s apart; if the time is in milliseconds, add --map time_ms=COLUMN",
            recording.name,
            trimmed(1.0 / timing.rate_hz, 5)
        ));
    }
    let (step, at) = timing.longest;
    if step * timing.rate_hz > GAP.0 && step > GAP.1 * (timing.last_s - timing.first_s) {
        let [from, to] = [at, at + step].map(|time| trimmed(time, 6));
        notes(&format!(
            "{}: no rows between {from} and {to} s; what the gear did there is unknown: give the parts as two recordings, or crop by --from and --to",
            recording.name
        ));
    }
}
