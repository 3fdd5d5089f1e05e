//! A factor of any size, for what is no fraction: encoder counts.

use super::super::Extended;
use super::Fixed;
use super::word::{self, FRACTION};

/// mantissa·2^exponent, the mantissa's top bit used: 31 digits whatever the size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Factor {
    mantissa: i32,
    exponent: i32,
}

impl Factor {
    /// The nearest factor; what is not finite counts as 0.
    #[must_use]
    pub fn new(x: f64) -> Self {
        let Self { mantissa, exponent } = Self::of(Extended::of_double(x).unwrap_or(Extended::ZERO));
        Self { mantissa: if x.is_sign_negative() { -mantissa } else { mantissa }, exponent }
    }

    /// The nearest factor to a positive number.
    #[must_use]
    pub fn of(x: Extended) -> Self {
        if x == Extended::ZERO {
            return Self { mantissa: 0, exponent: 0 };
        }
        let (digits, exponent) = x.digits(31);
        Self { mantissa: i32::try_from(digits).unwrap_or(i32::MAX), exponent }
    }

    /// A whole number to a fixed-point number, to nearest; saturates.
    #[inline]
    #[must_use]
    pub fn to_fixed(self, whole: i32) -> Fixed {
        Fixed::from_bits(self.times(whole, -FRACTION.cast_signed()))
    }

    /// A fixed-point number to a whole one, to nearest; saturates.
    #[inline]
    #[must_use]
    pub fn to_whole(self, fixed: Fixed) -> i32 {
        self.times(fixed.to_bits(), FRACTION.cast_signed())
    }

    #[inline]
    fn times(self, word: i32, shift: i32) -> i32 {
        // One binary place more than is kept, for rounding.
        word::saturate((word::scale(word::product(self.mantissa, word), shift - 1 - self.exponent) + 1) >> 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Scalar;

    #[test]
    fn products_are_rounded_to_nearest_and_saturate() {
        for (factor, whole, fixed) in [
            (1e-9, 1_000_000_000, 1.0),
            (0.25, -3, -0.75),
            (-1.5, 4, -6.0),
            (1e9, 1, 8.0),
            (1e9, -1, -8.0),
            (0.0, 7, 0.0),
        ] {
            let found = Factor::new(factor).to_fixed(whole).to_f64();
            assert!((found - fixed).abs() <= Fixed::EPSILON, "{factor}·{whole} = {found}");
        }
        for (factor, fixed, whole) in
            [(1e6, 0.5, 500_000), (3.0, 0.5, 2), (3.0, -0.5, -1), (1e30, 1.0, i32::MAX), (1e-30, 1.0, 0)]
        {
            assert_eq!(Factor::new(factor).to_whole(Fixed::from_f64(fixed)), whole, "{factor}·{fixed}");
        }
        assert_eq!(Factor::new(f64::NAN).to_whole(Fixed::ONE), 0);
    }
}
