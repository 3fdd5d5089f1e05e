//! Why a block was refused.

use core::fmt;

use super::header::TorqueUnit;
use super::layout::{FIRST_TERM, RECORDS};
use crate::terms::{TermError, kind_of_tag};

/// A block was refused; nothing was changed. [`code`](Self::code) is what a drive tells of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum BlockError {
    /// Fewer or more bytes than the header says.
    Length {
        /// Bytes there are.
        found: usize,
        /// Bytes there should be.
        expected: usize,
    },
    /// It does not begin with the magic.
    Magic,
    /// Another format version.
    Version(u16),
    /// The CRC-32 does not match.
    Checksum,
    /// A field of the header that cannot be: its name.
    Header(&'static str),
    /// The words are those of another scalar: its two bytes in the header.
    Scalar([u8; 2]),
    /// It remembers more turning points than there is room for.
    StackDepth(u16),
    /// Records that run past the end, are not of whole words or are not as many as the header says.
    Records,
    /// A record that this firmware does not know and must not skip: its tag.
    Unknown(u16),
    /// A record of another length than its fields: its tag.
    Malformed(u16),
    /// A record that may stand once stands twice, or two laws do: its tag.
    Twice(u16),
    /// A record without which nothing can be computed: its tag.
    Missing(u16),
    /// A value that is no number or out of its range.
    OutOfRange {
        /// The tag of its record.
        tag: u16,
        /// The name of its field.
        field: &'static str,
    },
    /// A term that cannot be.
    Term {
        /// The tag of its record.
        tag: u16,
        /// What is wrong.
        error: TermError,
    },
    /// A term, where the firmware computes none: its tag.
    TermsNotComputed(u16),
    /// The drive computes otherwise than the host that wrote the golden samples.
    SelfTest,
    /// A record of a set-up whose words are not those of the records that it was computed from: its tag.
    Disagrees(u16),
    /// It counts torques in another unit than the firmware: the one it counts in.
    Unit(TorqueUnit),
    /// More bytes than a block may have, or than the buffer of its writer has.
    NoRoom,
    /// The firmware around this crate refused it, by a code of its own.
    Firmware(u16),
}

impl BlockError {
    /// The number of the reason on the link, in logs and in C: 0x0101 to 0x0113, or the firmware's own.
    #[must_use]
    pub const fn code(&self) -> u16 {
        if let Self::Firmware(code) = self {
            return *code;
        }
        0x0100
            + match self {
                Self::Length { .. } => 1,
                Self::Magic => 2,
                Self::Version(_) => 3,
                Self::Checksum => 4,
                Self::Header(_) => 5,
                Self::Scalar(_) => 6,
                Self::StackDepth(_) => 7,
                Self::Records => 8,
                Self::Unknown(_) => 9,
                Self::Malformed(_) => 10,
                Self::Twice(_) => 11,
                Self::Missing(_) => 12,
                Self::OutOfRange { .. } => 13,
                Self::Term { .. } => 14,
                Self::NoRoom => 15,
                Self::TermsNotComputed(_) => 16,
                Self::SelfTest => 17,
                Self::Disagrees(_) => 18,
                Self::Unit(_) => 19,
                Self::Firmware(_) => 0,
            }
    }

    /// The abort code of a CANopen SDO transfer (CiA 301) that comes nearest.
    #[must_use]
    pub const fn sdo_abort(&self) -> u32 {
        sdo_abort(self.code())
    }
}

/// The abort code of a CANopen SDO transfer (CiA 301) that comes nearest to a [code](BlockError::code); the general error for any other number.
#[must_use]
pub const fn sdo_abort(code: u16) -> u32 {
    match code {
        // Data type or length does not match.
        0x0101 | 0x0102 | 0x0108 | 0x010A => 0x0607_0010,
        // Incompatible within the device.
        0x0103 | 0x0109 => 0x0604_0047,
        // CRC error.
        0x0104 => 0x0504_0004,
        // Incompatible parameters.
        0x0106 | 0x010B | 0x010C | 0x0110 | 0x0112 | 0x0113 => 0x0604_0043,
        // Value too high.
        0x0107 => 0x0609_0031,
        // Value out of range.
        0x0105 | 0x010D | 0x010E => 0x0609_0030,
        // Out of memory.
        0x010F => 0x0504_0005,
        // Hardware error.
        0x0111 => 0x0606_0000,
        _ => 0x0800_0000,
    }
}

/// The name of a record by its tag.
fn record_name(tag: u16) -> Option<&'static str> {
    let fixed = RECORDS.iter().find(|info| info.tag == tag).map(|info| info.name);
    fixed.or_else(|| kind_of_tag(tag.checked_sub(FIRST_TERM)?).map(|kind| kind.name))
}

/// A tag with the name of its record.
struct Tag(u16);

impl fmt::Display for Tag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match record_name(self.0) {
            Some(name) => write!(f, "record {name} ({:#06x})", self.0),
            None => write!(f, "record {:#06x}", self.0),
        }
    }
}

impl fmt::Display for BlockError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Length { found, expected } => write!(f, "there are {found} bytes where the block has {expected}"),
            Self::Magic => write!(f, "this is no parameter block: it does not begin with \"GMHM\""),
            Self::Version(version) => {
                write!(f, "format version {version} is not known; version {} is", super::FORMAT_VERSION)
            }
            Self::Checksum => write!(f, "the CRC-32 does not match: the block is damaged"),
            Self::Header(field) => write!(f, "the header's {field} cannot be"),
            Self::Scalar([kind, fraction]) => {
                write!(f, "its words are those of another arithmetic (scalar kind {kind}, {fraction} fractional bits)")
            }
            Self::StackDepth(depth) => write!(f, "it asks for {depth} turning points, more than there is room for"),
            Self::Records => write!(f, "its records do not fill it as the header says"),
            Self::Unknown(tag) => write!(f, "{} is not known here and must not be skipped", Tag(tag)),
            Self::Malformed(tag) => write!(f, "{} is of another length than its fields", Tag(tag)),
            Self::Twice(tag) => write!(f, "{} stands beside another of its kind", Tag(tag)),
            Self::Missing(tag) => write!(f, "{} is missing", Tag(tag)),
            Self::OutOfRange { tag, field } => write!(f, "{field} of {} cannot be", Tag(tag)),
            Self::Term { tag, error } => write!(f, "{}: {error}", Tag(tag)),
            Self::TermsNotComputed(tag) => write!(f, "{}: this firmware computes no terms", Tag(tag)),
            Self::SelfTest => {
                write!(f, "the golden samples come out otherwise here: do not use this drive's arithmetic")
            }
            Self::Disagrees(tag) => {
                write!(f, "{} does not go with the records that it was computed from: pack the block anew", Tag(tag))
            }
            Self::Unit(TorqueUnit::Ampere) => {
                write!(f, "it counts torques in amperes, and the firmware in newton metres")
            }
            Self::Unit(TorqueUnit::NewtonMetre) => {
                write!(f, "it counts torques in newton metres, and the firmware in amperes")
            }
            Self::NoRoom => write!(f, "the block is longer than there is room for"),
            Self::Firmware(code) => write!(f, "the firmware refused it by its code {code:#06x}"),
        }
    }
}

impl core::error::Error for BlockError {}

#[cfg(all(feature = "defmt", target_os = "none"))]
impl defmt::Format for BlockError {
    fn format(&self, f: defmt::Formatter<'_>) {
        match *self {
            Self::OutOfRange { tag, field } => {
                defmt::write!(
                    f,
                    "block refused, code {=u16:#06x}: {=str} of record {=u16:#06x}",
                    self.code(),
                    field,
                    tag
                );
            }
            Self::Term { tag, error } => {
                let key = error.key().unwrap_or("");
                defmt::write!(
                    f,
                    "block refused, code {=u16:#06x}: {=str} of record {=u16:#06x}",
                    self.code(),
                    key,
                    tag
                );
            }
            Self::Unknown(tag)
            | Self::Malformed(tag)
            | Self::Twice(tag)
            | Self::Missing(tag)
            | Self::Disagrees(tag)
            | Self::TermsNotComputed(tag) => {
                defmt::write!(f, "block refused, code {=u16:#06x}: record {=u16:#06x}", self.code(), tag);
            }
            _ => defmt::write!(f, "block refused, code {=u16:#06x}", self.code()),
        }
    }
}
