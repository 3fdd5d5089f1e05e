//! The gear's health from the estimate: relative changes with their standard deviations, and the limits that they are held against.

use super::filter::Estimate;
use super::kernel::dot;
use super::{Coefficients, Warning};
use crate::scalar::Float;

/// Checks in a row, one every five stretches, at which a limit must be passed.
const TIMES: u8 = 3;
/// Standard deviations by which it must be passed.
const SIGNIFICANT: f64 = 5.0;

/// A quantity that may drift: what multiplies the changes of the coefficients in it, its limit, its warning.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Quantity<S> {
    row: Coefficients<S>,
    limit: S,
    warning: Warning,
}

/// How many quantities there are.
const QUANTITIES: usize = 5;

/// The quantities of a gear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Health<S> {
    quantities: [Quantity<S>; QUANTITIES],
}

/// Which quantity is next, and for how many checks in a row each limit was passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Passed {
    next: u8,
    times: [u8; QUANTITIES],
}

impl<S: Float> Health<S> {
    /// To first order about the block's coefficients.
    pub(super) fn new(block: &Coefficients<S>, common: &Coefficients<S>) -> Self {
        let [k1, k3, k5, e, h] = *block;
        // A gear without a loop, or a spring, is held against the torque scale.
        let least = S::from_f64(0.02);
        let [spring, slope, width] = [k1 + k3 + k5, k1 - e, h].map(|of| of.max(least).recip());
        let (zero, one) = (S::ZERO, S::ONE);
        let quantity = |row, limit: f64, warning| Quantity { row, limit: S::from_f64(limit), warning };
        Self {
            quantities: [
                quantity(*common, 0.03, Warning::ScaleOrGear),
                quantity([spring, spring, spring, zero, zero], 0.05, Warning::Stiffness),
                quantity([zero, zero, zero, zero, width], 0.10, Warning::Hysteresis),
                quantity([zero, zero, zero, one, zero], 0.05, Warning::SingleValued),
                // Lost motion goes as h over the slope at zero.
                quantity([-slope, zero, zero, slope, width], 0.10, Warning::LostMotion),
            ],
        }
    }

    /// Holds one quantity after the other against its limit, one a call: its warning, if it is to be latched.
    #[inline(never)]
    pub(super) fn check(&self, estimate: &Estimate<S>, passed: &mut Passed) -> Option<Warning> {
        let number = usize::from(passed.next);
        passed.next = if number + 1 < QUANTITIES { passed.next + 1 } else { 0 };
        let (quantity, times) = (self.quantities.get(number)?, passed.times.get_mut(number)?);
        let room = dot(&quantity.row, &estimate.value).abs() - quantity.limit;
        let significant = S::from_f64(SIGNIFICANT * SIGNIFICANT) * estimate.spread(&quantity.row);
        let beyond = room > S::ZERO && room * room > significant;
        *times = if beyond { (*times + 1).min(TIMES) } else { 0 };
        (*times == TIMES).then_some(quantity.warning)
    }
}
