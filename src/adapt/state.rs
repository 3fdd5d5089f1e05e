//! What the adaptation of one joint has learnt.

use super::Coefficients;
use super::filter::Estimate;
use super::health::Passed;
use super::stretch::{Stretch, Sums};
use super::supervision::Noise;
use super::trial::{Losses, Trial};
use super::warnings::Warnings;
use super::work::Work;
use crate::scalar::Float;

/// What the adaptation of one joint has learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptationState<S> {
    pub(super) sums: Sums<S>,
    pub(super) samples: u16,
    pub(super) work: Work,
    pub(super) stretch: Stretch<S>,
    pub(super) estimate: Estimate<S>,
    pub(super) trial: Trial<S>,
    pub(super) losses: [Losses<S>; 3],
    pub(super) noise: Noise<S>,
    pub(super) warnings: Warnings,
    pub(super) passed: Passed,
    /// The block's torque at the last sample, and its range over the stretch.
    pub(super) last: S,
    pub(super) range: [S; 2],
    /// How far the loop's torque may be off over the stretch, for want of its past.
    pub(super) unknown: S,
    /// Whether the last sample was taken, and whether the path lets it be.
    pub(super) continues: bool,
    pub(super) known: bool,
}

impl<S: Float> AdaptationState<S> {
    /// Changes of the normalised coefficients in force, zero while the block is.
    pub fn in_force(&self) -> &Coefficients<S> {
        &self.trial.in_force
    }

    /// Whether adapted parameters are in force.
    pub fn is_taken_over(&self) -> bool {
        self.trial.adapted
    }

    /// The estimated changes of the normalised coefficients, bounds not applied.
    pub fn estimate(&self) -> &Coefficients<S> {
        &self.estimate.value
    }

    /// Variances of the [estimate](Self::estimate).
    pub fn variances(&self) -> Coefficients<S> {
        self.estimate.variances()
    }

    /// What is latched.
    pub fn warnings(&self) -> Warnings {
        self.warnings
    }

    /// Whether the next period takes its sample: not while a stretch is worked on.
    pub fn takes_samples(&self) -> bool {
        self.work.is_beside()
    }

    /// Stretches that were fit to be learnt from.
    pub fn stretches(&self) -> u32 {
        self.noise.stretches
    }

    /// Clears the latched warnings.
    pub fn clear_warnings(&mut self) {
        self.warnings = Warnings::default();
    }

    /// Variance of the rows that are learnt from, of T_A².
    pub fn variance(&self) -> S {
        self.noise.variance
    }

    /// The parameters in force could not be taken over: the block stays.
    pub fn give_back(&mut self) {
        self.trial.give_back();
    }
}
