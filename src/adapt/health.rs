//! What is held against a limit after every stretch: the delay and the offset of the signal, and changes of the gear from its block.
//!
//! A quantity passes its limit where it is beyond by 5 standard deviations, and is reported after [`TIMES`] stretches in a row. While the delay passes it nothing is decided.
//!
//! | quantity | limit |
//! |---|---|
//! | delay | [`LARGEST_DELAY_S`] |
//! | offset | 2 % of T_A |
//! | common factor of the coefficients | 3 % |
//! | elastic torque at the rated deflection | 5 % |
//! | h | 10 % |
//! | e | 5 % of T_A |
//! | lost motion | 10 % |

use core::hint::black_box;

use super::state::AdaptationState;
use super::triangle::{dot, places};
use super::{Adaptation, COEFFICIENTS, Coefficients, Settings};
use crate::scalar::Float;

/// Stretches in a row at which a limit must be passed.
const TIMES: u8 = 3;
/// Standard deviations by which it must be passed.
const SIGNIFICANT: f64 = 5.0;
/// Delay, s.
const LARGEST_DELAY_S: f64 = 2e-3;
/// Offset, of T_A.
const LARGEST_OFFSET: f64 = 0.02;

/// How many quantities there are: of the signal, and all.
const OF_SIGNAL: usize = 2;
pub(super) const QUANTITIES: usize = OF_SIGNAL + 5;

/// The quantities of a gear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Health<S> {
    /// What multiplies the changes of the coefficients in the quantities of the gear.
    rows: [Coefficients<S>; QUANTITIES - OF_SIGNAL],
    limits: [S; QUANTITIES],
}

/// For how many stretches in a row each limit was passed.
pub(super) type Passed = [u8; QUANTITIES];

impl<S: Float> Health<S> {
    /// To first order about the block's coefficients.
    pub(super) fn new(settings: &Settings, block: &Coefficients<S>, common: &Coefficients<S>) -> Self {
        let [h, e, k5, k3, k1] = *block;
        // A gear without a loop, or a spring, is held against the torque scale.
        let least = S::from_f64(0.02);
        let [spring, slope, width] = [k1 + k3 + k5, k1 - e, h].map(|of| of.max(least).recip());
        let (zero, one) = (S::ZERO, S::ONE);
        Self {
            rows: [
                *common,
                [zero, zero, spring, spring, spring],
                [width, zero, zero, zero, zero],
                [zero, one, zero, zero, zero],
                // Lost motion goes as h over the slope at zero.
                [width, slope, zero, zero, -slope],
            ],
            limits: [LARGEST_DELAY_S / settings.period_s, LARGEST_OFFSET, 0.03, 0.05, 0.10, 0.05, 0.10]
                .map(S::from_f64),
        }
    }
}

impl<S: Float> Adaptation<S> {
    /// Holds a quantity against its limit: finds its variance in `sums` in an odd step, compares in an even one.
    #[inline]
    pub(super) fn check(&self, state: &mut AdaptationState<S>, step: usize) {
        let number = step / 2;
        let AdaptationState { sums: [spread, ..], triangle, estimate, noise, warnings, passed, .. } = state;
        let (Some(limit), Some(times)) = (self.health.limits.get(number), passed.get_mut(number)) else { return };
        // The rows of delay and offset say value − row·x = diagonal·quantity.
        let (row, value, diagonal, variance) = match self.health.rows.get(number.wrapping_sub(OF_SIGNAL)) {
            Some(row) => (row.as_slice(), S::ZERO, S::ONE, S::ZERO),
            None => {
                const DELAY: usize = COEFFICIENTS + 2;
                // Of a length that the compiler knows, what is done with it would be unrolled.
                let row = black_box(if number == 0 { &triangle[places(DELAY)] } else { &triangle[places(DELAY + 1)] });
                let ([value, x @ ..], Some(&diagonal)) = (row, row.last()) else { return };
                (x, *value, diagonal, noise.variance)
            }
        };
        if !step.is_multiple_of(2) {
            *spread = variance + estimate.spread(row);
            return;
        }
        let beyond = (value - dot(row, &estimate.value)).abs() - *limit * diagonal;
        let significant = S::from_f64(SIGNIFICANT * SIGNIFICANT) * *spread;
        if beyond > S::ZERO && beyond * beyond > significant {
            *times = (*times + 1).min(TIMES);
        } else {
            *times = 0;
        }
        warnings.latch_quantity(*times == TIMES, number);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Warning;
    use super::*;

    #[test]
    fn quantities_are_in_the_order_of_their_warnings() {
        let first = Warning::Delay as usize;
        let warnings = &Warning::ALL[first..first + QUANTITIES];
        assert_eq!(
            (warnings[1], warnings[2], warnings[6]),
            (Warning::Offset, Warning::ScaleOrGear, Warning::LostMotion)
        );
    }
}
