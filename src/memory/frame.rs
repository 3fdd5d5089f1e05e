//! The measures of a gear: its rated deflection, what a sample is divided by, and the gate.

use crate::params::Params;
use crate::scalar::Scalar;

/// A sample beyond this many rated deflections makes the past uncertain: it may have been an outlier. In law `masing` the deflection after the play counts.
pub const DOUBTED_BEYOND: f64 = 1.25;

/// Law `time` counts a sample beyond this many rated deflections as one there. Fixed point refuses a sample before.
pub(crate) const COUNTED_UP_TO: f64 = 10.0;

/// Rated deflection and torque scale in input units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<S> {
    rated: S,
    inverse_rated: S,
    torque_scale: S,
    limit: S,
}

impl<S: Scalar> Frame<S> {
    /// The frame of a gear: radians and N·m for floats, fractions of A and T_A for fixed point.
    #[must_use]
    pub fn new(params: &Params) -> Self {
        Self::of(params.rated_deflection_rad(), params.torque_scale_nm())
    }

    /// The frame of A (rad) and T_A (N·m).
    pub(crate) fn of(rated_deflection_rad: f64, torque_scale_nm: f64) -> Self {
        let (rated, torque_scale) = if S::SI { (rated_deflection_rad, torque_scale_nm) } else { (1.0, 1.0) };
        Self {
            rated: S::from_f64(rated),
            inverse_rated: S::from_f64(1.0 / rated),
            torque_scale: S::from_f64(torque_scale),
            limit: S::from_f64(rated * S::REFUSED_BEYOND),
        }
    }

    /// The words of a prepared block, in order.
    #[cfg(feature = "block")]
    pub(crate) fn words(&self) -> [S; 4] {
        [self.rated, self.inverse_rated, self.torque_scale, self.limit]
    }

    /// The frame of such words.
    #[cfg(feature = "block")]
    pub(crate) fn of_words([rated, inverse_rated, torque_scale, limit]: [S; 4]) -> Self {
        Self { rated, inverse_rated, torque_scale, limit }
    }

    /// A in input units.
    #[inline]
    #[must_use]
    pub fn rated(&self) -> S {
        self.rated
    }

    /// 1/A in input units.
    #[must_use]
    pub fn inverse_rated(&self) -> S {
        self.inverse_rated
    }

    /// The largest deflection that is accepted, input units.
    #[must_use]
    pub fn limit(&self) -> S {
        self.limit
    }

    /// A deflection, or a difference of two, over A.
    #[inline]
    #[must_use]
    pub fn fraction(&self, theta: S) -> S {
        theta.normalise(self.inverse_rated)
    }

    /// A fraction of A as a deflection in input units.
    #[inline]
    #[must_use]
    pub fn deflection(&self, u: S) -> S {
        u.denormalise(self.rated)
    }

    /// A normalised torque in output units.
    #[inline]
    #[must_use]
    pub fn torque(&self, tau: S) -> S {
        tau.denormalise(self.torque_scale)
    }

    /// A torque in output units, normalised.
    #[inline]
    #[must_use]
    pub fn torque_scale(&self) -> S {
        self.torque_scale
    }

    /// Whether a sample can be a deflection at all: finite and below [`REFUSED_BEYOND`](Scalar::REFUSED_BEYOND).
    #[inline]
    #[must_use]
    pub fn accepts(&self, theta: S) -> bool {
        // A NaN compares false.
        theta.abs() <= self.limit
    }

    /// Whether the sample lies within ±A, where the model is calibrated.
    #[inline]
    #[must_use]
    pub fn in_range(&self, theta: S) -> bool {
        theta.abs() <= self.rated
    }

    /// Whether the sample lies so far out that it may have been an outlier: beyond [`DOUBTED_BEYOND`]. What is known of the past is then in doubt.
    #[inline]
    #[must_use]
    pub fn is_doubtful(&self, theta: S) -> bool {
        theta.abs() > self.doubted()
    }

    /// [`DOUBTED_BEYOND`] as a deflection.
    #[inline]
    pub(crate) fn doubted(&self) -> S {
        self.deflection(S::from_f64(DOUBTED_BEYOND))
    }

    /// The deflection that a memory in time counts: no gear winds up by more than [`COUNTED_UP_TO`] rated deflections, and one bad sample must not fill the memory for long.
    pub(crate) fn counted(&self, theta: S) -> S {
        let most = self.deflection(S::from_f64(COUNTED_UP_TO));
        theta.clamp(-most, most)
    }

    /// clamp(θ/A, −1, 1).
    #[inline]
    #[must_use]
    pub fn clamped_fraction(&self, theta: S) -> S {
        self.fraction(theta).clamp(-S::ONE, S::ONE)
    }

    /// The gate g = √(max(0, (1 − θ/A)(1 + θ/A))).
    ///
    /// A ∓ θ is exact near the tips, so the error stays at 3 units in the last place everywhere.
    #[inline(always)]
    #[must_use]
    pub fn gate(&self, theta: S) -> S {
        if !S::SI {
            // The spring shares the square.
            return theta.cosine(theta * theta);
        }
        (self.fraction(self.rated - theta) * self.fraction(self.rated + theta)).sqrt()
    }
}
