//! What a host asks of a drive.

use super::super::frame::{self, Body, Frame};
use super::super::refusal::Refusal;
use super::coding::{Encoder, Fields};
use super::{ANSWER, PROOF_BYTES, PROVEN, Tag, VERSION};

/// What a host asks of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Request<'a> {
    /// Who are you? Opens a session; what was staged is forgotten.
    Identify,
    /// What is in force?
    Status,
    /// Bytes of the block in force.
    Read {
        /// The first.
        offset: u32,
        /// How many, at most [`MOST_BYTES`](super::MOST_BYTES).
        length: u8,
    },
    /// What do you measure?
    Live,
    /// A block is to come.
    Stage {
        /// Its bytes.
        length: u32,
        /// Its CRC-32.
        crc: u32,
    },
    /// The next bytes of the staged block.
    Data {
        /// The place of the first in the block.
        offset: u32,
        /// At most [`MOST_BYTES`](super::MOST_BYTES).
        bytes: &'a [u8],
    },
    /// Put the staged block in force, in RAM only.
    Try,
    /// Put the stored block in force again.
    Revert,
    /// Store what is on trial.
    Commit {
        /// [`SAVE`](super::SAVE).
        signature: u32,
        /// The CRC-32 of the block meant.
        crc: u32,
    },
    /// Erase the newest stored block and put the one before it in force.
    RollBack {
        /// [`LOAD`](super::LOAD).
        signature: u32,
        /// The sequence number of the block to erase.
        sequence: u32,
    },
    /// Switch the compensation.
    Compensate {
        /// On.
        on: bool,
    },
    /// Set the gain ratio.
    Gain {
        /// From 0 to 1.
        ratio: f32,
    },
    /// What has gone wrong so far?
    Diagnostics,
    /// Count from nothing again.
    ClearDiagnostics,
    /// Set how far parameters that come on trial while the drive is enabled may be from those in force. Only while it is disabled; power-up brings back
    /// [`DEFAULT_BOUND`](crate::link::server::DEFAULT_BOUND).
    Bound {
        /// The largest difference of torques, elastic and hysteresis, as a share of the torque in force; infinite for none. See `docs/link.md`.
        share: f32,
    },
    /// What has the adaptation learnt?
    Adaptation,
    /// End the session: another host may open one at once. A trial goes on until it expires.
    Close,
    /// Erase the slots of the flash that cannot be read: see [`Store::erase_unreadable`](crate::store::Store::erase_unreadable).
    EraseUnreadable {
        /// [`ERASE`](super::ERASE).
        signature: u32,
    },
}

impl<'a> Request<'a> {
    /// Its number.
    #[must_use]
    pub const fn command(&self) -> u8 {
        match self {
            Self::Identify => 1,
            Self::Status => 2,
            Self::Read { .. } => 3,
            Self::Live => 4,
            Self::Stage { .. } => 5,
            Self::Data { .. } => 6,
            Self::Try => 7,
            Self::Revert => 8,
            Self::Commit { .. } => 9,
            Self::RollBack { .. } => 10,
            Self::Compensate { .. } => 11,
            Self::Gain { .. } => 12,
            Self::Diagnostics => 13,
            Self::ClearDiagnostics => 14,
            Self::Bound { .. } => 15,
            Self::Close => 16,
            Self::Adaptation => 17,
            Self::EraseUnreadable { .. } => 18,
        }
    }

    /// Whether it changes anything, and so must be the session's next.
    #[must_use]
    pub const fn changes(&self) -> bool {
        !matches!(
            self,
            Self::Identify | Self::Status | Self::Read { .. } | Self::Live | Self::Diagnostics | Self::Adaptation
        )
    }

    /// Its frame. Bytes beyond [`MOST_BYTES`](super::MOST_BYTES) are left out.
    #[must_use]
    pub fn encode(&self, tag: Tag) -> Frame {
        frame::encode(&self.body(self.command(), tag))
    }

    /// Its frame with the proof that the host knows the key of a drive with this challenge.
    #[cfg(feature = "lock")]
    #[must_use]
    pub fn encode_proven(&self, tag: Tag, key: &super::super::lock::Key, challenge: &[u8; PROOF_BYTES]) -> Frame {
        let mut body = self.body(self.command() | PROVEN, tag);
        let proof = key.prove(challenge, &body);
        // There is room: the longest body was counted with it.
        let _ = body.extend_from_slice(&proof);
        frame::encode(&body)
    }

    fn body(&self, command: u8, tag: Tag) -> Body {
        let mut encoder = Encoder::new(command, tag);
        match *self {
            Self::Identify | Self::Status | Self::Live | Self::Try | Self::Revert => {}
            Self::Diagnostics | Self::ClearDiagnostics | Self::Close | Self::Adaptation => {}
            Self::Read { offset, length } => encoder.u32(offset).u8(length).end(),
            Self::Stage { length, crc } => encoder.u32(length).u32(crc).end(),
            Self::Data { offset, bytes } => encoder.u32(offset).bytes(bytes).end(),
            Self::Commit { signature, crc } => encoder.u32(signature).u32(crc).end(),
            Self::RollBack { signature, sequence } => encoder.u32(signature).u32(sequence).end(),
            Self::EraseUnreadable { signature } => encoder.u32(signature).end(),
            Self::Compensate { on } => encoder.u8(u8::from(on)).end(),
            Self::Gain { ratio } | Self::Bound { share: ratio } => encoder.u32(ratio.to_bits()).end(),
        }
        encoder.body
    }

    /// The request of a body without a proof: its command, its tag, and what it asks. `None` where it is no request at all.
    #[must_use]
    pub fn decode(body: &'a [u8]) -> Option<(u8, Tag, Result<Self, Refusal>)> {
        let mut fields = Fields(body);
        let (version, command, tag) = (fields.u8()?, fields.u8()?, fields.tag()?);
        if command & ANSWER != 0 {
            return None;
        }
        let command = command & !PROVEN;
        if version != VERSION {
            return Some((command, tag, Err(Refusal::Command)));
        }
        let request = match command {
            1..=18 => read(&mut fields, command).filter(|_| fields.0.is_empty()).ok_or(Refusal::Payload),
            _ => Err(Refusal::Command),
        };
        Some((command, tag, request))
    }
}

/// A request as it comes to a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Asked<'a> {
    /// The number of its command.
    pub command: u8,
    /// Which request it is.
    pub tag: Tag,
    /// What it asks, or why that is not understood.
    pub request: Result<Request<'a>, Refusal>,
    /// The bytes that its proof is about, and the proof.
    pub proof: Option<(&'a [u8], &'a [u8; PROOF_BYTES])>,
}

impl<'a> Asked<'a> {
    /// A request without a proof.
    #[must_use]
    pub const fn plain(request: Request<'a>, tag: Tag) -> Self {
        Self { command: request.command(), tag, request: Ok(request), proof: None }
    }

    /// The request of a body. `None` where it is no request at all.
    #[must_use]
    pub fn of_body(body: &'a [u8]) -> Option<Self> {
        let is_proven = body.get(1).is_some_and(|command| command & (ANSWER | PROVEN) == PROVEN);
        let proof = if is_proven { Some(body.split_last_chunk()?) } else { None };
        let (command, tag, request) = Request::decode(proof.map_or(body, |(body, _)| body))?;
        Some(Self { command, tag, request, proof })
    }
}

/// What the fields of a command ask.
fn read<'a>(fields: &mut Fields<'a>, command: u8) -> Option<Request<'a>> {
    Some(match command {
        1 => Request::Identify,
        2 => Request::Status,
        3 => Request::Read { offset: fields.u32()?, length: fields.u8()? },
        4 => Request::Live,
        5 => Request::Stage { length: fields.u32()?, crc: fields.u32()? },
        6 => Request::Data { offset: fields.u32()?, bytes: fields.rest()? },
        7 => Request::Try,
        8 => Request::Revert,
        9 => Request::Commit { signature: fields.u32()?, crc: fields.u32()? },
        10 => Request::RollBack { signature: fields.u32()?, sequence: fields.u32()? },
        11 => Request::Compensate { on: fields.bool()? },
        12 => Request::Gain { ratio: fields.f32()? },
        13 => Request::Diagnostics,
        14 => Request::ClearDiagnostics,
        15 => Request::Bound { share: fields.f32()? },
        16 => Request::Close,
        17 => Request::Adaptation,
        18 => Request::EraseUnreadable { signature: fields.u32()? },
        _ => return None,
    })
}
