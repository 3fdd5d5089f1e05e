//! Where adapted coefficients may lie: a convex set about the block's own, so that the way to it never leaves the set.
//!
//! | bound | |
//! |---|---|
//! | each coefficient | within ± the largest change, of T_A |
//! | their common factor γ | within ± the largest change |
//! | e, h | 0 and more |
//! | p′ − e(1 − u²) − 2h at u² = 0, 1/4, 1/2, 3/4, 1 | nowhere below the block's by more than half of the least that the block has of it; where that is not above zero, the block's |
//!
//! The last is a lower bound of the least rising slope p′ − e(1 − 2u²)/g − 2h, since (1 − 2u²)/g ≤ 1 − u²: what an [inverse](crate::inverse) needs.
//!
//! An estimate below e = 0 or h = 0 becomes zero there. Then all changes shrink until every bound holds. Each is computed as it is held: none is stored.

use super::state::AdaptationState;
use super::triangle::{add, dot};
use super::{Adaptation, COEFFICIENTS, Coefficients};
use crate::scalar::Float;

/// u² between places where the slope is held.
const SPACING: f64 = 0.25;
/// Places where the slope is held, from u = 0 to the rated deflection.
const PLACES: usize = 5;

/// The common factor comes after the coefficients, the slopes first.
const FACTOR: usize = PLACES + COEFFICIENTS;
pub(super) const BOUNDS: usize = FACTOR + 1;

/// Less a lower bound of the rising slope at a place.
#[inline(always)]
fn descent<S: Float>(of: &Coefficients<S>, place: usize) -> S {
    let [h, e, k5, k3, k1] = *of;
    let [three, five] = [3.0, 5.0].map(S::from_f64);
    let square = S::from_f64(f64::from(place as u8)) * S::from_f64(SPACING);
    S::TWO * h + e - k1 - square * (e + three * k3 + square * (five * k5))
}

/// Half of what the slope may fall by anywhere, as each bound is twice a number: a quarter of the least of the block's.
pub(super) fn fall<S: Float>(block: &Coefficients<S>) -> S {
    let least = (0..PLACES).map(|place| -descent(block, place)).reduce(S::min).unwrap_or_default();
    // Where it may not fall at all, next to nothing is left.
    (S::from_f64(0.25) * least).max(S::from_f64(1e-9))
}

impl<S: Float> Adaptation<S> {
    /// The shadow anew: a coefficient of the estimate, e and h brought up to zero.
    #[inline]
    pub(super) fn lift(&self, state: &mut AdaptationState<S>, number: usize) {
        let AdaptationState { trial, estimate, held, .. } = state;
        if let (Some(shadow), Some(&value), Some(&block)) =
            (trial.shadow.get_mut(number), estimate.value.get(number), self.block.get(number))
        {
            *shadow = if number < 2 { value.max(-block) } else { value };
        }
        *held = false;
    }

    /// Holds the shadow within a bound.
    #[inline(always)]
    pub(super) fn bound(&self, state: &mut AdaptationState<S>, number: usize) {
        let shadow = state.trial.shadow;
        let (value, most) = if number < PLACES {
            (descent(&shadow, number), self.fall)
        } else if let Some(&change) = shadow.get(number - PLACES) {
            (change.abs(), self.deviation)
        } else {
            (dot(&self.common, &shadow).abs(), self.factor)
        };
        let most = most + most;
        if value > most {
            add(&mut state.trial.shadow, &shadow, most.over(value) - S::ONE);
            state.held = true;
        }
    }
}
