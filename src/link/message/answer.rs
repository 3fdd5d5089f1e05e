//! What a drive answers.

use super::super::adaptation::Adapted;
use super::super::frame::{self, Frame, LineCounts};
use super::super::refusal::{Refusal, Refused};
use super::coding::{Encoder, Fields};
use super::{ANSWER, Identified, LinkDiagnostics, Live, Origin, Status, Tag, VERSION};
use crate::block::{Identity, ScalarKind};
use crate::diagnostics::{Diagnostics, Fault, SelfTest};

/// What a drive answers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Answer<'a> {
    /// To [`Request::Identify`](super::Request::Identify).
    Identified(Identified),
    /// To [`Request::Status`](super::Request::Status).
    Status(Status),
    /// To [`Request::Read`](super::Request::Read).
    Bytes {
        /// The place of the first in the block.
        offset: u32,
        /// The bytes.
        bytes: &'a [u8],
    },
    /// To [`Request::Live`](super::Request::Live).
    Live(Live),
    /// To [`Request::Commit`](super::Request::Commit) and [`Request::RollBack`](super::Request::RollBack): the newest stored block from here on, stored and read back.
    Stored {
        /// Its sequence number.
        sequence: u32,
        /// Its CRC-32.
        crc: u32,
    },
    /// To [`Request::Diagnostics`](super::Request::Diagnostics).
    Diagnostics(LinkDiagnostics),
    /// To [`Request::Adaptation`](super::Request::Adaptation).
    Adaptation(Adapted),
    /// To everything else.
    Done,
    /// Refused. Nothing has changed, but for [`Refusal::Flash`] and [`Refusal::ReadBack`]: then the store holds what it held or what it was to hold, whole.
    Refused(Refused),
}

impl<'a> Answer<'a> {
    /// The frame of an answer to a request.
    #[must_use]
    pub fn encode(&self, command: u8, tag: Tag) -> Frame {
        let mut encoder = Encoder::new(command | ANSWER, tag);
        match *self {
            Self::Refused(Refused { refusal, detail }) => encoder.u8(refusal.number()).u16(detail).end(),
            _ => encoder.u8(0).u16(0).end(),
        }
        match *self {
            Self::Refused(_) | Self::Done => {}
            Self::Identified(it) => encoder
                .u32(it.session)
                .bytes(it.gear.bytes())
                .u32(it.room)
                .u16(it.format_version)
                .bytes(&it.scalar.bytes())
                .u16(it.stack_depth)
                .u8(u8::from(it.challenge.is_some()))
                .bytes(&it.challenge.unwrap_or_default())
                .end(),
            Self::Status(it) => encoder
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
            Self::Bytes { offset, bytes } => encoder.u32(offset).bytes(bytes).end(),
            Self::Live(it) => encoder
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
            Self::Stored { sequence, crc } => encoder.u32(sequence).u32(crc).end(),
            Self::Adaptation(it) => encoder
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
                encoder
                    .bytes(counters.map(u32::to_le_bytes).as_flattened())
                    .u8(it.joint.last.number())
                    .u8(it.joint.self_test.number())
                    .bytes(others.map(u32::to_le_bytes).as_flattened())
                    .u32(it.bound.to_bits())
                    .end();
            }
        }
        frame::encode(&encoder.body)
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
            read(&mut fields, command)?
        } else {
            Self::Refused(Refused { refusal: Refusal::of_number(refusal)?, detail })
        };
        fields.0.is_empty().then_some((command, tag, answer))
    }
}

/// What the fields of an answer to a command say.
fn read<'a>(fields: &mut Fields<'a>, command: u8) -> Option<Answer<'a>> {
    Some(match command {
        1 => Answer::Identified(Identified {
            session: fields.u32()?,
            gear: Identity::of_bytes(fields.chunk()?)?,
            room: fields.u32()?,
            format_version: fields.u16()?,
            scalar: ScalarKind::of(fields.chunk()?)?,
            stack_depth: fields.u16()?,
            challenge: {
                let is_locked = fields.bool()?;
                let challenge = fields.chunk()?;
                is_locked.then_some(challenge)
            },
        }),
        2 => Answer::Status(Status {
            origin: match fields.u8()? {
                0 => Origin::Nowhere,
                1 => Origin::Stored,
                2 => Origin::Trial,
                _ => return None,
            },
            sequence: fields.u32()?,
            crc: fields.u32()?,
            length: fields.u32()?,
            stored_sequence: fields.u32()?,
            boot_error: fields.u16()?,
            enabled: fields.bool()?,
            compensating: fields.bool()?,
            gain_ratio: fields.f32()?,
        }),
        3 => Answer::Bytes { offset: fields.u32()?, bytes: fields.rest()? },
        4 => Answer::Live(Live {
            deflection_rad: fields.f32()?,
            torque_nm: fields.f32()?,
            hysteresis_nm: fields.f32()?,
            words: [fields.u32()?, fields.u32()?],
            contribution_nm: fields.f32()?,
            out_of_range: fields.bool()?,
            refused: fields.bool()?,
            ticks: fields.u32()?,
            loop_cost: fields.u32()?,
        }),
        9 | 10 => Answer::Stored { sequence: fields.u32()?, crc: fields.u32()? },
        13 => {
            let [refused, out_of_range, quarantined] = [fields.u32()?, fields.u32()?, fields.u32()?];
            let [restarted, saturated, merged_pairs] = [fields.u32()?, fields.u32()?, fields.u32()?];
            let (last, self_test) = (Fault::of_number(fields.u8()?)?, SelfTest::of_number(fields.u8()?)?);
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
                line: LineCounts { frames: fields.u32()?, bad_checksums: fields.u32()?, malformed: fields.u32()? },
                refused_requests: fields.u32()?,
                expired_trials: fields.u32()?,
                bound: fields.f32()?,
            })
        }
        17 => Answer::Adaptation(Adapted {
            taken_over: fields.bool()?,
            warnings: fields.u16()?,
            stretches: fields.u32()?,
            in_force: fields.five()?,
            shadow: fields.five()?,
            deviations: fields.five()?,
        }),
        5..=8 | 11 | 12 | 14..=16 | 18 => Answer::Done,
        _ => return None,
    })
}
