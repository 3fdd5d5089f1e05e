//! Where adapted coefficients may lie: a convex set about the block's own, so that the way to it never leaves the set.
//!
//! | bound | |
//! |---|---|
//! | each coefficient | within ± the largest change, of T_A |
//! | their common factor γ | within ± the largest change |
//! | e, h | 0 and more |
//! | the least rising slope p′ − e(1 − 2u²)/g − 2h (what an [inverse](crate::inverse) needs) | at least half the block's, at u² = 0, 1/4, 1/2, 3/4, 1; where the block's is not above zero, the block's |
//!
//! An estimate below e = 0 or h = 0 becomes zero there. Then all changes shrink until every bound holds.

use super::state::AdaptationState;
use super::triangle::{dot, scale};
use super::{Adaptation, COEFFICIENTS, Coefficients};
use crate::scalar::Float;

/// u² and (1 − 2u²)/g where that is above zero; singles, which no scalar computes in double precision.
const PLACES: [[f32; 2]; 5] = [[0.0, 1.0], [0.25, 0.577_350_27], [0.5, 0.0], [0.75, 0.0], [1.0, 0.0]];

/// Bounds that are rows: both sides of the common factor, and slopes.
const ROWS: usize = 2 + PLACES.len();
/// All: the coefficients come after the rows.
pub(super) const BOUNDS: usize = ROWS + COEFFICIENTS;

/// Rows whose products with allowed changes are 1 at most.
pub(super) type Bounds<S> = [Coefficients<S>; ROWS];

/// The bounds about a block.
pub(super) fn bounds<S: Float>(block: &Coefficients<S>, common: &Coefficients<S>, change: S) -> Bounds<S> {
    let mut bounds = [common.map(|x| x.over(change)); ROWS];
    bounds[1] = bounds[0].map(|x| -x);
    let [three, five] = [3.0, 5.0].map(S::from_f64);
    for (row, place) in bounds[2..].iter_mut().zip(PLACES) {
        let [square, loosening] = place.map(|x| S::from_f64(f64::from(x)));
        let slope = [-S::TWO, -loosening, five * square * square, three * square, S::ONE];
        // Where it may not fall at all, next to nothing is left.
        let fall = (S::HALF * dot(&slope, block)).max(S::from_f64(1e-9));
        *row = slope.map(|x| -x.over(fall));
    }
    bounds
}

impl<S: Float> Adaptation<S> {
    /// The shadow anew: the estimate, e and h brought up to zero.
    #[inline]
    pub(super) fn lift(&self, state: &mut AdaptationState<S>) {
        let shadow = &mut state.trial.shadow;
        *shadow = state.estimate.value;
        let [h, e, ..] = shadow;
        let [block_h, block_e, ..] = self.block;
        (*h, *e) = (h.max(-block_h), e.max(-block_e));
        state.held = false;
    }

    /// Holds the shadow within a bound.
    #[inline(always)]
    pub(super) fn bound(&self, state: &mut AdaptationState<S>, number: usize) {
        let value = match (self.bounds.get(number), state.trial.shadow.get(number.wrapping_sub(ROWS))) {
            (Some(row), _) => dot(row, &state.trial.shadow),
            (None, Some(change)) => change.abs() * self.inverse_change,
            (None, None) => return,
        };
        if value > S::ONE {
            scale(&mut state.trial.shadow, value.recip());
            state.held = true;
        }
    }
}
