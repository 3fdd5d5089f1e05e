//! Parameters on trial: in force in RAM until they are kept, taken back, or the power fails.

use gmhm::block::{self, verify};
use gmhm::link::message::{LOAD, MOST_BYTES, SAVE};
use gmhm::link::{Origin, Refusal, Request};

use super::client::Client;
use super::error::DeviceError;
use super::flash::{Flashed, check, put_on_trial, read_back};

/// The command that puts a block in force.
const TRY: u8 = Request::Try.command();

/// Puts a block in force, in RAM only, and reads it back. It gets the sequence number after that of the newest stored block; one that is on trial makes way for it.
///
/// # Errors
/// [`DeviceError`]: a drive whose compensation is on, or that is of another gear or arithmetic, refuses.
pub fn try_out(
    block: &[u8],
    drive: &mut Client,
    mut progress: impl FnMut(usize, usize),
) -> Result<Flashed, DeviceError> {
    let header = *verify(block)?.header();
    check(&header, &drive.identify()?)?;
    let status = drive.status()?;
    if status.compensating {
        return Err(DeviceError::Refused { command: TRY, refused: Refusal::Compensating.into() });
    }
    if status.origin == Origin::Trial {
        drive.tell(&Request::Revert)?;
    }
    let mut stamped = block.to_vec();
    block::stamp(&mut stamped, gmhm::store::next_sequence(status.stored_sequence))?;
    put_on_trial(&stamped, drive, &mut progress)?;
    read_back(&stamped, drive, &mut progress)
}

/// Stores what is on trial: its sequence number and CRC-32.
///
/// # Errors
/// [`DeviceError`]: nothing is on trial, or the drive is enabled.
pub fn commit(drive: &mut Client) -> Result<(u32, u32), DeviceError> {
    drive.identify()?;
    let crc = drive.status()?.crc;
    drive.store(&Request::Commit { signature: SAVE, crc })
}

/// Erases the newest stored block and puts the one before it in force: its sequence number and CRC-32.
///
/// # Errors
/// [`DeviceError`]: there is none before it, something is on trial, the compensation is on, or the drive is enabled.
pub fn roll_back(drive: &mut Client) -> Result<(u32, u32), DeviceError> {
    drive.identify()?;
    let sequence = drive.status()?.stored_sequence;
    drive.store(&Request::RollBack { signature: LOAD, sequence })
}

/// The block in force.
///
/// # Errors
/// [`DeviceError`]: nothing is in force, or what was read is no block.
pub fn in_force(drive: &mut Client) -> Result<Vec<u8>, DeviceError> {
    let length = drive.status()?.length as usize;
    if length == 0 {
        let refused = Refusal::NoParameters.into();
        return Err(DeviceError::Refused { command: Request::Read { offset: 0, length: 0 }.command(), refused });
    }
    let mut bytes = Vec::with_capacity(length);
    while bytes.len() < length {
        let part = (length - bytes.len()).min(MOST_BYTES) as u8;
        bytes.extend(drive.read(bytes.len() as u32, part)?);
    }
    verify(&bytes)?;
    Ok(bytes)
}
