//! Numbers out of the bytes of a file that may be damaged: whatever lies beyond its end is an error, never a panic.

use super::error::{RecordingError, RecordingProblem};

/// Why a binary file is refused.
#[derive(Debug)]
pub(super) struct Damage(pub String);

impl Damage {
    /// As the refusal of a file of a format.
    pub(super) fn of(self, file: &str, format: super::format::Format) -> RecordingError {
        RecordingError::of_file(file, RecordingProblem::Damaged { format: format.name(), why: self.0 })
    }
}

impl<E: std::error::Error> From<E> for Damage {
    fn from(error: E) -> Self {
        Damage(error.to_string())
    }
}

/// A place that moves through bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cursor<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
    pub big_endian: bool,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Cursor { bytes, at: 0, big_endian: false }
    }

    /// The same bytes from another place on.
    pub(super) fn jump(self, at: u64) -> Result<Self, Damage> {
        match usize::try_from(at).ok().filter(|at| *at <= self.bytes.len()) {
            Some(at) => Ok(Cursor { at, ..self }),
            None => Err(Damage(format!("it points to byte {at} of {}: it was cut off", self.bytes.len()))),
        }
    }

    pub(super) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], Damage> {
        if count > self.left() {
            return Err(Damage(format!("it ends at byte {}: it was cut off", self.bytes.len())));
        }
        let taken = &self.bytes[self.at..self.at + count];
        self.at += count;
        Ok(taken)
    }

    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], Damage> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub(super) fn u8(&mut self) -> Result<u8, Damage> {
        Ok(self.array::<1>()?[0])
    }

    pub(super) fn u16(&mut self) -> Result<u16, Damage> {
        let bytes = self.array()?;
        Ok(if self.big_endian { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) })
    }

    pub(super) fn u32(&mut self) -> Result<u32, Damage> {
        let bytes = self.array()?;
        Ok(if self.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    pub(super) fn u64(&mut self) -> Result<u64, Damage> {
        let bytes = self.array()?;
        Ok(if self.big_endian { u64::from_be_bytes(bytes) } else { u64::from_le_bytes(bytes) })
    }

    pub(super) fn f64(&mut self) -> Result<f64, Damage> {
        self.u64().map(f64::from_bits)
    }
}

/// How a number is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    Unsigned,
    Signed,
    Float,
}

impl Number {
    /// A number of 1 to 8 bytes, given with the least significant byte first.
    pub(super) fn of(self, bytes: &[u8]) -> f64 {
        let mut wide = [0; 8];
        wide[..bytes.len()].copy_from_slice(bytes);
        self.of_bits(u64::from_le_bytes(wide), 8 * bytes.len() as u32)
    }

    /// A number of so many bits, the others being 0. A float of neither 32 nor 64 bits is NaN.
    pub(super) fn of_bits(self, bits: u64, count: u32) -> f64 {
        match (self, count) {
            (Number::Unsigned, _) => bits as f64,
            (Number::Signed, 1..=64) => ((bits << (64 - count)) as i64 >> (64 - count)) as f64,
            (Number::Float, 32) => f64::from(f32::from_bits(bits as u32)),
            (Number::Float, 64) => f64::from_bits(bits),
            _ => f64::NAN,
        }
    }

    /// Numbers of 1 to 8 bytes each.
    pub(super) fn all(self, bytes: &[u8], size: usize, big_endian: bool) -> Vec<f64> {
        let one = |chunk: &[u8]| match big_endian {
            true => {
                let mut turned = [0; 8];
                turned[..size].iter_mut().zip(chunk.iter().rev()).for_each(|(to, from)| *to = *from);
                self.of(&turned[..size])
            }
            false => self.of(chunk),
        };
        bytes.chunks_exact(size).map(one).collect()
    }
}
