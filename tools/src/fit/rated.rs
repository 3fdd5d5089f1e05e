//! Whether the rated deflection given is the one that the recordings are of.

use crate::fit::coverage::Coverage;
use crate::fit::heldout_rms_of;
use crate::fit::options::FitOptions;
use crate::fit::thresholds::THRESHOLDS;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::regression::error::EstimateError;

/// The largest deflection seen in the place of the rated one given.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct BetterRated {
    /// It, rad.
    pub rated_deflection_rad: f64,
    /// Root mean square of the error on blocks held out with it, N·m or A.
    pub heldout_rms: f64,
    /// The same with the one given.
    pub given_heldout_rms: f64,
}

impl BetterRated {
    /// The largest one seen, where it predicts rows held out better. `options` are those of the fit, whose rated deflection was given and leaves so much of the same recordings.
    ///
    /// # Errors
    /// `progress` cancels.
    pub fn of(
        recordings: &[Recording],
        options: &FitOptions,
        coverage: &Coverage,
        given_heldout_rms: f64,
        progress: &dyn Progress,
    ) -> Result<Option<Self>, EstimateError> {
        let (lowest, highest) = coverage.deflection_rad;
        let seen = highest.max(-lowest);
        if (seen / coverage.rated_deflection_rad - 1.0).abs() <= THRESHOLDS.rated_off_share {
            return Ok(None);
        }
        let options = FitOptions { rated_deflection_rad: Some(seen), ..options.clone() };
        let heldout_rms = heldout_rms_of(recordings, &options, progress)?;
        let better = Self { rated_deflection_rad: seen, heldout_rms, given_heldout_rms };
        Ok((heldout_rms < THRESHOLDS.rated_better_share * given_heldout_rms).then_some(better))
    }
}
