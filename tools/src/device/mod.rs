//! Drives at the end of a line: the host's end of the [link](gmhm::link), and what is flashed through it.
//!
//! | file | what |
//! |---|---|
//! | [`target`] | where a drive is: a serial port, a TCP port, a debug probe |
//! | [`mod@line`] | bytes to it and back |
//! | [`client`] | one request, one answer |
//! | [`Lockstep`] | a joint played for a drive |
//! | [`mod@flash`] | a whole block: staged, tried, stored, read back, compared |
//! | [`key`] | the key of a drive, from a file |
//! | [`trial`] | parameters in RAM: tried, kept, taken back |
//! | [`virtual_drive`] | a simulated drive on this computer |
//! | [`probe`] | a block into a chip's flash through a debug probe |

pub mod client;
mod error;
pub mod flash;
pub mod key;
pub mod line;
mod lockstep;
pub mod probe;
pub mod target;
pub mod trial;
pub mod virtual_drive;

pub use client::Client;
pub use error::DeviceError;
pub use flash::{Flashed, flash};
pub use line::Line;
pub use lockstep::Lockstep;
pub use target::Target;
