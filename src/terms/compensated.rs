//! Base model and terms together: the compensated gear, sample by sample.

use super::view::View;
use super::{Sample, Stack, StackState, TermState};
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
    last: LastSample<S>,
}

/// The last good sample of a compensated gear.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LastSample<S> {
    total: Total<S>,
    /// What the terms took off its deflection.
    correction: S,
}

impl<S> LastSample<S> {
    /// The torques there.
    #[must_use]
    pub fn total(&self) -> &Total<S> {
        &self.total
    }
}

/// A gear and its terms, wherever they lie.
pub type CompensatedView<'a, S, L = AnyLaw<S>> = View<'a, Gear<S, L>, S>;

/// The past of a compensated gear, wherever it lies.
pub struct CompensatedPast<'a, S: Float<Carry = S>, const N: usize, L: VaryingPeriod<S> = AnyLaw<S>> {
    /// The base model's past.
    pub gear: &'a mut State<S, N, L>,
    /// What each term remembers.
    pub terms: &'a mut [TermState<S>],
    /// The last good sample.
    pub last: &'a mut LastSample<S>,
}

impl<S: Float<Carry = S>, L: VaryingPeriod<S>, const K: usize> Compensated<S, L, K> {
    /// Gear and terms, wherever they lie.
    #[inline]
    #[must_use]
    pub fn view(&self) -> CompensatedView<'_, S, L> {
        View { base: &self.gear, stack: self.stack.view() }
    }

    /// The state at the first sample, its past unknown: y = 0, m = 0, all terms at rest.
    #[must_use]
    pub fn start<const N: usize>(&self, sample: &Sample<S>) -> CompensatedState<S, N, L, K> {
        let mut stack = self.stack.start();
        let (gear, last) = self.view().begin(stack.states_mut(), sample);
        CompensatedState { gear, stack, last }
    }

    /// Moves to the next sample, [`Sample::period`] after the last, and returns the torques there.
    #[inline]
    pub fn step<const N: usize>(&self, state: &mut CompensatedState<S, N, L, K>, sample: &Sample<S>) -> Total<S> {
        self.view().step(&mut state.past(), sample)
    }

    /// Makes a state of this gear of one that another gear had, as [`Gear::take_over`]; terms go on with what one of their kind remembers, new ones start at rest.
    pub fn take_over<const N: usize>(&self, before: &Gear<S, L>, state: &mut CompensatedState<S, N, L, K>) {
        self.gear.take_over(before, &mut state.gear);
        self.stack.take_over(&mut state.stack);
        state.last.total.base = self.gear.output(&state.gear);
    }

    /// Goes on from the past of a gear that had no terms: they start at rest.
    #[must_use]
    pub fn resume<const N: usize>(&self, gear: State<S, N, L>) -> CompensatedState<S, N, L, K> {
        let last = self.view().last_of(&gear);
        CompensatedState { gear, stack: self.stack.start(), last }
    }
}

impl<S: Float<Carry = S>, L: VaryingPeriod<S>> CompensatedView<'_, S, L> {
    /// As [`Compensated::start`], with a place for what each term remembers.
    pub fn start<const N: usize>(
        &self,
        terms: &mut [TermState<S>],
        sample: &Sample<S>,
    ) -> (State<S, N, L>, LastSample<S>) {
        self.stack.start(terms);
        self.begin(terms, sample)
    }

    /// The start of terms at rest.
    fn begin<const N: usize>(&self, terms: &mut [TermState<S>], sample: &Sample<S>) -> (State<S, N, L>, LastSample<S>) {
        let at_start = |theta| self.base.output(&self.base.start::<N>(theta)).torque;
        let accepted = sample.is_finite() && self.base.frame().accepts(sample.deflection);
        let sample = if accepted { *sample } else { Sample::default() };
        let corrected = self.stack.correct(terms, &sample, &at_start);
        let corrects = self.base.frame().accepts(corrected);
        let theta = if corrects { corrected } else { S::ZERO };
        let gear = self.base.start::<N>(theta);
        let base = self.base.output(&gear);
        let refused = !accepted || !corrects;
        let correction = sample.deflection - theta;
        let total = self.finish(terms, &sample, theta, base, Total { refused, ..Total::default() });
        (gear, LastSample { total, correction })
    }

    /// As [`Compensated::step`].
    #[inline]
    pub fn step<const N: usize>(&self, past: &mut CompensatedPast<'_, S, N, L>, sample: &Sample<S>) -> Total<S> {
        if self.advance(past, sample) {
            let CompensatedPast { gear, terms, last } = past;
            let base = self.base.output(gear);
            last.total = self.finish(terms, sample, gear.theta(), base, last.total);
        }
        past.last.total
    }

    /// Moves the gear, and says whether it did. A frame of its own, gone before the torques of the terms: firmware has little stack.
    #[inline(never)]
    fn advance<const N: usize>(&self, past: &mut CompensatedPast<'_, S, N, L>, sample: &Sample<S>) -> bool {
        let CompensatedPast { gear, terms, last } = past;
        last.total.refused = true;
        let is_time = sample.period >= S::ZERO;
        if !is_time || !sample.is_finite() || !self.base.frame().accepts(sample.deflection) {
            return false;
        }
        // A step of the encoders is one of the gear, but for what little the terms change in a period.
        if !self.base.admits_after(gear, sample.deflection - last.correction, sample.period) {
            last.total.refused = gear.status().refused;
            return false;
        }
        let before = &**gear;
        let transmitted = |theta| self.base.peek_after(before, theta, sample.period);
        let theta = self.stack.correct(terms, sample, &transmitted);
        // Corrections of the deflection may overflow, too.
        if !self.base.frame().accepts(theta) {
            return false;
        }
        self.base.advance_after(gear, theta, sample.period);
        last.correction = sample.deflection - theta;
        last.total.refused = false;
        true
    }

    /// As [`Compensated::take_over`], from as many terms as `count`; behind what they remember there are places for new ones.
    pub fn take_over<const N: usize>(
        &self,
        before: &Gear<S, L>,
        past: &mut CompensatedPast<'_, S, N, L>,
        count: usize,
    ) {
        self.base.take_over(before, past.gear);
        self.stack.take_over(past.terms, count);
        past.last.total.base = self.base.output(past.gear);
    }

    /// The last sample of a gear that had no terms.
    #[must_use]
    pub fn last_of<const N: usize>(&self, gear: &State<S, N, L>) -> LastSample<S> {
        let base = self.base.output(gear);
        let total = Total { torque: base.torque, base, deflection: gear.theta(), ..Total::default() };
        LastSample { total, correction: S::ZERO }
    }

    fn finish(
        &self,
        terms: &mut [TermState<S>],
        sample: &Sample<S>,
        deflection: S,
        base: Output<S>,
        last: Total<S>,
    ) -> Total<S> {
        let terms = self.stack.torque(terms, &Sample { deflection, base_torque: base.torque, ..*sample });
        if terms.is_finite() {
            Total { torque: base.torque + terms, terms, base, deflection, refused: last.refused }
        } else {
            Total { refused: true, ..last }
        }
    }
}

impl<S: Float<Carry = S>, const N: usize, L: VaryingPeriod<S>, const K: usize> CompensatedState<S, N, L, K> {
    /// The torques at the last good sample.
    #[must_use]
    pub fn last(&self) -> &Total<S> {
        &self.last.total
    }

    /// The base model's past.
    #[must_use]
    pub fn gear(&self) -> &State<S, N, L> {
        &self.gear
    }

    /// The past, wherever it lies.
    #[inline]
    pub fn past(&mut self) -> CompensatedPast<'_, S, N, L> {
        CompensatedPast { gear: &mut self.gear, terms: self.stack.states_mut(), last: &mut self.last }
    }

    /// What the terms remember.
    pub(super) fn stack(&self) -> &StackState<S, K> {
        &self.stack
    }
}
