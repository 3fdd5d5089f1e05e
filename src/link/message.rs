//! Requests and answers, and their bodies.

use super::adaptation::Adapted;
use super::frame::{self, Body, Frame, LineCounts};
use super::refusal::{Refusal, Refused};
use crate::block::{Identity, ScalarKind};
use crate::diagnostics::{Diagnostics, Fault, SelfTest};

/// The version of the protocol, the first byte of every body.
pub const VERSION: u8 = 1;

/// The most bytes of a block in one [`Request::Data`] or [`Answer::Bytes`].
pub const MOST_BYTES: usize = 128;

/// What [`Request::Commit`] must carry: "save", as object 1010h of CANopen.
pub const SAVE: u32 = u32::from_le_bytes(*b"save");

/// What [`Request::RollBack`] must carry: "load", as object 1011h of CANopen.
pub const LOAD: u32 = u32::from_le_bytes(*b"load");

/// What [`Request::EraseUnreadable`] must carry: "eras".
pub const ERASE: u32 = u32::from_le_bytes(*b"eras");

/// Bytes of a proof at the end of a body: see `docs/link.md`, access.
pub const PROOF_BYTES: usize = 16;

// The longest bodies: version, command, tag, refusal, detail, offset, bytes; version, command, tag, offset, bytes, proof.
const _: () = assert!(2 + 8 + 3 + 4 + MOST_BYTES <= frame::MOST_BODY);
const _: () = assert!(2 + 8 + 4 + MOST_BYTES + PROOF_BYTES <= frame::MOST_BODY);

/// Set in the command of an answer, so that a line which echoes is not taken for a drive.
const ANSWER: u8 = 0x80;

/// Set in the command of a request whose body ends with a proof.
const PROVEN: u8 = 0x40;

/// Which request this is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tag {
    /// The session, as [`Identified::session`] has opened it. Free in requests that change nothing.
    pub session: u32,
    /// Its turn among the session's requests that change something: 0, 1, 2, … Free in the others.
    pub turn: u32,
}

/// What a host asks of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Request<'a> {
    /// Who are you? Opens a session; what was staged is forgotten.
    Identify,
    /// What is in force?
    Status,
    /// Bytes of the block in force.
    Read {
        /// The first.
        offset: u32,
        /// How many, at most [`MOST_BYTES`].
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
        /// At most [`MOST_BYTES`].
        bytes: &'a [u8],
    },
    /// Put the staged block in force, in RAM only.
    Try,
    /// Put the stored block in force again.
    Revert,
    /// Store what is on trial.
    Commit {
        /// [`SAVE`].
        signature: u32,
        /// The CRC-32 of the block meant.
        crc: u32,
    },
    /// Erase the newest stored block and put the one before it in force.
    RollBack {
        /// [`LOAD`].
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
    /// [`DEFAULT_BOUND`](super::server::DEFAULT_BOUND).
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
        /// [`ERASE`].
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

    /// Its frame. Bytes beyond [`MOST_BYTES`] are left out.
    #[must_use]
    pub fn encode(&self, tag: Tag) -> Frame {
        frame::encode(&self.body(self.command(), tag))
    }

    /// Its frame with the proof that the host knows the key of a drive with this challenge.
    #[cfg(feature = "lock")]
    #[must_use]
    pub fn encode_proven(&self, tag: Tag, key: &super::lock::Key, challenge: &[u8; PROOF_BYTES]) -> Frame {
        let mut body = self.body(self.command() | PROVEN, tag);
        let proof = key.prove(challenge, &body);
        // There is room: the longest body was counted with it.
        let _ = body.extend_from_slice(&proof);
        frame::encode(&body)
    }

    fn body(&self, command: u8, tag: Tag) -> Body {
        let mut pen = Pen::new(command, tag);
        match *self {
            Self::Identify | Self::Status | Self::Live | Self::Try | Self::Revert => {}
            Self::Diagnostics | Self::ClearDiagnostics | Self::Close | Self::Adaptation => {}
            Self::Read { offset, length } => pen.u32(offset).u8(length).end(),
            Self::Stage { length, crc } => pen.u32(length).u32(crc).end(),
            Self::Data { offset, bytes } => pen.u32(offset).bytes(bytes).end(),
            Self::Commit { signature, crc } => pen.u32(signature).u32(crc).end(),
            Self::RollBack { signature, sequence } => pen.u32(signature).u32(sequence).end(),
            Self::EraseUnreadable { signature } => pen.u32(signature).end(),
            Self::Compensate { on } => pen.u8(u8::from(on)).end(),
            Self::Gain { ratio } | Self::Bound { share: ratio } => pen.u32(ratio.to_bits()).end(),
        }
        pen.body
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
            1..=18 => fields.request(command).filter(|_| fields.0.is_empty()).ok_or(Refusal::Payload),
            _ => Err(Refusal::Command),
        };
        Some((command, tag, request))
    }
}

/// A request as it comes to a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// Where the parameters in force come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Origin {
    /// There are none.
    #[default]
    Nowhere,
    /// From flash.
    Stored,
    /// They are on trial.
    Trial,
}

/// Who a drive is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Identified {
    /// The session that is open from here on.
    pub session: u32,
    /// The gear that it accepts blocks for; none where it accepts any.
    pub gear: Identity,
    /// The most bytes of a block.
    pub room: u32,
    /// The newest format of blocks that it reads.
    pub format_version: u16,
    /// The arithmetic that it computes in.
    pub scalar: ScalarKind,
    /// Turning points that it has room for.
    pub stack_depth: u16,
    /// What proofs of this session are made with; `None` where the drive is open to anyone.
    pub challenge: Option<[u8; PROOF_BYTES]>,
}

/// What is in force.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Status {
    /// Where it comes from.
    pub origin: Origin,
    /// Sequence number of its block; 0 where nothing is in force.
    pub sequence: u32,
    /// CRC-32 of its block.
    pub crc: u32,
    /// Bytes of its block.
    pub length: u32,
    /// Sequence number of the newest stored block; 0 where there is none.
    pub stored_sequence: u32,
    /// Why the newest stored block could not be loaded at boot, [`BlockError::code`](crate::block::BlockError::code); 0 where it could.
    pub boot_error: u16,
    /// Whether the drive is enabled.
    pub enabled: bool,
    /// Whether the compensation is on.
    pub compensating: bool,
    /// The gain ratio.
    pub gain_ratio: f32,
}

/// What a drive measures and computes, SI units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Live {
    /// θ, rad.
    pub deflection_rad: f32,
    /// T, N·m.
    pub torque_nm: f32,
    /// z, N·m.
    pub hysteresis_nm: f32,
    /// T and z as the drive's arithmetic holds them: the bits of an `f32`, or the word of a fixed-point number.
    pub words: [u32; 2],
    /// What the compensation adds to the command, N·m.
    pub contribution_nm: f32,
    /// Whether the deflection lies outside ±A.
    pub out_of_range: bool,
    /// Whether the last sample was refused.
    pub refused: bool,
    /// Control periods so far; wraps.
    pub ticks: u32,
    /// What the last one took, in counts of the drive's own clock.
    pub loop_cost: u32,
}

/// What has gone wrong since power-up or since it was cleared.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LinkDiagnostics {
    /// On the control path.
    pub joint: Diagnostics,
    /// On the line.
    pub line: LineCounts,
    /// Requests that were refused.
    pub refused_requests: u32,
    /// Trials that ended because their host was gone.
    pub expired_trials: u32,
    /// The bound of live changes, [`Request::Bound`].
    pub bound: f32,
}

/// What a drive answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Answer<'a> {
    /// To [`Request::Identify`].
    Identified(Identified),
    /// To [`Request::Status`].
    Status(Status),
    /// To [`Request::Read`].
    Bytes {
        /// The place of the first in the block.
        offset: u32,
        /// The bytes.
        bytes: &'a [u8],
    },
    /// To [`Request::Live`].
    Live(Live),
    /// To [`Request::Commit`] and [`Request::RollBack`]: the newest stored block from here on, stored and read back.
    Stored {
        /// Its sequence number.
        sequence: u32,
        /// Its CRC-32.
        crc: u32,
    },
    /// To [`Request::Diagnostics`].
    Diagnostics(LinkDiagnostics),
    /// To [`Request::Adaptation`].
    Adaptation(Adapted),
    /// To everything else.
    Done,
    /// Refused. Nothing has changed, but for [`Refusal::Flash`] and [`Refusal::ReadBack`]: then the store holds what it held or what it was to hold, whole.
    Refused(Refused),
}

impl<'a> Answer<'a> {
    /// The frame of an answer to a request.
    pub fn encode(&self, command: u8, tag: Tag) -> Frame {
        let mut pen = Pen::new(command | ANSWER, tag);
        match *self {
            Self::Refused(Refused { refusal, detail }) => pen.u8(refusal.number()).u16(detail).end(),
            _ => pen.u8(0).u16(0).end(),
        }
        match *self {
            Self::Refused(_) | Self::Done => {}
            Self::Identified(it) => pen
                .u32(it.session)
                .bytes(it.gear.bytes())
                .u32(it.room)
                .u16(it.format_version)
                .bytes(&it.scalar.bytes())
                .u16(it.stack_depth)
                .u8(u8::from(it.challenge.is_some()))
                .bytes(&it.challenge.unwrap_or_default())
                .end(),
            Self::Status(it) => pen
                .u8(it.origin as u8)
                .u32(it.sequence)
                .u32(it.crc)
                .u32(it.length)
                .u32(it.stored_sequence)
                .u16(it.boot_error)
                .u8(u8::from(it.enabled))
                .u8(u8::from(it.compensating))
                .u32(it.gain_ratio.to_bits())
                .end(),
            Self::Bytes { offset, bytes } => pen.u32(offset).bytes(bytes).end(),
            Self::Live(it) => pen
                .u32(it.deflection_rad.to_bits())
                .u32(it.torque_nm.to_bits())
                .u32(it.hysteresis_nm.to_bits())
                .bytes(it.words.map(u32::to_le_bytes).as_flattened())
                .u32(it.contribution_nm.to_bits())
                .u8(u8::from(it.out_of_range))
                .u8(u8::from(it.refused))
                .u32(it.ticks)
                .u32(it.loop_cost)
                .end(),
            Self::Stored { sequence, crc } => pen.u32(sequence).u32(crc).end(),
            Self::Adaptation(it) => pen
                .u8(u8::from(it.taken_over))
                .u16(it.warnings)
                .u32(it.stretches)
                .bytes(
                    [it.in_force, it.shadow, it.deviations]
                        .map(|five| five.map(f32::to_le_bytes))
                        .as_flattened()
                        .as_flattened(),
                )
                .end(),
            Self::Diagnostics(it) => {
                let Diagnostics { refused, out_of_range, quarantined, restarted, saturated, merged_pairs, .. } =
                    it.joint;
                let counters = [refused, out_of_range, quarantined, restarted, saturated, merged_pairs];
                let LineCounts { frames, bad_checksums, malformed } = it.line;
                let others = [frames, bad_checksums, malformed, it.refused_requests, it.expired_trials];
                pen.bytes(counters.map(u32::to_le_bytes).as_flattened())
                    .u8(it.joint.last.number())
                    .u8(it.joint.self_test.number())
                    .bytes(others.map(u32::to_le_bytes).as_flattened())
                    .u32(it.bound.to_bits())
                    .end();
            }
        }
        frame::encode(&pen.body)
    }

    /// The answer of a body to a request: the command, its tag, the answer. `None` where it is none.
    #[must_use]
    pub fn decode(body: &'a [u8]) -> Option<(u8, Tag, Self)> {
        let mut fields = Fields(body);
        let (version, command, tag) = (fields.u8()?, fields.u8()?, fields.tag()?);
        if version != VERSION || command & ANSWER == 0 {
            return None;
        }
        let (command, refusal, detail) = (command & !ANSWER, fields.u8()?, fields.u16()?);
        let answer = if refusal == 0 {
            fields.answer(command)?
        } else {
            Self::Refused(Refused { refusal: Refusal::of_number(refusal)?, detail })
        };
        fields.0.is_empty().then_some((command, tag, answer))
    }
}

/// Writes a body.
struct Pen {
    body: Body,
}

impl Pen {
    fn new(command: u8, tag: Tag) -> Self {
        let mut pen = Self { body: Body::new() };
        pen.u8(VERSION).u8(command).u32(tag.session).u32(tag.turn).end();
        pen
    }

    fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        // There is room: no fixed part is longer than what a body has beside its most bytes.
        let _ = self.body.extend_from_slice(bytes.get(..bytes.len().min(MOST_BYTES)).unwrap_or(&[]));
        self
    }

    fn u8(&mut self, x: u8) -> &mut Self {
        self.bytes(&[x])
    }

    fn u16(&mut self, x: u16) -> &mut Self {
        self.bytes(&x.to_le_bytes())
    }

    fn u32(&mut self, x: u32) -> &mut Self {
        self.bytes(&x.to_le_bytes())
    }

    fn end(&mut self) {}
}

/// Reads a body.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn chunk<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (chunk, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*chunk)
    }

    fn rest(&mut self) -> Option<&'a [u8]> {
        let rest = core::mem::take(&mut self.0);
        (rest.len() <= MOST_BYTES).then_some(rest)
    }

    fn u8(&mut self) -> Option<u8> {
        self.chunk().map(u8::from_le_bytes)
    }

    fn u16(&mut self) -> Option<u16> {
        self.chunk().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.chunk().map(u32::from_le_bytes)
    }

    fn f32(&mut self) -> Option<f32> {
        self.u32().map(f32::from_bits)
    }

    fn five(&mut self) -> Option<[f32; 5]> {
        Some([self.f32()?, self.f32()?, self.f32()?, self.f32()?, self.f32()?])
    }

    fn bool(&mut self) -> Option<bool> {
        match self.u8()? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }

    fn tag(&mut self) -> Option<Tag> {
        Some(Tag { session: self.u32()?, turn: self.u32()? })
    }

    fn request(&mut self, command: u8) -> Option<Request<'a>> {
        Some(match command {
            1 => Request::Identify,
            2 => Request::Status,
            3 => Request::Read { offset: self.u32()?, length: self.u8()? },
            4 => Request::Live,
            5 => Request::Stage { length: self.u32()?, crc: self.u32()? },
            6 => Request::Data { offset: self.u32()?, bytes: self.rest()? },
            7 => Request::Try,
            8 => Request::Revert,
            9 => Request::Commit { signature: self.u32()?, crc: self.u32()? },
            10 => Request::RollBack { signature: self.u32()?, sequence: self.u32()? },
            11 => Request::Compensate { on: self.bool()? },
            12 => Request::Gain { ratio: self.f32()? },
            13 => Request::Diagnostics,
            14 => Request::ClearDiagnostics,
            15 => Request::Bound { share: self.f32()? },
            16 => Request::Close,
            17 => Request::Adaptation,
            18 => Request::EraseUnreadable { signature: self.u32()? },
            _ => return None,
        })
    }

    fn answer(&mut self, command: u8) -> Option<Answer<'a>> {
        Some(match command {
            1 => Answer::Identified(Identified {
                session: self.u32()?,
                gear: Identity::of_bytes(self.chunk()?)?,
                room: self.u32()?,
                format_version: self.u16()?,
                scalar: ScalarKind::of(self.chunk()?)?,
                stack_depth: self.u16()?,
                challenge: {
                    let is_locked = self.bool()?;
                    let challenge = self.chunk()?;
                    is_locked.then_some(challenge)
                },
            }),
            2 => Answer::Status(Status {
                origin: match self.u8()? {
                    0 => Origin::Nowhere,
                    1 => Origin::Stored,
                    2 => Origin::Trial,
                    _ => return None,
                },
                sequence: self.u32()?,
                crc: self.u32()?,
                length: self.u32()?,
                stored_sequence: self.u32()?,
                boot_error: self.u16()?,
                enabled: self.bool()?,
                compensating: self.bool()?,
                gain_ratio: self.f32()?,
            }),
            3 => Answer::Bytes { offset: self.u32()?, bytes: self.rest()? },
            4 => Answer::Live(Live {
                deflection_rad: self.f32()?,
                torque_nm: self.f32()?,
                hysteresis_nm: self.f32()?,
                words: [self.u32()?, self.u32()?],
                contribution_nm: self.f32()?,
                out_of_range: self.bool()?,
                refused: self.bool()?,
                ticks: self.u32()?,
                loop_cost: self.u32()?,
            }),
            9 | 10 => Answer::Stored { sequence: self.u32()?, crc: self.u32()? },
            13 => {
                let [refused, out_of_range, quarantined] = [self.u32()?, self.u32()?, self.u32()?];
                let [restarted, saturated, merged_pairs] = [self.u32()?, self.u32()?, self.u32()?];
                let (last, self_test) = (Fault::of_number(self.u8()?)?, SelfTest::of_number(self.u8()?)?);
                Answer::Diagnostics(LinkDiagnostics {
                    joint: Diagnostics {
                        refused,
                        out_of_range,
                        quarantined,
                        restarted,
                        saturated,
                        merged_pairs,
                        last,
                        self_test,
                    },
                    line: LineCounts { frames: self.u32()?, bad_checksums: self.u32()?, malformed: self.u32()? },
                    refused_requests: self.u32()?,
                    expired_trials: self.u32()?,
                    bound: self.f32()?,
                })
            }
            17 => Answer::Adaptation(Adapted {
                taken_over: self.bool()?,
                warnings: self.u16()?,
                stretches: self.u32()?,
                in_force: self.five()?,
                shadow: self.five()?,
                deviations: self.five()?,
            }),
            5..=8 | 11 | 12 | 14..=16 | 18 => Answer::Done,
            _ => return None,
        })
    }
}
