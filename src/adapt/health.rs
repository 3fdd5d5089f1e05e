//! What is held against a limit after every stretch: the delay and the offset of the signal, and changes of the gear from its block.
//!
//! A quantity passes its limit where it is beyond by 5 standard deviations, and is reported after three stretches in a row. While delay or offset pass it nothing is taken over.
//! After a stretch that is unfit the means begin anew: what the signal has become is told apart from what it was.
//!
//! **Delay and offset** are means over some [`MEMORY`] stretches, each weighted by its information, so that faults which are less than the noise of a stretch are seen. What a gear that drifts leaves is the same in
//! all of them: no mean lessens it, so it is added to the limit. Learning by P that forgets q = `drift`² a stretch is behind a gear that drifts by ρ a stretch by Pρ/q. Of that a row r sees rᵀPρ/q, at most
//! abs(Pr)·abs(ρ)/q (Cauchy–Schwarz), over the last entry of the row; abs(ρ) is taken to be `drift`.
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

/// Stretches in a row at which a limit must be passed, a bit each.
const TIMES: u8 = 0b111;
/// Standard deviations by which it must be passed.
const SIGNIFICANT: f64 = 5.0;
/// Delay, s.
const LARGEST_DELAY_S: f64 = 0.5e-3;
/// Offset, of T_A.
const LARGEST_OFFSET: f64 = 0.005;
/// Stretches that the means are over.
const MEMORY: f64 = 16.0;

/// How many quantities there are: of the signal, and all.
pub(super) const OF_SIGNAL: usize = 2;
pub(super) const QUANTITIES: usize = OF_SIGNAL + 5;

/// Whether each limit was passed, a bit a stretch, the last one's lowest.
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

/// abs(ρ)/q. A gear that is said to stay leaves nothing.
pub(super) fn lag<S: Float>(drift: S) -> S {
    if drift > S::ZERO { drift.recip() } else { S::ZERO }
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

    /// Holds a quantity against its limit, from what its row missed, rᵀPr, the last entry of the row and abs(Pr).
    #[inline(always)]
    pub(super) fn check(
        &self,
        state: &mut AdaptationState<S>,
        number: usize,
        [mut off, spread, diagonal, lag]: [S; 4],
    ) {
        let (Some(&limit), Some(times)) = (self.limits.get(number), state.passed.get_mut(number)) else { return };
        let (mut limit, mut variance) = (limit, spread);
        if let Some([sum, weight]) = state.means.get_mut(number) {
            let told = diagonal.over(spread + state.noise.variance);
            let keep = S::from_f64(1.0 - 1.0 / MEMORY);
            *sum = *sum * keep + off * told;
            *weight = *weight * keep + diagonal * told;
            (off, variance) = (*sum, *weight);
            limit = variance * (limit + (self.lag * lag).over(diagonal));
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
