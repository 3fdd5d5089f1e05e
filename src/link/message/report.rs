//! What an answer says of a drive.

use super::super::frame::LineCounts;
use super::PROOF_BYTES;
use crate::block::{Identity, ScalarKind};
use crate::diagnostics::Diagnostics;

/// Where the parameters in force come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Origin {
    /// There are none.
    #[default]
    Nowhere,
    /// From flash.
    Stored,
    /// They are on trial.
    Trial,
}

impl Origin {
    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nowhere => "nowhere",
            Self::Stored => "stored",
            Self::Trial => "trial",
        }
    }
}

/// Who a drive is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Identified {
    /// The session that is open from here on.
    pub session: u32,
    /// The gear that it accepts blocks for; none where it accepts any.
    pub gear: Identity,
    /// The most bytes of a block.
    pub room: u32,
    /// The newest format of blocks that it reads.
    pub format_version: u16,
    /// The arithmetic that it computes in.
    pub scalar: ScalarKind,
    /// Turning points that it has room for.
    pub stack_depth: u16,
    /// What proofs of this session are made with; `None` where the drive is open to anyone.
    pub challenge: Option<[u8; PROOF_BYTES]>,
}

/// What is in force.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Status {
    /// Where it comes from.
    pub origin: Origin,
    /// Sequence number of its block; 0 where nothing is in force.
    pub sequence: u32,
    /// CRC-32 of its block.
    pub crc: u32,
    /// Bytes of its block.
    pub length: u32,
    /// Sequence number of the newest stored block; 0 where there is none.
    pub stored_sequence: u32,
    /// Why the newest stored block could not be loaded at boot, [`BlockError::code`](crate::block::BlockError::code); 0 where it could.
    pub boot_error: u16,
    /// Whether the drive is enabled.
    pub enabled: bool,
    /// Whether the compensation is on.
    pub compensating: bool,
    /// The gain ratio.
    pub gain_ratio: f32,
}

/// What a drive measures and computes, SI units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Live {
    /// θ, rad.
    pub deflection_rad: f32,
    /// T, N·m.
    pub torque_nm: f32,
    /// z, N·m.
    pub hysteresis_nm: f32,
    /// T and z as the drive's arithmetic holds them: the bits of an `f32`, or the word of a fixed-point number.
    pub words: [u32; 2],
    /// What the compensation adds to the command, N·m.
    pub contribution_nm: f32,
    /// Whether the deflection lies outside ±A.
    pub out_of_range: bool,
    /// Whether the last sample was refused.
    pub refused: bool,
    /// Control periods so far; wraps.
    pub ticks: u32,
    /// What the last one took, in counts of the drive's own clock.
    pub loop_cost: u32,
}

/// What has gone wrong since power-up or since it was cleared.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LinkDiagnostics {
    /// On the control path.
    pub joint: Diagnostics,
    /// On the line.
    pub line: LineCounts,
    /// Requests that were refused.
    pub refused_requests: u32,
    /// Trials that ended because their host was gone.
    pub expired_trials: u32,
    /// The bound of live changes, [`Request::Bound`](super::Request::Bound).
    pub bound: f32,
}
