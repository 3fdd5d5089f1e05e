//! Inverse and feed-forward with terms: friction, ripple, gravity and temperature act on what a drive feeds forward.
//!
//! A term changes one of three things.
//!
//! | terms | what they change |
//! |---|---|
//! | of the gear: torque terms that follow the deflection or its rate (`soft_windup`, `nonlocal_memory`, `creep`, `thermal_stiffness` …) | the deflection at which the gear carries a torque |
//! | of the joint: friction, ripple, gravity, inertia | the torque between the gear and the place where the model's torque is taken |
//! | of the deflection, as far as the sample tells them (`kinematic_error`) | the encoders' deflection at the gear's own θ |
//!
//! With the base torque T_base(θ) of gear and hysteresis, the terms of the gear G(θ) and those of the joint J, the torque of the model is T = T_base + G + J.
//! [`CompensatedInverse`] finds θ with T(θ) = T*. [`CompensatedFeedForward`] is asked for the torque T* that the joint shall deliver to its link. By an output-side sensor
//! (σ = −1) that is T, and J is part of the deflection. With the torque taken on the motor side (σ = +1) the gear carries T* itself, T_base + G = T*, and J is
//! what the motor has to give beside it: [`Compensation::joint_torque`].
//!
//! G is found by a secant search from its last value, of at most [`MOST_TRIALS`] inverses; one does where no term follows the deflection or T_base. Backlash is not fed forward: it would be a
//! step of the motor by the whole gap at each reversal of the torque. The temperature is [`Sample::temperature`].

mod balance;
mod inverse;
mod shares;

pub use balance::{ABSURD_BEYOND, MOST_TRIALS, Parts, Trial};
pub use inverse::{CompensatedInverse, CompensatedInverseState, CompensatedInverseView, CompensatedSolution};
pub use shares::Shares;

use super::view::View;
use super::{Sample, Stack, StackState, TermState};
use crate::feedforward::{Contribution, Controls, Demand, FeedForward, FeedForwardState};
use crate::gear::State;
use crate::inverse::Invertible;
use crate::memory::{AnyLaw, MemoryLaw};
use crate::scalar::Float;
use balance::Asked;
use inverse::begin;

/// The feed-forward of a gear with its plant terms.
#[derive(Debug, Clone, PartialEq)]
pub struct CompensatedFeedForward<S: Float, L = AnyLaw<S>, const K: usize = 8> {
    /// That of the base model.
    pub feed_forward: FeedForward<S, L>,
    /// The plant terms.
    pub stack: Stack<S, K>,
}

/// What the feed-forward of one joint remembers.
#[derive(Clone)]
pub struct CompensatedFeedForwardState<
    S: Float<Carry = S>,
    const N: usize = 16,
    L: MemoryLaw<S> = AnyLaw<S>,
    const K: usize = 8,
> {
    feed_forward: FeedForwardState<S, N, L>,
    terms: StackState<S, K>,
    shares: Shares<S>,
    last: Compensation<S>,
}

/// A feed-forward and its terms, wherever they lie.
pub type CompensatedFeedForwardView<'a, S, L = AnyLaw<S>> = View<'a, FeedForward<S, L>, S>;

/// What the feed-forward of one joint remembers, wherever it lies.
pub struct CompensatedFeedForwardPast<'a, S: Float<Carry = S>, const N: usize, L: MemoryLaw<S> = AnyLaw<S>> {
    /// That of the base model.
    pub feed_forward: &'a mut FeedForwardState<S, N, L>,
    /// What each term remembers.
    pub terms: &'a mut [TermState<S>],
    /// As many places.
    pub trial: Trial<'a, S>,
    /// What was given last.
    pub shares: &'a mut Shares<S>,
}

/// What is fed forward in a period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Compensation<S> {
    /// Of the base model, its torque less by what the terms give.
    pub base: Contribution<S>,
    /// The share of the encoders' deflection to add to the output's reference, rad: that of the base and of the terms of the deflection.
    pub offset: S,
    /// How much more that is than in the period before.
    pub change: S,
    /// The share of G, N·m.
    pub gear_torque: S,
    /// The share of J, N·m: to add to the torque reference of the motor where σ = +1; with σ = −1 it is in the offset.
    pub joint_torque: S,
    /// A number of the sample or the demand was NaN or infinite, or the terms were so or absurd: they stay those of the period before, and everything fades with the gain.
    pub refused: bool,
}

impl<S: Float<Carry = S>, L: Invertible<S>, const K: usize> CompensatedFeedForward<S, L, K> {
    /// With the plant terms of a stack; faults of the measurement are left out.
    #[must_use]
    pub fn new(feed_forward: FeedForward<S, L>, stack: &Stack<S, K>) -> Self {
        Self { feed_forward, stack: stack.plant() }
    }

    /// The state at power-up: off, the gear where the encoders of the first sample show it, its past unknown. A sample that is none counts as one of zeros.
    #[must_use]
    pub fn start<const N: usize>(&self, sample: &Sample<S>) -> CompensatedFeedForwardState<S, N, L, K> {
        let mut terms = self.stack.start();
        let (feed_forward, shares) = self.view().begin(terms.states_mut(), sample);
        CompensatedFeedForwardState { feed_forward, terms, shares, last: Compensation::default() }
    }

    /// Feed-forward and terms, wherever they lie.
    #[inline]
    #[must_use]
    pub fn view(&self) -> CompensatedFeedForwardView<'_, S, L> {
        View { base: &self.feed_forward, stack: self.stack.view() }
    }

    /// Goes on with a state that the feed-forward `before` had: other parameters or terms with the loop running. Terms go on with what one of their kind remembers, new ones start at
    /// rest; what they add fades over to the new values within [`Settings::ramp_s`](crate::feedforward::Settings::ramp_s).
    pub fn take_over<const N: usize>(
        &self,
        before: &FeedForward<S, L>,
        state: &mut CompensatedFeedForwardState<S, N, L, K>,
    ) {
        self.feed_forward.take_over(before, &mut state.feed_forward);
        self.stack.take_over(&mut state.terms);
        state.shares.renew();
    }

    /// Starts the memory of the gear anew where the encoders show it, its past unknown, with the loop running. The contribution does not jump.
    pub fn restart<const N: usize>(&self, state: &mut CompensatedFeedForwardState<S, N, L, K>, deflection: S) {
        self.view().restart(&mut state.feed_forward, &mut state.shares, deflection);
    }

    /// One control period. The sample holds the reference's angles, speeds and acceleration (or the measured ones) and the temperature; its deflection is not read.
    #[must_use]
    pub fn step<const N: usize>(
        &self,
        state: &mut CompensatedFeedForwardState<S, N, L, K>,
        controls: &Controls<S>,
        demand: &Demand<S>,
        sample: &Sample<S>,
    ) -> Compensation<S> {
        let mut trial = state.terms.clone();
        let mut past = CompensatedFeedForwardPast {
            feed_forward: &mut state.feed_forward,
            terms: state.terms.states_mut(),
            trial: Trial::in_copy(trial.states_mut()),
            shares: &mut state.shares,
        };
        state.last = self.view().step(&mut past, controls, demand, sample);
        state.last
    }
}

impl<S: Float<Carry = S>, L: Invertible<S>> CompensatedFeedForwardView<'_, S, L> {
    /// As [`CompensatedFeedForward::start`], with a place for what each term remembers.
    pub fn start<const N: usize>(
        &self,
        terms: &mut [TermState<S>],
        sample: &Sample<S>,
    ) -> (FeedForwardState<S, N, L>, Shares<S>) {
        self.stack.start(terms);
        self.begin(terms, sample)
    }

    fn begin<const N: usize>(
        &self,
        terms: &mut [TermState<S>],
        sample: &Sample<S>,
    ) -> (FeedForwardState<S, N, L>, Shares<S>) {
        let (gear, last) = begin::<S, L, N>(self.base.inverse().gear(), self.stack, terms, sample);
        (self.base.start(gear.theta()), Shares::of_start(last))
    }

    /// As [`CompensatedFeedForward::take_over`], from as many terms as `count`; behind what they remember there are places for new ones.
    pub fn take_over<const N: usize>(
        &self,
        before: &FeedForward<S, L>,
        past: &mut CompensatedFeedForwardPast<'_, S, N, L>,
        count: usize,
    ) {
        self.base.take_over(before, past.feed_forward);
        self.stack.take_over(past.terms, count);
        past.shares.renew();
    }

    /// As [`CompensatedFeedForward::restart`].
    pub fn restart<const N: usize>(
        &self,
        state: &mut FeedForwardState<S, N, L>,
        shares: &mut Shares<S>,
        deflection: S,
    ) {
        self.base.restart(state, deflection - shares.error);
        shares.renew();
    }

    /// As [`CompensatedFeedForward::step`].
    pub fn step<const N: usize>(
        &self,
        past: &mut CompensatedFeedForwardPast<'_, S, N, L>,
        controls: &Controls<S>,
        demand: &Demand<S>,
        sample: &Sample<S>,
    ) -> Compensation<S> {
        let CompensatedFeedForwardPast { feed_forward, terms, trial, shares } = past;
        let asked = if self.stack.sigma() > S::ZERO { Asked::Carried } else { Asked::Total };
        let inverse = View { base: self.base.inverse(), stack: self.stack };
        let of_state = (feed_forward.gear(), &**terms, &shares.last);
        let found = inverse.balance(of_state, trial, (demand.torque, asked), sample);
        let last = *feed_forward.contribution();
        let last_offset = last.offset + last.gain * shares.given_error();
        let refused = found.is_none();
        let carried = match found {
            Some(found) => {
                trial.keep(terms);
                (shares.last, shares.error) = (found.parts, found.error);
                found.carried
            }
            // No torque that the gear could be asked for.
            None => S::from_f64(f64::NAN),
        };
        let demand = Demand { torque: carried, deflection: demand.deflection - shares.error };
        let base = self.base.step(feed_forward, controls, &demand);
        let [error, gear, joint] = shares.give(self.base.gain_step());
        let offset = base.offset + base.gain * error;
        Compensation {
            base,
            offset,
            change: offset - last_offset,
            gear_torque: base.gain * gear,
            joint_torque: base.gain * joint,
            refused: refused || base.refused,
        }
    }
}

impl<S: Float<Carry = S>, const N: usize, L: MemoryLaw<S>, const K: usize> CompensatedFeedForwardState<S, N, L, K> {
    /// What was fed forward last.
    #[must_use]
    pub fn last(&self) -> &Compensation<S> {
        &self.last
    }

    /// The gear as the feed-forward believes it to be.
    #[must_use]
    pub fn gear(&self) -> &State<S, N, L> {
        self.feed_forward.gear()
    }
}
