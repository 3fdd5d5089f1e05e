//! What a command needs of a recording.

use super::quantity::Quantity;

/// What a command needs of a group of columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// It must be there.
    Required,
    /// It is read and checked where it is there.
    IfPresent,
    /// It is not even looked at.
    Ignored,
}

/// What a command needs of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Needs {
    /// `time_s`. Where it is not read, `time_s` counts the rows.
    pub time: Need,
    /// `torque_nm`, or `current_a` in its stead.
    pub torque: Need,
    /// The deflection, both angles, or the output-side angle alone; velocity and temperature where present.
    pub motion: Need,
    /// `torque_sim_nm`.
    pub simulation: Need,
}

impl Needs {
    /// To identify a model.
    pub const FIT: Needs =
        Needs { time: Need::Required, torque: Need::Required, motion: Need::Required, simulation: Need::IfPresent };
    /// To predict the torque from the motion.
    pub const PREDICT: Needs =
        Needs { time: Need::Required, torque: Need::Ignored, motion: Need::Required, simulation: Need::Ignored };
    /// To find the deflection that a torque needs; law `time` requires the time too.
    pub const INVERT: Needs =
        Needs { time: Need::Ignored, torque: Need::Required, motion: Need::Ignored, simulation: Need::Ignored };

    pub(super) fn of(&self, quantity: Quantity) -> Need {
        match quantity {
            Quantity::Time => self.time,
            Quantity::Torque | Quantity::Current => self.torque,
            Quantity::TorqueSim => self.simulation,
            _ => self.motion,
        }
    }
}
