//! The operations that the model asks of a number.
//!
//! [`Scalar`] is what the quasi-static law and the memory in real time need: sums, products, one square root. [`Float`] adds what the memory
//! in pseudo-time and varying sample periods need. Both are implemented for `f32` and `f64` by the `libm` crate alone, [`Scalar`] also for
//! [`Fixed`] point, so that host and microcontroller agree bit by bit.
//!
#![cfg_attr(not(feature = "fixed"), doc = "[`Fixed`]: crate#features")]

pub mod circle;
mod extended;
#[cfg(feature = "fixed")]
pub mod fixed;
mod float;

use core::fmt::Debug;
use core::ops::{Add, Mul, Neg, Sub};

pub use self::extended::Extended;
#[cfg(feature = "fixed")]
pub use self::fixed::Fixed;

/// A number the model can be evaluated in.
///
/// Samples enter in *input units* and are scaled once by [`normalise`](Self::normalise): radians for floats, deflections that are
/// already divided by the rated deflection for fixed point.
pub trait Scalar:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + crate::sealed::Sealed
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// 1/2.
    const HALF: Self;
    /// 1.
    const ONE: Self;
    /// 2.
    const TWO: Self;
    /// The spacing of the numbers next to 1.
    const EPSILON: f64;
    /// What an inverse may leave of a torque, as a share of the rated one.
    const TOLERANCE: f64;
    /// No number is larger.
    const LARGEST: f64;
    /// Whether input units are SI (floats) or fractions of the rated deflection and the rated torque (fixed point).
    const SI: bool;
    /// Samples beyond this many rated deflections are refused: no gear survives them, and their powers would overflow.
    const REFUSED_BEYOND: f64;

    /// A factor that may be far smaller than one, kept to the full precision of a word.
    type Gain: Copy + Debug + PartialEq;
    /// What the sums of [`leak`](Self::leak) rounded off.
    type Carry: Copy + Debug + Default + PartialEq;

    /// The nearest representable value; saturates.
    fn from_f64(x: f64) -> Self;
    /// The exact value.
    fn to_f64(self) -> f64;
    /// Absolute value.
    fn abs(self) -> Self;
    /// √x, 0 for x ≤ 0; correctly rounded for floats.
    fn sqrt(self) -> Self;
    /// 1/x for x ≠ 0.
    fn recip(self) -> Self;
    /// Quotient, for a divisor other than 0.
    #[inline]
    fn over(self, divisor: Self) -> Self {
        self * divisor.recip()
    }
    /// √((1 − x)(1 + x)), 0 beyond ±1. `_square` is x², which says it all on an even grid.
    #[inline]
    fn cosine(self, _square: Self) -> Self {
        ((Self::ONE - self) * (Self::ONE + self)).sqrt()
    }
    /// √(a² + 2xy), 0 where that is negative; the squares may be larger than any number is.
    #[inline]
    fn root_of_parabola(a: Self, x: Self, y: Self) -> Self {
        (a * a + (x + x) * y).sqrt()
    }
    /// self·n for n of 0, ±1 or ±2.
    #[inline]
    fn multiple(self, n: Self) -> Self {
        self * n
    }
    /// self·sign for a sign of 1 or −1.
    #[inline]
    fn signed(self, sign: Self) -> Self {
        self * sign
    }
    /// An input-unit difference as a fraction of the rated deflection.
    fn normalise(self, inverse_scale: Self) -> Self;
    /// A fraction of the rated torque in output units.
    fn denormalise(self, scale: Self) -> Self;

    /// The nearest gain.
    fn gain_from_f64(x: f64) -> Self::Gain;
    /// x − forgotten·x.
    fn fade(self, forgotten: Self::Gain) -> Self;
    /// memory ← memory − forgotten·memory + Σ gain·input, with what is rounded off carried to the next call, so that nothing drifts
    /// however little is forgotten a step.
    fn leak(memory: &mut Self, carry: &mut Self::Carry, forgotten: Self::Gain, inputs: [(Self::Gain, Self); 2]);

    /// The larger of the two.
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    /// The smaller of the two.
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    /// x limited to [low, high]; NaN stays NaN, so that no limit is ever taken for it.
    #[inline]
    fn clamp(self, low: Self, high: Self) -> Self {
        if self < low {
            low
        } else if self > high {
            high
        } else {
            self
        }
    }
}

/// A floating-point number: what the memory integral needs beyond [`Scalar`].
pub trait Float: Scalar<Gain = Self> {
    /// The nearest value, without arithmetic in double precision; 0 below the least normal one, infinite beyond the largest.
    fn of_extended(x: Extended) -> Self;
    /// Neither NaN nor infinite.
    fn is_finite(self) -> bool;
    /// e^x − 1 without cancellation near 0.
    fn exp_m1(self) -> Self;
    /// e^x.
    fn exp(self) -> Self;
    /// ln x for x > 0.
    fn ln(self) -> Self;
    /// arcsin x for abs(x) ≤ 1.
    fn asin(self) -> Self;
    /// arcsin x for abs(x) ≤ 1/2. In `f32` by [`circle::arcsine`], without double arithmetic.
    fn asin_of_small(self) -> Self;
    /// The angle of the point (x, y) from the x axis, in (−π, π].
    fn atan2(self, x: Self) -> Self;
    /// sin x.
    fn sin(self) -> Self;
    /// cos x.
    fn cos(self) -> Self;
    /// sin x and cos x. In `f32` by [`circle::sin_cos`], without double arithmetic.
    fn sin_cos(self) -> (Self, Self);
    /// x less whole turns in `f32` (within ±π), where multiples of a large angle would lose its digits; x itself in `f64`.
    fn wrap_turn(self) -> Self;
    /// tanh x.
    fn tanh(self) -> Self;
    /// x^y for x ≥ 0.
    fn powf(self, y: Self) -> Self;
    /// The nearest integer.
    fn round(self) -> Self;
}
