//! The flash of a simulated drive. Its power can be cut between any two words of a write.

use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use gmhm::store::RamFlash;

/// Bytes of a sector and of a slot.
const SECTOR: usize = 1024;
/// Bytes that are programmed at once.
const WORD: usize = 4;

type Cells<'a> = RamFlash<'a, WORD, SECTOR>;

/// The two slots of the store.
pub const SLOTS: [Range<u32>; 2] = [0..SECTOR as u32, SECTOR as u32..2 * SECTOR as u32];

/// A handle of the flash; every clone is the same flash.
#[derive(Debug, Clone)]
pub struct Chip(Arc<Mutex<Content>>);

#[derive(Debug)]
struct Content {
    bytes: Vec<u8>,
    powered: bool,
    cut_in_next_write: bool,
}

impl Chip {
    /// Two erased sectors.
    pub fn erased() -> Self {
        let bytes = vec![0xFF; 2 * SECTOR];
        Self(Arc::new(Mutex::new(Content { bytes, powered: true, cut_in_next_write: false })))
    }

    /// Whether it has power.
    pub fn is_powered(&self) -> bool {
        self.content().powered
    }

    /// Switches the power on.
    pub fn switch_on(&self) {
        self.content().powered = true;
    }

    /// The next write of more than one word ends half-way, by a power cut.
    pub fn cut_in_next_write(&self) {
        self.content().cut_in_next_write = true;
    }

    fn content(&self) -> MutexGuard<'_, Content> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The content, if there is power.
    fn powered(&self) -> Result<MutexGuard<'_, Content>, NorFlashErrorKind> {
        let content = self.content();
        if content.powered { Ok(content) } else { Err(NorFlashErrorKind::Other) }
    }
}

impl ErrorType for Chip {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Chip {
    const READ_SIZE: usize = Cells::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        Cells::new(&mut self.powered()?.bytes).read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl NorFlash for Chip {
    const WRITE_SIZE: usize = Cells::WRITE_SIZE;
    const ERASE_SIZE: usize = Cells::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        Cells::new(&mut self.powered()?.bytes).erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let mut content = self.powered()?;
        let words = bytes.len() / WORD;
        let cut = content.cut_in_next_write && words > 1;
        let written = if cut { bytes.get(..words / 2 * WORD).unwrap_or(bytes) } else { bytes };
        Cells::new(&mut content.bytes).write(offset, written)?;
        if cut {
            content.cut_in_next_write = false;
            content.powered = false;
            return Err(NorFlashErrorKind::Other);
        }
        Ok(())
    }
}
