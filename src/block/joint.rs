//! The joint that a gear sits in: ratio, zero of the encoders, side of the torque.

use super::error::BlockError;
use super::layout::JOINT;
use super::prepared::words;
use super::record::{Block, double};
use crate::drive::pair::MOST_RATIO;
use crate::drive::{Mounting, Setup, SetupError};
use crate::scalar::Extended;

/// The joint that the gear sits in.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Joint {
    /// N, negative where the gear reverses; `None` where not stated.
    pub ratio: Option<f64>,
    /// Subtracted from every deflection, rad.
    pub deflection_zero_rad: f64,
    /// Whether the torque is taken on the motor side (σ = +1), not by a sensor on the output side (σ = −1).
    pub motor_side: bool,
}

impl Joint {
    /// The encoders of this joint, ratio and zero applied: what a drive makes its [`EncoderPair`](crate::drive::EncoderPair) of. A negative ratio turns the motor's sense.
    ///
    /// # Errors
    /// [`SetupError::Ratio`]: the block states none, or one that is no fraction of integers to 2^20 within 1e-12. Counts are checked by the pair.
    pub fn encoders(&self, motor: Mounting, output: Mounting, rated_deflection_rad: f64) -> Result<Setup, SetupError> {
        let ratio = self.ratio.ok_or(SetupError::Ratio)?;
        Ok(Setup {
            motor: Mounting { reversed: motor.reversed != ratio.is_sign_negative(), ..motor },
            output,
            ratio: Extended::of_double(ratio).and_then(fraction).ok_or(SetupError::Ratio)?,
            deflection_zero_rad: self.deflection_zero_rad,
            rated_deflection_rad,
        })
    }

    /// σ.
    #[must_use]
    pub fn sigma(&self) -> f32 {
        if self.motor_side { 1.0 } else { -1.0 }
    }
}

/// The fraction of integers to 2^20 that is a ratio within 1e-12 of itself, by continued fractions.
fn fraction(ratio: Extended) -> Option<(u32, u32)> {
    let (mut before, mut now) = ((0, 1), (1, 0));
    let mut rest = ratio;
    for _ in 0..24 {
        let whole = rest.floor();
        let next = |now: u64, before: u64| {
            let next = whole.checked_mul(now)?.checked_add(before)?;
            (next <= u64::from(MOST_RATIO)).then_some(next)
        };
        (before, now) = (now, (next(now.0, before.0)?, next(now.1, before.1)?));
        let [numerator, denominator] = [now.0, now.1].map(Extended::of_whole);
        let error = numerator.over(denominator).apart(ratio);
        if now.0 > 0 && error.times(Extended::of_whole(1_000_000_000_000)) <= ratio {
            return Some((now.0 as u32, now.1 as u32));
        }
        rest = Extended::ONE.over(rest.apart(Extended::of_whole(whole)));
    }
    None
}

/// The record of a [`Joint`] as a block holds it: a drive reads what it needs of it without arithmetic in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct JointRecord([u32; 5]);

impl JointRecord {
    /// That of a block, its words as they are.
    ///
    /// # Errors
    /// [`BlockError`]: none, two, or of another length.
    pub fn of_block(block: &Block<'_>) -> Result<Self, BlockError> {
        words(block, JOINT.tag).map(Self)
    }

    /// That of a block, each of its words within its range.
    pub(super) fn checked(block: &Block<'_>) -> Result<Self, BlockError> {
        block.words::<f32, 5>(&JOINT).map(Self)
    }

    /// What it says.
    #[must_use]
    pub fn joint(&self) -> Joint {
        let [n0, n1, z0, z1, _] = self.0;
        let [ratio, deflection_zero_rad] = [[n0, n1], [z0, z1]].map(double);
        Joint {
            ratio: Extended::of_double(ratio).filter(|size| *size != Extended::ZERO).map(|_| ratio),
            deflection_zero_rad,
            motor_side: self.motor_side(),
        }
    }

    /// [`Joint::ratio`], rounded; 0 where it is not stated.
    #[must_use]
    pub fn ratio(&self) -> f32 {
        let [low, high, ..] = self.0;
        single([low, high])
    }

    /// [`Joint::deflection_zero_rad`], rounded.
    #[must_use]
    pub fn deflection_zero_rad(&self) -> f32 {
        let [_, _, low, high, _] = self.0;
        single([low, high])
    }

    /// [`Joint::motor_side`].
    #[must_use]
    pub fn motor_side(&self) -> bool {
        let [.., side] = self.0;
        side == 1
    }
}

/// A finite double of two words, the lower first, rounded to the nearest single in integers; 0 below the least normal number.
#[inline(never)]
pub(crate) fn single([low, high]: [u32; 2]) -> f32 {
    let sign = high & 1 << 31;
    // Biased as a single is.
    let exponent = (high >> 20 & 0x7ff).saturating_sub(1023 - 127);
    if exponent == 0 {
        return f32::from_bits(sign);
    }
    if exponent >= 0xff {
        return f32::from_bits(sign | 0xff << 23);
    }
    let fraction = (high & 0xf_ffff) << 3 | low >> 29;
    let (rest, half) = (low << 3, 1 << 31);
    let up = rest > half || rest == half && fraction & 1 == 1;
    // A carry goes on into the exponent.
    f32::from_bits((sign | exponent << 23 | fraction) + u32::from(up))
}

#[cfg(test)]
mod tests {
    use super::single;

    #[test]
    fn a_double_is_rounded_as_the_compiler_rounds_it() {
        let of = |x: f64| single([x.to_bits() as u32, (x.to_bits() >> 32) as u32]);
        let mut x = 1.0_f64;
        for k in 0..20_000_u64 {
            // Digits of every length, ties among them, over the whole range.
            x = f64::from_bits(x.to_bits().wrapping_mul(6364136223846793005).wrapping_add(k));
            let x = f64::from_bits(x.to_bits() & !0 << (k % 40));
            let expected = x as f32;
            if expected == 0.0 || expected.is_normal() {
                assert_eq!(of(x).to_bits(), expected.to_bits(), "{x:e}");
            }
        }
        for x in [0.0, -0.0, 100.0, -160.5, 0.1255, 1.0 - f64::EPSILON, 16_777_217.0, 16_777_219.0, 1e300] {
            assert_eq!(of(x).to_bits(), (x as f32).to_bits(), "{x:e}");
        }
    }
}
