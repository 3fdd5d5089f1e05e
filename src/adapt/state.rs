//! What the adaptation of one joint has learnt.

use super::estimate::Estimate;
use super::health::{Passed, QUANTITIES};
use super::samples::LEVEL;
use super::supervision::Noise;
use super::trial::Trial;
use super::warnings::Warnings;
use super::work::ROWS;
use super::{COEFFICIENTS, Coefficients, reversed};
use crate::scalar::Float;

/// What the adaptation of one joint has learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)] // Small fields first: the instructions that reach them are short.
pub struct AdaptationState<S> {
    /// Pieces of work that are left.
    pub(super) work: u8,
    /// Stretches that nothing is learnt from, or decided after, for now.
    pub(super) hold: u8,
    /// Whether a bound holds the shadow.
    pub(super) held: bool,
    /// Whether samples were taken, by [`samples`](super::samples).
    pub(super) sampled: u8,
    /// Samples of the block.
    pub(super) samples: u16,
    /// Blocks of the stretch.
    pub(super) blocks: u16,
    /// Spikes in the stretch.
    pub(super) spikes: u16,
    pub(super) warnings: Warnings,
    pub(super) passed: Passed,
    /// Stretches with spikes, less those without.
    pub(super) spiky: u8,
    /// Weighted sums of the samples of a block, then its row; while a stretch is worked on, a place to work in.
    pub(super) sums: [S; ROWS],
    /// The block's torque at the last sample.
    pub(super) last: S,
    /// The span of the places that the gear had been to as the stretch began, over A.
    pub(super) span: S,
    pub(super) noise: Noise<S>,
    pub(super) trial: Trial<S>,
    pub(super) estimate: Estimate<S>,
    /// The triangle of the stretch.
    pub(super) triangle: [S; ROWS * (ROWS + 1) / 2],
    /// The mean delay over many stretches: Σ of it by its weights, and of the weights.
    pub(super) mean: [S; 2],
}

impl<S: Float> AdaptationState<S> {
    /// Nothing learnt yet: the block is in force. All zero, so that a `static` of it takes no flash; the first [`period`](super::Adaptation::period) starts it.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            work: 0,
            hold: 0,
            held: false,
            sampled: 0,
            spiky: 0,
            samples: 0,
            blocks: 0,
            spikes: 0,
            warnings: Warnings::NONE,
            passed: [0; QUANTITIES],
            last: S::ZERO,
            span: S::ZERO,
            noise: Noise::NEW,
            trial: Trial::NEW,
            estimate: Estimate::NEW,
            sums: [S::ZERO; ROWS],
            triangle: [S::ZERO; ROWS * (ROWS + 1) / 2],
            mean: [S::ZERO; 2],
        }
    }

    /// Changes of the normalised coefficients in force, zero while the block is.
    #[must_use]
    pub fn in_force(&self) -> Coefficients<S> {
        reversed(self.trial.in_force)
    }

    /// Whether adapted parameters are in force.
    #[must_use]
    pub fn is_taken_over(&self) -> bool {
        self.trial.in_force.iter().any(|change| *change != S::ZERO)
    }

    /// The estimated changes of the normalised coefficients, bounds not applied.
    #[must_use]
    pub fn estimate(&self) -> Coefficients<S> {
        let [coefficients @ .., _] = self.estimate.value;
        reversed(coefficients)
    }

    /// Variances of the [estimate](Self::estimate).
    #[must_use]
    pub fn variances(&self) -> Coefficients<S> {
        reversed(core::array::from_fn(|number| self.estimate.variance(number)))
    }

    /// The learnt offset of the torque signal, over T_A, and its variance. Nothing in force uses it.
    #[must_use]
    pub fn offset(&self) -> [S; 2] {
        let [.., offset] = self.estimate.value;
        let level = S::from_f64(LEVEL);
        [offset * level, self.estimate.variance(COEFFICIENTS) * level * level]
    }

    /// What is latched.
    #[must_use]
    pub fn warnings(&self) -> Warnings {
        self.warnings
    }

    /// Whether the next period takes its sample: not while a block or a stretch is worked on. Periods longer than 1 ms may do both.
    #[must_use]
    pub fn takes_samples(&self) -> bool {
        self.work == 0
    }

    /// Stretches that were fit to be learnt from.
    #[must_use]
    pub fn stretches(&self) -> u32 {
        self.noise.stretches
    }

    /// Clears the latched warnings.
    pub fn clear_warnings(&mut self) {
        self.warnings = Warnings::default();
    }

    /// Variance of the rows that are learnt from, of T_A².
    #[must_use]
    pub fn variance(&self) -> S {
        self.noise.variance
    }

    /// The parameters in force could not be taken over: the block stays.
    pub fn give_back(&mut self) {
        self.trial.give_back();
        self.trial.leads = Default::default();
    }
}

impl<S: Float> Default for AdaptationState<S> {
    fn default() -> Self {
        Self::new()
    }
}
