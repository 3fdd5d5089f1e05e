//! Terms as records: the key `shape` where the kind has it, then the other keys in the registry's order.
//!
//! | form | words |
//! |---|---|
//! | number | single precision; the default of one left out |
//! | choice | the number of the word, counted from 0 |
//! | list | how many, then each in single precision |
//!
//! Keys of other shapes than the record's are left out. Keys that a kind has got since version 1 come last, and the record ends before those that are at their
//! defaults: what needs none of them is the record of version 1.

use heapless::Vec;

use super::error::BlockError;
use super::layout::FIRST_TERM;
use super::record::Record;
#[cfg(feature = "link")]
use super::{Block, JOINT, TorqueUnit, crc32};
use crate::terms::{Form, KeyInfo, KindInfo, Setting, Source, Term, TermError, Value, kind, kind_of_tag, tag_of_kind};

/// The most keys of a kind.
const MOST_KEYS: usize = 12;
/// The most words of one term's record.
pub(super) const MOST_WORDS: usize = 80;

/// The values of a term, from a record.
#[derive(Debug, Clone, PartialEq)]
pub struct TermRecord {
    info: &'static KindInfo,
    numbers: Vec<f32, MOST_WORDS>,
    values: Vec<(&'static KeyInfo, Held), MOST_KEYS>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Held {
    Number(f32),
    List { first: usize, count: usize },
    Choice(usize),
}

/// The keys of a kind in the order of its record: the one that decides which others there are comes first.
fn ordered(info: &'static KindInfo) -> impl Iterator<Item = &'static KeyInfo> {
    let (shapes, others) = (info.keys.iter(), info.keys.iter());
    shapes.filter(|key| is_shape(key)).chain(others.filter(|key| !is_shape(key)))
}

fn is_shape(key: &KeyInfo) -> bool {
    key.name == "shape"
}

/// A digest of what a block says beside its gear: the same where terms, ratio, zero, side and unit of the torque are.
#[cfg(feature = "link")]
pub(crate) fn digest_beside_gear(block: &Block<'_>) -> u32 {
    let beside = block.records().filter(|record| record.tag == JOINT.tag || TermRecord::kind(record).is_some());
    let unit = u32::from(block.header().torque_unit == TorqueUnit::Ampere);
    beside.fold(unit, |digest, record| digest.rotate_left(7) ^ u32::from(record.tag) ^ crc32(record.payload))
}

impl TermRecord {
    /// The kind of a record; `None` where its tag is no known term's.
    pub(super) fn kind(record: &Record<'_>) -> Option<&'static KindInfo> {
        kind_of_tag(record.tag.checked_sub(FIRST_TERM)?)
    }

    /// The values of a record; `None` where its tag is no known term's.
    ///
    /// # Errors
    /// A record of another length than its keys.
    #[must_use]
    pub fn decode(record: &Record<'_>) -> Option<Result<Self, BlockError>> {
        Some(Self::decode_as(record, Self::kind(record)?))
    }

    fn decode_as(record: &Record<'_>, info: &'static KindInfo) -> Result<Self, BlockError> {
        let malformed = BlockError::Malformed(record.tag);
        let mut term = Self { info, numbers: Vec::new(), values: Vec::new() };
        let mut words = record.words();
        let mut shape = None;
        for key in ordered(info) {
            if !key.belongs_to(shape) {
                continue;
            }
            let word = match words.next() {
                None if key.appended => break,
                word => word.ok_or(malformed)?,
            };
            let held = match key.form {
                Form::Number => Held::Number(f32::from_bits(word)),
                Form::Choice(accepted) => {
                    let number = word as usize;
                    let chosen = accepted.get(number).ok_or(BlockError::Term {
                        tag: record.tag,
                        error: TermError::WrongForm { key: key.name, form: key.form },
                    })?;
                    if is_shape(key) {
                        shape = Some(*chosen);
                    }
                    Held::Choice(number)
                }
                Form::List { most } => {
                    let (first, count) = (term.numbers.len(), word as usize);
                    if count > most {
                        let error = TermError::TooMany { key: key.name, most };
                        return Err(BlockError::Term { tag: record.tag, error });
                    }
                    for _ in 0..count {
                        let number = f32::from_bits(words.next().ok_or(malformed)?);
                        term.numbers.push(number).map_err(|_| malformed)?;
                    }
                    Held::List { first, count }
                }
            };
            term.values.push((key, held)).map_err(|_| malformed)?;
        }
        if words.next().is_some() { Err(malformed) } else { Ok(term) }
    }

    /// Its kind.
    #[must_use]
    pub fn info(&self) -> &'static KindInfo {
        self.info
    }

    /// Its keys and values in the order of the record.
    pub fn values(&self) -> impl Iterator<Item = (&'static KeyInfo, Value<'_, f32>)> {
        self.values.iter().map(|(key, held)| (*key, self.value(*held)))
    }

    fn value(&self, held: Held) -> Value<'_, f32> {
        match held {
            Held::Number(x) => Value::Number(x),
            Held::Choice(number) => Value::Choice(number),
            Held::List { first, count } => {
                Value::List(self.numbers.get(first..first.saturating_add(count)).unwrap_or(&[]))
            }
        }
    }

    /// The term, every value checked.
    ///
    /// # Errors
    /// What the registry or the kind refuses.
    pub fn term(&self, setting: Setting<f32>) -> Result<Term<f32>, TermError> {
        Term::read(self.info.name, self, setting)
    }
}

impl Source<f32> for TermRecord {
    fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, f32>> {
        let (_, held) = self.values.iter().find(|(held, _)| held.name == key.name)?;
        Some(self.value(*held))
    }
}

/// The tag and the words of a term.
///
/// # Errors
/// A key that is missing or cannot be.
pub(super) fn encode(name: &str, source: &dyn Source<f32>) -> Result<(u16, Vec<u32, MOST_WORDS>), TermError> {
    let (Some(info), Some(number)) = (kind(name), tag_of_kind(name)) else { return Err(TermError::UnknownKind) };
    let mut words = Vec::new();
    let mut shape = None;
    // As far as the record goes: up to the last word that says anything.
    let mut length = 0;
    for key in ordered(info) {
        if !key.belongs_to(shape) {
            continue;
        }
        let room = TermError::TooMany { key: key.name, most: MOST_WORDS };
        let mut put = |word: u32| words.push(word).map_err(|_| room);
        match (key.form, source.get(key)) {
            (Form::Number, Some(Value::Number(x))) => put(x.to_bits())?,
            (Form::Number, None) if key.optional => put(key.absent.to_bits())?,
            (Form::Choice(_), None) if key.optional => put(key.absent as u32)?,
            (Form::List { .. }, Some(Value::List(list))) => {
                put(list.len() as u32)?;
                list.iter().try_for_each(|x| put(x.to_bits()))?;
            }
            (Form::Choice(accepted), Some(Value::Choice(chosen))) if chosen < accepted.len() => {
                if is_shape(key) {
                    shape = accepted.get(chosen).copied();
                }
                put(chosen as u32)?;
            }
            (_, None) => return Err(TermError::Missing { key: key.name }),
            (form, Some(_)) => return Err(TermError::WrongForm { key: key.name, form }),
        }
        let default = match key.form {
            Form::Number => Some(key.absent.to_bits()),
            Form::Choice(_) => Some(key.absent as u32),
            Form::List { .. } => None,
        };
        if !key.appended || words.last().copied() != default {
            length = words.len();
        }
    }
    words.truncate(length);
    Ok((FIRST_TERM + number, words))
}
