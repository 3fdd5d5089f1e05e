//! Keys and values to a checked term.

use core::fmt;

use heapless::Vec;

use super::registry::{Form, KeyInfo, Range};
use crate::scalar::Float;

/// What a key of a term holds.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Value<'a, S> {
    /// A number.
    Number(S),
    /// A list.
    List(&'a [S]),
    /// The number of a word among the key's choices.
    Choice(usize),
    /// A word that is none of them.
    NoChoice,
}

/// Where the values of a term come from: a model file or a parameter block.
pub trait Source<S> {
    /// The value of a key; `None` where there is none.
    fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, S>>;
}

/// The gear that a term belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Setting<S> {
    /// σ: +1 where the torque is taken on the motor side, −1 for a sensor on the output side.
    pub sigma: S,
    /// c1, N·m/rad; 0 for a joint without gear.
    pub c1: S,
    /// A, rad; 0 where it is not known.
    pub rated_deflection: S,
}

/// Why a term was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum TermError {
    /// No such kind.
    UnknownKind,
    /// A key is missing.
    Missing {
        /// The key.
        key: &'static str,
    },
    /// A number where a list should be, or the other way.
    WrongForm {
        /// The key.
        key: &'static str,
        /// What it should hold.
        form: Form,
    },
    /// A number that cannot be.
    OutOfRange {
        /// The key.
        key: &'static str,
        /// What it accepts.
        range: Range,
    },
    /// NaN or infinite.
    NotFinite {
        /// The key.
        key: &'static str,
    },
    /// More numbers than there is room for.
    TooMany {
        /// The key.
        key: &'static str,
        /// The most it may hold.
        most: usize,
    },
    /// A list without numbers.
    Empty {
        /// The key.
        key: &'static str,
    },
    /// Two lists of one term that differ in length.
    Lengths {
        /// The list.
        key: &'static str,
        /// The one that it must match.
        other: &'static str,
    },
    /// Numbers that do not grow along a list, or from one key to the other.
    NotIncreasing {
        /// The key.
        key: &'static str,
    },
    /// The rated deflection A that its numbers refer to is not known.
    NoRatedDeflection,
    /// More terms than the stack has room for.
    StackFull,
}

impl TermError {
    /// The key to blame.
    #[must_use]
    pub const fn key(&self) -> Option<&'static str> {
        match self {
            Self::UnknownKind | Self::StackFull | Self::NoRatedDeflection => None,
            Self::Missing { key }
            | Self::WrongForm { key, .. }
            | Self::OutOfRange { key, .. }
            | Self::NotFinite { key }
            | Self::TooMany { key, .. }
            | Self::Empty { key }
            | Self::Lengths { key, .. }
            | Self::NotIncreasing { key } => Some(key),
        }
    }
}

impl fmt::Display for TermError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownKind => write!(f, "there is no such kind of term"),
            Self::Missing { key } => write!(f, "`{key}` is missing"),
            Self::WrongForm { key, form: Form::Number } => write!(f, "`{key}` must be a number"),
            Self::WrongForm { key, form: Form::List { .. } } => write!(f, "`{key}` must be a list of numbers"),
            Self::WrongForm { key, form: Form::Choice(words) } => {
                write!(f, "`{key}` must be one of")?;
                words.iter().try_for_each(|word| write!(f, " \"{word}\""))
            }
            Self::OutOfRange { key, range: Range::AtLeastZero } => write!(f, "`{key}` must not be negative"),
            Self::OutOfRange { key, range } => write!(f, "`{key}` must be {}", range.words()),
            Self::NotFinite { key } => write!(f, "`{key}` must be finite"),
            Self::TooMany { key, most } => write!(f, "`{key}` holds more than {most} numbers"),
            Self::Empty { key } => write!(f, "`{key}` holds no number"),
            Self::Lengths { key, other } => write!(f, "`{key}` must be as long as `{other}`"),
            Self::NotIncreasing { key } => write!(f, "`{key}` must increase"),
            Self::NoRatedDeflection => write!(f, "the rated deflection that it refers to is not known"),
            Self::StackFull => write!(f, "there are more terms than there is room for"),
        }
    }
}

impl core::error::Error for TermError {}

/// Reads the keys of one term.
pub struct Reader<'a, S> {
    source: &'a dyn Source<S>,
    /// The gear that the term belongs to.
    pub setting: Setting<S>,
}

impl<'a, S: Float> Reader<'a, S> {
    /// A reader of the values of one term.
    #[must_use]
    pub fn new(source: &'a dyn Source<S>, setting: Setting<S>) -> Self {
        Self { source, setting }
    }

    fn check(key: &'static KeyInfo, x: S) -> Result<S, TermError> {
        if !x.is_finite() {
            Err(TermError::NotFinite { key: key.name })
        } else if !key.range.holds_in(x) {
            Err(TermError::OutOfRange { key: key.name, range: key.range })
        } else {
            Ok(x)
        }
    }

    /// A number; [`KeyInfo::absent`] where it may be left out and is.
    pub fn number(&self, key: &'static KeyInfo) -> Result<S, TermError> {
        match self.source.get(key) {
            Some(Value::Number(x)) => Self::check(key, x),
            Some(_) => Err(TermError::WrongForm { key: key.name, form: key.form }),
            None if key.optional => Ok(S::from_f64(f64::from(key.absent))),
            None => Err(TermError::Missing { key: key.name }),
        }
    }

    /// A list of at least one number.
    pub(crate) fn list<const N: usize>(&self, key: &'static KeyInfo) -> Result<Vec<S, N>, TermError> {
        let Some(value) = self.source.get(key) else { return Err(TermError::Missing { key: key.name }) };
        let Value::List(items) = value else { return Err(TermError::WrongForm { key: key.name, form: key.form }) };
        if items.is_empty() {
            return Err(TermError::Empty { key: key.name });
        }
        let mut list = Vec::new();
        for x in items {
            let full = |_| TermError::TooMany { key: key.name, most: N };
            list.push(Self::check(key, *x)?).map_err(full)?;
        }
        Ok(list)
    }

    /// A list as long as another of the same term.
    pub(crate) fn list_like<const N: usize>(
        &self,
        key: &'static KeyInfo,
        other: &Vec<S, N>,
        other_key: &'static KeyInfo,
    ) -> Result<Vec<S, N>, TermError> {
        let list = self.list(key)?;
        let same = list.len() == other.len();
        if same { Ok(list) } else { Err(TermError::Lengths { key: key.name, other: other_key.name }) }
    }

    /// The number of the word among the key's choices.
    pub fn choice(&self, key: &'static KeyInfo) -> Result<usize, TermError> {
        match self.source.get(key) {
            Some(Value::Choice(word)) => Ok(word),
            Some(_) => Err(TermError::WrongForm { key: key.name, form: key.form }),
            None if key.optional => Ok(key.absent as usize),
            None => Err(TermError::Missing { key: key.name }),
        }
    }
}
