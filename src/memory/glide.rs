//! The short way along a branch of law `masing`: what a sample needs that neither turns, nor reaches a turning point, nor leaves the arc.
//!
//! Everything else is decided once, where the branch is entered. The bits are those of the long way.

use super::Frame;
use super::masing::TurningPoint;
use crate::scalar::Scalar;

/// Just below one: rounding never carries a sample past the end of an arc unseen.
const NEARLY_ONE: f64 = 1.0 - 1e-6;

/// The present branch up to the place where something changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Glide<S> {
    rising: bool,
    /// 2 on the initial curve, else 1.
    steepness: S,
    /// The deflection after the play has to stay before; no sample does where there is no short way.
    until: S,
}

impl<S: Scalar> Glide<S> {
    /// No short way.
    #[inline]
    pub(super) fn none() -> Self {
        Self { rising: true, steepness: S::ONE, until: S::from_f64(-1e30) }
    }

    /// Along the arc of `anchor`, rising or falling, to the turning point `target` (without one, the initial curve), within ±A.
    #[inline]
    pub(super) fn new(frame: &Frame<S>, half_play: S, rising: bool, anchor: S, target: Option<S>) -> Self {
        // An arc that starts beyond a tip may be fully open before it ends.
        if !frame.in_range(anchor) {
            return Self::none();
        }
        let (nearly_rated, initial) = (frame.rated() * S::from_f64(NEARLY_ONE), target.is_none());
        let until = if rising {
            target.unwrap_or(anchor + nearly_rated).min(nearly_rated - half_play)
        } else {
            target.unwrap_or(anchor - nearly_rated).max(half_play - nearly_rated)
        };
        Self { rising, steepness: if initial { S::TWO } else { S::ONE }, until }
    }

    /// The deflection after the play and η there, if a sample at `theta` goes on along the arc; it then lies within ±A.
    #[inline]
    pub(super) fn follow(
        &self,
        frame: &Frame<S>,
        half_play: S,
        filtered: S,
        theta: S,
        anchor: TurningPoint<S>,
    ) -> Option<[S; 2]> {
        let eta = |bent: fn(S, S) -> S, ahead: S| {
            let step = frame.fraction(ahead - anchor.theta);
            anchor.eta + step * bent(S::TWO, step.multiple(self.steepness))
        };
        if self.rising {
            let ahead = theta - half_play;
            (ahead > filtered && ahead < self.until).then(|| [ahead, eta(S::sub, ahead)])
        } else {
            let ahead = theta + half_play;
            (ahead < filtered && ahead > self.until).then(|| [ahead, eta(S::add, ahead)])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Glide, TurningPoint};
    use crate::memory::Frame;
    use crate::{Elastic, Memory, ParamError, Params};

    #[test]
    fn follows_up_to_turns_targets_and_tips_only() -> Result<(), ParamError> {
        let elastic = Elastic { c1_nm_per_rad: 1.0, ..Elastic::default() };
        let memory = Memory { alpha: 0.1, beta_per_s: 1.0, omega_per_s: 1.0, ..Memory::default() };
        let frame = Frame::<f64>::new(&Params::new(1.0, elastic, memory)?);
        let point = |theta: f64| TurningPoint { theta, eta: 0.0 };
        let follow = |glide: Glide<f64>, half_play, filtered, theta, anchor| {
            glide.follow(&frame, half_play, filtered, theta, point(anchor)).map(|[ahead, _]| ahead)
        };
        let falling = Glide::new(&frame, 0.0, false, 0.75, Some(-0.25));
        assert_eq!(falling.follow(&frame, 0.0, 0.5, 0.25, point(0.75)), Some([0.25, -0.5 * 1.5]));
        assert_eq!(follow(falling, 0.0, 0.5, 0.5, 0.75), None);
        assert_eq!(follow(falling, 0.0, 0.5, 0.625, 0.75), None);
        assert_eq!(follow(falling, 0.0, 0.5, -0.25, 0.75), None);
        assert_eq!(follow(falling, 0.0, 0.5, f64::NAN, 0.75), None);
        assert_eq!(follow(falling, 0.125, 0.5, 0.25, 0.75), Some(0.375));
        assert_eq!(follow(falling, 0.125, 0.5, 0.375, 0.75), None);
        let initial = Glide::new(&frame, 0.0, true, 0.25, None);
        assert_eq!(initial.follow(&frame, 0.0, 0.5, 0.875, point(0.25)), Some([0.875, 0.625 * 0.75]));
        assert_eq!(follow(initial, 0.0, 0.5, 1.0, 0.25), None);
        let outside = Glide::new(&frame, 0.0, true, -2.0, Some(0.0));
        assert_eq!(follow(outside, 0.0, -1.5, -0.5, -2.0), None);
        Ok(())
    }
}
