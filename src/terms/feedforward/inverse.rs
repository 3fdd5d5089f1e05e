//! The inverse with terms.

use super::balance::{Asked, Parts, Trial, deflection_error};
use crate::gear::{Gear, State};
use crate::inverse::{Inverse, Invertible, Solution};
use crate::memory::{AnyLaw, MemoryLaw, VaryingPeriod};
use crate::scalar::Float;
use crate::terms::compensated::CompensatedState;
use crate::terms::view::View;
use crate::terms::{Sample, Stack, StackState, StackView, TermState};

/// A gear's inverse and its terms.
#[derive(Debug, Clone, PartialEq)]
pub struct CompensatedInverse<S: Float, L = AnyLaw<S>, const K: usize = 8> {
    /// The inverse of the base model.
    pub inverse: Inverse<S, L>,
    /// The terms.
    pub stack: Stack<S, K>,
}

/// The past of gear and terms.
#[derive(Clone)]
pub struct CompensatedInverseState<
    S: Float<Carry = S>,
    const N: usize = 16,
    L: MemoryLaw<S> = AnyLaw<S>,
    const K: usize = 8,
> {
    gear: State<S, N, L>,
    terms: TermsState<S, K>,
}

/// What the terms remember, and what they added last.
#[derive(Debug, Clone)]
struct TermsState<S: Float<Carry = S>, const K: usize> {
    stack: StackState<S, K>,
    last: Parts<S>,
}

/// An inverse and its terms, wherever they lie.
pub type CompensatedInverseView<'a, S, L = AnyLaw<S>> = View<'a, Inverse<S, L>, S>;

/// A deflection for a torque, with terms.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CompensatedSolution<S> {
    /// The deflection of the encoders, rad.
    pub measured: S,
    /// θ of the gear, and how it was found.
    pub gear: Solution<S>,
    /// T_base there, N·m.
    pub base_torque: S,
    /// What the terms add there.
    pub terms: Parts<S>,
    /// The search for G met its tolerance, 1e-6 of the torque scale (1e-12 in `f64`).
    pub converged: bool,
}

/// Gear and terms at a first sample, the terms at rest before.
pub(super) fn begin<S: Float<Carry = S>, L: MemoryLaw<S>, const N: usize>(
    gear: &Gear<S, L>,
    stack: StackView<'_, S>,
    terms: &mut [TermState<S>],
    sample: &Sample<S>,
) -> (State<S, N, L>, Parts<S>) {
    let theta = sample.deflection - deflection_error(stack, sample);
    let accepted = sample.is_finite() && gear.frame().accepts(theta);
    let (sample, theta) = if accepted { (*sample, theta) } else { (Sample::default(), S::ZERO) };
    let state = gear.start::<N>(theta);
    let base_torque = gear.output(&state).torque;
    let last = stack.parts(terms, &Sample { deflection: theta, base_torque, ..sample });
    let last = if last.gear.is_finite() && last.joint.is_finite() { last } else { Parts::default() };
    (state, last)
}

impl<S: Float<Carry = S>, L: Invertible<S>, const K: usize> CompensatedInverse<S, L, K> {
    /// Inverse and terms, wherever they lie.
    #[inline]
    #[must_use]
    pub fn view(&self) -> CompensatedInverseView<'_, S, L> {
        View { base: &self.inverse, stack: self.stack.view() }
    }

    /// The state at a first sample, its deflection that of the encoders, its past unknown. A sample that is none counts as one of zeros.
    #[must_use]
    pub fn start<const N: usize>(&self, sample: &Sample<S>) -> CompensatedInverseState<S, N, L, K> {
        let mut stack = self.stack.start();
        let (gear, last) = begin(self.inverse.gear(), self.stack.view(), stack.states_mut(), sample);
        CompensatedInverseState { gear, terms: TermsState { stack, last } }
    }

    /// Moves gear and terms to the deflection at which they give a torque together, at the speeds, angles and temperature of a sample; its deflection is not read. A torque or a sample that is
    /// refused moves nothing.
    pub fn commit<const N: usize>(
        &self,
        state: &mut CompensatedInverseState<S, N, L, K>,
        torque: S,
        sample: &Sample<S>,
    ) -> CompensatedSolution<S> {
        let (view, terms) = (self.view(), &state.terms);
        let mut stack = terms.stack.clone();
        let of_state = (&state.gear, terms.stack.states(), &terms.last);
        let mut trial = Trial::in_copy(stack.states_mut());
        let Some(found) = view.balance(of_state, &mut trial, (torque, Asked::Total), sample) else {
            return view.refused(&state.gear, state.terms.last);
        };
        let (gear, output) = self.inverse.commit(&mut state.gear, found.carried);
        if gear.refused {
            return view.refused(&state.gear, state.terms.last);
        }
        state.terms = TermsState { stack, last: found.parts };
        CompensatedSolution {
            measured: gear.theta + found.error,
            gear,
            base_torque: output.torque,
            terms: found.parts,
            converged: found.converged,
        }
    }
}

impl<S: Float<Carry = S>, const N: usize, L: Invertible<S> + VaryingPeriod<S>, const K: usize>
    CompensatedState<S, N, L, K>
{
    /// The deflection of the encoders at which the next sample of gear and terms gives a torque, at the speeds, angles and temperature of a sample; its deflection is not read, and
    /// nothing moves. A torque or a sample that is refused gives the present deflection of the gear.
    #[must_use]
    pub fn solve(
        &self,
        inverse: &Inverse<S, L>,
        stack: &Stack<S, K>,
        torque: S,
        sample: &Sample<S>,
    ) -> CompensatedSolution<S> {
        let mut trial = self.stack().clone();
        let view = View { base: inverse, stack: stack.view() };
        view.solve((self.gear(), self.stack().states()), Trial::in_copy(trial.states_mut()), torque, sample)
    }
}

impl<S: Float<Carry = S>, L: Invertible<S>> CompensatedInverseView<'_, S, L> {
    /// As [`CompensatedState::solve`], from a gear's past and what the terms remember.
    #[must_use]
    pub fn solve<const N: usize>(
        &self,
        (gear, terms): (&State<S, N, L>, &[TermState<S>]),
        mut trial: Trial<'_, S>,
        torque: S,
        sample: &Sample<S>,
    ) -> CompensatedSolution<S> {
        let none = Parts::default();
        let Some(found) = self.balance((gear, terms, &none), &mut trial, (torque, Asked::Total), sample) else {
            return self.refused(gear, none);
        };
        let solution = self.base.peek(gear, found.carried);
        CompensatedSolution {
            measured: solution.theta + found.error,
            gear: solution,
            base_torque: found.carried,
            terms: found.parts,
            converged: found.converged,
        }
    }

    /// The present deflection of the gear, where a torque or a sample is refused.
    fn refused<const N: usize>(&self, gear: &State<S, N, L>, terms: Parts<S>) -> CompensatedSolution<S> {
        let theta = gear.theta();
        CompensatedSolution {
            measured: theta,
            gear: Solution { refused: true, theta, ..self.base.peek(gear, S::ZERO) },
            base_torque: self.base.gear().output(gear).torque,
            terms,
            converged: true,
        }
    }
}
