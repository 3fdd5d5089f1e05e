//! The MPS2 boards: a serial port of the Cortex-M system design kit, and a store in memory that outlives a reset.

#[path = "registers.rs"]
mod registers;

use core::ops::Range;

use gmhm::memory::AnyLaw;
use gmhm::store::RamFlash;
use registers::{read, write};

/// What it computes in.
pub type Number = f32;

/// Whichever law a block has.
pub type Law = AnyLaw<Number>;

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

/// Neither cleared nor set by start-up code.
#[unsafe(link_section = ".uninit.store")]
static mut MEMORY: [u8; 2048] = [0; 2048];

#[unsafe(link_section = ".uninit.boots")]
static mut BOOTS: u32 = 0;

/// The memory as a flash.
pub fn flash() -> RamFlash<'static, 4, 1024> {
    let memory = &raw mut MEMORY;
    // SAFETY: called once, before anything else could have touched it; every value of a byte is one.
    RamFlash::new(unsafe { &mut *memory })
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
