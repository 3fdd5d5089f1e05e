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

use super::{COEFFICIENTS, Coefficients};
use crate::scalar::Float;

/// Stretches in a row at which a limit must be passed.
pub(super) const TIMES: u8 = 3;
/// Standard deviations by which it must be passed.
const SIGNIFICANT: f64 = 5.0;
/// Delay, s.
const LARGEST_DELAY_S: f64 = 2e-3;
/// Offset, of T_A.
const LARGEST_OFFSET: f64 = 0.02;
/// d of the rows of the gear.
const DIAGONAL: f64 = 1e3;

/// How many quantities there are: of the signal, and all.
pub(super) const OF_SIGNAL: usize = 2;
pub(super) const QUANTITIES: usize = OF_SIGNAL + 5;

/// The quantities of a gear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Health<S> {
    /// Of the gear: [0, row·d, d], as rows of the triangle say value − row·x = d·quantity, with a d beside which the noise of a row is nothing.
    pub(super) rows: [[S; COEFFICIENTS + 2]; QUANTITIES - OF_SIGNAL],
    pub(super) limits: [S; QUANTITIES],
}

/// For how many stretches in a row each limit was passed.
pub(super) type Passed = [u8; QUANTITIES];

impl<S: Float> Health<S> {
    /// To first order about the block's coefficients.
    pub(super) fn new(period_s: S, block: &Coefficients<S>, common: &Coefficients<S>) -> Self {
        let [h, e, k5, k3, k1] = *block;
        // A gear without a loop, or a spring, is held against the torque scale.
        let least = S::from_f64(0.02);
        let [spring, slope, width] = [k1 + k3 + k5, k1 - e, h].map(|of| of.max(least).recip());
        let (zero, one) = (S::ZERO, S::ONE);
        let diagonal = S::from_f64(DIAGONAL);
        let row = |row: Coefficients<S>| {
            let [a, b, c, d, e] = row.map(|x| x * diagonal);
            [zero, a, b, c, d, e, diagonal]
        };
        Self {
            rows: [
                *common,
                [zero, zero, spring, spring, spring],
                [width, zero, zero, zero, zero],
                [zero, one, zero, zero, zero],
                // Lost motion goes as h over the slope at zero.
                [width, slope, zero, zero, -slope],
            ]
            .map(row),
            limits: {
                let [offset, factor, spring, h, e, lost_motion] =
                    [LARGEST_OFFSET, 0.03, 0.05, 0.10, 0.05, 0.10].map(S::from_f64);
                [S::from_f64(LARGEST_DELAY_S).over(period_s), offset, factor, spring, h, e, lost_motion]
            },
        }
    }
}

/// Whether a quantity is beyond its limit by more than chance; all of them times the diagonal of its row, the variance times its square.
#[inline]
pub(super) fn is_beyond<S: Float>(quantity: S, limit: S, variance: S) -> bool {
    let beyond = quantity.abs() - limit;
    beyond * beyond.abs() > S::from_f64(SIGNIFICANT * SIGNIFICANT) * variance
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
