//! Frames: COBS between zero bytes, a CRC-32 at the end of each body.

use cobs::{CobsEncoder, DecodeResult, DecoderState};
use heapless::Vec;

use crate::block::crc32;

/// The most bytes of a body.
pub const MOST_BODY: usize = 164;

const CRC_BYTES: usize = 4;

/// The most bytes of a frame on the line: zero, one byte of overhead, body, CRC-32, zero.
pub const MOST_FRAME: usize = MOST_BODY + CRC_BYTES + 3;

/// The bytes of a body: a slice of them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Body(Vec<u8, MOST_BODY>);

impl Body {
    /// None yet.
    #[must_use]
    pub const fn new() -> Self {
        Self(Vec::new())
    }

    /// These bytes; `None` where there are more than [`MOST_BODY`].
    #[must_use]
    pub fn from_slice(bytes: &[u8]) -> Option<Self> {
        Vec::from_slice(bytes).ok().map(Self)
    }

    /// There is room for what is written: the longest body was counted.
    pub(crate) fn extend(&mut self, bytes: impl Iterator<Item = u8>) {
        for byte in bytes {
            let _ = self.0.push(byte);
        }
    }

    pub(crate) fn extend_from_slice(&mut self, bytes: &[u8]) -> Result<(), heapless::CapacityError> {
        self.0.extend_from_slice(bytes)
    }
}

impl core::ops::Deref for Body {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0
    }
}

/// The bytes of a frame, its zeros included: a slice of them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Frame(Vec<u8, MOST_FRAME>);

impl core::ops::Deref for Frame {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0
    }
}

/// The frame of a body of at most [`MOST_BODY`] bytes; empty for a longer one.
#[must_use]
pub fn encode(body: &[u8]) -> Frame {
    let mut frame = Frame::default();
    let mut encoded = [0; MOST_FRAME - 2];
    let mut encoder = CobsEncoder::new(&mut encoded);
    let fits =
        body.len() <= MOST_BODY && encoder.push(body).is_ok() && encoder.push(&crc32(body).to_le_bytes()).is_ok();
    let length = encoder.finalize();
    if let (true, Some(encoded)) = (fits, encoded.get(..length)) {
        // There is room: a body of less than 254 bytes has one byte of overhead.
        let _ = frame.0.push(0);
        let _ = frame.0.extend_from_slice(encoded);
        let _ = frame.0.push(0);
    }
    frame
}

/// What came over the line so far; the counters stop at `u32::MAX`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LineCounts {
    /// Bodies whose CRC-32 was right.
    pub frames: u32,
    /// Frames whose CRC-32 was wrong, or that were too short for one.
    pub bad_checksums: u32,
    /// Frames that were too long, or no COBS.
    pub malformed: u32,
}

/// Finds the bodies in what comes over the line. Whatever comes, the next zero byte begins anew.
#[derive(Debug, Default)]
pub struct Receiver {
    state: DecoderState,
    bytes: Vec<u8, { MOST_BODY + CRC_BYTES }>,
    overrun: bool,
    counts: LineCounts,
}

impl Receiver {
    /// One that has heard nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes the next byte; a body where it ends a frame whose CRC-32 is right.
    #[must_use]
    pub fn feed(&mut self, byte: u8) -> Option<&[u8]> {
        match self.state.feed(byte) {
            Ok(DecodeResult::DataStart) => {
                self.bytes.clear();
                self.overrun = false;
                None
            }
            Ok(DecodeResult::DataContinue(byte)) => {
                self.overrun |= self.bytes.push(byte).is_err();
                None
            }
            Ok(DecodeResult::DataComplete) if !self.overrun => {
                let whole = self.bytes.split_last_chunk::<CRC_BYTES>();
                let body = whole.and_then(|(body, crc)| {
                    let right = crc32(body) == u32::from_le_bytes(*crc);
                    right.then_some(body)
                });
                let counter = if body.is_some() { &mut self.counts.frames } else { &mut self.counts.bad_checksums };
                *counter = counter.saturating_add(1);
                body
            }
            Ok(DecodeResult::DataComplete) | Err(_) => {
                self.counts.malformed = self.counts.malformed.saturating_add(1);
                None
            }
            Ok(DecodeResult::NoData) => None,
        }
    }

    /// What came so far.
    #[must_use]
    pub fn counts(&self) -> LineCounts {
        self.counts
    }

    /// Counts from nothing again.
    pub fn clear_counts(&mut self) {
        self.counts = LineCounts::default();
    }
}
