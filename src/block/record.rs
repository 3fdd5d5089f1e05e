//! A block whose bytes are sound, and the walk over its records.

use heapless::Vec;

use super::error::BlockError;
use super::header::{HEADER_BYTES, Header};
use super::layout::{Coding, FIRST_TERM, FieldInfo, NAME, RecordInfo};
use super::{ScalarKind, Word, crc32};
use crate::scalar::Fixed;
use crate::terms::PLANT_TAGS;

/// The most bytes of a block.
pub const MOST_BYTES: usize = 4096;

/// Fields with their values: a slice of them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FieldValues(Vec<(&'static FieldInfo, f64), 32>);

impl core::ops::Deref for FieldValues {
    type Target = [(&'static FieldInfo, f64)];

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

/// A block whose header, records and CRC-32 are in order. What its values say is for [`Parameters::load`](super::Parameters::load) to check.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block<'a> {
    header: Header,
    bytes: &'a [u8],
    body: &'a [u8],
    crc: u32,
}

/// Checks the bytes of exactly one block: magic, format version, the fields of the header, length, CRC-32, and that the records fill it.
///
/// # Errors
/// [`BlockError`], whatever the bytes.
pub fn verify(bytes: &[u8]) -> Result<Block<'_>, BlockError> {
    let header = Header::decode(bytes)?;
    let expected = usize::try_from(header.length).unwrap_or(usize::MAX);
    if expected > MOST_BYTES {
        return Err(BlockError::NoRoom);
    }
    if expected != bytes.len() || expected < HEADER_BYTES + 4 {
        return Err(BlockError::Length { found: bytes.len(), expected: expected.max(HEADER_BYTES + 4) });
    }
    let (checked, crc) = bytes.split_last_chunk().ok_or(BlockError::Checksum)?;
    let crc = u32::from_le_bytes(*crc);
    if crc32(checked) != crc {
        return Err(BlockError::Checksum);
    }
    let body = checked.get(HEADER_BYTES..).ok_or(BlockError::Records)?;
    let block = Block { header, bytes, body, crc };
    let mut records = block.records();
    let count = records.by_ref().count();
    if !records.rest.is_empty() || count != usize::from(header.records) {
        return Err(BlockError::Records);
    }
    Ok(block)
}

/// [`verify`] for the block that longer bytes begin with, such as a sector of flash.
///
/// # Errors
/// As there.
pub fn verify_first(bytes: &[u8]) -> Result<Block<'_>, BlockError> {
    let length = usize::try_from(Header::decode(bytes)?.length).unwrap_or(usize::MAX);
    verify(bytes.get(..length).unwrap_or(bytes))
}

impl<'a> Block<'a> {
    /// Its header.
    #[must_use]
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// All its bytes.
    #[must_use]
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// Its CRC-32.
    #[must_use]
    pub fn crc(&self) -> u32 {
        self.crc
    }

    /// The model's name, for people; empty where there is none.
    #[must_use]
    pub fn name(&self) -> &'a str {
        let payload = self.records().find(|record| record.tag == NAME.tag).map_or(&[][..], |record| record.payload);
        let end = payload.iter().position(|byte| *byte == 0).unwrap_or(payload.len());
        payload.get(..end).and_then(|name| core::str::from_utf8(name).ok()).unwrap_or_default()
    }

    /// Its records in order.
    #[must_use]
    pub fn records(&self) -> Records<'a> {
        Records { rest: self.body }
    }

    /// The only record of its kind; `None` where there is none.
    ///
    /// # Errors
    /// There are two.
    pub fn only(&self, info: &RecordInfo) -> Result<Option<Record<'a>>, BlockError> {
        let mut same = self.records().filter(|record| record.tag == info.tag);
        let first = same.next();
        if same.next().is_some() { Err(BlockError::Twice(info.tag)) } else { Ok(first) }
    }

    /// The words of a record that must be there, each within its range.
    pub(crate) fn words<S: Word, const N: usize>(&self, info: &'static RecordInfo) -> Result<[u32; N], BlockError> {
        self.only(info)?.ok_or(BlockError::Missing(info.tag))?.checked::<S, N>(info)
    }
}

/// A record: its tag and the bytes of its words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Record<'a> {
    /// Its tag.
    pub tag: u16,
    /// Its words, little-endian.
    pub payload: &'a [u8],
}

/// The records of a block. Ends where the next one is not whole.
#[derive(Debug, Clone)]
pub struct Records<'a> {
    rest: &'a [u8],
}

impl<'a> Iterator for Records<'a> {
    type Item = Record<'a>;

    fn next(&mut self) -> Option<Record<'a>> {
        let (tag, rest) = self.rest.split_first_chunk()?;
        let (length, rest) = rest.split_first_chunk()?;
        let length = usize::from(u16::from_le_bytes(*length));
        let (payload, rest) = rest.split_at_checked(length)?;
        if !length.is_multiple_of(4) {
            return None;
        }
        self.rest = rest;
        Some(Record { tag: u16::from_le_bytes(*tag), payload })
    }
}

impl<'a> Record<'a> {
    /// Whether it is a term that a drive feeds forward.
    #[must_use]
    pub fn is_plant_term(&self) -> bool {
        let number = self.tag.checked_sub(FIRST_TERM).filter(|number| *number < 64);
        number.is_some_and(|number| PLANT_TAGS >> number & 1 == 1)
    }

    /// Its words.
    pub fn words(&self) -> impl Iterator<Item = u32> + 'a {
        self.payload.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word))
    }

    /// Its words against the ranges of its fields, `N` of them.
    pub(super) fn checked<S: Word, const N: usize>(&self, info: &'static RecordInfo) -> Result<[u32; N], BlockError> {
        if self.payload.len() != 4 * N {
            return Err(BlockError::Malformed(self.tag));
        }
        self.check::<S>(info)?;
        let mut words = [0; N];
        words.iter_mut().zip(self.words()).for_each(|(to, from)| *to = from);
        Ok(words)
    }

    /// Its words against the ranges of its fields.
    pub(super) fn check<S: Word>(&self, info: &'static RecordInfo) -> Result<(), BlockError> {
        if self.payload.len() != 4 * info.size() {
            return Err(BlockError::Malformed(self.tag));
        }
        check::<S>(info, self.words())
    }
}

impl Record<'_> {
    /// The values of its fields in order, each within its range: numbers, and the numbers of choices.
    ///
    /// # Errors
    /// Another length than the fields', a value out of range.
    pub fn values(&self, info: &'static RecordInfo, scalar: ScalarKind) -> Result<FieldValues, BlockError> {
        if self.payload.len() != 4 * info.size() {
            return Err(BlockError::Malformed(self.tag));
        }
        let mut words = self.words();
        let mut values = FieldValues::default();
        for field in info.fields {
            let first = words.next().unwrap_or_default();
            let second = if field.coding.words() == 2 { words.next().unwrap_or_default() } else { 0 };
            let value = match scalar {
                ScalarKind::F32 => value::<f32>(field, [first, second]),
                ScalarKind::Fixed => value::<Fixed>(field, [first, second]),
            };
            let out_of_range = BlockError::OutOfRange { tag: self.tag, field: field.key.name };
            // There is room: no record has more fields.
            let _ = values.0.push((field, value.ok_or(out_of_range)?));
        }
        Ok(values)
    }
}

/// Holds words against the ranges of a record's fields.
pub(super) fn check<S: Word>(info: &'static RecordInfo, mut at: impl Iterator<Item = u32>) -> Result<(), BlockError> {
    for field in info.fields {
        let first = at.next().unwrap_or_default();
        let second = if field.coding.words() == 2 { at.next().unwrap_or_default() } else { 0 };
        if !is_within::<S>(field, [first, second]) {
            return Err(BlockError::OutOfRange { tag: info.tag, field: field.key.name });
        }
    }
    Ok(())
}

/// Whether the words of a field are within its range, without arithmetic in double precision.
fn is_within<S: Word>(field: &FieldInfo, words: [u32; 2]) -> bool {
    let range = field.key.range;
    match field.coding {
        // What is no number is NaN or infinite.
        Coding::Scalar => range.holds_in(S::KIND.number(words[0])),
        Coding::Gain => range.holds_in(S::KIND.gain(words)),
        Coding::Double => range.holds(double(words)),
        Coding::Choice => usize::try_from(words[0]).is_ok_and(|number| number < field.choices().len()),
    }
}

/// What the words of a field say; `None` where they are out of range.
pub(super) fn value<S: Word>(field: &FieldInfo, words: [u32; 2]) -> Option<f64> {
    if !is_within::<S>(field, words) {
        return None;
    }
    match field.coding {
        Coding::Scalar => S::of_word(words[0]).map(S::to_f64),
        Coding::Gain => S::gain_of_words(words).map(|(_, value)| value),
        Coding::Double => Some(double(words)),
        Coding::Choice => Some(f64::from(words[0])),
    }
}

/// The double of two words, the lower first.
pub(crate) fn double([low, high]: [u32; 2]) -> f64 {
    f64::from_bits(u64::from(high) << 32 | u64::from(low))
}

/// The two words of a double, the lower first.
pub(super) fn double_words(x: f64) -> [u32; 2] {
    let bits = x.to_bits();
    [bits as u32, (bits >> 32) as u32]
}
