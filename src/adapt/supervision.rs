//! Which samples and stretches are fit to be learnt from, and how noisy they are.
//!
//! | a stretch is not learnt from where | warning |
//! |---|---|
//! | its torque differs from the block's by more than the largest change and 0.1 of what the block's moves by, an offset apart | [`Warning::Dead`] |
//! | its residuals are [`ROUGHER`] times those of the stretches before; that level rises by 22 % a stretch at most, so that a signal that stays rougher is learnt from after some ten | [`Warning::Disturbed`] |
//! | more than one sample in [`SPIKE_BLOCKS`] blocks lies beyond 8σ | [`Warning::Spikes`] |
//!
//! The next [`HOLD`] stretches are not learnt from either.
//!
//! Rare spikes: a stretch with one adds [`SPIKY`] to a count, one without takes 1 off it. From [`SPIKES`] on it is [`Warning::Spikes`], too.

use super::state::AdaptationState;
use super::work::{DROPPED, LEARNT, ROWS};
use super::{Adaptation, Warning, Warnings};
use crate::scalar::Float;

/// Weights fall beyond this many σ, as the square of the distance.
const FAR: f64 = 3.0;
/// Beyond this many it is a spike.
const SPIKE: f64 = 8.0;
/// Samples that σ² is averaged over.
const NOISE_SAMPLES: f64 = 256.0;
/// Residuals this many times the usual are a disturbance.
const ROUGHER: f64 = 3.0;
/// What the usual variance of residuals may rise by in a stretch.
const RISE: f64 = 1.5;
/// σ² before anything is known, of T_A²: 2.2 % of T_A.
const FIRST_VARIANCE: f64 = 1.0 / 2048.0;
/// No torque is better than this, of T_A.
const LEAST_NOISE: f64 = 1e-5;
/// One sample in so many blocks may be a spike.
const SPIKE_BLOCKS: u32 = 4;
/// What a stretch with spikes adds to the count of rare ones.
const SPIKY: u8 = 16;
/// Rare spikes are reported from this count on.
const SPIKES: u8 = 64;
/// Stretches that are not learnt from after one that was unfit.
const HOLD: u8 = 2;
/// The mean square of innovations over their variance on a gear that stays: P has it wander.
const USUAL: f64 = 0.875;
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
    /// Σ of squared innovations over their variance, less [`USUAL`] each.
    surprise: S,
    /// Stretches that were fit.
    pub(super) stretches: u32,
}

impl<S: Float> Noise<S> {
    /// Before it is started.
    pub(super) const NEW: Self = {
        let zero = S::ZERO;
        Self { centre: zero, sample: zero, within: zero, variance: zero, surprise: zero, stretches: 0 }
    };

    /// Nothing is known yet.
    #[inline]
    pub(super) fn begin(&mut self) {
        self.sample = S::from_f64(FIRST_VARIANCE);
        self.within = self.sample;
    }

    /// The weight of a sample by its residual, if that is a number.
    #[inline]
    pub(super) fn weigh(&mut self, residual: S, spikes: &mut u16, warnings: &mut Warnings) -> Option<S> {
        let far = residual - self.centre;
        let square = (far * far).over(self.sample);
        if !square.is_finite() {
            warnings.latch(true, Warning::NotANumber);
            return None;
        }
        let far = S::from_f64(FAR * FAR);
        let weight = far.over(square.max(far));
        if weight < S::from_f64(FAR * FAR / (SPIKE * SPIKE)) {
            *spikes = spikes.wrapping_add(1);
        }
        let change = self.sample * (square * weight - S::ONE) + S::from_f64(LEAST_NOISE * LEAST_NOISE);
        self.sample = self.sample + change * S::from_f64(1.0 / NOISE_SAMPLES);
        Some(weight)
    }

    /// Notes the innovation of a row over its deviation.
    #[inline]
    pub(super) fn note(&mut self, innovation: S) {
        self.surprise = self.surprise + (innovation * innovation - S::from_f64(USUAL));
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
    /// Judges a stretch: whether it is long enough, is fit to be learnt from, and to decide by.
    #[inline]
    pub(super) fn judge(&self, state: &mut AdaptationState<S>) {
        // Σ p² and Σ r² about their means, without what a delay explains.
        let [of_block, of_residual, ..] = state.sums;
        let AdaptationState { triangle, noise, warnings, blocks, spikes, spiky, .. } = &mut *state;
        let blocks = *blocks;
        let number = S::from_f64(f64::from(blocks));
        let [unexplained, ..] = *triangle;
        if of_block < self.motion * number {
            state.work = if blocks >= self.most_blocks { DROPPED } else { 0 };
            return;
        }
        let free = number - S::from_f64((ROWS - 1) as f64);
        let within = (unexplained * unexplained).over(free) + S::from_f64(LEAST_NOISE * LEAST_NOISE);
        // A NaN compares false.
        let calm = within <= S::from_f64(ROUGHER * ROUGHER) * noise.within;
        noise.within = within.min(S::from_f64(RISE) * noise.within);
        let mut faults = Warnings::default();
        faults.latch(!calm, Warning::Disturbed);
        faults.latch(of_residual > self.gain * of_block, Warning::Dead);
        faults.latch(SPIKE_BLOCKS * u32::from(*spikes) > u32::from(blocks), Warning::Spikes);
        *spiky = if *spikes > 0 { spiky.wrapping_add(SPIKY) } else { spiky.saturating_sub(1) };
        let mut seen = faults;
        seen.latch(*spiky >= SPIKES, Warning::Spikes);
        warnings.add(seen);
        if faults != Warnings::default() {
            state.hold = HOLD;
            state.work = DROPPED;
            // What the signal has become is told apart from what it was: it begins anew.
            state.mean = Default::default();
            return;
        }
        // Until innovations say more.
        if noise.stretches == 0 {
            noise.variance = S::from_f64(4.0) * within;
        }
        if state.hold > 0 {
            state.hold -= 1;
            state.work = LEARNT;
        }
    }
}
