//! What is held against a limit after every stretch: the delay and the offset of the signal, and changes of the gear from its block.
//!
//! A quantity passes its limit where it is beyond by 5 standard deviations, and is reported after three stretches in a row. While delay or offset pass it nothing is taken over, and after eight stretches of an offset in a
//! row the block is put back in force ([`trial`](super::trial)). After a stretch that cannot be used the mean of the delay starts again, so that it describes the signal as it is now.
//!
//! **The delay** is a mean over some [`MEMORY`] stretches, each weighted by its information, so that faults which are less than the noise of a stretch are seen. **The offset** is learnt beside the coefficients.
//! A gear that drifts is followed with a lag, which looks like a little of either. `docs/adaptation.md` says which drifts that may be taken for a fault.
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
//! Rows of quantities are made as they are needed, scaled so that each limit is 1, but that of the delay: none but that of the common factor is stored.

use super::estimate::LEARNT;
use super::samples::LEVEL;
use super::state::AdaptationState;
use super::triangle::clear;
use super::{Adaptation, Coefficients};
use crate::scalar::Float;

/// Stretches in a row at which a limit must be passed, a bit each.
const TIMES: u8 = 0b111;
/// Standard deviations by which it must be passed.
const SIGNIFICANT: f64 = 5.0;
/// Delay, s.
pub(super) const LARGEST_DELAY_S: f64 = 0.5e-3;
/// Offset, of T_A.
const LARGEST_OFFSET: f64 = 0.005;
/// The common factor.
pub(super) const LARGEST_FACTOR: f64 = 0.03;
/// The spring, of its torque, and e, of T_A.
const LARGEST_CHANGE: f64 = 0.05;
/// h and lost motion, of themselves.
const LARGEST_WIDTH: f64 = 0.10;
/// Stretches that the mean of the delay is over.
const MEMORY: f64 = 16.0;

/// How many quantities there are.
pub(super) const QUANTITIES: usize = 7;

/// Whether each limit was passed, a bit a stretch, the last one's lowest.
pub(super) type Passed = [u8; QUANTITIES];

/// What the quantities count by, so that the limit of each is 1: the spring, the slope at zero in lost motion, and h.
pub(super) fn scales<S: Float>(block: &Coefficients<S>) -> [S; 3] {
    let [h, e, k5, k3, k1] = *block;
    // A gear without a loop, or a spring, is held against the torque scale.
    let of = [k1 + k3 + k5, k1 - e, h].map(|of| of.max(S::from_f64(0.02)));
    let [spring, slope, width] = of.map(S::recip);
    [
        S::from_f64(1.0 / LARGEST_CHANGE) * spring,
        S::from_f64(1.0 / LARGEST_WIDTH) * slope,
        S::from_f64(1.0 / LARGEST_WIDTH) * width,
    ]
}

impl<S: Float> Adaptation<S> {
    /// Makes the row of a quantity, whose product with changes is held against 1, behind a value of zero.
    #[inline(always)]
    pub(super) fn quantity(&self, number: usize, row: &mut [S; LEARNT + 1]) {
        clear(row);
        let [_, h, e, k5, k3, k1, offset] = row;
        let [spring, slope, width] = self.scales;
        match number {
            1 => *offset = S::from_f64(LEVEL / LARGEST_OFFSET),
            2 => [*h, *e, *k5, *k3, *k1] = self.common,
            3 => [*k5, *k3, *k1] = [spring; 3],
            4 => *h = width,
            5 => *e = S::from_f64(1.0 / LARGEST_CHANGE),
            // Lost motion goes as h over the slope at zero.
            _ => [*h, *e, *k1] = [width, slope, -slope],
        }
    }

    /// Holds a quantity against its limit, from what its row missed, rᵀPr and the last entry of the row.
    #[inline(always)]
    pub(super) fn check(&self, state: &mut AdaptationState<S>, number: usize, [mut off, spread, diagonal]: [S; 3]) {
        let Some(times) = state.passed.get_mut(number) else { return };
        let (mut limit, mut variance) = (S::ONE, spread);
        if number == 0 {
            let [sum, weight] = &mut state.mean;
            let told = diagonal.over(spread + state.noise.variance);
            let keep = S::from_f64(1.0 - 1.0 / MEMORY);
            *sum = *sum * keep + off * told;
            *weight = *weight * keep + diagonal * told;
            (off, variance) = (*sum, *weight);
            limit = variance * self.delay;
        }
        let beyond = off.abs() - limit;
        let is_beyond = beyond * beyond.abs() > S::from_f64(SIGNIFICANT * SIGNIFICANT) * variance;
        *times = *times << 1 | u8::from(is_beyond);
        state.warnings.latch_quantity(*times & TIMES == TIMES, number);
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
