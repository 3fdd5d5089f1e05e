//! A block into a chip's flash through a debug probe: past the firmware, which need not run.
//!
//! | file | what |
//! |---|---|
//! | [`elf`] | where the firmware keeps its blocks, by the symbols of its ELF file |
//! | [`sector`] | which erase sectors a block takes, and that nothing else lies in them |
//! | `chip` | the chip, by probe-rs; with the feature `probe` |
//!
//! The firmware has one place for a block, or two of which the newest valid block counts (the slots of a [`Store`](gmhm::store::Store)). Of two, the one
//! without the newest block is written.

#[cfg(feature = "probe")]
pub mod chip;
pub mod elf;
mod error;
pub mod sector;

use gmhm::block::{self, Block, HEADER_BYTES, Header, Identity, MOST_BYTES, verify, verify_first};
use gmhm::link::{Refusal, Request};

pub use elf::Elf;
pub use error::ProbeError;
pub use sector::{Range, Sectors};

use super::error::DeviceError;
use super::flash::{self, Flashed};

/// The command of the link that would store the block.
const COMMIT: u8 = Request::Commit { signature: 0, crc: 0 }.command();

/// A chip behind a debug probe.
pub trait Chip {
    /// The erase sectors of the flash at an address; `None` where there is no flash.
    fn sectors(&self, address: u64) -> Option<Sectors>;

    /// Reads memory.
    ///
    /// # Errors
    /// The probe or the chip fails.
    fn read(&mut self, address: u64, bytes: &mut [u8]) -> Result<(), ProbeError>;

    /// Erases the sectors of these bytes, programs and verifies them; `progress` hears how many are programmed.
    ///
    /// # Errors
    /// The probe or the chip fails.
    fn program(&mut self, address: u64, bytes: &[u8], progress: &mut dyn FnMut(usize)) -> Result<(), ProbeError>;

    /// Lets the firmware start anew.
    ///
    /// # Errors
    /// The probe or the chip fails.
    fn restart(&mut self) -> Result<(), ProbeError>;
}

/// Writes a block to the address, or to one of the two addresses, where the firmware looks for it, reads it back, compares and restarts the chip. It gets the sequence number
/// that follows that of the newest block there.
///
/// With the firmware's ELF file, its sectors must hold nothing else of it. `progress` hears how many bytes of how many have gone either way.
///
/// # Errors
/// Neither one address nor two; a place that is no flash, does not begin a sector or shares one; a block for another gear or arithmetic than the newest there; a probe or a chip that fails; bytes
/// that read back otherwise.
pub fn flash(
    block: &[u8],
    places: &[u64],
    firmware: Option<&Elf>,
    chip: &mut impl Chip,
    mut progress: impl FnMut(usize, usize),
) -> Result<Flashed, DeviceError> {
    check_count(places)?;
    let header = *verify(block)?.header();
    let taken = sector::of_places(places, block.len() as u64, |address| chip.sectors(address))?;
    if let Some(elf) = firmware {
        elf.leaves(&taken)?;
    }
    let mut held = Vec::new();
    for address in places {
        held.push(held_at(*address, chip)?);
    }
    let newest = held
        .iter()
        .enumerate()
        .filter_map(|(place, bytes)| Some((place, *verify(bytes.as_deref()?).ok()?.header())))
        .max_by_key(|(_, header)| header.sequence);
    let (place, sequence) = match newest {
        Some((place, newest)) => {
            check(&header, &newest)?;
            let sequence = newest
                .sequence
                .checked_add(1)
                .ok_or(DeviceError::Refused { command: COMMIT, refused: Refusal::Sequence.into() })?;
            (if held.len() == 2 { 1 - place } else { place }, sequence)
        }
        None => (0, 1),
    };
    let address = places[place];
    let mut stamped = block.to_vec();
    block::stamp(&mut stamped, sequence)?;
    let total = 2 * stamped.len();
    chip.program(address, &stamped, &mut |done| progress(done.min(stamped.len()), total))?;
    let mut bytes = vec![0; stamped.len()];
    chip.read(address, &mut bytes)?;
    progress(total, total);
    let flashed = flash::compared(&stamped, bytes)?;
    chip.restart()?;
    Ok(flashed)
}

/// Checks that there are one or two addresses.
fn check_count(places: &[u64]) -> Result<(), ProbeError> {
    if (1..=2).contains(&places.len()) { Ok(()) } else { Err(ProbeError::Places(places.len())) }
}

/// [`flash()`] into the chip of this name, or the one that is found, behind the one probe that is attached.
///
/// # Errors
/// As there; without the feature `probe`, always.
pub fn flash_attached(
    block: &[u8],
    places: &[u64],
    firmware: Option<&Elf>,
    chip: Option<&str>,
    progress: impl FnMut(usize, usize),
) -> Result<Flashed, DeviceError> {
    check_count(places)?;
    #[cfg(feature = "probe")]
    return flash(block, places, firmware, &mut chip::Attached::to(chip)?, progress);
    #[cfg(not(feature = "probe"))]
    {
        let _ = (block, firmware, chip, progress);
        Err(DeviceError::NoProbe)
    }
}

/// The bytes of the block at a place, if one is there.
fn held_at(address: u64, chip: &mut impl Chip) -> Result<Option<Vec<u8>>, ProbeError> {
    let mut head = [0; HEADER_BYTES];
    chip.read(address, &mut head)?;
    let Ok(header) = Header::decode(&head) else { return Ok(None) };
    let length = header.length as usize;
    if !(HEADER_BYTES..=MOST_BYTES).contains(&length) {
        return Ok(None);
    }
    let mut bytes = vec![0; length];
    chip.read(address, &mut bytes)?;
    Ok(verify_first(&bytes).ok().as_ref().map(Block::bytes).map(<[u8]>::to_vec))
}

/// What the link's end on the drive would refuse.
fn check(block: &Header, newest: &Header) -> Result<(), DeviceError> {
    if newest.identity != Identity::NONE && block.identity != newest.identity {
        return Err(DeviceError::OtherGear { block: block.identity, drive: newest.identity });
    }
    if block.scalar != newest.scalar {
        return Err(DeviceError::OtherScalar { block: block.scalar.name(), drive: newest.scalar.name() });
    }
    Ok(())
}
