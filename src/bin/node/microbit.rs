//! The nRF51 of the micro:bit: its serial port, its random numbers, and its flash by the controller that erases and programs it.

#[path = "registers.rs"]
mod registers;

use core::ops::Range;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use gmhm::memory::masing::Masing;
use gmhm::scalar::Fixed;
use registers::{read, write};

/// What it computes in: the core has no unit for floating point.
pub type Number = Fixed;

/// The one law that it has room for.
pub type Law = Masing<Number>;

/// The clock of the core: 16 MHz.
pub const CLOCKS_PER_MS: u32 = 16_000;

/// Bytes of a block.
pub const ROOM: usize = 1024;

/// The two slots: the last pages of the flash.
pub const SLOTS: [Range<u32>; 2] = [0x3_F800..0x3_FC00, 0x3_FC00..0x4_0000];

const UART: u32 = 0x4000_2000;
const START_RX: u32 = UART;
const START_TX: u32 = UART + 0x008;
const RX_READY: u32 = UART + 0x108;
const TX_READY: u32 = UART + 0x11C;
const ENABLE: u32 = UART + 0x500;
const PIN_TX: u32 = UART + 0x50C;
const PIN_RX: u32 = UART + 0x514;
const RXD: u32 = UART + 0x518;
const TXD: u32 = UART + 0x51C;
const BAUD: u32 = UART + 0x524;
const BAUD_115200: u32 = 0x01D7_E000;

const RANDOM: u32 = 0x4000_D000;
const RANDOM_READY: u32 = RANDOM + 0x100;
const RANDOM_VALUE: u32 = RANDOM + 0x508;

const CONTROLLER: u32 = 0x4001_E000;
const READY: u32 = CONTROLLER + 0x400;
const CONFIG: u32 = CONTROLLER + 0x504;
const ERASE_PAGE: u32 = CONTROLLER + 0x508;
/// What programming a word takes: 46 µs at 16 MHz.
const WORD_CLOCKS: u32 = 736;

const READ_ONLY: u32 = 0;
const WRITES: u32 = 1;
const ERASES: u32 = 2;

/// The whole flash.
pub struct Flash;

/// The flash; nothing else writes it.
pub fn flash() -> Flash {
    Flash
}

impl Flash {
    fn settle(&self) {
        while read(READY) & 1 == 0 {}
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        for (word, at) in bytes.chunks_mut(4).zip((offset..).step_by(4)) {
            word.copy_from_slice(&read(at).to_le_bytes());
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        256 * 1024
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 1024;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        write(CONFIG, ERASES);
        for page in (from..to).step_by(Self::ERASE_SIZE) {
            write(ERASE_PAGE, page);
            self.settle();
        }
        write(CONFIG, READ_ONLY);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        write(CONFIG, WRITES);
        for (word, at) in bytes.chunks(4).zip((offset..).step_by(4)) {
            if let [a, b, c, d] = *word {
                write(at, u32::from_le_bytes([a, b, c, d]));
                self.settle();
                // The emulator's controller is ready at once: take the time that a real one does, for power to fail in.
                cortex_m::asm::delay(WORD_CLOCKS);
            }
        }
        write(CONFIG, READ_ONLY);
        Ok(())
    }
}

/// The serial port and the random numbers.
pub struct Board;

impl Board {
    /// Switches them on.
    pub fn start() -> Self {
        write(PIN_TX, 24);
        write(PIN_RX, 25);
        write(BAUD, BAUD_115200);
        write(ENABLE, 4);
        write(START_TX, 1);
        write(START_RX, 1);
        write(RANDOM, 1);
        Self
    }

    /// A number that differs from boot to boot.
    pub fn nonce(&mut self) -> u32 {
        let mut bytes = [0; 4];
        for byte in &mut bytes {
            while read(RANDOM_READY) == 0 {}
            write(RANDOM_READY, 0);
            *byte = read(RANDOM_VALUE) as u8;
        }
        u32::from_le_bytes(bytes)
    }

    /// The next byte that has come.
    pub fn hear(&mut self) -> Option<u8> {
        if read(RX_READY) == 0 {
            return None;
        }
        write(RX_READY, 0);
        Some(read(RXD) as u8)
    }

    /// Sends a byte.
    pub fn say(&mut self, byte: u8) {
        write(TX_READY, 0);
        write(TXD, u32::from(byte));
        while read(TX_READY) == 0 {}
    }
}
