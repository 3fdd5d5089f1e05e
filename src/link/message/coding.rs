//! Numbers to the bytes of a body and back.

use super::super::frame::Body;
use super::{MOST_BYTES, Tag, VERSION};

/// Writes a body.
pub(super) struct Encoder {
    pub(super) body: Body,
}

impl Encoder {
    pub(super) fn new(command: u8, tag: Tag) -> Self {
        let mut encoder = Self { body: Body::new() };
        encoder.u8(VERSION).u8(command).u32(tag.session).u32(tag.turn).end();
        encoder
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        // There is room: no fixed part is longer than what a body has beside its most bytes.
        let _ = self.body.extend_from_slice(bytes.get(..bytes.len().min(MOST_BYTES)).unwrap_or(&[]));
        self
    }

    pub(super) fn u8(&mut self, x: u8) -> &mut Self {
        self.bytes(&[x])
    }

    pub(super) fn u16(&mut self, x: u16) -> &mut Self {
        self.bytes(&x.to_le_bytes())
    }

    pub(super) fn u32(&mut self, x: u32) -> &mut Self {
        self.bytes(&x.to_le_bytes())
    }

    pub(super) fn end(&mut self) {}
}

/// Reads a body.
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn chunk<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (chunk, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*chunk)
    }

    pub(super) fn rest(&mut self) -> Option<&'a [u8]> {
        let rest = core::mem::take(&mut self.0);
        (rest.len() <= MOST_BYTES).then_some(rest)
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.chunk().map(u8::from_le_bytes)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        self.chunk().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.chunk().map(u32::from_le_bytes)
    }

    pub(super) fn f32(&mut self) -> Option<f32> {
        self.u32().map(f32::from_bits)
    }

    pub(super) fn five(&mut self) -> Option<[f32; 5]> {
        Some([self.f32()?, self.f32()?, self.f32()?, self.f32()?, self.f32()?])
    }

    pub(super) fn bool(&mut self) -> Option<bool> {
        match self.u8()? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }

    pub(super) fn tag(&mut self) -> Option<Tag> {
        Some(Tag { session: self.u32()?, turn: self.u32()? })
    }
}
