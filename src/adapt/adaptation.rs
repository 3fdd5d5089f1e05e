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
use crate::memory::Frame;
use crate::params::{Law, ParamError, Params};
use crate::scalar::Float;

/// Blocks of a stretch at least.
const FEWEST_BLOCKS: f64 = 30.0;

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
    /// The adaptation of the gear of a block's parameters.
    ///
    /// # Errors
    /// [`AdaptError`]: a setting out of range, a law other than `masing`.
    pub fn new(block: &Params, settings: &Settings) -> Result<Self, AdaptError> {
        settings.check()?;
        if block.memory().law != Law::Masing {
            return Err(AdaptError::Law(block.memory().law));
        }
        let frame = Frame::new(block);
        let block_coefficients = coefficients::of(block);
        let samples = libm::round(BLOCK_S / settings.period_s).clamp(1.0, 10_000.0);
        let block_s = samples * settings.period_s;
        let blocks = |seconds: f64| libm::ceil(seconds / block_s).clamp(FEWEST_BLOCKS, 60_000.0);
        let deviation = 0.5 * settings.largest_change;
        let drift = settings.drift / deviation;
        let common = coefficients::common(&frame, &block_coefficients);
        Ok(Self {
            frame,
            block: block_coefficients,
            inverse_torque: S::from_f64(1.0 / block.torque_scale_nm()),
            samples: samples as u16,
            share: S::from_f64(1.0 / libm::sqrt(samples)),
            pieces: libm::ceil(settings.period_s / 1e-3 - 1e-6).clamp(1.0, 1000.0) as u16,
            fewest_blocks: blocks(SHORTEST_S) as u16,
            most_blocks: blocks(LONGEST_S) as u16,
            drift: S::from_f64(drift * drift),
            deviation: S::from_f64(deviation),
            prior: S::from_f64(deviation * deviation),
            inverse_change: S::from_f64(1.0 / settings.largest_change),
            bounds: bounds(&block_coefficients, &common, S::from_f64(settings.largest_change)),
            health: Health::new(settings, &block_coefficients, &common),
            motion: S::from_f64(LEAST_MOTION * LEAST_MOTION * samples),
            gain: S::from_f64((settings.largest_change + 0.1) * (settings.largest_change + 0.1)),
            threshold: S::from_f64(-libm::log(settings.false_acceptance)),
        })
    }

    /// Nothing learnt yet: the block is in force.
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

    /// The parameters of the shadow, bounds kept: what a host may commit.
    ///
    /// # Errors
    /// As [`params`](Self::params).
    pub fn shadow(&self, state: &AdaptationState<S>, block: &Params) -> Result<Params, ParamError> {
        changed(block, &self.shadow_change(state))
    }

    /// Changes of the normalised coefficients of the shadow, bounds kept.
    pub fn shadow_change(&self, state: &AdaptationState<S>) -> Coefficients<S> {
        reversed(state.trial.shadow)
    }
}
