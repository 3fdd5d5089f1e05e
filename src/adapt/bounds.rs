//! Where adapted coefficients may lie: a convex set about the block's own, so that the way to it never leaves the set.
//!
//! | bound | |
//! |---|---|
//! | each coefficient | within ± the largest change, of T_A |
//! | their common factor γ | within ± the largest change |
//! | e, h | 0 and more |
//! | the least rising slope p′ − e(1 − 2u²)/g − 2h (what an [inverse](crate::inverse) needs) | at least half the block's, at u² = 0, 1/4, 1/2, 3/4, 1; where the block's is not above zero, the block's |
//!
//! An estimate below e = 0 or h = 0 becomes the best one there: x − P_k·x_k/P_kk. Then all changes shrink by one share until every bound holds.

use super::Coefficients;
use super::filter::Estimate;
use super::stretch::dot;
use crate::scalar::Float;

/// Numbers of e and h among the coefficients.
const NOT_NEGATIVE: [usize; 2] = [3, 4];

/// u² and (1 − 2u²)/g where that is above zero.
const PLACES: [[f64; 2]; 5] = [[0.0, 1.0], [0.25, 0.577_350_27], [0.5, 0.0], [0.75, 0.0], [1.0, 0.0]];

/// What multiplies the coefficients in the least rising slope.
#[inline]
fn slope_row<S: Float>([square, loosening]: [f64; 2]) -> Coefficients<S> {
    [1.0, 3.0 * square, 5.0 * square * square, -loosening, -2.0].map(S::from_f64)
}

/// The bounds about a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds<S> {
    /// The most that a coefficient may change.
    pub(super) change: S,
    /// How far each slope may fall.
    fall: [S; PLACES.len()],
}

impl<S: Float> Bounds<S> {
    pub(super) fn new(block: &Coefficients<S>, change: S) -> Self {
        let fall = PLACES.map(|place| (S::HALF * dot(&slope_row(place), block)).max(S::ZERO));
        Self { change, fall }
    }

    /// Brings e (number 0) or h (1) of the changes of an estimate up to zero, and the others to the best ones beside it.
    #[inline(never)]
    pub(super) fn lift(block: &Coefficients<S>, estimate: &Estimate<S>, change: &mut Coefficients<S>, number: usize) {
        let number = NOT_NEGATIVE[number.min(1)];
        let below = block[number] + change[number];
        if below < S::ZERO {
            let covariance = estimate.covariance(number);
            let share = below.over(covariance[number]);
            for (change, covariance) in change.iter_mut().zip(covariance) {
                *change = *change - covariance * share;
            }
        }
    }

    /// Shrinks changes until every bound holds; says whether one held.
    #[inline(never)]
    pub(super) fn shrink(
        &self,
        block: &Coefficients<S>,
        common: &Coefficients<S>,
        change: &mut Coefficients<S>,
    ) -> bool {
        for number in NOT_NEGATIVE {
            change[number] = change[number].max(-block[number]);
        }
        let mut share = S::ONE;
        let mut within = |value: S, limit: S| {
            if value * share > limit {
                share = limit.over(value);
            }
        };
        for value in change.iter() {
            within(value.abs(), self.change);
        }
        within(dot(common, change).abs(), self.change);
        for (place, fall) in PLACES.iter().zip(self.fall) {
            within(-dot(&slope_row(*place), change), fall);
        }
        *change = change.map(|change| change * share);
        share < S::ONE
    }
}
