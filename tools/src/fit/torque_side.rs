//! Whether the torque of a joint was taken on the side of the gear that the model says.

use crate::fit::options::FitOptions;
use crate::fit::thresholds::THRESHOLDS;
use crate::fit::{Fit, heldout_rms_of};
use crate::kinds::JOINT_BASE;
use crate::model::TorqueSide;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::regression::error::EstimateError;

/// The other side of the gear in the place of the one that was fitted with.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct BetterSide {
    /// It.
    pub torque_side: TorqueSide,
    /// Root mean square of the error on blocks held out with it, N·m or A.
    pub heldout_rms: f64,
    /// The same with the side fitted with.
    pub given_heldout_rms: f64,
}

impl BetterSide {
    /// The other side, where friction or inertia of a joint is held at zero and the other side predicts rows held out better: on the wrong side both have the wrong sign. `options` are those of the
    /// fit, its model the one to start from.
    ///
    /// # Errors
    /// `progress` cancels.
    pub fn of(
        found: &Fit,
        recordings: &[Recording],
        options: &FitOptions,
        progress: &dyn Progress,
    ) -> Result<Option<Self>, EstimateError> {
        let is_of_base = |name: &str| name.split_once('.').is_some_and(|(kind, _)| JOINT_BASE.contains(&kind));
        let is_held = found.uncertainty.parameters.iter().any(|p| p.at_bound && is_of_base(&p.name));
        if found.model.has_gear() || !is_held {
            return Ok(None);
        }
        let torque_side = found.model.gear.torque_side.other();
        let options = FitOptions { torque_side: Some(torque_side), ..options.clone() };
        let heldout_rms = heldout_rms_of(recordings, &options, progress)?;
        let better = Self { torque_side, heldout_rms, given_heldout_rms: found.heldout_rms };
        Ok((heldout_rms < THRESHOLDS.side_better_share * found.heldout_rms).then_some(better))
    }
}
