//! The short way along a branch of law `masing`: what a sample needs that neither turns, nor reaches a turning point, nor leaves the arc.
//!
//! Everything else is decided once, where the branch is entered. The bits are those of the long way.

use super::Frame;
use super::masing::Branch;
use crate::scalar::Scalar;

/// Just below one: rounding never carries a sample past the end of an arc unseen.
const NEARLY_ONE: f64 = 1.0 - 1e-6;

/// The present branch up to the place where something changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FastPath<S> {
    /// By how much the deflection after the play lags behind.
    lag: S,
    /// That deflection has to stay before; none does where there is no short way. In floats times the bend of the branch, which spares two branches.
    until: S,
}

impl<S: Scalar> FastPath<S> {
    /// No short way.
    #[inline]
    pub(super) fn none(sign: S) -> Self {
        Self { lag: S::ZERO, until: S::from_f64(-1e30).signed(sign) }
    }

    /// Along a branch, rising (`sign` = 1) or falling (−1), to the turning point `target` (without one, the initial curve), within ±A.
    #[inline]
    pub(super) fn new(frame: &Frame<S>, half_play: S, sign: S, branch: &Branch<S>, target: Option<S>) -> Self {
        let anchor = branch.anchor.theta;
        // A branch that starts beyond a tip may be fully open before it ends.
        if !frame.in_range(anchor) {
            return Self::none(if S::SI { S::ONE } else { sign });
        }
        let nearly_rated = frame.rated() * S::from_f64(NEARLY_ONE);
        let end = target.map_or(anchor.signed(sign) + nearly_rated, |target| target.signed(sign));
        let until = end.min(nearly_rated - half_play);
        let until = if S::SI { until.multiple(branch.bend.abs()) } else { until.signed(sign) };
        Self { lag: half_play.signed(sign), until }
    }

    /// The deflection after the play that ends the short way along a branch from a turning point, or one behind where there is none.
    #[inline]
    pub(super) fn end(&self, sign: S) -> S {
        if S::SI { self.until.signed(sign) } else { self.until }
    }

    /// The deflection after the play and η there, if a sample at `theta` goes on along the branch; it then lies within ±A.
    #[inline]
    pub(super) fn follow(&self, frame: &Frame<S>, filtered: S, theta: S, branch: &Branch<S>) -> Option<[S; 2]> {
        let Branch { anchor, slope, bend } = *branch;
        let ahead = theta - self.lag;
        let goes_on = if S::SI {
            ahead * bend > filtered * bend && ahead * bend < self.until
        } else if bend > S::ZERO {
            ahead > filtered && ahead < self.until
        } else {
            ahead < filtered && ahead > self.until
        };
        goes_on.then(|| {
            let step = frame.fraction(ahead - anchor.theta);
            [ahead, anchor.eta + step * (slope - step.multiple(bend))]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::FastPath;
    use crate::memory::Frame;
    use crate::memory::masing::{Branch, TurningPoint};
    use crate::{Elastic, Memory, ParamError, Params};

    #[test]
    fn follows_up_to_turns_targets_and_tips_only() -> Result<(), ParamError> {
        let elastic = Elastic { c1_nm_per_rad: 1.0, ..Elastic::default() };
        let memory = Memory { alpha: 0.1, beta_per_s: 1.0, omega_per_s: 1.0, ..Memory::default() };
        let frame = Frame::<f64>::new(&Params::new(1.0, elastic, memory)?);
        let branch = |theta: f64, sign| Branch::from(TurningPoint { theta, eta: 0.0 }, sign);
        let along = |branch: &Branch<f64>, half_play, sign, target, filtered, theta| {
            FastPath::new(&frame, half_play, sign, branch, target).follow(&frame, filtered, theta, branch)
        };
        let falling = |half_play, filtered, theta| {
            let seen = along(&branch(0.75, -1.0), half_play, -1.0, Some(-0.25), filtered, theta);
            seen.map(|[ahead, _]| ahead)
        };
        assert_eq!(along(&branch(0.75, -1.0), 0.0, -1.0, Some(-0.25), 0.5, 0.25), Some([0.25, -0.5 * 1.5]));
        assert_eq!(falling(0.0, 0.5, 0.5), None);
        assert_eq!(falling(0.0, 0.5, 0.625), None);
        assert_eq!(falling(0.0, 0.5, -0.25), None);
        assert_eq!(falling(0.0, 0.5, f64::NAN), None);
        assert_eq!(falling(0.125, 0.5, 0.25), Some(0.375));
        assert_eq!(falling(0.125, 0.5, 0.375), None);
        let initial = Branch::initial(0.25, 1.0);
        assert_eq!(along(&initial, 0.0, 1.0, None, 0.5, 0.875), Some([0.875, 0.625 * 0.75]));
        assert_eq!(along(&initial, 0.0, 1.0, None, 0.5, 1.0), None);
        assert_eq!(along(&branch(-2.0, 1.0), 0.0, 1.0, Some(0.0), -1.5, -0.5), None);
        Ok(())
    }
}
