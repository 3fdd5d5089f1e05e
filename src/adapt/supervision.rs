//! Which samples and stretches are fit to be learnt from, and how noisy they are.
//!
//! | a stretch is not learnt from where | warning |
//! |---|---|
//! | its torque differs from the block's by more than the largest change and 0.1 of what the block's moves by, an offset apart | [`Warning::Dead`] |
//! | its residuals are [`ROUGHER`] times those of the stretches before; that level rises by 22 % a stretch at most, so that a signal that stays rougher is learnt from after some ten | [`Warning::Disturbed`] |
//! | more than 1 sample in 100 lies beyond 8σ | [`Warning::Spikes`] |
//!
//! The next [`HOLD`] stretches are not learnt from either.

use super::state::AdaptationState;
use super::triangle::row;
use super::work::ROWS;
use super::{Adaptation, LEAST_MOTION, Warning, Warnings};
use crate::scalar::Float;

/// Weights fall beyond this many σ, as the square of the distance.
const FAR: f64 = 4.0;
/// Beyond twice as many it is a spike.
const SPIKE: f64 = 8.0;
/// Samples that σ² is averaged over.
const NOISE_SAMPLES: f64 = 256.0;
/// Residuals this many times the usual are a disturbance.
const ROUGHER: f64 = 3.0;
/// What the usual variance of residuals may rise by in a stretch.
const RISE: f64 = 1.5;
/// σ before anything is known, of T_A.
const FIRST_NOISE: f64 = 0.02;
/// No torque is better than this, of T_A.
const LEAST_NOISE: f64 = 1e-5;
/// Stretches that are not learnt from after one that was unfit.
const HOLD: u8 = 2;
/// Rows whose innovations v is averaged over.
const VARIANCE_ROWS: f64 = 50.0;

/// What is known of the signal's noise and faults.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise<S> {
    /// Mean residual of the block before.
    pub(super) centre: S,
    /// Variance of samples about it.
    sample: S,
    /// Usual variance of blocks within a stretch.
    within: S,
    /// v, the same for all rows of a stretch.
    pub(super) variance: S,
    /// Σ of squared innovations less one, over their variance.
    surprise: S,
    /// Spikes in the stretch, a whole number.
    pub(super) spikes: S,
    /// Stretches that were fit.
    pub(super) stretches: u32,
}

impl<S: Float> Noise<S> {
    pub(super) fn new() -> Self {
        let variance = S::from_f64(FIRST_NOISE * FIRST_NOISE);
        Self {
            centre: S::ZERO,
            sample: variance,
            within: variance,
            variance: S::ZERO,
            surprise: S::ZERO,
            spikes: S::ZERO,
            stretches: 0,
        }
    }

    /// The weight of a sample by its residual; 0 if that is no number.
    #[inline]
    pub(super) fn weigh(&mut self, residual: S, warnings: &mut Warnings) -> S {
        let far = residual - self.centre;
        let square = (far * far).over(self.sample);
        if !square.is_finite() {
            warnings.latch(true, Warning::NotANumber);
            return S::ZERO;
        }
        if square > S::from_f64(SPIKE * SPIKE) {
            self.spikes = self.spikes + S::ONE;
        }
        let change = (square.min(S::from_f64(9.0)) - S::ONE) * S::from_f64(1.0 / NOISE_SAMPLES);
        self.sample = (self.sample + self.sample * change).max(S::from_f64(LEAST_NOISE * LEAST_NOISE));
        S::from_f64(FAR * FAR).over(square).min(S::ONE)
    }

    /// Notes the innovation of a row over its deviation, and that deviation over the noise's.
    #[inline]
    pub(super) fn note(&mut self, innovation: S, total: S) {
        // What is not known yet says nothing of the noise.
        if total < S::TWO {
            self.surprise = self.surprise + (innovation * innovation - S::ONE);
        }
    }

    /// Learns v from what was noted over a stretch that was fit.
    #[inline]
    pub(super) fn learn(&mut self) {
        let change = core::mem::take(&mut self.surprise) * S::from_f64(1.0 / VARIANCE_ROWS);
        self.variance = (self.variance + self.variance * change).max(self.within);
        self.stretches += 1;
    }
}

impl<S: Float> Adaptation<S> {
    /// Whether a stretch is fit to be learnt from, by its triangle and by Σ p² and Σ r² about their means, what nothing explains apart.
    #[inline]
    pub(super) fn judge(&self, state: &mut AdaptationState<S>, of_block: S, of_residual: S) -> bool {
        let blocks = state.blocks;
        let AdaptationState { triangle, noise, warnings, .. } = &mut *state;
        let [.., weight] = *row(triangle, ROWS) else { return false };
        if of_block < S::from_f64(LEAST_MOTION * LEAST_MOTION) * weight * weight {
            state.work = 0;
            if blocks >= self.most_blocks {
                Self::begin_stretch(state);
            }
            return false;
        }
        let [unexplained, ..] = *triangle;
        let free = blocks - S::from_f64((ROWS - 1) as f64);
        let within = (unexplained * unexplained).over(free) + S::from_f64(LEAST_NOISE * LEAST_NOISE);
        // A NaN compares false.
        let calm = within <= S::from_f64(ROUGHER * ROUGHER) * noise.within;
        noise.within = within.min(S::from_f64(RISE) * noise.within);
        let mut faults = Warnings::default();
        faults.latch(!calm, Warning::Disturbed);
        faults.latch(of_residual > self.gain * of_block, Warning::Dead);
        faults.latch(noise.spikes > self.spikes * blocks, Warning::Spikes);
        if faults != Warnings::default() {
            warnings.add(faults);
            state.hold = HOLD;
            state.work = 0;
            Self::begin_stretch(state);
            return false;
        }
        // Until innovations say more.
        let first = if noise.stretches == 0 { S::from_f64(4.0) * within } else { noise.within };
        noise.variance = noise.variance.max(first);
        true
    }
}
