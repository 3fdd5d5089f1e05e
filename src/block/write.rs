//! Blocks, written record by record into a buffer.

use heapless::Vec;

use super::error::BlockError;
use super::header::{HEADER_BYTES, Header, SEQUENCE_AT};
use super::joint::Joint;
use super::law::BlockLaw;
use super::layout::{FIRST_TERM, GEAR, INVERSE, JOINT, LARGEST_STEP, NAME, RecordInfo, SELF_TEST};
use super::prepared::{MOST_WORDS, PreparedLaw};
use super::record::{MOST_BYTES, check, double_words, verify};
use super::self_test::samples;
use super::{Word, crc32, term};
use crate::elastic::Polynomial;
use crate::gear::Gear;
use crate::inverse::{Inverse, InverseError, Monotony};
use crate::params::Params;
use crate::terms::{Source, tag_of_kind};

/// Tag and length of a record.
const RECORD_BYTES: usize = 4;
/// The CRC-32 at the end.
const CRC_BYTES: usize = 4;

/// Writes a block.
#[derive(Debug)]
pub struct Writer<'a> {
    buffer: &'a mut [u8],
    used: usize,
    header: Header,
}

impl<'a> Writer<'a> {
    /// An empty block of this header; its length and count of records are filled in at the end.
    pub fn new(buffer: &'a mut [u8], header: Header) -> Self {
        Self { buffer, used: HEADER_BYTES, header: Header { records: 0, ..header } }
    }

    /// Room for a record of so many bytes, its tag and length written; the CRC-32 still fits behind it.
    fn place(&mut self, tag: u16, bytes: usize) -> Result<&mut [u8], BlockError> {
        let length = u16::try_from(bytes).map_err(|_| BlockError::NoRoom)?;
        let end = self.used + RECORD_BYTES + bytes;
        if end + CRC_BYTES > self.buffer.len().min(MOST_BYTES) {
            return Err(BlockError::NoRoom);
        }
        let record = self.buffer.get_mut(self.used..end).ok_or(BlockError::NoRoom)?;
        let (head, payload) = record.split_at_mut_checked(RECORD_BYTES).ok_or(BlockError::NoRoom)?;
        let [t0, t1] = tag.to_le_bytes();
        let [l0, l1] = length.to_le_bytes();
        head.copy_from_slice(&[t0, t1, l0, l1]);
        self.used = end;
        self.header.records += 1;
        Ok(payload)
    }

    /// A record of words. What does not fit leaves the block as it was.
    ///
    /// # Errors
    /// No room.
    pub fn record(&mut self, tag: u16, words: &[u32]) -> Result<(), BlockError> {
        let payload = self.place(tag, 4 * words.len())?;
        payload.chunks_exact_mut(4).zip(words).for_each(|(to, word)| to.copy_from_slice(&word.to_le_bytes()));
        Ok(())
    }

    /// A gear, its law and the scales of its parameters.
    ///
    /// # Errors
    /// A value that the format cannot hold, no room.
    pub fn gear<S: Word, L: BlockLaw<S>>(&mut self, gear: &Gear<S, L>, params: &Params) -> Result<(), BlockError> {
        let [[a0, a1], [t0, t1]] = [params.rated_deflection_rad(), params.torque_scale_nm()].map(double_words);
        let Polynomial { k1, k3, k5 } = *gear.elastic().polynomial();
        let [k1, k3, k5] = [k1, k3, k5].map(S::word);
        self.fixed::<S>(&GEAR, &[a0, a1, t0, t1, k1, k3, k5])?;
        let (info, words) = gear.law().record(params);
        self.fixed::<S>(info, &words)
    }

    /// What the inverse has to know of the gear of these parameters, in law `time` at every period up to the header's.
    ///
    /// # Errors
    /// [`InverseError`] as [`BlockError::OutOfRange`] of the range: parameters without an inverse; no room.
    pub fn inverse<S: Word>(&mut self, params: &Params, longest_period_s: f64) -> Result<(), BlockError> {
        let none = |_: InverseError| BlockError::OutOfRange { tag: INVERSE.tag, field: "range" };
        let Monotony { reach, least_slope, bounds: [slope, bend, jerk] } =
            Monotony::of::<S>(params, longest_period_s).map_err(none)?;
        let mut words: Vec<u32, 10> = Vec::new();
        // There is room: five doubles.
        [reach, least_slope, slope, bend, jerk].map(double_words).iter().for_each(|pair| words.extend(*pair));
        self.fixed::<S>(&INVERSE, &words)
    }

    /// The golden samples of the gear and of the inverse that were written: the drive computes them anew.
    ///
    /// # Errors
    /// No room.
    pub fn self_test<S: Word, L: BlockLaw<S>>(
        &mut self,
        gear: &Gear<S, L>,
        inverse: Option<&Inverse<S, L>>,
    ) -> Result<(), BlockError> {
        self.fixed::<S>(&SELF_TEST, &samples(gear, inverse))
    }

    /// What the set-up of this inverse came to, for loaders without double precision.
    ///
    /// # Errors
    /// No room.
    pub fn prepared<S: Word, L: PreparedLaw<S>>(&mut self, inverse: &Inverse<S, L>) -> Result<(), BlockError> {
        let mut words: Vec<u32, MOST_WORDS> = Vec::new();
        // There is room: no record has more words.
        let info = L::prepared_words(inverse, |word| words.extend([word.word()]));
        self.fixed::<S>(info, &words)
    }

    /// The most that the deflection moves in the control period of the header, in input units: what moves faster is quarantined by every gear of this block.
    ///
    /// # Errors
    /// A step that is none, no room.
    pub fn largest_step<S: Word>(&mut self, step: S) -> Result<(), BlockError> {
        self.fixed::<S>(&LARGEST_STEP, &[step.word()])
    }

    /// The joint.
    ///
    /// # Errors
    /// A value that the format cannot hold, no room.
    pub fn joint(&mut self, joint: &Joint) -> Result<(), BlockError> {
        let [n0, n1] = double_words(joint.ratio.unwrap_or(0.0));
        let [z0, z1] = double_words(joint.deflection_zero_rad);
        self.fixed::<f32>(&JOINT, &[n0, n1, z0, z1, u32::from(joint.motor_side)])
    }

    /// A record of the registry, its values within their ranges.
    fn fixed<S: Word>(&mut self, info: &'static RecordInfo, words: &[u32]) -> Result<(), BlockError> {
        check::<S>(info, words.iter().copied())?;
        self.record(info.tag, words)
    }

    /// A term by its keys.
    ///
    /// # Errors
    /// [`BlockError::Term`] with the key to blame, no room.
    pub fn term(&mut self, kind: &str, source: &dyn Source<f32>) -> Result<(), BlockError> {
        let tag = tag_of_kind(kind).map_or(0, |number| FIRST_TERM + number);
        let (tag, words) = term::encode(kind, source).map_err(|error| BlockError::Term { tag, error })?;
        self.record(tag, &words)
    }

    /// The model's name. A zero byte ends it.
    ///
    /// # Errors
    /// No room.
    pub fn name(&mut self, name: &str) -> Result<(), BlockError> {
        let payload = self.place(NAME.tag, name.len().next_multiple_of(4))?;
        payload.fill(0);
        payload.iter_mut().zip(name.bytes()).for_each(|(to, byte)| *to = byte);
        Ok(())
    }

    /// Header and CRC-32: the length of the whole block.
    ///
    /// # Errors
    /// No room.
    pub fn finish(self) -> Result<usize, BlockError> {
        let length = self.used + CRC_BYTES;
        let header = Header { length: length as u32, ..self.header }.encode();
        let block = self.buffer.get_mut(..length).ok_or(BlockError::NoRoom)?;
        let (checked, crc) = block.split_last_chunk_mut().ok_or(BlockError::NoRoom)?;
        checked.get_mut(..HEADER_BYTES).ok_or(BlockError::NoRoom)?.copy_from_slice(&header);
        *crc = crc32(checked).to_le_bytes();
        Ok(length)
    }
}

/// Gives a block another sequence number, and the CRC-32 that goes with it.
///
/// # Errors
/// It is no block.
pub fn stamp(block: &mut [u8], sequence: u32) -> Result<(), BlockError> {
    verify(block)?;
    if let Some(place) = block.get_mut(SEQUENCE_AT..SEQUENCE_AT + 4) {
        place.copy_from_slice(&sequence.to_le_bytes());
    }
    if let Some((checked, crc)) = block.split_last_chunk_mut::<4>() {
        *crc = crc32(checked).to_le_bytes();
    }
    Ok(())
}
