//! The adaptation of a gear: what its block and its settings make of it.

use super::bounds::{Bounds, bounds};
use super::coefficients::{self, changed};
use super::estimate::Estimate;
use super::health::{Health, Passed};
use super::state::AdaptationState;
use super::supervision::Noise;
use super::trial::Trial;
use super::warnings::Warnings;
use super::work::ROWS;
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
    /// 1/T_A in output units.
    pub(super) inverse_torque: S,
    /// Samples of a block.
    pub(super) samples: u16,
    /// 1 over the square root of it.
    pub(super) share: S,
    /// Pieces of work in a period.
    pub(super) pieces: u16,
    pub(super) fewest_blocks: u16,
    pub(super) most_blocks: u16,
    /// κ of the [filter](super::filter).
    pub(super) drift: S,
    /// Prior deviation of each coefficient, and its square.
    pub(super) deviation: S,
    pub(super) prior: S,
    /// 1 over the most that a coefficient may change.
    pub(super) inverse_change: S,
    pub(super) bounds: Bounds<S>,
    pub(super) health: Health<S>,
    /// Σ p² about its mean that a stretch must have, a block.
    pub(super) motion: S,
    /// The square of the share of the block's torque that residuals may have.
    pub(super) gain: S,
    /// ln(1/α).
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
        let drift = drift.over(deviation);
        let common = coefficients::common(&frame, &block);
        let gain = largest_change + S::from_f64(0.1);
        Ok(Self {
            frame,
            block,
            inverse_torque: frame.torque_scale().recip(),
            samples,
            share: number.sqrt().recip(),
            pieces: at_least(period_s * S::from_f64(1e3), 1, MOST_PIECES),
            fewest_blocks: blocks(SHORTEST_S),
            most_blocks: blocks(LONGEST_S),
            drift: drift * drift,
            deviation,
            prior: deviation * deviation,
            inverse_change: largest_change.recip(),
            bounds: bounds(&block, &common, largest_change),
            health: Health::new(period_s, &block, &common),
            motion: S::from_f64(LEAST_MOTION * LEAST_MOTION) * number,
            gain: gain * gain,
            threshold: -false_acceptance.ln(),
        })
    }

    /// Nothing learnt yet: the block is in force.
    #[must_use]
    pub fn start(&self) -> AdaptationState<S> {
        AdaptationState {
            sums: [S::ZERO; ROWS],
            triangle: [S::ZERO; ROWS * (ROWS + 1) / 2],
            blocks: 0,
            estimate: Estimate::new(self.deviation),
            trial: Trial::new(self.threshold),
            noise: Noise::new(),
            last: S::ZERO,
            span: S::ZERO,
            samples: 0,
            warnings: Warnings::default(),
            passed: Passed::default(),
            work: 0,
            hold: 0,
            held: false,
            continues: false,
        }
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
