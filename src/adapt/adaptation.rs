//! The adaptation of a gear: what its block and its settings make of it.

use super::bounds::fall;
use super::coefficients::{self, changed};
use super::health::{LARGEST_DELAY_S, LARGEST_FACTOR, scales};
use super::state::AdaptationState;
use super::{AdaptError, BLOCK_S, Coefficients, LEAST_MOTION, LONGEST_S, SHORTEST_S, Settings, reversed};
use crate::gear::Gear;
use crate::inverse::Inverse;
use crate::memory::Frame;
use crate::memory::masing::Masing;
use crate::params::{Law, ParamError, Params};
use crate::scalar::Float;

/// Blocks of a stretch at least, and at most.
const FEWEST_BLOCKS: u16 = 30;
const MOST_BLOCKS: u16 = 60_000;
/// Samples of a block at most.
const MOST_SAMPLES: u16 = 10_000;
/// Pieces of work in a period at most: one a millisecond.
const MOST_PIECES: u16 = 1000;

/// The adaptation of a gear; what it has learnt is apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptation<S> {
    pub(super) frame: Frame<S>,
    pub(super) block: Coefficients<S>,
    /// Samples of a block.
    pub(super) samples: u16,
    /// 1 over the square root of it.
    pub(super) share: S,
    /// Pieces of work in a period.
    pub(super) pieces: u16,
    pub(super) fewest_blocks: u16,
    pub(super) most_blocks: u16,
    /// What a coefficient drifts by in a stretch.
    pub(super) drift: S,
    /// Prior standard deviation of each coefficient: half of the most that a coefficient, and their common factor, may change.
    pub(super) deviation: S,
    /// Half of the most that the slope may fall by.
    pub(super) fall: S,
    /// Half of the most that γ may change by, over the largest change of it that is normal.
    pub(super) factor: S,
    /// γ's row, over the largest change of γ that is normal.
    pub(super) common: Coefficients<S>,
    /// What the spring, the slope at zero and h count by where they are held against their limits.
    pub(super) scales: [S; 3],
    /// The largest delay, in periods.
    pub(super) delay: S,
    /// Σ p² about its mean that a stretch must have, a block.
    pub(super) motion: S,
    /// The square of the share of the block's torque that residuals may have.
    pub(super) gain: S,
    /// 2·ln(1/α).
    pub(super) threshold: S,
}

impl<S: Float> Adaptation<S> {
    /// The adaptation of the gear of a block's parameters: that [of its gear](Self::of_gear), to the bit.
    ///
    /// # Errors
    /// [`AdaptError`]: a setting out of range, a law other than `masing`.
    pub fn new(block: &Params, settings: &Settings) -> Result<Self, AdaptError> {
        settings.check()?;
        if block.memory().law != Law::Masing {
            return Err(AdaptError::Law(block.memory().law));
        }
        Self::of_gear(&Gear::with_law(block, Masing::new(block)), &settings.cast())
    }

    /// The adaptation of a gear that is set up already, such as that of a stored block: computed in the scalar alone.
    ///
    /// # Errors
    /// [`AdaptError::Setting`].
    pub fn of_gear(gear: &Gear<S, Masing<S>>, settings: &Settings<S>) -> Result<Self, AdaptError> {
        settings.check()?;
        let Settings { period_s, drift, largest_change, false_acceptance } = *settings;
        let frame = *gear.frame();
        let block = coefficients::of(gear);
        let samples = at_least(S::from_f64(BLOCK_S).over(period_s) - S::HALF, 1, MOST_SAMPLES);
        let number = S::from_f64(f64::from(samples));
        let blocks = |seconds: f64| at_least(S::from_f64(seconds).over(number * period_s), FEWEST_BLOCKS, MOST_BLOCKS);
        let deviation = S::HALF * largest_change;
        let common = coefficients::common(&frame, &block).map(|of| of.over(S::from_f64(LARGEST_FACTOR)));
        let gain = largest_change + S::from_f64(0.1);
        Ok(Self {
            frame,
            block,
            samples,
            share: number.sqrt().recip(),
            pieces: at_least(period_s * S::from_f64(1e3), 1, MOST_PIECES),
            fewest_blocks: blocks(SHORTEST_S),
            most_blocks: blocks(LONGEST_S),
            drift,
            deviation,
            fall: fall(&block),
            factor: deviation.over(S::from_f64(LARGEST_FACTOR)),
            common,
            scales: scales(&block),
            delay: S::from_f64(LARGEST_DELAY_S).over(period_s),
            motion: S::from_f64(LEAST_MOTION * LEAST_MOTION) * number,
            gain: gain * gain,
            threshold: -S::TWO * false_acceptance.ln(),
        })
    }

    /// Nothing learnt yet: the block is in force. The same as [`AdaptationState::new`], which the first period starts.
    #[must_use]
    pub fn start(&self) -> AdaptationState<S> {
        let mut state = AdaptationState::new();
        self.begin(&mut state);
        state
    }

    /// What is not zero in a state that has learnt nothing.
    #[inline]
    pub(super) fn begin(&self, state: &mut AdaptationState<S>) {
        state.noise.begin();
        state.trial.needed = self.threshold;
        state.estimate.begin(self.deviation);
    }

    /// The parameters in force: the block's with the changes that were taken over. e and h become α, β and ω with the block's β² + ω².
    ///
    /// # Errors
    /// Rounding brought them to the edge of what [`Params::new`] accepts.
    pub fn params(&self, state: &AdaptationState<S>, block: &Params) -> Result<Params, ParamError> {
        changed(block, &state.in_force())
    }

    /// The inverse in force, from that of the block: computed in the scalar alone ([`Inverse::changed`]), where [`params`](Self::params) compute in `f64`. `None`: its
    /// torque need not rise about θ = 0.
    #[must_use]
    pub fn inverse(&self, state: &AdaptationState<S>, block: &Inverse<S, Masing<S>>) -> Option<Inverse<S, Masing<S>>> {
        block.changed(&state.in_force())
    }

    /// The parameters of the shadow, bounds kept: what a host may commit.
    ///
    /// # Errors
    /// As [`params`](Self::params).
    pub fn shadow(&self, state: &AdaptationState<S>, block: &Params) -> Result<Params, ParamError> {
        changed(block, &self.shadow_change(state))
    }

    /// Changes of the normalised coefficients of the shadow, bounds kept.
    #[must_use]
    pub fn shadow_change(&self, state: &AdaptationState<S>) -> Coefficients<S> {
        reversed(state.trial.shadow)
    }
}

/// The least whole number that is not below a quotient, its rounding forgiven, within bounds.
fn at_least<S: Float>(quotient: S, least: u16, most: u16) -> u16 {
    let quotient = quotient - quotient * S::from_f64(1e-5);
    // By halves: no conversion that every scalar has.
    let (mut low, mut high) = (least, most);
    while low < high {
        let middle = low + (high - low) / 2;
        if S::from_f64(f64::from(middle)) < quotient {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low
}
