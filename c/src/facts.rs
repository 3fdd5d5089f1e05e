//! What a block says beside its numbers: identity, joint and unit.

use gmhm::block::{Block, BlockError, Identity, JointRecord, TorqueUnit};
use gmhm::{Gear, State};

use crate::types::StatusC;

/// Of the block in force.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Facts {
    sequence: u32,
    crc: u32,
    period_s: f32,
    gear: Identity,
    joint: JointRecord,
    unit: TorqueUnit,
}

impl Facts {
    pub(crate) fn of_block(block: &Block<'_>) -> Result<Self, BlockError> {
        let header = block.header();
        let joint = JointRecord::of_block(block)?;
        let (sequence, crc, period_s) = (header.sequence, block.crc(), header.period_s);
        Ok(Self { sequence, crc, period_s, gear: header.identity, joint, unit: header.torque_unit })
    }

    /// CRC-32 of the block.
    pub(crate) fn crc(&self) -> u32 {
        self.crc
    }

    /// Ratio, zero and side.
    pub(crate) fn joint(&self) -> &JointRecord {
        &self.joint
    }

    /// The control period that the block was made for.
    pub(crate) fn period_s(&self) -> f32 {
        self.period_s
    }

    /// The status of a gear, but for the edge of its inverse, what its terms need and the flags of the last step.
    pub(crate) fn status<const N: usize>(&self, gear: &Gear<f32>, state: &State<f32, N>) -> StatusC {
        StatusC {
            sequence: self.sequence,
            crc32: self.crc,
            period_s: self.period_s,
            rated_deflection_rad: gear.frame().rated(),
            start_uncertainty_nm: gear.start_uncertainty(state),
            merged_pairs: gear.merged_pairs(state),
            gear: label(&self.gear),
            ratio: self.joint.ratio(),
            deflection_zero_rad: self.joint.deflection_zero_rad(),
            torque_on_motor_side: u32::from(self.joint.motor_side()),
            torque_in_amperes: u32::from(self.unit == TorqueUnit::Ampere),
            ..StatusC::default()
        }
    }
}

/// An identity, ended by a zero.
pub(crate) fn label(identity: &Identity) -> [u8; 20] {
    let mut label = [0; 20];
    label.iter_mut().zip(identity.bytes()).for_each(|(to, byte)| *to = *byte);
    label
}
