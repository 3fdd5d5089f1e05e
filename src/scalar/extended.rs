//! Positive numbers of 64 binary digits, by integers alone: encoders and servos are set up with them on drives that have no double precision.
//!
//! Set-up is rare: each operation is a call, whatever a compiler for speed would make of it.
//!
//! A product or a quotient is off by less than 2⁻⁶² of itself: to odd, so that it is rounded right where a scalar takes fewer digits of it.

/// mantissa·2^exponent, the top bit of the mantissa set; or 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd)]
pub struct Extended {
    // First, for the order of the numbers.
    exponent: i32,
    mantissa: u64,
}

impl Extended {
    /// 0.
    pub const ZERO: Self = Self { exponent: i32::MIN, mantissa: 0 };
    /// 1.
    pub const ONE: Self = Self { exponent: -63, mantissa: 1 << 63 };
    /// 2π.
    pub const TURN: Self = Self { exponent: -61, mantissa: 0xc90f_daa2_2168_c234 };

    /// The magnitude of a double; `None` where it is NaN or infinite.
    #[must_use]
    #[inline(never)]
    pub const fn of_double(x: f64) -> Option<Self> {
        let bits = x.to_bits();
        let (exponent, fraction) = ((bits >> 52 & 0x7ff) as i32, bits & ((1 << 52) - 1));
        match exponent {
            0x7ff => None,
            0 => Some(Self::of(fraction, -1074)),
            _ => Some(Self::of(fraction | 1 << 52, exponent - 1075)),
        }
    }

    /// The magnitude of a single; `None` where it is NaN or infinite.
    #[must_use]
    pub const fn of_single(x: f32) -> Option<Self> {
        let bits = x.to_bits();
        let (exponent, fraction) = ((bits >> 23 & 0xff) as i32, (bits & ((1 << 23) - 1)) as u64);
        match exponent {
            0xff => None,
            0 => Some(Self::of(fraction, -149)),
            _ => Some(Self::of(fraction | 1 << 23, exponent - 150)),
        }
    }

    /// 1 − e^(−self), within 2⁻⁵⁶ of itself.
    #[must_use]
    #[inline(never)]
    pub const fn decay(self) -> Self {
        const SMALL: i32 = -16;
        let whole = Self::of_whole;
        // 1 − e^(−x) of x below 2^SMALL, then of its doubles: 1 − (1 − y)² = y·(2 − y).
        let (mut doublings, mut x) = (self.exponent.saturating_add(64 - SMALL), self);
        if doublings > 6 - SMALL {
            return Self::ONE;
        }
        if doublings > 0 {
            x.exponent -= doublings;
        }
        let third = Self::ONE.apart(x.over(whole(4))).times(x).over(whole(3));
        let half = Self::ONE.apart(third).times(x).over(whole(2));
        let mut y = Self::ONE.apart(half).times(x);
        while doublings > 0 {
            y = y.times(whole(2).apart(y));
            doublings -= 1;
        }
        y
    }

    /// A whole number.
    #[must_use]
    pub const fn of_whole(x: u64) -> Self {
        Self::of(x, 0)
    }

    #[inline(never)]
    const fn of(mantissa: u64, exponent: i32) -> Self {
        if mantissa == 0 {
            return Self::ZERO;
        }
        let places = mantissa.leading_zeros();
        Self { exponent: exponent.saturating_sub(places.cast_signed()), mantissa: mantissa << places }
    }

    /// self·factor.
    #[must_use]
    #[inline(never)]
    pub const fn times(self, factor: Self) -> Self {
        let product = self.mantissa as u128 * factor.mantissa as u128;
        let (high, low) = ((product >> 64) as u64, product as u64);
        let exponent = self.exponent.saturating_add(factor.exponent).saturating_add(64);
        // One place at most is free.
        if high >> 63 == 1 {
            Self { exponent, mantissa: high | (low != 0) as u64 }
        } else {
            Self::of(high << 1 | low >> 63 | (low << 1 != 0) as u64, exponent.saturating_sub(1))
        }
    }

    /// self/divisor, digit by digit; the divisor is not 0.
    #[must_use]
    #[inline(never)]
    pub const fn over(self, divisor: Self) -> Self {
        let (mut rest, mut quotient) = (self.mantissa, 0_u64);
        // The rest is below twice the divisor: its 65th digit.
        let mut carry = false;
        let mut places = 0;
        // The first digit of the quotient is 0 where the mantissa is below that of the divisor.
        while places < 64 + (self.mantissa < divisor.mantissa) as i32 {
            quotient <<= 1;
            if carry || rest >= divisor.mantissa {
                rest = rest.wrapping_sub(divisor.mantissa);
                quotient |= 1;
            }
            carry = rest >> 63 == 1;
            rest <<= 1;
            places += 1;
        }
        Self::of(
            quotient | (carry || rest != 0) as u64,
            self.exponent.saturating_sub(divisor.exponent).saturating_sub(places - 1),
        )
    }

    /// abs(self − other).
    #[must_use]
    #[inline(never)]
    pub const fn apart(self, other: Self) -> Self {
        let is_larger =
            self.exponent > other.exponent || self.exponent == other.exponent && self.mantissa >= other.mantissa;
        let (large, small) = if is_larger { (self, other) } else { (other, self) };
        let places = large.exponent.saturating_sub(small.exponent);
        let small = if places < 64 { small.mantissa >> places } else { 0 };
        Self::of(large.mantissa - small, large.exponent)
    }

    /// The whole number below; saturates.
    #[must_use]
    pub const fn floor(self) -> u64 {
        match self.exponent {
            ..=-64 => 0,
            1.. => u64::MAX,
            places => self.mantissa >> -places,
        }
    }

    /// The nearest whole number, halves up; saturates.
    #[must_use]
    #[inline(never)]
    pub const fn rounded(self) -> u64 {
        match self.exponent {
            -64 => self.mantissa >> 63,
            -63..=-1 => (self.mantissa >> -self.exponent) + (self.mantissa >> (-self.exponent - 1) & 1),
            _ => self.floor(),
        }
    }

    /// The nearest number of so many digits, fewer than 64: its digits, one more where they carry, and the exponent of the last.
    #[must_use]
    #[inline(never)]
    pub const fn digits(self, count: u32) -> (u64, i32) {
        let places = 64 - count;
        let (digits, rest, half) = (self.mantissa >> places, self.mantissa << count, 1 << 63);
        let up = rest > half || rest == half && digits & 1 == 1;
        (digits + up as u64, self.exponent.saturating_add(places.cast_signed()))
    }

    /// The nearest single; 0 below the least normal one, infinite beyond the largest.
    #[must_use]
    pub const fn single(self) -> f32 {
        let (digits, last) = self.digits(24);
        match last.saturating_add(23 + 127) {
            ..=0 => 0.0,
            0xff.. => f32::INFINITY,
            // A carry goes on into the exponent.
            biased => f32::from_bits(((biased as u32 - 1) << 23) + digits as u32),
        }
    }

    /// The nearest double, likewise.
    #[must_use]
    pub const fn double(self) -> f64 {
        let (digits, last) = self.digits(53);
        match last.saturating_add(52 + 1023) {
            ..=0 => 0.0,
            0x7ff.. => f64::INFINITY,
            biased => f64::from_bits(((biased as u64 - 1) << 52) + digits),
        }
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use super::Extended;

    /// Doubles of every digit, between 2^-70 and 2^70.
    fn doubles() -> impl Iterator<Item = f64> {
        let mut bits = 1_u64;
        (0..20_000).map(move |_| {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let exponent = 1023 - 70 + (bits >> 33) % 140;
            f64::from_bits(exponent << 52 | bits & ((1 << 52) - 1))
        })
    }

    fn of(x: f64) -> Extended {
        Extended::of_double(x).expect("finite")
    }

    #[test]
    fn products_and_quotients_are_those_of_doubles() {
        for (a, b) in doubles().zip(doubles().skip(1)) {
            assert_eq!(of(a).double().to_bits(), a.to_bits());
            assert_eq!(of(a).single().to_bits(), (a as f32).to_bits(), "{a:e}");
            assert_eq!(Extended::of_single(a as f32), Extended::of_double(f64::from(a as f32)), "{a:e}");
            assert_eq!(of(a).times(of(b)).double(), a * b, "{a:e}·{b:e}");
            assert_eq!(of(a).over(of(b)).double(), a / b, "{a:e}/{b:e}");
            assert_eq!(of(a) < of(b), a < b);
            let apart = of(a).apart(of(b)).double();
            assert!((apart - (a - b).abs()).abs() <= 1e-15 * a.max(b), "{a:e} − {b:e}");
        }
        assert_eq!(Extended::TURN.double(), TAU);
        assert_eq!(Extended::ONE.apart(Extended::ONE), Extended::ZERO);
    }

    #[test]
    fn whole_numbers_are_rounded_as_libm_rounds_them() {
        for x in doubles().map(|x| x.abs()).filter(|x| *x < 9e18).chain([
            0.0,
            0.5,
            0.49999999999999994,
            1.5,
            2.5,
            1e15 + 0.5,
        ]) {
            assert_eq!((of(x).floor(), of(x).rounded()), (libm::floor(x) as u64, libm::round(x) as u64), "{x:e}");
        }
        assert_eq!((of(1e30).floor(), of(1e30).rounded()), (u64::MAX, u64::MAX));
        assert_eq!(Extended::of_whole(u64::MAX).floor(), u64::MAX);
    }

    #[test]
    fn a_decay_is_that_of_libm() {
        for x in doubles().chain([1e-300, 0.5, 1.0, 36.0, 50.0, 63.9, 64.0, 1e300]) {
            let (ours, libm) = (of(x).decay().double(), -libm::expm1(-x));
            assert!((ours - libm).abs() <= 4.0 * f64::EPSILON * libm, "{x:e}: {ours:e} {libm:e}");
        }
        assert_eq!((of(0.0).decay(), of(1e300).decay()), (Extended::ZERO, Extended::ONE));
    }

    #[test]
    fn what_is_no_number_is_none() {
        assert_eq!([f64::NAN, f64::INFINITY, -f64::INFINITY].map(Extended::of_double), [None; 3]);
        assert_eq!([f32::NAN, f32::INFINITY].map(Extended::of_single), [None; 2]);
        for x in [0.0, -0.0, 1e-45, -1e-40, -3.5] {
            assert_eq!(Extended::of_single(x), Some(of(f64::from(x))));
        }
        assert_eq!((of(0.0), of(-0.0), of(-2.0).double()), (Extended::ZERO, Extended::ZERO, 2.0));
        assert_eq!((of(1e300).single(), of(1e-300).single()), (f32::INFINITY, 0.0));
        assert_eq!(of(f64::from_bits(1)).times(of(2f64.powi(60))).double(), f64::from_bits(1) * 2f64.powi(60));
    }
}
