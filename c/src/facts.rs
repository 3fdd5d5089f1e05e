//! What a block says beside its numbers: identity, joint and unit.

use gmhm::block::{Block, Identity, JointRecord, TorqueUnit};
use gmhm::{Gear, State};

use crate::types::StatusC;

/// Of the block in force.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Facts {
    sequence: u32,
    crc: u32,
    gear: Identity,
}

impl Facts {
    pub(crate) fn of_block(block: &Block<'_>) -> Self {
        let header = block.header();
        Self { sequence: header.sequence, crc: block.crc(), gear: header.identity }
    }

    /// CRC-32 of the block.
    pub(crate) fn crc(&self) -> u32 {
        self.crc
    }

    /// The status of a gear, but for period, joint and unit, the edge of its inverse, what its terms need and the flags of the last step.
    #[inline(always)]
    pub(crate) fn status<const N: usize>(&self, gear: &Gear<f32>, state: &State<f32, N>) -> StatusC {
        StatusC {
            sequence: self.sequence,
            crc32: self.crc,
            rated_deflection_rad: gear.frame().rated(),
            start_uncertainty_nm: gear.start_uncertainty(state),
            merged_pairs: gear.merged_pairs(state),
            gear: label(&self.gear),
            ..StatusC::default()
        }
    }
}

impl StatusC {
    /// The same with a joint and the unit of its torques.
    #[inline(always)]
    pub(crate) fn in_joint(self, joint: &JointRecord, unit: TorqueUnit) -> Self {
        Self {
            ratio: joint.ratio(),
            deflection_zero_rad: joint.deflection_zero_rad(),
            torque_on_motor_side: u32::from(joint.motor_side()),
            torque_in_amperes: u32::from(unit == TorqueUnit::Ampere),
            ..self
        }
    }
}

/// An identity, ended by a zero.
pub(crate) fn label(identity: &Identity) -> [u8; 20] {
    let mut label = [0; 20];
    if let Some(name) = label.first_chunk_mut() {
        *name = *identity.bytes();
    }
    label
}
