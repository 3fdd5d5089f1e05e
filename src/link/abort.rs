//! Why a bus aborts a transfer.

use super::refusal::{Refusal, Refused};
use crate::block::sdo_abort;

/// Why a transfer is aborted: an SDO abort code of CiA 301.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Abort(pub u32);

impl Abort {
    /// The toggle bit did not alternate.
    pub const TOGGLE: Self = Self(0x0503_0000);
    /// A command that is not known here, such as a block transfer.
    pub const COMMAND: Self = Self(0x0504_0001);
    /// A write-only object was to be read.
    pub const WRITE_ONLY: Self = Self(0x0601_0001);
    /// A read-only object was to be written.
    pub const READ_ONLY: Self = Self(0x0601_0002);
    /// There is no such index.
    pub const NO_OBJECT: Self = Self(0x0602_0000);
    /// A value of another length.
    pub const LENGTH: Self = Self(0x0607_0010);
    /// There is no such sub-index.
    pub const NO_SUB: Self = Self(0x0609_0011);
    /// A value out of its range.
    pub const VALUE: Self = Self(0x0609_0030);
}

impl From<Refused> for Abort {
    fn from(refused: Refused) -> Self {
        if refused.refusal == Refusal::Block { Self(sdo_abort(refused.detail)) } else { refused.refusal.into() }
    }
}

impl From<Refusal> for Abort {
    fn from(refusal: Refusal) -> Self {
        Self(refusal.abort_code())
    }
}
