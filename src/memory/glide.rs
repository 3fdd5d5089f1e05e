//! The short way along a branch of law `masing`: what a sample needs that neither turns, nor reaches a turning point, nor leaves the arc.
//!
//! Everything else is decided once, where the branch is entered. The bits are those of the long way.

use super::Frame;
use crate::scalar::Scalar;

/// Just below one: rounding never carries a sample past the end of an arc unseen.
const NEARLY_ONE: f64 = 1.0 - 1e-6;

/// The present branch up to the place where something changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Glide<S> {
    /// 1 rising, −1 falling.
    sign: S,
    /// 2 on the initial curve, else 1.
    steepness: S,
    /// sign·θ has to stay below; no sample is where there is no short way.
    until: S,
}

impl<S: Scalar> Glide<S> {
    /// No short way.
    #[inline]
    pub(super) fn none() -> Self {
        Self { sign: S::ONE, steepness: S::ONE, until: S::from_f64(-1e30) }
    }

    /// From `here` along the arc of `anchor`, rising or falling, to the turning point `target` (without one, the initial curve), within ±A.
    pub(super) fn new(frame: &Frame<S>, half_play: S, rising: bool, here: S, anchor: S, target: Option<S>) -> Self {
        if !frame.in_range(here) {
            return Self::none();
        }
        let sign = if rising { S::ONE } else { -S::ONE };
        let nearly_rated = frame.rated() * S::from_f64(NEARLY_ONE);
        let half_arc = anchor.signed(sign) + nearly_rated;
        let (steepness, end) = match target {
            Some(target) => (S::ONE, (half_arc + nearly_rated).min(target.signed(sign))),
            None => (S::TWO, half_arc),
        };
        Self { sign, steepness, until: end.min(nearly_rated - half_play) }
    }

    /// The deflection after the play, if a sample at `theta` goes on along the arc; it then lies within ±A.
    #[inline]
    pub(super) fn follow(&self, half_play: S, filtered: S, theta: S) -> Option<S> {
        let ahead = theta.signed(self.sign) - half_play;
        (ahead > filtered.signed(self.sign) && ahead < self.until).then(|| ahead.signed(self.sign))
    }

    /// η at a distance `step` (over A) from the anchor.
    #[inline]
    pub(super) fn eta(&self, anchor_eta: S, step: S) -> S {
        anchor_eta + step * (S::TWO - self.steepness * step.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::Glide;
    use crate::memory::Frame;
    use crate::{Elastic, Memory, ParamError, Params};

    #[test]
    fn follows_up_to_turns_targets_and_tips_only() -> Result<(), ParamError> {
        let elastic = Elastic { c1_nm_per_rad: 1.0, ..Elastic::default() };
        let memory = Memory { alpha: 0.1, beta_per_s: 1.0, omega_per_s: 1.0, ..Memory::default() };
        let frame = Frame::<f64>::new(&Params::new(1.0, elastic, memory)?);
        let falling = Glide::new(&frame, 0.0, false, 0.5, 0.75, Some(-0.25));
        assert_eq!(falling.follow(0.0, 0.5, 0.25), Some(0.25));
        assert_eq!(falling.follow(0.0, 0.5, 0.5), None);
        assert_eq!(falling.follow(0.0, 0.5, 0.625), None);
        assert_eq!(falling.follow(0.0, 0.5, -0.25), None);
        assert_eq!(falling.follow(0.0, 0.5, f64::NAN), None);
        assert_eq!(falling.follow(0.125, 0.5, 0.25), Some(0.375));
        assert_eq!(falling.follow(0.125, 0.5, 0.375), None);
        let initial = Glide::new(&frame, 0.0, true, 0.5, 0.25, None);
        assert_eq!(initial.follow(0.0, 0.5, 0.875), Some(0.875));
        assert_eq!(initial.follow(0.0, 0.5, 1.0), None);
        let outside = Glide::new(&frame, 0.0, true, -1.5, -2.0, Some(0.0));
        assert_eq!(outside.follow(0.0, -1.5, -0.5), None);
        Ok(())
    }
}
