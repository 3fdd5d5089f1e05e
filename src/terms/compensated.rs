//! Base model and terms together: the compensated gear, sample by sample.

use super::{Sample, Stack, StackState};
use crate::gear::{Gear, Output, State};
use crate::memory::{AnyLaw, VaryingPeriod};
use crate::scalar::Float;

/// A gear and its terms.
#[derive(Debug, Clone, PartialEq)]
pub struct Compensated<S: Float, L = AnyLaw<S>, const K: usize = 8> {
    /// The base model.
    pub gear: Gear<S, L>,
    /// The terms.
    pub stack: Stack<S, K>,
}

/// Torques at one sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Total<S> {
    /// T with all terms, N·m.
    pub torque: S,
    /// What the terms add, N·m.
    pub terms: S,
    /// The base model at the corrected deflection.
    pub base: Output<S>,
    /// The corrected deflection, rad.
    pub deflection: S,
    /// The sample was none (NaN, infinite, an absurd deflection): nothing moved, and the torques are those of the last good sample. They are so, too, where the base
    /// model [quarantines](crate::Status::quarantined) it.
    pub refused: bool,
}

/// The past of a compensated gear.
#[derive(Clone)]
pub struct CompensatedState<
    S: Float<Carry = S>,
    const N: usize = 16,
    L: VaryingPeriod<S> = AnyLaw<S>,
    const K: usize = 8,
> {
    gear: State<S, N, L>,
    stack: StackState<S, K>,
    last: Total<S>,
    /// What the terms took off the last deflection.
    correction: S,
}

impl<S: Float<Carry = S>, L: VaryingPeriod<S>, const K: usize> Compensated<S, L, K> {
    /// The state at the first sample, its past unknown: y = 0, m = 0, all terms at rest.
    pub fn start<const N: usize>(&self, sample: &Sample<S>) -> CompensatedState<S, N, L, K> {
        let mut stack = self.stack.start();
        let at_start = |theta| self.gear.output(&self.gear.start::<N>(theta)).torque;
        let accepted = sample.is_finite() && self.gear.frame().accepts(sample.deflection);
        let sample = if accepted { *sample } else { Sample::default() };
        let corrected = self.stack.correct(&mut stack, &sample, &at_start);
        let corrects = self.gear.frame().accepts(corrected);
        let theta = if corrects { corrected } else { S::ZERO };
        let gear = self.gear.start::<N>(theta);
        let base = self.gear.output(&gear);
        let refused = !accepted || !corrects;
        let correction = sample.deflection - theta;
        let mut state = CompensatedState { gear, stack, last: Total { refused, ..Total::default() }, correction };
        state.last = self.finish(&mut state.stack, &sample, theta, base, state.last);
        state
    }

    /// Moves to the next sample, [`Sample::period`] after the last, and returns the torques there.
    #[inline]
    pub fn step<const N: usize>(&self, state: &mut CompensatedState<S, N, L, K>, sample: &Sample<S>) -> Total<S> {
        let is_time = sample.period >= S::ZERO;
        if !is_time || !sample.is_finite() || !self.gear.frame().accepts(sample.deflection) {
            state.last.refused = true;
            return state.last;
        }
        // A step of the encoders is one of the gear, but for what little the terms change in a period.
        if !self.gear.admits_after(&mut state.gear, sample.deflection - state.correction, sample.period) {
            state.last.refused = state.gear.status().refused;
            return state.last;
        }
        let before = &state.gear;
        let transmitted = |theta| self.gear.peek_after(before, theta, sample.period);
        let theta = self.stack.correct(&mut state.stack, sample, &transmitted);
        // Corrections of the deflection may overflow, too.
        if !self.gear.frame().accepts(theta) {
            state.last.refused = true;
            return state.last;
        }
        self.gear.advance_after(&mut state.gear, theta, sample.period);
        state.correction = sample.deflection - theta;
        let base = self.gear.output(&state.gear);
        state.last = self.finish(&mut state.stack, sample, theta, base, Total { refused: false, ..state.last });
        state.last
    }

    /// Makes a state of this gear of one that another gear had, as [`Gear::take_over`]; terms go on with what one of their kind remembers, new ones start at rest.
    pub fn take_over<const N: usize>(&self, before: &Gear<S, L>, state: &mut CompensatedState<S, N, L, K>) {
        self.gear.take_over(before, &mut state.gear);
        self.stack.take_over(&mut state.stack);
        state.last.base = self.gear.output(&state.gear);
    }

    /// Goes on from the past of a gear that had no terms: they start at rest.
    pub fn resume<const N: usize>(&self, gear: State<S, N, L>) -> CompensatedState<S, N, L, K> {
        let base = self.gear.output(&gear);
        let last = Total { torque: base.torque, base, deflection: gear.theta(), ..Total::default() };
        CompensatedState { gear, stack: self.stack.start(), last, correction: S::ZERO }
    }

    fn finish(
        &self,
        stack: &mut StackState<S, K>,
        sample: &Sample<S>,
        deflection: S,
        base: Output<S>,
        last: Total<S>,
    ) -> Total<S> {
        let terms = self.stack.torque(stack, &Sample { deflection, base_torque: base.torque, ..*sample });
        if terms.is_finite() {
            Total { torque: base.torque + terms, terms, base, deflection, refused: last.refused }
        } else {
            Total { refused: true, ..last }
        }
    }
}

impl<S: Float<Carry = S>, const N: usize, L: VaryingPeriod<S>, const K: usize> CompensatedState<S, N, L, K> {
    /// The torques at the last good sample.
    pub fn last(&self) -> &Total<S> {
        &self.last
    }

    /// The base model's past.
    pub fn gear(&self) -> &State<S, N, L> {
        &self.gear
    }

    /// What the terms remember.
    pub(super) fn stack(&self) -> &StackState<S, K> {
        &self.stack
    }
}
