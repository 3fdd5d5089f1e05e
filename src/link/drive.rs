//! What the link asks of a drive.

use super::adaptation::Adapted;
use super::message::Live;
use crate::block::{Block, BlockError, Identity, ScalarKind};
use crate::diagnostics::Diagnostics;

/// The compensation as a host has set it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CompensationSetting {
    /// Whether it is on.
    pub on: bool,
    /// The share of the contribution, 0 to 1.
    pub gain_ratio: f32,
}

impl Default for CompensationSetting {
    /// Off, and whole once it is on.
    fn default() -> Self {
        Self { on: false, gain_ratio: 1.0 }
    }
}

impl CompensationSetting {
    /// What it makes of a contribution: the share while it is on, else 0.
    #[must_use]
    pub fn of(&self, contribution: f32) -> f32 {
        if self.on { self.gain_ratio * contribution } else { 0.0 }
    }
}

/// A drive at the end of a link.
pub trait Drive {
    /// The gear that it is mounted on; [`Identity::NONE`] where it does not know, and then the gear of the newest stored block counts.
    fn gear(&self) -> Identity {
        Identity::NONE
    }

    /// The arithmetic it computes in, and how many turning points it has room for.
    fn arithmetic(&self) -> (ScalarKind, u16);

    /// Whether its power stage is on.
    fn is_enabled(&self) -> bool;

    /// Puts a block in force, or none.
    ///
    /// # Errors
    /// [`BlockError`]: what was in force before stays so.
    fn adopt(&mut self, block: Option<&Block<'_>>) -> Result<(), BlockError>;

    /// The compensation.
    fn compensation(&self) -> CompensationSetting;

    /// Sets the compensation; the gain ratio lies between 0 and 1.
    fn set_compensation(&mut self, compensation: CompensationSetting);

    /// What it measures and computes.
    fn live(&self) -> Live;

    /// What its adaptation has learnt; `None` where it has none.
    fn adaptation(&self) -> Option<Adapted> {
        None
    }

    /// What has gone wrong on its control path.
    fn diagnostics(&self) -> Diagnostics {
        Diagnostics::default()
    }

    /// Counts that from nothing again.
    fn clear_diagnostics(&mut self) {}
}
