//! Why a drive refuses a request.

use core::fmt;

/// The reason. Its number goes over the line; [`abort_code`](Self::abort_code) is what a CANopen drive answers for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Refusal {
    /// No such command, or a version of the protocol that is not spoken.
    Command = 1,
    /// The command's payload has another length.
    Payload = 2,
    /// The request is not of the session that is open.
    Session = 3,
    /// It is not the session's next request: one was lost, repeated or late.
    Order = 4,
    /// The drive is enabled: an erase would stall its core.
    Enabled = 5,
    /// The compensation is on: other parameters would make a torque step.
    Compensating = 6,
    /// The signature word is wrong.
    Signature = 7,
    /// The block has not come whole, or there is none.
    Incomplete = 8,
    /// Data that do not continue the block, or a range outside it.
    Offset = 9,
    /// The block is too long for this drive.
    Room = 10,
    /// The block is not the one that was announced, tried or meant: its CRC-32 differs.
    Checksum = 11,
    /// The block is refused; the detail is [`BlockError::code`](crate::block::BlockError::code).
    Block = 12,
    /// The block is for another gear.
    Gear = 13,
    /// Its sequence number is not above that of the newest stored block, or not that of the block meant.
    Sequence = 14,
    /// The flash failed.
    Flash = 15,
    /// The flash does not read back what was written.
    ReadBack = 16,
    /// There is no stored block to go back to.
    NothingBefore = 17,
    /// A value out of its range.
    Value = 18,
    /// Parameters are on trial: revert or commit first.
    OnTrial = 19,
    /// No parameters are on trial.
    NotOnTrial = 20,
    /// No parameters are in force.
    NoParameters = 21,
    /// The drive is enabled, and the parameters are too far from those in force or have other terms or another ratio, zero, side or unit.
    Bound = 22,
    /// Another host has a session open.
    Busy = 23,
    /// The drive has a key, and the request lacks the proof that its host knows it.
    Locked = 24,
    /// The drive adapts nothing.
    NoAdaptation = 25,
    /// A slot of the flash cannot be read, and no stored block is known to be in force: storing might erase it.
    Unreadable = 26,
}

impl Refusal {
    /// All of them.
    pub const ALL: [Self; 26] = [
        Self::Command,
        Self::Payload,
        Self::Session,
        Self::Order,
        Self::Enabled,
        Self::Compensating,
        Self::Signature,
        Self::Incomplete,
        Self::Offset,
        Self::Room,
        Self::Checksum,
        Self::Block,
        Self::Gear,
        Self::Sequence,
        Self::Flash,
        Self::ReadBack,
        Self::NothingBefore,
        Self::Value,
        Self::OnTrial,
        Self::NotOnTrial,
        Self::NoParameters,
        Self::Bound,
        Self::Busy,
        Self::Locked,
        Self::NoAdaptation,
        Self::Unreadable,
    ];

    /// Its number.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The reason of a number.
    #[must_use]
    pub fn of_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|refusal| refusal.number() == number)
    }

    /// The SDO abort code of CiA 301 for it.
    #[must_use]
    pub const fn abort_code(self) -> u32 {
        match self {
            Self::Command => 0x0504_0001,
            Self::Payload => 0x0607_0010,
            Self::Session => 0x060A_0023,
            Self::Order => 0x0503_0000,
            Self::Enabled | Self::OnTrial | Self::NotOnTrial => 0x0800_0022,
            Self::Compensating | Self::Busy => 0x0800_0021,
            Self::Signature => 0x0800_0020,
            Self::Incomplete | Self::NoParameters | Self::NoAdaptation => 0x0800_0024,
            Self::Offset => 0x0504_0003,
            Self::Room => 0x0504_0005,
            Self::Checksum => 0x0504_0004,
            Self::Block => 0x0604_0043,
            Self::Gear => 0x0604_0047,
            Self::Sequence => 0x0609_0032,
            Self::Flash | Self::Unreadable => 0x0606_0000,
            Self::ReadBack => 0x0800_0000,
            Self::NothingBefore => 0x0602_0000,
            Self::Value | Self::Bound => 0x0609_0030,
            Self::Locked => 0x0601_0000,
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Command => "it does not know the command",
            Self::Payload => "the command's payload has another length",
            Self::Session => "the request is not of the session that is open",
            Self::Order => "the request is not the next of its session: one was lost, repeated or late",
            Self::Enabled => "the drive is enabled, and storing would stall its core: disable it first",
            Self::Compensating => "the compensation is on: switch it off first",
            Self::Signature => "the signature word is wrong",
            Self::Incomplete => "the block has not come whole",
            Self::Offset => "the range does not continue the block, or lies outside it",
            Self::Room => "the block is too long for this drive",
            Self::Checksum => "the block's CRC-32 is not the one that was announced",
            Self::Block => "the block cannot be loaded",
            Self::Gear => "the block is for another gear",
            Self::Sequence => "the block's sequence number does not follow that of the newest stored block",
            Self::Flash => "the flash failed",
            Self::ReadBack => "the flash does not read back what was written",
            Self::NothingBefore => "there is no stored block to go back to",
            Self::Value => "the value is out of its range",
            Self::OnTrial => "parameters are on trial: revert or commit them first",
            Self::NotOnTrial => "no parameters are on trial",
            Self::NoParameters => "no parameters are in force",
            Self::Bound => "the drive is enabled, and the parameters are too far from those in force or have other terms or another ratio, zero, side or unit",
            Self::Locked => "the drive has a key, and the request does not prove that its host knows it",
            Self::NoAdaptation => {
                "it adapts nothing: no parameters of law masing are in force, or its firmware has no adaptation"
            }
            Self::Unreadable => {
                "a slot of the flash cannot be read, and no stored block is known to be in force: storing might erase it"
            }
            Self::Busy => "another host has a session open: wait until it has been silent for a while",
        })
    }
}

impl core::error::Error for Refusal {}

/// A refusal as it goes over the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Refused {
    /// Why.
    pub refusal: Refusal,
    /// [`BlockError::code`](crate::block::BlockError::code) for a refused block, else 0.
    pub detail: u16,
}

impl From<Refusal> for Refused {
    fn from(refusal: Refusal) -> Self {
        Self { refusal, detail: 0 }
    }
}
