//! `gmhm virtual-drive`.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::path::PathBuf;
use std::sync::mpsc::channel;

use clap::Args;
use gmhm::link::lock::PROOF_BYTES;

use super::Session;
use super::common::positive;
use super::failure::Failure;
use super::keys::{self, Source};
use crate::device::virtual_drive::VirtualDrive;
use crate::device::virtual_drive::listen::Listen;
use crate::device::virtual_drive::serve::{Key, Socket};
use crate::device::{DeviceError, key};

/// Run a simulated drive on this computer, to try flash, drive and simulate --drive without hardware
///
/// The core, its parameter store and its link run as on a microcontroller, in f32. As soon as parameters are in force, the load of the joint
/// rises and falls slowly. The flash is erased at the start and lost when the program ends.
///
/// Keys: c cuts the power and restores it, w cuts it in the middle of the next write to the flash, e switches the power stage on or off (an enabled drive
/// rejects a request to store), q ends the program. If the input is a pipe, press Enter after each key. If the program was started with &, it accepts keys after fg.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gmhm virtual-drive --listen tcp:localhost:5555
  gmhm virtual-drive --listen pty
Then, in another terminal:
  gmhm flash params.bin --to tcp:localhost:5555
  gmhm drive --to tcp:localhost:5555 status")]
pub struct VirtualDriveArgs {
    /// Where to listen: tcp:HOST:PORT (port 0 takes a free one) or pty, a pseudo-terminal
    #[arg(long, value_name = "tcp:HOST:PORT|pty")]
    listen: Listen,
    /// A key, 64 hexadecimal digits: only hosts that have it can change the drive
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// The gear warms up within this time: stiffness -10 %, hysteresis +20 %. The adaptation of the drive follows the change; see gmhm drive adaptation
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = positive)]
    warms: Option<f64>,
}

impl VirtualDriveArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let mut socket = Socket::open(&self.listen)?;
        let key = self.key.as_deref().map(key::read).transpose()?;
        let mut drive = VirtualDrive::new(nonce()).map_err(DeviceError::from)?;
        if let Some(seconds) = self.warms {
            drive = drive.warming(seconds as f32);
        }
        if let Some(key) = key {
            drive = drive.with_key(key, entropy()).map_err(DeviceError::from)?;
        }
        let how = match Source::now() {
            Source::Terminal => "Keys",
            Source::Background => "Keys, after fg",
            Source::Lines => "Keys, then Enter",
        };
        session.say(format_args!(
            "Virtual drive at {}\n{how}: c cut the power, w cut it in the next write, e enable or disable, q quit\n",
            socket.target(&self.listen)
        ))?;
        let (sender, pressed) = channel();
        let _terminal = keys::Restore;
        let press = move |key| named(key).is_none_or(|key| sender.send(key).is_ok() && key != Key::Quit);
        std::thread::spawn(move || keys::read(press));
        // A reader that has gone does not end the drive.
        socket
            .serve(&mut drive, &pressed, |text| drop(session.say(format_args!("{}", keys::lines(format!("{text}\n"))))))
            .map_err(DeviceError::from)?;
        Ok(())
    }
}

/// A number that differs from run to run.
fn nonce() -> u32 {
    std::time::UNIX_EPOCH.elapsed().map_or(0, |since| since.subsec_nanos()) ^ std::process::id()
}

/// Random bytes: those that the standard library seeds its hashes with.
fn entropy() -> [u8; PROOF_BYTES] {
    let mut bytes = [0; PROOF_BYTES];
    for part in bytes.chunks_mut(8) {
        let random = RandomState::new().build_hasher().finish().to_le_bytes();
        part.iter_mut().zip(random).for_each(|(to, byte)| *to = byte);
    }
    bytes
}

/// What a key does; Ctrl-C ends the drive.
fn named(key: Option<char>) -> Option<Key> {
    match key {
        Some('c') => Some(Key::Cut),
        Some('w') => Some(Key::CutInWrite),
        Some('e') => Some(Key::Enable),
        Some('q') | None => Some(Key::Quit),
        Some(_) => None,
    }
}
