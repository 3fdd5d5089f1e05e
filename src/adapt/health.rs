//! What is held against a limit after every stretch: the delay and the offset of the signal, and changes of the gear from its block.
//!
//! A quantity passes its limit where it is beyond by 5 standard deviations, and is reported after [`TIMES`] stretches in a row. While the delay passes it nothing is decided.
//!
//! The delay is the mean over some [`MEMORY`] stretches, each weighted by its information, so that delays which are less than the noise of a stretch are seen. The variance of delay and offset counts what
//! is not known of the gear, rᵀPr, [`LAG`] times: a gear that drifts is left behind by more than its standard deviation.
//!
//! | quantity | limit |
//! |---|---|
//! | delay | [`LARGEST_DELAY_S`] |
//! | offset | [`LARGEST_OFFSET`] of T_A |
//! | common factor of the coefficients | 3 % |
//! | elastic torque at the rated deflection | 5 % |
//! | h | 10 % |
//! | e | 5 % of T_A |
//! | lost motion | 10 % |
//!
//! The rows of the gear's quantities are made as they are needed: none but that of the common factor is stored.

use super::state::AdaptationState;
use super::{Adaptation, COEFFICIENTS, Coefficients};
use crate::scalar::Float;

/// Stretches in a row at which a limit must be passed.
const TIMES: u8 = 3;
/// Standard deviations by which it must be passed.
const SIGNIFICANT: f64 = 5.0;
/// Delay, s.
const LARGEST_DELAY_S: f64 = 0.5e-3;
/// Offset, of T_A.
const LARGEST_OFFSET: f64 = 0.005;
/// Stretches that the mean of the delay is over.
const MEMORY: f64 = 32.0;
/// What the variance of what is not known of the gear counts, where the signal is held against its limits.
const LAG: f64 = 9.0;

/// How many quantities there are: of the signal, and all.
pub(super) const OF_SIGNAL: usize = 2;
pub(super) const QUANTITIES: usize = OF_SIGNAL + 5;

/// For how many stretches in a row each limit was passed.
pub(super) type Passed = [u8; QUANTITIES];

/// The limits of the quantities, those of the gear to first order about the block's coefficients; and q, what the slope at zero counts in lost motion where h counts one.
pub(super) fn limits<S: Float>(period_s: S, block: &Coefficients<S>) -> ([S; QUANTITIES], S) {
    let [h, e, k5, k3, k1] = *block;
    // A gear without a loop, or a spring, is held against the torque scale.
    let [spring, slope, width] = [k1 + k3 + k5, k1 - e, h].map(|of| of.max(S::from_f64(0.02)));
    let [delay, offset, factor, of_spring, of_width, e] =
        [LARGEST_DELAY_S, LARGEST_OFFSET, 0.03, 0.05, 0.10, 0.05].map(S::from_f64);
    let width_limit = of_width * width;
    ([delay.over(period_s), offset, factor, of_spring * spring, width_limit, e, width_limit], width.over(slope))
}

impl<S: Float> Adaptation<S> {
    /// Makes the row of a quantity of the gear, whose product with changes is held against its limit, behind a value of zero.
    #[inline(always)]
    pub(super) fn quantity(&self, number: usize, row: &mut [S; COEFFICIENTS + 1]) {
        *row = [S::ZERO; COEFFICIENTS + 1];
        let [_, h, e, k5, k3, k1] = row;
        match number {
            2 => [*h, *e, *k5, *k3, *k1] = self.common,
            3 => [*k5, *k3, *k1] = [S::ONE; 3],
            4 => *h = S::ONE,
            5 => *e = S::ONE,
            // Lost motion goes as h over the slope at zero.
            _ => [*h, *e, *k1] = [S::ONE, self.of_slope, -self.of_slope],
        }
    }

    /// Holds a quantity against its limit, from what its row missed, rᵀPr and the last entry of the row.
    #[inline(always)]
    pub(super) fn check(&self, state: &mut AdaptationState<S>, number: usize, [mut off, spread, diagonal]: [S; 3]) {
        let (Some(limit), Some(times)) = (self.limits.get(number), state.passed.get_mut(number)) else { return };
        let (mut unit, mut variance) = (S::ONE, spread);
        if number < OF_SIGNAL {
            unit = diagonal;
            variance = spread * S::from_f64(LAG) + state.noise.variance;
        }
        if number == 0 {
            let [sum, weight] = &mut state.delay;
            let told = unit.over(variance);
            let keep = S::from_f64(1.0 - 1.0 / MEMORY);
            *sum = *sum * keep + off * told;
            *weight = *weight * keep + unit * told;
            (off, unit, variance) = (*sum, *weight, *weight);
        }
        let beyond = off.abs() - unit * *limit;
        let is_beyond = beyond * beyond.abs() > S::from_f64(SIGNIFICANT * SIGNIFICANT) * variance;
        *times = if is_beyond { times.saturating_add(1) } else { 0 };
        state.warnings.latch_quantity(*times >= TIMES, number);
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
