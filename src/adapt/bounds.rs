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

use core::hint::black_box;

use super::Coefficients;
use super::filter::Estimate;
use super::kernel::{add, dot};
use crate::scalar::Float;

/// Numbers of e and h among the coefficients.
const NOT_NEGATIVE: [usize; 2] = [3, 4];

/// u² and (1 − 2u²)/g where that is above zero.
const PLACES: [[f64; 2]; 5] = [[0.0, 1.0], [0.25, 0.577_350_27], [0.5, 0.0], [0.75, 0.0], [1.0, 0.0]];

/// A place at which the slope is bounded.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place<S> {
    square: S,
    loosening: S,
    /// How far the slope may fall.
    fall: S,
}

impl<S: Float> Place<S> {
    /// The least rising slope of coefficients.
    fn slope(&self, [k1, k3, k5, e, h]: &Coefficients<S>) -> S {
        let (three, five) = (S::from_f64(3.0), S::from_f64(5.0));
        *k1 + self.square * (three * *k3 + five * self.square * *k5) - self.loosening * *e - (*h + *h)
    }
}

/// The bounds about a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds<S> {
    /// The most that a coefficient may change.
    pub(super) change: S,
    places: [Place<S>; PLACES.len()],
}

impl<S: Float> Bounds<S> {
    pub(super) fn new(block: &Coefficients<S>, change: S) -> Self {
        let places = PLACES.map(|[square, loosening]| {
            let place = Place { square: S::from_f64(square), loosening: S::from_f64(loosening), fall: S::ZERO };
            Place { fall: (S::HALF * place.slope(block)).max(S::ZERO), ..place }
        });
        Self { change, places }
    }

    /// Brings e (number 0) or h (1) of the changes of an estimate up to zero, and the others to the best ones beside it.
    #[inline(never)]
    pub(super) fn lift(block: &Coefficients<S>, estimate: &Estimate<S>, change: &mut Coefficients<S>, number: usize) {
        let number = NOT_NEGATIVE[number.min(1)];
        let below = block[number] + change[number];
        if below < S::ZERO {
            let covariance = estimate.covariance(number);
            let share = below.over(covariance[number]);
            add(change, &covariance, -share);
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
        let largest = change.iter().fold(dot(common, change).abs(), |largest, change| largest.max(change.abs()));
        // The most that a value passes its limit by.
        let mut excess = S::ONE;
        let mut within = |value: S, limit: S| {
            if value > excess * limit {
                excess = value.over(limit);
            }
        };
        within(largest, self.change);
        for place in black_box(self.places.as_slice()) {
            within(-place.slope(change), place.fall);
            black_box(());
        }
        let share = excess.recip();
        for change in black_box(change.as_mut_slice()) {
            *change = *change * share;
            black_box(());
        }
        excess > S::ONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_below_zero_becomes_the_best_one_at_zero() {
        let block = [0.9, 0.1, 0.0, 0.1, 0.05];
        let estimate = Estimate::<f64>::new(0.01);
        let mut change = [0.02, 0.0, 0.0, -0.2, -0.01];
        Bounds::lift(&block, &estimate, &mut change, 0);
        Bounds::lift(&block, &estimate, &mut change, 1);
        // Of an estimate whose coefficients do not vary together, the others stay.
        assert!((change[3] + 0.1).abs() < 1e-12 && change[4] == -0.01 && change[0] == 0.02, "{change:?}");
    }
}
