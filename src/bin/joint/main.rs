//! A servo at the end of a serial line, in lock-step with a joint that a host plays: `gmhm simulate --experiment joint --drive`.
//!
//! For the MPS2 boards, whose serial port is that of the Cortex-M system design kit. It waits for frames and answers each; it ends with its emulator.
#![no_std]
#![no_main]

#[path = "../platform/device.rs"]
#[allow(dead_code, reason = "this image never ends")]
mod device;
#[path = "../node/registers.rs"]
mod registers;

use gmhm::drive::lockstep::Drive;
use gmhm::link::frame::{self, Receiver};
use registers::{read, write};

const UART: u32 = 0x4000_4000;
const DATA: u32 = UART;
const STATE: u32 = UART + 0x04;
const CTRL: u32 = UART + 0x08;
const BAUDDIV: u32 = UART + 0x10;
const TX_FULL: u32 = 1;
const RX_FULL: u32 = 1 << 1;

#[cortex_m_rt::entry]
fn main() -> ! {
    write(BAUDDIV, 25_000_000 / 921_600);
    write(CTRL, 3);
    let mut receiver = Receiver::new();
    let mut drive = Drive::default();
    loop {
        while read(STATE) & RX_FULL == 0 {}
        let request = receiver.feed(read(DATA) as u8);
        let Some(answer) = request.and_then(|request| drive.answer(request)) else { continue };
        for byte in frame::encode(&answer).iter() {
            while read(STATE) & TX_FULL != 0 {}
            write(DATA, u32::from(*byte));
        }
    }
}
