//! Adapted parameters in the shadow of those in force, and the sequential tests between them.
//!
//! Each stretch is predicted before it is learnt from. With L(x) the squared error of coefficients x over a stretch, over twice the variance of the noise, the learnt offset taken off, and L′(x) the same
//! without what level and delay of the signal explain,
//!
//! ```text
//! Λ ← max(0, Λ + clamp(ΔL′ − 1/4, ±4))       Δ: in force less shadow      take over where Λ ≥ ln(1/α)·2^n, n times given back
//! B ← max(0, B + clamp(ΔL − 1/4, ±4))        Δ: in force less block       give back where B ≥ 6
//! ```
//!
//! ΔL′ is the logarithm of a likelihood ratio, whose exponential has the mean 1 at most while the parameters in force are the truth: that Λ passes ln(1/α) within a run
//! that begins at a given stretch has then the probability α at most (Ville's inequality), so takeovers come less often than α a stretch (Lorden 1971).
//!
//! While the signal is late or off ([`health`](super::health)) Λ is 0: nothing is taken over. After eight stretches in a row in which it was off the block is put back in force, as what was taken over may be of the
//! offset.
//!
//! L′ alone would let coefficients stay in force that predict changes better and the level worse: so L leads to a return. Both leads are kept doubled.

use super::Adaptation;
use super::state::AdaptationState;
use super::triangle::{clear, dot, row};
use super::warnings::Warning;
use super::{COEFFICIENTS, Coefficients};
use crate::scalar::Float;

/// How many leads there are.
pub(super) const LEADS: usize = 2;
/// No stretch counts for more.
const LARGEST_GAIN: f64 = 4.0;
/// B at which parameters are given back.
const GIVE_BACK: f64 = 6.0;
/// Where the gains begin in the sums of a stretch, in the order of the leads.
const FIRST_GAIN: usize = 2;
/// What a gain must exceed in a stretch to count.
const MARGIN: f64 = 0.25;

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
    /// Λ and B, doubled.
    pub(super) leads: [S; LEADS],
    /// What Λ must reach, doubled.
    pub(super) needed: S,
}

impl<S: Float> Trial<S> {
    /// Before it is started.
    pub(super) const NEW: Self = {
        let zero = [S::ZERO; COEFFICIENTS];
        Self { in_force: zero, shadow: zero, leads: [S::ZERO; LEADS], needed: S::ZERO }
    };

    /// Puts the block back in force.
    pub(super) fn give_back(&mut self) {
        self.in_force = [S::ZERO; COEFFICIENTS];
        self.needed = self.needed + self.needed;
    }
}

/// A gain, or an innovation in standard deviations, within what one row or stretch may count for.
#[inline(never)]
pub(super) fn limited<S: Float>(x: S) -> S {
    let most = S::from_f64(LARGEST_GAIN);
    x.max(-most).min(most)
}

impl<S: Float> Adaptation<S> {
    /// Predicts the row of a length by those in force, the shadow and the block; adds to what [`judge`](Self::judge) and [`advance`](Self::advance) need.
    #[inline]
    pub(super) fn assess(&self, state: &mut AdaptationState<S>, length: usize) {
        let AdaptationState { triangle, trial, sums, estimate, .. } = state;
        let [value, x @ ..] = &*row(triangle, length) else { return };
        let [.., offset] = estimate.value;
        let mut value = *value;
        let level = x.get(COEFFICIENTS);
        if let Some(level) = level {
            value = value - *level * offset;
        }
        let square = |of: S| of * of;
        let now = square(value - dot(x, &trial.in_force));
        let [of_block, of_residual, of_shadow, plain_block, ..] = sums;
        *plain_block = *plain_block + (now - square(value));
        // The rows of level and delay come after: what they explain is no motion either.
        if level.is_none() {
            *of_shadow = *of_shadow + (now - square(value - dot(x, &trial.shadow)));
            *of_block = *of_block + square(dot(x, &self.block));
            *of_residual = *of_residual + square(value);
        }
    }

    /// Adds the gain of a stretch to a lead.
    #[inline]
    pub(super) fn advance(state: &mut AdaptationState<S>, number: usize) {
        let AdaptationState { trial, noise, sums, .. } = state;
        if let (Some(lead), Some(gain)) = (trial.leads.get_mut(number), sums.get(FIRST_GAIN + number)) {
            let gain = gain.over(noise.variance) * S::HALF - S::from_f64(MARGIN);
            let sum = *lead * S::HALF + limited(gain);
            // Twice the greater of it and zero.
            *lead = sum + sum.abs();
        }
    }

    /// Decides what is in force.
    #[inline]
    pub(super) fn decide(state: &mut AdaptationState<S>) -> Change {
        let AdaptationState { trial, warnings, passed: [delayed, off, ..], .. } = state;
        // The signal was late, or off, in the stretch before: nothing is taken over.
        if (*delayed | *off) & 1 != 0 {
            let [shadow, ..] = &mut trial.leads;
            *shadow = S::ZERO;
        }
        let [shadow, block] = trial.leads;
        // Zero while the block is in force.
        let [.., slope] = trial.in_force;
        let change = if block >= S::from_f64(2.0 * GIVE_BACK) || (*off == u8::MAX && slope != S::ZERO) {
            trial.give_back();
            Change::GivenBack
        } else if shadow >= trial.needed {
            trial.in_force = trial.shadow;
            warnings.latch(state.held, Warning::Bound);
            Change::TakenOver
        } else {
            return Change::None;
        };
        clear(&mut trial.leads);
        change
    }
}
