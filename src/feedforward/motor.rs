//! The motor's side of the gear, in integer counts: N·(q_o* + θ*).
//!
//! A joint after hundreds of turns of its motor stands at an angle of which `f32` keeps no more than 1e-4 rad; θ* is an offset to it, and the sum is taken
//! in integers, in parts of 1/256 of a motor count, so that it stays smooth between two counts. It is right by a part after any number of turns, and by what
//! the scalar rounds of θ* itself.

use core::num::NonZeroU64;

use crate::drive::pair::{FromCounts, MOST_COUNTS, MOST_RATIO, Place, SetupError, below_half_turn, gcd};
use crate::scalar::{Extended, Float};

/// How counts of the output's reference become counts of the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotorEncoder {
    /// Counts of a turn of the motor.
    pub counts_per_turn: u32,
    /// N as a fraction: (100, 1).
    pub ratio: (u32, u32),
    /// Counts of a turn of the output in which its reference is given: any, such as 2^30.
    pub reference_counts_per_turn: u32,
    /// A, rad: what a deflection is a fraction of in fixed point.
    pub rated_deflection_rad: f64,
}

/// The way from the output's reference to the motor's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorSide<S: FromCounts> {
    /// Motor parts in reference counts: a fraction in lowest terms.
    parts: u64,
    reference_counts: NonZeroU64,
    /// Motor parts in a unit of deflection.
    per_deflection: S::Factor,
    /// Motor angle in a part: rad for floats, turns for fixed point.
    angle: S::Factor,
    /// N.
    ratio: S::Factor,
}

/// Parts of a count.
const PARTS: i64 = 256;

impl<S: FromCounts> MotorSide<S> {
    /// Parts of a motor count in which positions of the motor are given.
    pub const PARTS: i64 = PARTS;

    /// Checks the counts and finds their ratio.
    ///
    /// # Errors
    /// [`SetupError`]: counts beyond 1 to 2^30 a turn, a ratio beyond 1 to 2^20, no rated deflection.
    pub fn new(encoder: &MotorEncoder) -> Result<Self, SetupError> {
        let MotorEncoder { counts_per_turn, ratio: (numerator, denominator), .. } = *encoder;
        let counts = |counts: u32| (1..=MOST_COUNTS).contains(&counts);
        let part = |part: u32| (1..=MOST_RATIO).contains(&part);
        if !counts(counts_per_turn) || !counts(encoder.reference_counts_per_turn) {
            return Err(SetupError::Counts);
        }
        if !part(numerator) || !part(denominator) {
            return Err(SetupError::Ratio);
        }
        let rated = below_half_turn(encoder.rated_deflection_rad).ok_or(SetupError::Deflection)?;
        if rated == Extended::ZERO || encoder.rated_deflection_rad.is_sign_negative() {
            return Err(SetupError::Deflection);
        }
        // 2^8·2^30·2^20 and 2^30·2^20 fit 64 bits.
        let parts = PARTS.unsigned_abs() * u64::from(counts_per_turn) * u64::from(numerator);
        let reference = u64::from(encoder.reference_counts_per_turn) * u64::from(denominator);
        let common = gcd(parts, reference);
        let (parts, reference) = (parts / common, reference / common);
        let whole = Extended::of_whole;
        let parts_per_turn = whole(PARTS.unsigned_abs() * u64::from(counts_per_turn));
        let ratio = whole(numerator.into()).over(whole(denominator.into()));
        let per_rad = ratio.times(parts_per_turn).over(Extended::TURN);
        // The products of `position` must fit 64 bits, twice the rated deflection 32.
        let fits = parts.checked_mul(reference).is_some_and(|product| product <= i64::MAX.unsigned_abs())
            && rated.times(per_rad) <= whole(1 << 30);
        let Some(reference_counts) = NonZeroU64::new(reference).filter(|_| fits) else {
            return Err(SetupError::TooFine);
        };
        Ok(Self {
            parts,
            reference_counts,
            per_deflection: S::factor_of(if S::SI { per_rad } else { per_rad.times(rated) }),
            angle: S::factor_of(if S::SI { Extended::TURN } else { Extended::ONE }.over(parts_per_turn)),
            ratio: S::factor_of(ratio),
        })
    }

    /// N·(q_o* + θ*) in parts: the reference of the output in its counts over all turns, and the [offset](super::Contribution::offset).
    #[inline]
    #[must_use]
    pub fn position(&self, reference: i64, offset: S) -> i64 {
        let size = reference.unsigned_abs();
        let (whole, rest) = (size / self.reference_counts, size % self.reference_counts);
        let rest = (rest * self.parts + self.reference_counts.get() / 2) / self.reference_counts;
        let parts = whole.wrapping_mul(self.parts).wrapping_add(rest).cast_signed();
        self.offset(offset).wrapping_add(if reference < 0 { parts.wrapping_neg() } else { parts })
    }

    /// N·θ* in parts.
    #[inline]
    #[must_use]
    pub fn offset(&self, offset: S) -> i64 {
        i64::from(offset.to_counts(self.per_deflection))
    }

    /// A [position](Self::position) less the measured one, as the motor's angle: rad for floats, turns for fixed point; saturates.
    #[inline]
    #[must_use]
    pub fn error(&self, position: i64, measured: &Place) -> S {
        let parts = position.wrapping_sub(measured.counts.wrapping_mul(PARTS));
        S::from_counts(parts.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32, self.angle)
    }
}

impl<S: FromCounts<Factor = S> + Float> MotorSide<S> {
    /// N·(q̇_o* + θ̇*): the motor's velocity, rad/s, from the output's, rad/s, the [change](super::Contribution::change) of the offset and the rate
    /// of the control periods, Hz.
    #[inline]
    #[must_use]
    pub fn velocity(&self, reference: S, change: S, rate_hz: S) -> S {
        self.ratio * (reference + change * rate_hz)
    }
}
