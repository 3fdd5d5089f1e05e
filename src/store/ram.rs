//! Memory that behaves as a flash: for boards without one, emulators and tests.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// A piece of memory with sectors of `ERASE` bytes, programmed in units of `WRITE`: erasing sets every bit, programming clears some.
#[derive(Debug)]
pub struct RamFlash<'a, const WRITE: usize = 4, const ERASE: usize = 1024> {
    bytes: &'a mut [u8],
}

impl<'a, const WRITE: usize, const ERASE: usize> RamFlash<'a, WRITE, ERASE> {
    /// A flash of what these bytes hold; those beyond the last whole sector are left alone.
    pub fn new(bytes: &'a mut [u8]) -> Self {
        Self { bytes }
    }

    fn part(&mut self, from: usize, to: usize) -> Result<&mut [u8], NorFlashErrorKind> {
        self.bytes.get_mut(from..to).ok_or(NorFlashErrorKind::OutOfBounds)
    }
}

impl<const WRITE: usize, const ERASE: usize> ErrorType for RamFlash<'_, WRITE, ERASE> {
    type Error = NorFlashErrorKind;
}

impl<const WRITE: usize, const ERASE: usize> ReadNorFlash for RamFlash<'_, WRITE, ERASE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        let from = offset as usize;
        bytes.copy_from_slice(self.part(from, from.saturating_add(bytes.len()))?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len() - self.bytes.len() % ERASE
    }
}

impl<const WRITE: usize, const ERASE: usize> NorFlash for RamFlash<'_, WRITE, ERASE> {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        self.part(from as usize, to as usize)?.fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        let from = offset as usize;
        let cells = self.part(from, from.saturating_add(bytes.len()))?;
        cells.iter_mut().zip(bytes).for_each(|(cell, byte)| *cell &= byte);
        Ok(())
    }
}
