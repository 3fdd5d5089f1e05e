//! Which samples and stretches are fit to be learnt from, and how noisy they are.
//!
//! | a stretch is not learnt from where | warning |
//! |---|---|
//! | its torque follows the block's with a gain that differs from 1 by more than the largest change, 0.1 and 5 standard deviations | [`Warning::Dead`] |
//! | its residuals are [`ROUGHER`] times those of the stretches before; each refusal raises that level by 12 %, so that a signal that stays rougher is learnt from after some 20 | [`Warning::Disturbed`] |
//! | more than 1 sample in 100 lies beyond 8σ, or half of them lacked a block | [`Warning::Spikes`] |
//! | the delay, estimated over some stretches, is beyond 2 ms and 8 standard deviations | [`Warning::Delay`] |
//!
//! After the first three, and while a delay lasts, the next [`PROBATION`] stretches are not learnt from either.

use super::filter::Estimate;
use super::kernel::dot;
use super::stretch::{ROWS, Stretch};
use super::{Settings, Warning, Warnings};
use crate::scalar::Float;

/// Weights fall beyond this many σ.
const FAR: f64 = 4.0;
/// Beyond twice as many it is a spike.
const SPIKE: f64 = 8.0;
/// Samples that σ² is averaged over.
const NOISE_SAMPLES: f64 = 256.0;
/// Residuals this many times the usual are a disturbance.
const ROUGHER: f64 = 3.0;
/// σ before anything is known, of T_A.
const FIRST_NOISE: f64 = 0.02;
/// No torque is better than this, of T_A.
const LEAST_NOISE: f64 = 1e-5;
/// Stretches on probation.
const PROBATION: u8 = 2;
/// Delay, s.
const LARGEST_DELAY_S: f64 = 2e-3;
/// Standard deviations by which a delay is significant: the noise may be coloured.
const SIGNIFICANT_DELAY: f64 = 8.0;
/// Offset, of T_A.
const LARGEST_OFFSET: f64 = 0.02;
/// Rows whose innovations v is averaged over.
const VARIANCE_ROWS: f64 = 50.0;
/// Samples that are no numbers before that is reported.
const NOT_NUMBERS: u8 = 10;

/// What is known of the signal's noise and faults.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise<S> {
    /// Mean residual of the block before.
    pub(super) centre: S,
    /// Variance of samples about it.
    sample: S,
    /// Variance of blocks within a stretch; zero before the first.
    pub(super) within: S,
    /// v, the same for all rows of a stretch.
    pub(super) variance: S,
    /// Σ of squared innovations less one, over their variance.
    surprise: S,
    /// Mean residual of stretches.
    offset: S,
    /// Σ weight·delay and Σ weight, in periods.
    delay: [S; 2],
    delayed: bool,
    probation: u8,
    not_numbers: u8,
    spikes: u16,
    samples: u16,
    /// Stretches that were fit.
    pub(super) stretches: u32,
}

impl<S: Float> Noise<S> {
    pub(super) fn new() -> Self {
        Self {
            centre: S::ZERO,
            sample: S::from_f64(FIRST_NOISE * FIRST_NOISE),
            within: S::ZERO,
            variance: S::ZERO,
            surprise: S::ZERO,
            offset: S::ZERO,
            delay: [S::ZERO; 2],
            delayed: false,
            probation: 0,
            not_numbers: 0,
            spikes: 0,
            samples: 0,
            stretches: 0,
        }
    }

    /// Whether nothing is learnt or decided for now.
    pub(super) fn holds(&self) -> bool {
        self.delayed || self.probation > 0
    }

    /// Notes the squared innovation of a row over its variance, and 1 + rᵀPr.
    pub(super) fn note(&mut self, surprise: S, total: S) {
        // What is not known yet says nothing of the noise.
        if total < S::TWO {
            self.surprise = self.surprise + (surprise - S::ONE);
        }
    }

    /// Learns v from what was noted over a stretch.
    fn learn(&mut self) {
        let change = core::mem::take(&mut self.surprise) * S::from_f64(1.0 / VARIANCE_ROWS);
        self.variance = (self.variance * (S::ONE + change)).max(self.within);
    }

    pub(super) fn begin_stretch(&mut self) {
        (self.spikes, self.samples) = (0, 0);
    }
}

/// The limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Supervision<S> {
    /// The most that the gain may differ from 1.
    gain: S,
    /// The longest delay, in periods.
    delay: S,
}

impl<S: Float> Supervision<S> {
    pub(super) fn new(settings: &Settings) -> Self {
        Self {
            gain: S::from_f64(settings.largest_change + 0.1),
            delay: S::from_f64(LARGEST_DELAY_S / settings.period_s),
        }
    }

    /// The weight of a sample by its residual.
    #[inline]
    pub(super) fn weigh(&self, noise: &mut Noise<S>, residual: S, warnings: &mut Warnings) -> S {
        if !residual.is_finite() {
            noise.not_numbers = noise.not_numbers.saturating_add(1);
            warnings.latch(noise.not_numbers >= NOT_NUMBERS, Warning::NotANumber);
            return S::ZERO;
        }
        let far = (residual - noise.centre).abs();
        let square = far * far;
        noise.samples = noise.samples.saturating_add(1);
        if square > S::from_f64(SPIKE * SPIKE) * noise.sample {
            noise.spikes = noise.spikes.saturating_add(1);
        }
        let nine = S::from_f64(9.0) * noise.sample;
        let limited = square.min(nine);
        let floor = S::from_f64(LEAST_NOISE * LEAST_NOISE);
        let limit = S::from_f64(FAR * FAR) * noise.sample;
        noise.sample = (noise.sample + (limited - noise.sample) * S::from_f64(1.0 / NOISE_SAMPLES)).max(floor);
        if square <= limit { S::ONE } else { limit.sqrt().over(far) }
    }

    /// Whether a stretch is fit to be learnt from, by its rows and by Σ p² and Σ p·r about their means.
    #[inline(never)]
    pub(super) fn judge(
        &self,
        noise: &mut Noise<S>,
        stretch: &Stretch<S>,
        [square, product]: [S; 2],
        warnings: &mut Warnings,
    ) -> bool {
        let free = (stretch.blocks - S::from_f64(ROWS as f64)).max(S::ONE);
        let within = stretch.unexplained.over(free).max(S::from_f64(LEAST_NOISE * LEAST_NOISE));
        let first = noise.within == S::ZERO;
        if first {
            noise.within = S::from_f64(FIRST_NOISE * FIRST_NOISE);
        }
        let spiky = noise.spikes > noise.samples / 100;
        warnings.latch(spiky, Warning::Spikes);
        // A NaN compares false.
        let calm = within <= S::from_f64(ROUGHER * ROUGHER) * noise.within;
        let disturbed = !calm;
        warnings.latch(disturbed, Warning::Disturbed);
        let gain = product.over(square.max(S::from_f64(1e-12)));
        let dead = gain.abs() > self.gain && product * product > S::from_f64(25.0) * square * within;
        warnings.latch(dead, Warning::Dead);
        if disturbed || dead || spiky {
            if disturbed && !dead {
                noise.within = noise.within * S::from_f64(1.25);
            }
            if first {
                noise.within = S::ZERO;
            }
            noise.probation = PROBATION;
            return false;
        }
        if first {
            noise.within = within;
            // Until innovations say more.
            noise.variance = S::from_f64(4.0) * within;
        } else {
            noise.within = noise.within + (within - noise.within) * S::from_f64(0.125);
            noise.variance = noise.variance.max(noise.within);
        }
        noise.probation = noise.probation.saturating_sub(1);
        true
    }

    /// Learns v, and follows the offset of the signal, after a stretch was learnt from. `unsure` is rᵀPr of the offset's row.
    #[inline(never)]
    pub(super) fn watch_offset(
        &self,
        noise: &mut Noise<S>,
        stretch: &Stretch<S>,
        estimate: &Estimate<S>,
        unsure: S,
        warnings: &mut Warnings,
    ) {
        noise.learn();
        noise.stretches = noise.stretches.saturating_add(1);
        let (diagonal, row, value) = stretch.row(0);
        let offset = (value - dot(&row, &estimate.value)).over(diagonal);
        noise.offset = noise.offset + (offset - noise.offset) * S::from_f64(0.125);
        let beyond = noise.offset.abs() - S::from_f64(LARGEST_OFFSET);
        let passed = beyond * diagonal;
        warnings.latch(beyond > S::ZERO && passed * passed > S::from_f64(9.0) * unsure, Warning::Offset);
    }

    /// Follows the delay of the signal, after a stretch was learnt from. `unsure` is rᵀPr of the delay's row.
    #[inline(never)]
    pub(super) fn watch_delay(
        &self,
        noise: &mut Noise<S>,
        stretch: &Stretch<S>,
        estimate: &Estimate<S>,
        unsure: S,
        warnings: &mut Warnings,
    ) {
        let (diagonal, row, value) = stretch.row(1);
        let variance = noise.variance + unsure;
        let left = value - dot(&row, &estimate.value);
        let keep = S::from_f64(0.75);
        let [sum, weight] = noise.delay;
        let sum = sum * keep - (diagonal * left).over(variance);
        let weight = weight * keep + (diagonal * diagonal).over(variance);
        noise.delay = [sum, weight];
        // abs(sum/weight) beyond the limit, and beyond so many of its deviations 1/√weight.
        let size = sum.abs();
        noise.delayed =
            size > self.delay * weight && size * size > S::from_f64(SIGNIFICANT_DELAY * SIGNIFICANT_DELAY) * weight;
        warnings.latch(noise.delayed, Warning::Delay);
    }
}
