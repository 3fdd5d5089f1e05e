//! AS5047P, an absolute magnetic encoder of 14 bits on SPI (ams OSRAM, data sheet AS5047P v1-03, section "SPI interface").
//!
//! Frames of 16 bits, most significant first, SPI mode 1, up to 10 MHz; the select line goes up after each. A command is an even-parity bit, a read bit and
//! 14 bits of address; the answer comes in the *next* frame: an even-parity bit, an error flag, 14 bits of data. The AS5048A and AS5147P answer the same frames.

use core::fmt;

use embedded_hal::spi::SpiDevice;

use super::Encoder;

const READ: u16 = 1 << 14;
const ERROR_FLAG: u16 = 1 << 14;
const DATA: u16 = ERROR_FLAG - 1;

const NOP: u16 = 0x0000;
/// What went wrong on the bus; cleared by reading.
const ERRFL: u16 = 0x0001;
/// The angle, corrected for the delay of the chip at speed.
const ANGLECOM: u16 = 0x3fff;

/// The encoder on its SPI device.
#[derive(Debug)]
pub struct As5047p<D> {
    device: D,
}

/// Why there is no angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum As5047pError<E> {
    /// The bus.
    Bus(E),
    /// The answer's parity is odd: a bit was lost on the way, or nothing answers.
    Parity,
    /// The encoder complains of an earlier frame; its flags have been cleared.
    Flagged {
        /// A command came with odd parity.
        parity: bool,
        /// A command named no register.
        invalid_command: bool,
        /// A frame had not 16 bits.
        framing: bool,
    },
}

impl<E: fmt::Debug> fmt::Display for As5047pError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(error) => write!(f, "SPI bus: {error:?}"),
            Self::Parity => {
                f.write_str("parity of the answer is odd: check wiring, SPI mode 1 and clock (at most 10 MHz)")
            }
            Self::Flagged { parity, invalid_command, framing } => {
                write!(
                    f,
                    "the encoder flags an error (parity {parity}, invalid command {invalid_command}, framing {framing})"
                )
            }
        }
    }
}

impl<E: fmt::Debug> core::error::Error for As5047pError<E> {}

impl<D: SpiDevice> As5047p<D> {
    /// Counts of a turn.
    pub const COUNTS_PER_TURN: u32 = 1 << 14;

    /// The encoder on a device that is set to mode 1, most significant bit first.
    #[must_use]
    pub const fn new(device: D) -> Self {
        Self { device }
    }

    /// Gives the device back.
    #[must_use]
    pub fn release(self) -> D {
        self.device
    }

    /// A register. Two frames: the question, and the answer to it.
    fn read(&mut self, register: u16) -> Result<u16, As5047pError<D::Error>> {
        self.exchange(register)?;
        let answer = self.exchange(NOP)?;
        if answer.count_ones().is_multiple_of(2) { Ok(answer) } else { Err(As5047pError::Parity) }
    }

    fn exchange(&mut self, register: u16) -> Result<u16, As5047pError<D::Error>> {
        let command = register | READ;
        let parity = if command.count_ones().is_multiple_of(2) { 0 } else { 1 << 15 };
        let mut frame = (command | parity).to_be_bytes();
        self.device.transfer_in_place(&mut frame).map_err(As5047pError::Bus)?;
        Ok(u16::from_be_bytes(frame))
    }
}

impl<D: SpiDevice> Encoder for As5047p<D> {
    type Error = As5047pError<D::Error>;

    /// Reads the angle afresh: two frames.
    fn counts(&mut self) -> Result<u32, Self::Error> {
        let answer = self.read(ANGLECOM)?;
        if answer & ERROR_FLAG != 0 {
            let flags = self.read(ERRFL)?;
            let flag = |bit: u16| flags & (1 << bit) != 0;
            return Err(As5047pError::Flagged { parity: flag(2), invalid_command: flag(1), framing: flag(0) });
        }
        Ok(u32::from(answer & DATA))
    }
}
