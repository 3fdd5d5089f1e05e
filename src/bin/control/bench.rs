//! The hardware that the emulator has not: two encoder chips whose shaft an invisible hand swings, and a PWM channel.

use core::convert::Infallible;
use core::sync::atomic::{AtomicU16, Ordering};

use embedded_hal::pwm::{self, SetDutyCycle};
use embedded_hal::spi::{self, Operation, SpiDevice};

/// Counts of a turn of either shaft.
pub const COUNTS_PER_TURN: u32 = 1 << 14;

/// An AS5047P: answers a frame in the next one.
pub struct Chip {
    answer: u16,
    shaft: Shaft,
}

/// A shaft that swings between turning points, given in counts; it starts at 0 and stands at the last one.
pub struct Shaft {
    counts: i32,
    turns: &'static [i32],
}

/// Counts from one reading to the next.
const SPEED: i32 = 2;

impl Chip {
    pub const fn new(turns: &'static [i32]) -> Self {
        Self { answer: 0, shaft: Shaft { counts: 0, turns } }
    }

    fn exchange(&mut self, command: u16) -> u16 {
        const ADDRESS: u16 = (1 << 14) - 1;
        let answer = match command & ADDRESS {
            ADDRESS => self.shaft.read(),
            _ => 0,
        };
        let parity = (answer.count_ones() as u16 & 1) << 15;
        core::mem::replace(&mut self.answer, answer | parity)
    }
}

impl Shaft {
    fn read(&mut self) -> u16 {
        if let Some((&end, rest)) = self.turns.split_first() {
            self.counts += (end - self.counts).clamp(-SPEED, SPEED);
            if self.counts == end {
                self.turns = rest;
            }
        }
        self.counts.rem_euclid(COUNTS_PER_TURN as i32) as u16
    }
}

impl spi::ErrorType for Chip {
    type Error = Infallible;
}

impl SpiDevice for Chip {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        for operation in operations {
            if let Operation::TransferInPlace([high, low]) = operation {
                [*high, *low] = self.exchange(u16::from_be_bytes([*high, *low])).to_be_bytes();
            }
        }
        Ok(())
    }
}

/// A PWM channel of ten bits.
pub struct Channel;

static DUTY: AtomicU16 = AtomicU16::new(0);

/// The duty cycle that the channel has.
pub fn duty() -> u16 {
    DUTY.load(Ordering::Relaxed)
}

impl pwm::ErrorType for Channel {
    type Error = Infallible;
}

impl SetDutyCycle for Channel {
    fn max_duty_cycle(&self) -> u16 {
        1023
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        DUTY.store(duty, Ordering::Relaxed);
        Ok(())
    }
}
