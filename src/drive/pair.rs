//! Counts of the motor's and the output's encoder to the torsional deflection.
//!
//! θ = 2π·(n_m/(N·C_m) − n_o/C_o) − θ_zero for n counts at C counts a turn. Both are brought to the common unit 2π/L, L a common multiple of
//! N·C_m and C_o, and subtracted there in integers: the difference is exact after any number of turns, where a difference of two angles in `f32` would keep
//! nothing of a millirad. Only the small difference becomes a scalar, within two roundings; the zero is kept to 2e-8 of the rated deflection.
//!
//! The output's encoder is absolute, the motor's within one turn: the motor's turn is chosen so that the deflection is the least, which is right as
//! long as deflection and encoder errors stay below π/N. It is chosen anew where a reading is beyond [`MISREAD_BEYOND`] rated deflections: counts that were misread may have
//! led into another turn, and the first good ones lead back.

use core::fmt;

use crate::scalar::{Extended, Float, Scalar};
#[cfg(feature = "fixed")]
use crate::scalar::{Fixed, fixed::Factor};

/// The deflection must reach this many rated deflections without leaving 32 bits.
const HEADROOM: u64 = 64;

/// A deflection beyond this many rated ones was misread, or the joint is breaking.
pub const MISREAD_BEYOND: f64 = 4.0;

/// The most counts of a turn.
pub(crate) const MOST_COUNTS: u32 = 1 << 30;

/// The most of either part of a ratio.
pub(crate) const MOST_RATIO: u32 = 1 << 20;

/// A scalar that counts can be turned into without arithmetic of another precision.
pub trait FromCounts: Scalar {
    /// A factor of any size.
    type Factor: Copy + fmt::Debug + PartialEq;

    /// The nearest factor to a positive number, without arithmetic in double precision.
    fn factor_of(x: Extended) -> Self::Factor;

    /// counts·factor; saturates.
    fn from_counts(counts: i32, factor: Self::Factor) -> Self;

    /// self·factor, rounded to whole counts; saturates.
    fn to_counts(self, factor: Self::Factor) -> i32;
}

macro_rules! from_counts {
    ($float:ty) => {
        impl FromCounts for $float {
            type Factor = Self;

            fn factor_of(x: Extended) -> Self {
                Float::of_extended(x)
            }

            #[inline]
            fn from_counts(counts: i32, factor: Self) -> Self {
                counts as Self * factor
            }

            #[inline]
            fn to_counts(self, factor: Self) -> i32 {
                let counts = self * factor;
                (if counts < 0.0 { counts - 0.5 } else { counts + 0.5 }) as i32
            }
        }
    };
}

from_counts!(f32);
from_counts!(f64);

#[cfg(feature = "fixed")]
impl FromCounts for Fixed {
    type Factor = Factor;

    fn factor_of(x: Extended) -> Factor {
        Factor::of(x)
    }

    #[inline]
    fn from_counts(counts: i32, factor: Factor) -> Self {
        factor.to_fixed(counts)
    }

    #[inline]
    fn to_counts(self, factor: Factor) -> i32 {
        factor.to_whole(self)
    }
}

/// An encoder as it is mounted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mounting {
    /// Counts of one turn of its shaft.
    pub counts_per_turn: u32,
    /// It counts down where the angle of the model grows. Motor and output must both grow the same way along the gear.
    pub reversed: bool,
}

/// Two encoders on a gear.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Setup {
    /// On the motor.
    pub motor: Mounting,
    /// On the output.
    pub output: Mounting,
    /// N as a fraction: (100, 1).
    pub ratio: (u32, u32),
    /// What the encoders show at θ = 0, rad: `deflection_zero_rad` of the model file.
    pub deflection_zero_rad: f64,
    /// A, rad.
    pub rated_deflection_rad: f64,
}

/// Why two encoders do not make a deflection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum SetupError {
    /// An encoder without counts, or beyond 2^30 a turn.
    Counts,
    /// A ratio that is not above zero, or beyond 2^20.
    Ratio,
    /// The rated deflection or the zero is no deflection below half a turn.
    Deflection,
    /// The least common multiple is so fine that the deflection leaves 32 bits: fewer counts on one of them will do.
    TooFine,
    /// The stored block is another one than the gear was loaded from, or says nothing of its joint.
    Block,
}

impl fmt::Display for SetupError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Counts => "counts_per_turn must lie within 1 and 2^30",
            Self::Ratio => "ratio must be a fraction of two numbers within 1 and 2^20",
            Self::Deflection => {
                "rated_deflection_rad must be positive, and both it and deflection_zero_rad below half a turn"
            }
            Self::TooFine => "the encoders have no common unit that is coarse enough: drop bits of one of them",
            Self::Block => {
                "the stored block is another one than the gear was loaded from, or says nothing of its joint"
            }
        })
    }
}

impl core::error::Error for SetupError {}

/// Two encoders on a gear, ready to be read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EncoderPair<S: FromCounts> {
    motor: Shaft<S>,
    output: Shaft<S>,
    zero: i64,
    deflection: S::Factor,
    /// Common units of [`MISREAD_BEYOND`].
    largest: u32,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Shaft<S: FromCounts> {
    counts_per_turn: u32,
    reversed: bool,
    /// Common units in a count.
    weight: i64,
    /// rad of its own in a count (floats), or turns (fixed point).
    angle: S::Factor,
}

/// Where one shaft has come to, in the sense of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Place {
    /// Counts over all its turns.
    pub counts: i64,
    /// Counts within a turn.
    pub within_turn: i32,
    /// Counts since the last reading.
    pub change: i32,
}

/// What both encoders say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reading<S> {
    /// θ: rad for floats, a fraction of the rated deflection for fixed point.
    pub deflection: S,
    /// The motor's shaft.
    pub motor: Place,
    /// The output's shaft.
    pub output: Place,
}

impl<S: FromCounts> EncoderPair<S> {
    /// Checks a pair of encoders and finds their common unit.
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn new(setup: &Setup) -> Result<Self, SetupError> {
        const MOST_UNITS: u64 = 1 << 60;
        let Setup { motor, output, ratio: (numerator, denominator), deflection_zero_rad, rated_deflection_rad } =
            *setup;
        let counts = |mounting: Mounting| (1..=MOST_COUNTS).contains(&mounting.counts_per_turn);
        if !counts(motor) || !counts(output) {
            return Err(SetupError::Counts);
        }
        if !(1..=MOST_RATIO).contains(&numerator) || !(1..=MOST_RATIO).contains(&denominator) {
            return Err(SetupError::Ratio);
        }
        let deflections = [rated_deflection_rad, deflection_zero_rad].map(below_half_turn);
        let [Some(rated), Some(zero)] = deflections else { return Err(SetupError::Deflection) };
        if rated == Extended::ZERO || rated_deflection_rad.is_sign_negative() {
            return Err(SetupError::Deflection);
        }
        // A constant, and constant for the compiler.
        let most_rated = Extended::of_double(MISREAD_BEYOND).unwrap_or(Extended::ONE);
        // Counts of the motor a turn of the output, as a fraction in lowest terms.
        let (per_turn, parts) = (u64::from(motor.counts_per_turn) * u64::from(numerator), u64::from(denominator));
        let common = gcd(per_turn, parts);
        let (per_turn, parts) = (quotient(per_turn, common), quotient(parts, common));
        let output_counts = u64::from(output.counts_per_turn);
        let units = quotient(per_turn, gcd(per_turn, output_counts)).checked_mul(output_counts);
        let units = units.ok_or(SetupError::TooFine)?;
        // Units of a turn that bring the deflection to 32 bits.
        let whole = Extended::of_whole;
        let most_units = whole(i32::MAX as u64).times(Extended::TURN).over(whole(HEADROOM).times(rated));
        let finer =
            if most_units < whole(MOST_UNITS) { most_units } else { whole(MOST_UNITS) }.over(whole(units)).floor();
        if finer == 0 {
            return Err(SetupError::TooFine);
        }
        // As fine as 32 bits bear, for the sake of the zero.
        let units = units * finer;
        let unit_rad = Extended::TURN.over(whole(units));
        let motor_weight = quotient(units, per_turn).checked_mul(parts).and_then(|weight| i64::try_from(weight).ok());
        let output_weight = i64::try_from(quotient(units, output_counts)).ok();
        let (Some(motor_weight), Some(output_weight)) = (motor_weight, output_weight) else {
            return Err(SetupError::TooFine);
        };
        Ok(Self {
            motor: Shaft::new(motor, motor_weight),
            output: Shaft::new(output, output_weight),
            zero: signed(deflection_zero_rad, zero.over(unit_rad)),
            deflection: S::factor_of(if S::SI { unit_rad } else { unit_rad.over(rated) }),
            // Far within 32 bits, by the headroom.
            largest: most_rated.times(rated).over(unit_rad).rounded() as u32,
        })
    }

    /// The first reading: the motor is taken to be in the turn that makes the deflection least.
    #[must_use]
    pub fn start(&self, motor: u32, output: u32) -> Reading<S> {
        let (motor, output) = (self.motor.start(motor), self.output.start(output));
        self.in_nearest_turn(motor, output)
    }

    #[cold]
    #[inline(never)]
    fn in_nearest_turn(&self, mut motor: Place, output: Place) -> Reading<S> {
        let counts_per_turn = i64::from(self.motor.counts_per_turn);
        let turn = self.motor.weight.wrapping_mul(counts_per_turn);
        let turns = nearest(self.units(motor.counts, output.counts), turn);
        motor.counts = motor.counts.wrapping_sub(turns.wrapping_mul(counts_per_turn));
        self.reading(motor, output)
    }

    /// The next reading. Either shaft may have moved by less than half a turn of its own; beyond [`MISREAD_BEYOND`] rated deflections the motor's turn is found anew.
    #[inline]
    #[must_use]
    pub fn follow(&self, last: &Reading<S>, motor: u32, output: u32) -> Reading<S> {
        let (motor, output) = (self.motor.follow(&last.motor, motor), self.output.follow(&last.output, output));
        if self.within(motor.counts, output.counts).unsigned_abs() > self.largest {
            return self.in_nearest_turn(motor, output);
        }
        self.reading(motor, output)
    }

    /// The deflection at counts over all turns: rad for floats, a fraction of the rated deflection for fixed point; saturates.
    #[inline]
    #[must_use]
    pub fn deflection(&self, motor_counts: i64, output_counts: i64) -> S {
        S::from_counts(self.within(motor_counts, output_counts), self.deflection)
    }

    /// θ in common units; saturates.
    #[inline]
    fn within(&self, motor_counts: i64, output_counts: i64) -> i32 {
        let units = self.units(motor_counts, output_counts);
        if units > i64::from(i32::MAX) {
            i32::MAX
        } else if units < i64::from(i32::MIN) {
            i32::MIN
        } else {
            units as i32
        }
    }

    /// θ in common units. The products may overflow after very many turns; their difference is right all the same.
    #[inline]
    fn units(&self, motor_counts: i64, output_counts: i64) -> i64 {
        let (motor, output) =
            (motor_counts.wrapping_mul(self.motor.weight), output_counts.wrapping_mul(self.output.weight));
        motor.wrapping_sub(output).wrapping_sub(self.zero)
    }

    #[inline]
    fn reading(&self, motor: Place, output: Place) -> Reading<S> {
        Reading { deflection: self.deflection(motor.counts, output.counts), motor, output }
    }
}

impl<S: FromCounts + Float> EncoderPair<S> {
    /// q_m within one turn, rad, for terms that depend on it.
    #[inline]
    #[must_use]
    pub fn motor_angle(&self, reading: &Reading<S>) -> S {
        S::from_counts(reading.motor.within_turn, self.motor.angle)
    }

    /// q_o within one turn, rad.
    #[inline]
    #[must_use]
    pub fn output_angle(&self, reading: &Reading<S>) -> S {
        S::from_counts(reading.output.within_turn, self.output.angle)
    }

    /// The mean of q̇_o over the last period, rad/s.
    #[inline]
    #[must_use]
    pub fn output_velocity(&self, reading: &Reading<S>, rate_hz: S) -> S {
        S::from_counts(reading.output.change, self.output.angle) * rate_hz
    }
}

impl<S: FromCounts> Shaft<S> {
    fn new(mounting: Mounting, weight: i64) -> Self {
        let counts_per_turn = mounting.counts_per_turn;
        let turn = if S::SI { Extended::TURN } else { Extended::ONE };
        let angle = S::factor_of(turn.over(Extended::of_whole(u64::from(counts_per_turn))));
        Self { counts_per_turn, reversed: mounting.reversed, weight, angle }
    }

    /// A raw angle in the sense of the model. Encoders of this crate give at most 2^30; what is more cannot be an angle.
    #[inline]
    fn directed(&self, raw: u32) -> i32 {
        let raw = raw.min(self.counts_per_turn) as i32;
        if self.reversed { -raw } else { raw }
    }

    fn start(&self, raw: u32) -> Place {
        let within_turn = self.directed(raw);
        Place { counts: i64::from(within_turn), within_turn, change: 0 }
    }

    /// Moves to a raw angle by the shorter way.
    #[inline]
    fn follow(&self, last: &Place, raw: u32) -> Place {
        let within_turn = self.directed(raw);
        let turn = self.counts_per_turn as i32;
        let mut change = within_turn - last.within_turn;
        if change > turn / 2 {
            change -= turn;
        } else if change < -(turn / 2) {
            change += turn;
        }
        Place { counts: last.counts.wrapping_add(i64::from(change)), within_turn, change }
    }
}

/// The magnitude of an angle below half a turn.
pub(crate) fn below_half_turn(angle_rad: f64) -> Option<Extended> {
    Extended::of_double(angle_rad).filter(|angle| *angle < Extended::TURN.over(Extended::of_whole(2)))
}

/// The nearest whole number to a magnitude, with the sign of another number.
pub(crate) const fn signed(like: f64, magnitude: Extended) -> i64 {
    let whole = magnitude.rounded().cast_signed();
    if like.is_sign_negative() { whole.wrapping_neg() } else { whole }
}

pub(crate) const fn gcd(mut a: u64, mut b: u64) -> u64 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// a/b; a divisor is never 0 here, which the compiler cannot know.
const fn quotient(a: u64, b: u64) -> u64 {
    match a.checked_div(b) {
        Some(quotient) => quotient,
        None => 0,
    }
}

/// a/b to the nearest integer, b > 0.
const fn nearest(a: i64, b: i64) -> i64 {
    match a.saturating_add(b / 2).checked_div_euclid(b) {
        Some(quotient) => quotient,
        None => 0,
    }
}
