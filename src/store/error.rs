//! Why the store refused or failed.

use core::fmt;

use super::Slot;

/// The two ranges cannot be slots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum PlaceError {
    /// A slot is empty, or not made of whole erase sectors.
    Sectors {
        /// Bytes of a sector.
        erase_size: usize,
    },
    /// A slot reaches beyond the flash.
    Beyond {
        /// Bytes of the flash.
        capacity: usize,
    },
    /// The slots overlap.
    Overlap,
}

impl fmt::Display for PlaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sectors { erase_size } => write!(f, "a slot must be one or more whole sectors of {erase_size} bytes"),
            Self::Beyond { capacity } => write!(f, "a slot reaches beyond the flash of {capacity} bytes"),
            Self::Overlap => write!(f, "the two slots overlap: each needs sectors of its own"),
        }
    }
}

impl core::error::Error for PlaceError {}

/// A block was not stored, or not rolled back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum StoreError<E> {
    /// The flash failed.
    Flash(E),
    /// Its sequence number is not above that of the newest block.
    NotNewer {
        /// The newest sequence number; 0 where there is no block.
        newest: u32,
    },
    /// It does not fit into a slot.
    TooLong {
        /// Bytes of the smaller slot.
        room: u32,
    },
    /// What was written, or erased, reads back otherwise.
    ReadBack,
    /// There is no block before the newest.
    NothingBefore,
    /// A slot could not be read, and no block is known to be in force: it may hold the one that is. Nothing was touched. Find the newest block first, with the power
    /// switched off and on where need be; where a slot never reads again, [`Store::erase_unreadable`](super::Store::erase_unreadable) is the way out.
    Unreadable {
        /// The slot; the first where neither could be read.
        slot: Slot,
    },
}

impl<E: fmt::Debug> fmt::Display for StoreError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flash(error) => write!(f, "the flash failed: {error:?}"),
            Self::NotNewer { newest } => {
                write!(f, "its sequence number must be above {newest}, that of the newest block")
            }
            Self::TooLong { room } => write!(f, "it does not fit into a slot of {room} bytes"),
            Self::ReadBack => write!(f, "the flash does not read back what was written"),
            Self::NothingBefore => write!(f, "there is no block before the newest"),
            Self::Unreadable { slot } => write!(
                f,
                "slot {slot:?} cannot be read, and no block is known to be in force: switch power off and on; if it stays, erase what cannot be read"
            ),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for StoreError<E> {}
