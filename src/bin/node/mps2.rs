//! The MPS2 boards: a serial port of the Cortex-M system design kit, and a store in memory that outlives a reset.

#[path = "registers.rs"]
mod registers;

use core::ops::Range;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use gmhm::memory::AnyLaw;
use gmhm::store::RamFlash;
use registers::{read, write};

/// What it computes in.
pub type Number = f32;

/// Whichever law a block has.
pub type Law = AnyLaw<Number>;

/// The clock of the core: 25 MHz.
pub const CLOCKS_PER_MS: u32 = 25_000;

/// Bytes of a block.
pub const ROOM: usize = 1024;

/// The two slots.
pub const SLOTS: [Range<u32>; 2] = [0..1024, 1024..2048];

const UART: u32 = 0x4000_4000;
const DATA: u32 = UART;
const STATE: u32 = UART + 0x04;
const CTRL: u32 = UART + 0x08;
const BAUDDIV: u32 = UART + 0x10;
const TX_FULL: u32 = 1;
const RX_FULL: u32 = 1 << 1;

/// What programming a word takes: 16 µs, as flash does.
const WORD_CLOCKS: u32 = 400;

/// Memory of the board beyond what the image is linked into: it outlives a reset, and who plays a power cut fills it.
const MEMORY: usize = 0x2010_0000;
const MEMORY_BYTES: usize = 2048;

#[unsafe(link_section = ".uninit.boots")]
static mut BOOTS: u32 = 0;

/// The memory as a flash, word by word as one, for power to fail in between.
pub struct Flash(RamFlash<'static, 4, 1024>);

/// The memory; nothing else writes it.
pub fn flash() -> Flash {
    // SAFETY: the board has 4 MiB here, of which memory.x gives the image 16 KiB; called once, and every value of a byte is one.
    let memory =
        unsafe { core::slice::from_raw_parts_mut(core::ptr::with_exposed_provenance_mut(MEMORY), MEMORY_BYTES) };
    Flash(RamFlash::new(memory))
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = RamFlash::<'static, 4, 1024>::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = RamFlash::<'static, 4, 1024>::WRITE_SIZE;
    const ERASE_SIZE: usize = RamFlash::<'static, 4, 1024>::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.0.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        for (word, at) in bytes.chunks(Self::WRITE_SIZE).zip((offset..).step_by(Self::WRITE_SIZE)) {
            self.0.write(at, word)?;
            cortex_m::asm::delay(WORD_CLOCKS);
        }
        Ok(())
    }
}

/// The serial port.
pub struct Board;

impl Board {
    /// Switches it on.
    pub fn start() -> Self {
        write(BAUDDIV, 25_000_000 / 115_200);
        write(CTRL, 3);
        Self
    }

    /// A number that differs from boot to boot.
    pub fn nonce(&mut self) -> u32 {
        // SAFETY: one thread, no interrupt; every value of a word is one.
        unsafe {
            BOOTS = BOOTS.wrapping_add(1);
            BOOTS
        }
    }

    /// The next byte that has come.
    pub fn hear(&mut self) -> Option<u8> {
        (read(STATE) & RX_FULL != 0).then(|| read(DATA) as u8)
    }

    /// Sends a byte.
    pub fn say(&mut self, byte: u8) {
        while read(STATE) & TX_FULL != 0 {}
        write(DATA, u32::from(byte));
    }
}
