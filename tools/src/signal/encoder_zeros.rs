//! Zeros of encoders: an incremental encoder counts from where it was switched on, an absolute one from where it was mounted.

use crate::recording::{Recording, RecordingError};

/// How far zeros are from the first, rad; `None` where all are one.
pub fn apart(zeros_rad: &[f64]) -> Option<Vec<f64>> {
    let first = zeros_rad.first()?;
    zeros_rad.iter().any(|zero| zero != first).then(|| zeros_rad.iter().map(|zero| zero - first).collect())
}

/// Takes a zero off the deflection of a recording.
///
/// # Errors
/// Angles without a ratio.
pub fn take_off(recording: &mut Recording, zero_rad: f64, ratio: Option<f64>) -> Result<(), RecordingError> {
    if zero_rad != 0.0 {
        recording.derive_deflection(ratio)?;
        recording.deflection_rad.iter_mut().flatten().for_each(|theta| *theta -= zero_rad);
    }
    Ok(())
}
