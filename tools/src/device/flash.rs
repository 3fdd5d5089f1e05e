//! A block into a drive: staged, tried, stored, read back, compared.

use gmhm::block::{self, Header, Identity, verify};
use gmhm::link::message::{MOST_BYTES, SAVE};
use gmhm::link::{Identified, Origin, Request};

use super::client::Client;
use super::error::DeviceError;

/// How often a broken line is tried again.
const ATTEMPTS: usize = 3;

/// What a drive holds after a block was flashed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Flashed {
    /// The bytes that were read back: those of the block, its sequence number that of the drive.
    pub bytes: Vec<u8>,
    /// That sequence number.
    pub sequence: u32,
    /// The CRC-32 of the bytes.
    pub crc: u32,
}

/// Flashes a block: `open` gives a client on a line to the drive, `progress` hears how many bytes of how many have gone either way.
///
/// Where the line breaks, everything is started over, on a line opened anew. The drive keeps what it had until the whole block is stored.
///
/// # Errors
/// [`DeviceError`]: no line, a drive that does not answer, refuses or reads back otherwise.
pub fn flash(
    block: &[u8],
    mut open: impl FnMut() -> Result<Client, DeviceError>,
    mut progress: impl FnMut(usize, usize),
) -> Result<Flashed, DeviceError> {
    verify(block)?;
    let mut past = Past::default();
    for _ in 1..ATTEMPTS {
        match attempt(block, &mut open()?, &mut past, &mut progress) {
            Err(error) if error.is_of_the_line() => {}
            done => return done,
        }
    }
    attempt(block, &mut open()?, &mut past, &mut progress)
}

/// What broken attempts have left behind.
#[derive(Debug, Default)]
struct Past {
    /// The block as it was to be stored: if its answer was all that got lost, the drive has it.
    sent: Option<Vec<u8>>,
    /// Whether the compensation was on before.
    was_compensating: bool,
}

fn attempt(
    block: &[u8],
    drive: &mut Client,
    past: &mut Past,
    progress: &mut impl FnMut(usize, usize),
) -> Result<Flashed, DeviceError> {
    let identified = drive.identify()?;
    let status = drive.status()?;
    let sent = past.sent.as_deref().and_then(|sent| verify(sent).ok());
    let has_it = status.origin == Origin::Stored && sent.is_some_and(|sent| sent.crc() == status.crc);
    let stamped = if has_it {
        past.sent.take().unwrap_or_default()
    } else {
        if status.enabled {
            return Err(DeviceError::Enabled);
        }
        check(verify(block)?.header(), &identified)?;
        if status.compensating {
            past.was_compensating = true;
            // The drive is not enabled: no torque changes by this.
            drive.tell(&Request::Compensate { on: false })?;
        }
        if status.origin == Origin::Trial {
            drive.tell(&Request::Revert)?;
        }
        let mut stamped = block.to_vec();
        block::stamp(&mut stamped, gmhm::store::next_sequence(status.stored_sequence))?;
        let stored = store(&stamped, drive, progress, &mut past.sent);
        if let Err(error) = stored {
            if past.was_compensating && !error.is_of_the_line() {
                // Why the block was not stored is the better answer if this is refused, too.
                let _ = drive.tell(&Request::Compensate { on: true });
            }
            return Err(error);
        }
        stamped
    };
    if past.was_compensating {
        drive.tell(&Request::Compensate { on: true })?;
    }
    read_back(&stamped, drive, progress)
}

/// What the drive would refuse, before anything is sent.
pub(super) fn check(block: &Header, drive: &Identified) -> Result<(), DeviceError> {
    if drive.gear != Identity::NONE && block.identity != drive.gear {
        return Err(DeviceError::OtherGear { block: block.identity, drive: drive.gear });
    }
    if block.scalar != drive.scalar {
        return Err(DeviceError::OtherScalar { block: block.scalar.name(), drive: drive.scalar.name() });
    }
    if block.length > drive.room {
        return Err(DeviceError::TooLarge { what: "bytes", needed: block.length, room: drive.room });
    }
    let (needed, room) = (u32::from(block.stack_depth), u32::from(drive.stack_depth));
    if needed > room {
        return Err(DeviceError::TooLarge { what: "turning points", needed, room });
    }
    Ok(())
}

fn store(
    stamped: &[u8],
    drive: &mut Client,
    progress: &mut impl FnMut(usize, usize),
    sent: &mut Option<Vec<u8>>,
) -> Result<(), DeviceError> {
    put_on_trial(stamped, drive, progress)?;
    let crc = verify(stamped)?.crc();
    *sent = Some(stamped.to_vec());
    match drive.tell(&Request::Commit { signature: SAVE, crc }) {
        Err(error) if !error.is_of_the_line() => {
            // What could not be stored does not stay in force either.
            drive.tell(&Request::Revert)?;
            Err(error)
        }
        done => done,
    }
}

/// Stages a block and puts it in force, in RAM.
pub(super) fn put_on_trial(
    stamped: &[u8],
    drive: &mut Client,
    progress: &mut impl FnMut(usize, usize),
) -> Result<(), DeviceError> {
    drive.tell(&Request::Stage { length: stamped.len() as u32, crc: verify(stamped)?.crc() })?;
    let mut offset = 0;
    for bytes in stamped.chunks(MOST_BYTES) {
        drive.tell(&Request::Data { offset: offset as u32, bytes })?;
        offset += bytes.len();
        progress(offset, 2 * stamped.len());
    }
    drive.tell(&Request::Try)
}

/// Reads what is in force and compares it with what was sent.
pub(super) fn read_back(
    stamped: &[u8],
    drive: &mut Client,
    progress: &mut impl FnMut(usize, usize),
) -> Result<Flashed, DeviceError> {
    let mut bytes = Vec::with_capacity(stamped.len());
    for part in stamped.chunks(MOST_BYTES) {
        bytes.extend(drive.read(bytes.len() as u32, part.len() as u8)?);
        progress(stamped.len() + bytes.len(), 2 * stamped.len());
    }
    compared(stamped, bytes)
}

/// What was read back, if it is what was sent.
pub(super) fn compared(stamped: &[u8], bytes: Vec<u8>) -> Result<Flashed, DeviceError> {
    let differing = stamped.iter().zip(&bytes).position(|(sent, found)| sent != found);
    if let Some(offset) = differing {
        return Err(DeviceError::ReadBack { offset, expected: stamped[offset], found: bytes[offset] });
    }
    let header = *verify(&bytes)?.header();
    Ok(Flashed { sequence: header.sequence, crc: verify(&bytes)?.crc(), bytes })
}
