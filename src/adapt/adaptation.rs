//! The adaptation of a gear: what its block and its settings make of it.

use super::bounds::Bounds;
use super::coefficients::{self, changed};
use super::filter::Estimate;
use super::health::{Health, Passed};
use super::state::AdaptationState;
use super::stretch::{Stretch, Sums};
use super::supervision::{Noise, Supervision};
use super::trial::{Losses, Trial};
use super::warnings::Warnings;
use super::work::Work;
use super::{AdaptError, BLOCK_S, Coefficients, LONGEST_S, SHORTEST_S, Settings};
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
    /// Pieces of work in a period.
    pub(super) pieces: u16,
    /// A quarter of the samples of a block.
    pub(super) least_weight: S,
    pub(super) fewest_blocks: S,
    pub(super) most_blocks: S,
    /// κ of the [filter](super::filter).
    pub(super) drift: S,
    /// Prior variance of each coefficient.
    pub(super) prior: S,
    /// What multiplies changes of the coefficients in their common factor γ = Σ p·(x·δ)/Σ p² over the rated cycle.
    pub(super) common: Coefficients<S>,
    pub(super) bounds: Bounds<S>,
    pub(super) health: Health<S>,
    pub(super) supervision: Supervision<S>,
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
            pieces: libm::ceil(settings.period_s / 1e-3 - 1e-6).clamp(1.0, 1000.0) as u16,
            least_weight: S::from_f64(0.25 * samples),
            fewest_blocks: S::from_f64(blocks(SHORTEST_S)),
            most_blocks: S::from_f64(blocks(LONGEST_S)),
            drift: S::from_f64(drift * drift),
            prior: S::from_f64(deviation * deviation),
            common,
            bounds: Bounds::new(&block_coefficients, S::from_f64(settings.largest_change)),
            health: Health::new(&block_coefficients, &common),
            supervision: Supervision::new(settings),
            threshold: S::from_f64(-libm::log(settings.false_acceptance)),
        })
    }

    /// Nothing learnt yet: the block is in force.
    pub fn start(&self) -> AdaptationState<S> {
        AdaptationState {
            sums: Sums::default(),
            samples: 0,
            work: Work::None,
            stretch: Stretch::new(),
            estimate: Estimate::new(self.prior),
            trial: Trial::new(),
            losses: [Losses::default(); 3],
            noise: Noise::new(),
            warnings: Warnings::default(),
            passed: Passed::default(),
            last: S::ZERO,
            range: [S::ZERO; 2],
            unknown: S::from_f64(S::LARGEST),
            continues: false,
            known: false,
        }
    }

    /// The parameters in force: the block's with the changes that were taken over. e and h become α, β and ω with the block's β² + ω².
    ///
    /// # Errors
    /// Rounding brought them to the edge of what [`Params::new`] accepts.
    pub fn params(&self, state: &AdaptationState<S>, block: &Params) -> Result<Params, ParamError> {
        changed(block, &state.trial.in_force)
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
        let mut change = state.estimate.value;
        Bounds::lift(&self.block, &state.estimate, &mut change, 0);
        Bounds::lift(&self.block, &state.estimate, &mut change, 1);
        self.bounds.shrink(&self.block, &self.common, &mut change);
        change
    }
}
