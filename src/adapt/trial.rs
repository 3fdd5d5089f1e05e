//! Adapted parameters in the shadow of those in force, and the sequential tests between them.
//!
//! Each stretch is predicted before it is learnt from. With L(x) the squared error of coefficients x over a stretch, over twice the variance of the noise, and L′(x) the same with
//! offset and delay of the signal taken out,
//!
//! ```text
//! Λ ← max(0, Λ + clamp(ΔL′, ±4))               Δ: in force less shadow      take over where Λ ≥ ln(1/α)·2^n, n times given back
//! B ← max(0, B + clamp(ΔL′, ±4))               Δ: in force less block       give back where B ≥ 6
//! B ← max(0, B + clamp(ΔL − 1/4, ±4))                                       or this one
//! ```
//!
//! ΔL′ is the logarithm of a likelihood ratio, whose exponential has the mean 1 at most while the parameters in force are the truth: that Λ passes ln(1/α) within a run
//! that begins at a given stretch has then the probability α at most (Ville's inequality), so takeovers come less often than α a stretch (Lorden 1971).
//!
//! L′ alone would let coefficients predict changes better and the level worse: so L must not have grown over the run of Λ either, and both errors lead to a return.

use super::Adaptation;
use super::state::AdaptationState;
use super::triangle::{clear, dot, row};
use super::warnings::Warning;
use super::work::LEARNT;
use super::{COEFFICIENTS, Coefficients};
use crate::scalar::Float;

/// No stretch counts for more.
const LARGEST_GAIN: f64 = 4.0;
/// B at which parameters are given back.
const GIVE_BACK: f64 = 6.0;
/// What the plain error of those in force may exceed the block's by in a stretch, as a gain.
const PLAIN_MARGIN: f64 = 0.25;

/// What a stretch decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Change {
    /// The parameters in force stay.
    #[default]
    None,
    /// Adapted parameters are to be taken over: [`Adaptation::params`](super::Adaptation::params).
    TakenOver,
    /// The block's own parameters are to be put back in force.
    GivenBack,
}

/// The tests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Trial<S> {
    pub(super) in_force: Coefficients<S>,
    pub(super) shadow: Coefficients<S>,
    /// Λ, B of either error, and the plain gain of the shadow since Λ was 0.
    leads: [S; 4],
    /// What Λ must reach.
    needed: S,
}

impl<S: Float> Trial<S> {
    pub(super) fn new(threshold: S) -> Self {
        let zero = [S::ZERO; COEFFICIENTS];
        Self { in_force: zero, shadow: zero, leads: [S::ZERO; 4], needed: threshold }
    }

    /// Puts the block back in force.
    pub(super) fn give_back(&mut self) {
        clear(&mut self.in_force);
        clear(&mut self.leads);
        self.needed = self.needed + self.needed;
    }
}

/// Adds the gain of a stretch to a lead.
#[inline(never)]
fn advance<S: Float>(lead: &mut S, gain: S) {
    let most = S::from_f64(LARGEST_GAIN);
    *lead = (*lead + gain.clamp(-most, most)).max(S::ZERO);
}

impl<S: Float> Adaptation<S> {
    /// Predicts the row of a length by those in force, the shadow and the block; adds to what [`decide`](Self::decide) needs.
    #[inline]
    pub(super) fn assess(&self, state: &mut AdaptationState<S>, length: usize) {
        let AdaptationState { triangle, trial, row: sums, .. } = state;
        let [value, x @ ..] = &*row(triangle, length) else { return };
        let square = |of: S| of * of;
        let now = square(*value - dot(x, &trial.in_force));
        let shadow = now - square(*value - dot(x, &trial.shadow));
        let block = now - square(*value);
        let moved = square(dot(x, &self.block));
        let [plain_shadow, plain_block, freed_shadow, freed_block, of_block, of_residual, ..] = sums;
        (*plain_shadow, *plain_block) = (*plain_shadow + shadow, *plain_block + block);
        if length <= COEFFICIENTS + 1 {
            (*freed_shadow, *freed_block) = (*plain_shadow, *plain_block);
        }
        // An offset of the signal is no motion.
        if length <= COEFFICIENTS + 2 {
            (*of_block, *of_residual) = (*of_block + moved, *of_residual + square(*value));
        }
    }

    /// Judges a stretch, and decides what is in force.
    #[inline]
    pub(super) fn decide(&self, state: &mut AdaptationState<S>) -> Change {
        let [plain_shadow, plain_block, freed_shadow, freed_block, of_block, of_residual, ..] = state.row;
        if !self.judge(state, of_block, of_residual) {
            return Change::None;
        }
        let AdaptationState { trial, noise, warnings, .. } = state;
        if state.hold > 0 {
            state.hold -= 1;
            state.work = LEARNT;
            return Change::None;
        }
        // The signal was late in the stretch before: nothing is decided.
        let [delayed, ..] = state.passed;
        if delayed > 0 {
            return Change::None;
        }
        let share = S::HALF.over(noise.variance);
        let [shadow, freed, plain, shadow_plain] = &mut trial.leads;
        advance(freed, freed_block * share);
        advance(plain, plain_block * share - S::from_f64(PLAIN_MARGIN));
        advance(shadow, freed_shadow * share);
        *shadow_plain = if *shadow > S::ZERO { *shadow_plain + plain_shadow } else { S::ZERO };
        if freed.max(*plain) >= S::from_f64(GIVE_BACK) {
            trial.give_back();
            return Change::GivenBack;
        }
        if *shadow >= trial.needed && *shadow_plain >= S::ZERO {
            trial.in_force = trial.shadow;
            clear(&mut trial.leads);
            warnings.latch(state.held, Warning::Bound);
            return Change::TakenOver;
        }
        Change::None
    }
}
