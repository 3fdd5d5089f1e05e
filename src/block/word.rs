//! Numbers as 32-bit words.

use crate::scalar::Scalar;
use crate::scalar::fixed::{Fixed, Gain};

/// The arithmetic that a block's words are made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ScalarKind {
    /// IEEE 754 single precision.
    F32,
    /// 32-bit words with 28 bits after the point, [`Fixed`].
    Fixed,
}

impl ScalarKind {
    /// Its two bytes in the header: its number, and the bits after the point of a fixed-point word.
    #[must_use]
    pub const fn bytes(self) -> [u8; 2] {
        match self {
            Self::F32 => [1, 0],
            Self::Fixed => [2, 28],
        }
    }

    /// The kind of two bytes of a header.
    #[must_use]
    pub const fn of(bytes: [u8; 2]) -> Option<Self> {
        match bytes {
            [1, 0] => Some(Self::F32),
            [2, 28] => Some(Self::Fixed),
            _ => None,
        }
    }

    /// The value of a word, in single precision; a word that is no number gives NaN or an infinity.
    pub(crate) fn number(self, word: u32) -> f32 {
        match self {
            Self::F32 => f32::from_bits(word),
            Self::Fixed => word.cast_signed() as f32 * const { Fixed::EPSILON as f32 },
        }
    }

    /// The value of the two words of a gain, in single precision; NaN for what is none.
    pub(crate) fn gain(self, [first, second]: [u32; 2]) -> f32 {
        match self {
            Self::F32 if second == 0 => f32::from_bits(first),
            Self::F32 => f32::NAN,
            Self::Fixed => {
                let gain = Gain::from_parts(first.cast_signed(), second.cast_signed());
                gain.map_or(f32::NAN, Gain::to_f32)
            }
        }
    }

    /// Its name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::Fixed => "fixed",
        }
    }
}

/// A scalar that blocks can hold: a word for a number, two for a gain.
pub trait Word: Scalar {
    /// Its kind.
    const KIND: ScalarKind;
    /// The word of a number.
    fn word(self) -> u32;
    /// The number of a word; `None` for what is no number.
    fn of_word(word: u32) -> Option<Self>;
    /// The words of a gain.
    fn gain_words(gain: Self::Gain) -> [u32; 2];
    /// The gain of two words and its value; `None` for what is none.
    fn gain_of_words(words: [u32; 2]) -> Option<(Self::Gain, f64)>;
}

impl Word for f32 {
    const KIND: ScalarKind = ScalarKind::F32;

    fn word(self) -> u32 {
        self.to_bits()
    }

    fn of_word(word: u32) -> Option<Self> {
        let x = Self::from_bits(word);
        x.is_finite().then_some(x)
    }

    fn gain_words(gain: f32) -> [u32; 2] {
        [gain.to_bits(), 0]
    }

    fn gain_of_words([word, rest]: [u32; 2]) -> Option<(f32, f64)> {
        let gain = if rest == 0 { Self::of_word(word) } else { None };
        gain.map(|gain| (gain, f64::from(gain)))
    }
}

impl Word for Fixed {
    const KIND: ScalarKind = ScalarKind::Fixed;

    fn word(self) -> u32 {
        self.to_bits().cast_unsigned()
    }

    fn of_word(word: u32) -> Option<Self> {
        Some(Self::from_bits(word.cast_signed()))
    }

    fn gain_words(gain: Gain) -> [u32; 2] {
        let (mantissa, shift) = gain.parts();
        [mantissa, shift].map(i32::cast_unsigned)
    }

    fn gain_of_words(words: [u32; 2]) -> Option<(Gain, f64)> {
        let [mantissa, shift] = words.map(u32::cast_signed);
        let gain = Gain::from_parts(mantissa, shift)?;
        Some((gain, gain.to_f64()))
    }
}
