//! Fixed point: the model on a core without a floating-point unit.
//!
//! **Format.** 4 bits before the point, its sign among them, and 28 after it (`I4F28` of the `fixed` crate): ±8 in units of 2^−28 = 3.7e-9.
//!
//! - Eight is enough. Normalised coefficients are at most 8 ([`Params`](crate::Params) chooses the torque scale so), fractions of the rated
//!   deflection count to ±2.5 (samples beyond are refused), their differences to ±5, a branch ends after 2.
//! - Twenty-eight are needed at the tips, where the gate √((1 − u)(1 + u)) turns one unit δ of the deflection into √(2δ): 8.6e-5, times e = 0.19 of
//!   the published gear 1.6e-5 of the rated torque. With 26 bits that is 3.2e-5, with 24 it is 6.5e-5.
//!
//! **Edges.** Every operation saturates; none wraps or panics, whatever the words.
//!
//! Derivatives can be larger than torques: an [inverse](crate::inverse) whose search would meet more than ±8 is refused.
//!
//! **Error.** Sums are exact, products rounded to nearest, roots within a unit and 2^−27 of themselves, quotients by half a unit more
//! for every unit of the dividend. A step of law `masing` or
//! `time` stays within 5e-8 of the rated torque for the published gear, and the torque at a solution of their inverses within 1e-6, 1.8e-5 at
//! the tips. The arithmetic is that of 32-bit words on every machine, so a host gives the microcontroller's bits.
//!
//! ```
//! use fixed::types::I4F28;
//! use gmhm::memory::masing::Masing;
//! use gmhm::scalar::Fixed;
//! use gmhm::{Elastic, Inverse, Memory, Params};
//!
//! let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
//! let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
//! let params = Params::new(1.168e-3, elastic, memory)?;
//!
//! let inverse = Inverse::of(&params, Masing::<Fixed>::new(&params), 0.0)?;
//! let mut state = inverse.gear().start::<16>(Fixed::default());
//! let half = Fixed::from(I4F28::from_num(0.5));
//! let loaded = inverse.gear().step(&mut state, half); // half the rated deflection
//! let solution = inverse.peek(&state, -loaded.torque); // what the opposite torque would take
//! assert!(solution.theta < Fixed::default() && solution.converged);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

mod factor;
mod word;

use core::ops::{Add, Mul, Neg, Sub};

use fixed::types::I4F28;

pub use factor::Factor;

use super::Scalar;
use word::FRACTION;

/// A fraction of the rated deflection or the rated torque, within ±8.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Fixed(I4F28);

/// A factor as mantissa·2^−(28 + shift), the mantissa's top bit used: 31 digits however small it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gain {
    mantissa: i32,
    shift: i32,
}

/// Left shift from the product of a word and a mantissa (56 bits after the point) to a word with its carry (60).
const TO_CARRY: i32 = 4;

impl Gain {
    /// The gain of a mantissa and a shift; `None` where the top bit of the mantissa is not used, or the shift is beyond 0 to 127.
    #[must_use]
    pub const fn from_parts(mantissa: i32, shift: i32) -> Option<Self> {
        let full = mantissa == 0 || shift == 0 || mantissa.unsigned_abs() >= 1 << 30;
        if full && 0 <= shift && shift <= i8::MAX as i32 { Some(Self { mantissa, shift }) } else { None }
    }

    /// Mantissa and shift.
    #[must_use]
    pub const fn parts(self) -> (i32, i32) {
        (self.mantissa, self.shift)
    }

    /// The exact value.
    #[must_use]
    pub fn to_f64(self) -> f64 {
        libm::ldexp(f64::from(self.mantissa), -(FRACTION.cast_signed() + self.shift))
    }

    /// The value, in single precision.
    #[cfg(feature = "block")]
    pub(crate) fn to_f32(self) -> f32 {
        libm::ldexpf(self.mantissa as f32, -(FRACTION.cast_signed() + self.shift))
    }

    /// x·gain in units of 2^−60; saturates.
    #[inline]
    fn times(self, x: i32) -> i64 {
        word::scale(word::product(self.mantissa, x), self.shift - TO_CARRY)
    }
}

impl Fixed {
    /// The value of a word in units of 2^−28.
    #[inline]
    #[must_use]
    pub const fn from_bits(bits: i32) -> Self {
        Self(I4F28::from_bits(bits))
    }

    /// The word.
    #[inline]
    #[must_use]
    pub const fn to_bits(self) -> i32 {
        self.0.to_bits()
    }
}

impl From<I4F28> for Fixed {
    fn from(value: I4F28) -> Self {
        Self(value)
    }
}

impl From<Fixed> for I4F28 {
    fn from(value: Fixed) -> Self {
        value.0
    }
}

impl Add for Fixed {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for Fixed {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl Neg for Fixed {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self(self.0.saturating_neg())
    }
}

impl Mul for Fixed {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        Self::from_bits(word::multiply(self.to_bits(), other.to_bits()))
    }
}

impl Scalar for Fixed {
    const ZERO: Self = Self(I4F28::ZERO);
    const HALF: Self = Self::from_bits(1 << (FRACTION - 1));
    const ONE: Self = Self(I4F28::ONE);
    const TWO: Self = Self::from_bits(2 << FRACTION);
    const EPSILON: f64 = 1.0 / (1_u32 << FRACTION) as f64;
    /// That of `f32`: closer takes another step of the search and serves nobody.
    const TOLERANCE: f64 = 4.0 * f32::EPSILON as f64;
    const LARGEST: f64 = 8.0;
    const SI: bool = false;
    const REFUSED_BEYOND: f64 = 2.5;

    type Gain = Gain;
    type Carry = i32;

    fn from_f64(x: f64) -> Self {
        // The cast saturates, and takes NaN for 0.
        Self::from_bits(libm::round(libm::ldexp(x, FRACTION.cast_signed())) as i32)
    }

    fn to_f64(self) -> f64 {
        f64::from(self.to_bits()) * Self::EPSILON
    }

    #[inline]
    fn abs(self) -> Self {
        Self(self.0.saturating_abs())
    }

    #[inline]
    fn sqrt(self) -> Self {
        Self::from_bits(word::root(self.to_bits()))
    }

    #[inline]
    fn recip(self) -> Self {
        Self::from_bits(word::invert(self.to_bits()))
    }

    #[inline]
    fn over(self, divisor: Self) -> Self {
        Self::from_bits(word::divide(self.to_bits(), divisor.to_bits()))
    }

    #[inline]
    fn root_of_parabola(a: Self, x: Self, y: Self) -> Self {
        // By halves, so that squares up to 32 fit.
        let [a, y] = [a, y].map(|x| Self::from_bits(x.to_bits() >> 1));
        let half = (a * a + x * y).sqrt();
        half + half
    }

    #[inline]
    fn multiple(self, n: Self) -> Self {
        if n == Self::ONE {
            self
        } else if n == -Self::ONE {
            -self
        } else if n == Self::ZERO {
            Self::ZERO
        } else {
            (self + self).signed(n)
        }
    }

    #[inline]
    fn cosine(self, square: Self) -> Self {
        (Self::ONE - square).sqrt()
    }

    #[inline]
    fn signed(self, sign: Self) -> Self {
        if sign < Self::ZERO { -self } else { self }
    }

    #[inline]
    fn normalise(self, _inverse_scale: Self) -> Self {
        self
    }

    #[inline]
    fn denormalise(self, _scale: Self) -> Self {
        self
    }

    fn gain_from_f64(x: f64) -> Gain {
        // x = fraction·2^exponent, fraction in [1/2, 1): 31 digits of it make the mantissa.
        let (fraction, exponent) = libm::frexp(x);
        let shift = 31 - FRACTION.cast_signed() - exponent;
        if !x.is_finite() || shift < 0 {
            return Gain { mantissa: Self::from_f64(x).to_bits(), shift: 0 };
        }
        Gain { mantissa: libm::round(libm::ldexp(fraction, 31)) as i32, shift: shift.min(i32::from(i8::MAX)) }
    }

    #[inline]
    fn fade(self, forgotten: Gain) -> Self {
        Self::from_bits(self.to_bits().saturating_sub((forgotten.times(self.to_bits()) >> 32) as i32))
    }

    #[inline]
    fn leak(memory: &mut Self, carry: &mut i32, forgotten: Gain, inputs: [(Gain, Self); 2]) {
        let word = memory.to_bits();
        let mut sum = (i64::from(word) << 32).saturating_add(i64::from(*carry));
        sum = sum.saturating_sub(forgotten.times(word));
        for (gain, input) in inputs {
            sum = sum.saturating_add(gain.times(input.to_bits()));
        }
        let rounded = word::saturate((sum.saturating_add(1 << 31)) >> 32);
        *memory = Self::from_bits(rounded);
        *carry = word::saturate(sum - (i64::from(rounded) << 32));
    }
}

/// As the number that it stands for.
#[cfg(all(feature = "defmt", target_os = "none"))]
impl defmt::Format for Fixed {
    fn format(&self, f: defmt::Formatter<'_>) {
        // The low bits do not matter to a reader.
        defmt::write!(f, "{=f32}", self.to_bits() as f32 / (1_u32 << 28) as f32);
    }
}

/// As its bits.
#[cfg(feature = "serde")]
impl serde::Serialize for Fixed {
    fn serialize<T: serde::Serializer>(&self, serializer: T) -> Result<T::Ok, T::Error> {
        serializer.serialize_i32(self.to_bits())
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for Fixed {
    fn deserialize<T: serde::Deserializer<'de>>(deserializer: T) -> Result<Self, T::Error> {
        i32::deserialize(deserializer).map(Self::from_bits)
    }
}
