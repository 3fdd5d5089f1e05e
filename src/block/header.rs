//! The header: 48 bytes, little-endian.

use core::fmt;

use super::error::BlockError;
use super::utf8::is_padded_utf8;
use super::{ScalarKind, crc32};

/// The first four bytes.
pub const MAGIC: [u8; 4] = *b"GMHM";
/// The format that this crate writes, and the only one it reads.
pub const FORMAT_VERSION: u16 = 1;
/// Bytes of the header.
pub const HEADER_BYTES: usize = 48;
/// Offset of the sequence number.
pub(super) const SEQUENCE_AT: usize = 12;

/// Which gear a block is for: up to 16 bytes of UTF-8, zero-padded. Empty is no identity.
#[derive(Clone, Copy, PartialEq, Eq, Default, Hash)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Identity([u8; 16]);

impl Identity {
    /// No identity.
    pub const NONE: Self = Self([0; 16]);

    /// The identity of a label; `None` where it has more than 16 bytes or a zero byte.
    #[must_use]
    pub fn new(label: &str) -> Option<Self> {
        let mut bytes = [0; 16];
        bytes.get_mut(..label.len())?.copy_from_slice(label.as_bytes());
        (!label.as_bytes().contains(&0)).then_some(Self(bytes))
    }

    /// The identity of a gear by its name, however long: the name itself where it fits, else as much of it as goes into 7 bytes, `~` and the CRC-32
    /// of the name in 8 hexadecimal digits.
    #[must_use]
    pub fn of_name(name: &str) -> Self {
        if let Some(whole) = Self::new(name) {
            return whole;
        }
        let mut length = 7.min(name.len());
        while !name.is_char_boundary(length) {
            length -= 1;
        }
        let shown = name.get(..length).unwrap_or_default().bytes().map(|byte| if byte == 0 { b' ' } else { byte });
        let crc = crc32(name.as_bytes());
        let digits = (0..8).rev().map(|digit| {
            let value = (crc >> (4 * digit)) as u8 & 0xf;
            if value < 10 { b'0' + value } else { b'a' + value - 10 }
        });
        let mut bytes = [0; 16];
        bytes.iter_mut().zip(shown.chain([b'~']).chain(digits)).for_each(|(to, from)| *to = from);
        Self(bytes)
    }

    /// The identity of 16 bytes; `None` where they are no zero-padded UTF-8.
    #[must_use]
    pub fn of_bytes(bytes: [u8; 16]) -> Option<Self> {
        is_padded_utf8(&bytes).then_some(Self(bytes))
    }

    /// Its bytes.
    #[must_use]
    pub const fn bytes(&self) -> &[u8; 16] {
        &self.0
    }

    /// Its label.
    #[must_use]
    pub fn label(&self) -> &str {
        let length = self.0.iter().position(|b| *b == 0).unwrap_or(16);
        self.0.get(..length).and_then(|label| core::str::from_utf8(label).ok()).unwrap_or("")
    }
}

impl fmt::Debug for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.label())
    }
}

/// What torques are counted in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TorqueUnit {
    /// N·m.
    #[default]
    NewtonMetre,
    /// Amperes of motor current; "N·m" then reads "A" in every unit.
    Ampere,
}

/// The header of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Header {
    /// All bytes of the block, header and CRC-32 included.
    pub length: u32,
    /// Grows from commit to commit; the newest counts. 0 in a file that no drive has stored.
    pub sequence: u32,
    /// The gear.
    pub identity: Identity,
    /// The arithmetic of its words.
    pub scalar: ScalarKind,
    /// Turning points that law `masing` is to remember; even, at least 4.
    pub stack_depth: u16,
    /// The control period Δ that law `time` was prepared for, s; 0 where none was stated.
    pub period_s: f32,
    /// How many records follow.
    pub records: u16,
    /// What torques are counted in.
    pub torque_unit: TorqueUnit,
}

impl Header {
    /// The header of a block to be written: no sequence, 16 turning points, no control period, torques in N·m.
    #[must_use]
    pub const fn new(identity: Identity, scalar: ScalarKind) -> Self {
        Self {
            length: 0,
            sequence: 0,
            identity,
            scalar,
            stack_depth: 16,
            period_s: 0.0,
            records: 0,
            torque_unit: TorqueUnit::NewtonMetre,
        }
    }

    /// Its bytes.
    #[must_use]
    pub fn encode(&self) -> [u8; HEADER_BYTES] {
        let mut bytes = [0; HEADER_BYTES];
        let mut put = |at: usize, field: &[u8]| {
            if let Some(place) = bytes.get_mut(at..at + field.len()) {
                place.copy_from_slice(field);
            }
        };
        put(0, &MAGIC);
        put(4, &FORMAT_VERSION.to_le_bytes());
        put(6, &(HEADER_BYTES as u16).to_le_bytes());
        put(8, &self.length.to_le_bytes());
        put(SEQUENCE_AT, &self.sequence.to_le_bytes());
        put(16, self.identity.bytes());
        put(32, &self.scalar.bytes());
        put(34, &self.stack_depth.to_le_bytes());
        put(36, &self.period_s.to_bits().to_le_bytes());
        put(40, &self.records.to_le_bytes());
        put(42, &(self.torque_unit as u16).to_le_bytes());
        bytes
    }

    /// The header that bytes begin with. It is no more than that: only [`verify`](super::verify) tells whether the block behind it is whole.
    ///
    /// # Errors
    /// [`BlockError`]: too short, another magic or version, a field that cannot be.
    pub fn decode(bytes: &[u8]) -> Result<Self, BlockError> {
        let short = BlockError::Length { found: bytes.len(), expected: HEADER_BYTES };
        let bytes: &[u8; HEADER_BYTES] = bytes.first_chunk().ok_or(short)?;
        let u16_at = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let u32_at = |at: usize| u32::from(u16_at(at)) | u32::from(u16_at(at + 2)) << 16;
        if u32_at(0) != u32::from_le_bytes(MAGIC) {
            return Err(BlockError::Magic);
        }
        let version = u16_at(4);
        if version != FORMAT_VERSION {
            return Err(BlockError::Version(version));
        }
        let scalar = [bytes[32], bytes[33]];
        let identity = bytes[16..].first_chunk().copied().and_then(Identity::of_bytes);
        let header = Self {
            length: u32_at(8),
            sequence: u32_at(SEQUENCE_AT),
            identity: identity.ok_or(BlockError::Header("gear identity"))?,
            scalar: ScalarKind::of(scalar).ok_or(BlockError::Scalar(scalar))?,
            stack_depth: u16_at(34),
            period_s: f32::from_bits(u32_at(36)),
            records: u16_at(40),
            torque_unit: match u16_at(42) {
                0 => TorqueUnit::NewtonMetre,
                1 => TorqueUnit::Ampere,
                _ => return Err(BlockError::Header("torque unit")),
            },
        };
        let checks = [
            ("own length", usize::from(u16_at(6)) == HEADER_BYTES),
            ("stack depth", header.stack_depth >= 4 && header.stack_depth.is_multiple_of(2)),
            // A NaN is in no range.
            ("control period", (0.0..=crate::gear::LONGEST_PERIOD_S as f32).contains(&header.period_s)),
            ("reserved word", u32_at(44) == 0),
        ];
        match checks.iter().find(|(_, holds)| !holds) {
            Some((field, _)) => Err(BlockError::Header(field)),
            None => Ok(header),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_name_makes_an_identity_of_its_own() {
        let identity = |name| Identity::of_name(name).label().len();
        assert_eq!(Identity::of_name("joint 3").label(), "joint 3");
        assert_eq!(Identity::of_name("published gear, size 25").label().get(..8), Some("publish~"));
        assert_ne!(Identity::of_name("published gear, size 25"), Identity::of_name("published gear, size 20"));
        assert_eq!(identity("Wellgetriebe für Gelenk 3"), 16);
        // No letter is cut in two.
        assert_eq!(Identity::of_name("öööööööööö").label().get(..7), Some("ööö~"));
        assert!(Identity::of_bytes(*Identity::of_name("öööööööööö").bytes()).is_some());
        assert!(Identity::of_bytes(*Identity::of_name("a\0b").bytes()).is_some());
    }
}
