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

use super::compensated::CompensatedState;
use super::{Sample, Stack, StackState, StackView, TermState};
use crate::feedforward::{Contribution, Controls, Demand, FeedForward, FeedForwardState, towards};
use crate::gear::{Gear, State};
use crate::inverse::{Inverse, Invertible, Solution};
use crate::memory::{AnyLaw, MemoryLaw, VaryingPeriod};
use crate::scalar::Float;

/// The most inverses of the gear for one sample.
pub const MOST_TRIALS: u8 = 8;

/// Terms that come to more than this many torque scales T_A are refused: no joint loses as much, and its speed or its temperature was misread.
pub const ABSURD_BEYOND: f64 = 64.0;

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

/// What terms add to T, N·m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Parts<S> {
    /// Those of the gear, G.
    pub gear: S,
    /// Those of the joint, J.
    pub joint: S,
}

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

/// What the gear has to carry at a sample.
struct Balance<S> {
    carried: S,
    /// What stands between the gear's θ and the encoders'.
    error: S,
    parts: Parts<S>,
    converged: bool,
}

/// Which terms stand between T* and the gear.
#[derive(Clone, Copy, PartialEq)]
enum Asked {
    /// All: T* is the torque of the model.
    Total,
    /// Those of the gear: T* is what the gear carries.
    Carried,
}

/// Finds the torque that the gear carries when T* is asked for. Nothing of a state moves; what the terms remember then is in `trial`, a copy of `terms` before. `None` where a number of the torque, the sample or the terms is NaN, infinite or absurd.
fn balance<S: Float<Carry = S>, L: Invertible<S>, const N: usize>(
    (inverse, stack): (&Inverse<S, L>, StackView<'_, S>),
    (gear, terms, last): (&State<S, N, L>, &[TermState<S>], &Parts<S>),
    trial: &mut [TermState<S>],
    (torque, asked): (S, Asked),
    sample: &Sample<S>,
) -> Option<Balance<S>> {
    if !torque.is_finite() || !sample.is_finite() {
        return None;
    }
    let searches = stack.follows_gear();
    let mut is_copy = true;
    let mut at = |carried: S| {
        let theta = if searches { inverse.peek(gear, carried).theta } else { gear.theta() };
        let rate = if sample.period > S::ZERO { (theta - gear.theta()).over(sample.period) } else { S::ZERO };
        if !core::mem::take(&mut is_copy) {
            copy(trial, terms);
        }
        stack.parts(trial, &Sample { deflection: theta, deflection_rate: rate, base_torque: carried, ..*sample })
    };
    let of = |parts: &Parts<S>| total(parts, asked);
    let mut taken = of(last);
    let tolerance = S::from_f64(4.0 * S::TOLERANCE) * inverse.gear().frame().torque_scale();
    let mut before: Option<(S, S)> = None;
    let mut parts = at(torque - taken);
    for _ in 1..MOST_TRIALS {
        let excess = of(&parts) - taken;
        if !searches || excess.abs() <= tolerance {
            break;
        }
        // The chord through the last two trials; at first, what the terms are there.
        let step = match before.replace((taken, excess)) {
            Some((last, last_excess)) if last_excess != excess => (last - taken).over(last_excess - excess) * -excess,
            _ => excess,
        };
        taken = taken + step;
        parts = at(torque - taken);
    }
    let converged = !searches || (of(&parts) - taken).abs() <= tolerance;
    let (carried, error) = (torque - of(&parts), deflection_error(stack, sample));
    let most = S::from_f64(ABSURD_BEYOND) * inverse.gear().frame().torque_scale();
    // A NaN compares false.
    let accepted = carried.is_finite() && error.is_finite() && parts.gear.abs() <= most && parts.joint.abs() <= most;
    accepted.then_some(Balance { carried, error, parts, converged })
}

fn copy<S: Float<Carry = S>>(to: &mut [TermState<S>], from: &[TermState<S>]) {
    to.iter_mut().zip(from).for_each(|(to, from)| to.clone_from(from));
}

/// Σ of what stands between the gear's θ and the encoders', as far as the sample tells it.
fn deflection_error<S: Float<Carry = S>>(stack: StackView<'_, S>, sample: &Sample<S>) -> S {
    stack.terms().iter().fold(S::ZERO, |sum, term| sum + term.deflection_error(sample))
}

/// The present deflection of the gear, where a torque or a sample is refused.
fn refused<S: Float<Carry = S>, L: Invertible<S>, const N: usize>(
    inverse: &Inverse<S, L>,
    gear: &State<S, N, L>,
    terms: Parts<S>,
) -> CompensatedSolution<S> {
    let theta = gear.theta();
    CompensatedSolution {
        measured: theta,
        gear: Solution { refused: true, theta, ..inverse.peek(gear, S::ZERO) },
        base_torque: inverse.gear().output(gear).torque,
        terms,
        converged: true,
    }
}

/// Gear and terms at a first sample, the terms at rest before.
fn begin<S: Float<Carry = S>, L: MemoryLaw<S>, const N: usize>(
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
    /// The state at a first sample, its deflection that of the encoders, its past unknown. A sample that is none counts as one of zeros.
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
        let (both, terms) = ((&self.inverse, self.stack.view()), &state.terms);
        let mut trial = terms.stack.clone();
        let of_state = (&state.gear, terms.stack.states(), &terms.last);
        let Some(found) = balance(both, of_state, trial.states_mut(), (torque, Asked::Total), sample) else {
            return refused(&self.inverse, &state.gear, state.terms.last);
        };
        let (gear, output) = self.inverse.commit(&mut state.gear, found.carried);
        if gear.refused {
            return refused(&self.inverse, &state.gear, state.terms.last);
        }
        state.terms = TermsState { stack: trial, last: found.parts };
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
    pub fn solve(
        &self,
        inverse: &Inverse<S, L>,
        stack: &Stack<S, K>,
        torque: S,
        sample: &Sample<S>,
    ) -> CompensatedSolution<S> {
        let mut trial = self.stack().clone();
        solve_with((inverse, stack.view()), (self.gear(), self.stack().states()), trial.states_mut(), torque, sample)
    }
}

/// As [`CompensatedState::solve`] for terms wherever they lie: what they remember, and as many places for trials.
pub fn solve<S: Float<Carry = S>, L: Invertible<S>, const N: usize>(
    both: (&Inverse<S, L>, StackView<'_, S>),
    (gear, terms): (&State<S, N, L>, &[TermState<S>]),
    trial: &mut [TermState<S>],
    torque: S,
    sample: &Sample<S>,
) -> CompensatedSolution<S> {
    copy(trial, terms);
    solve_with(both, (gear, terms), trial, torque, sample)
}

fn solve_with<S: Float<Carry = S>, L: Invertible<S>, const N: usize>(
    (inverse, stack): (&Inverse<S, L>, StackView<'_, S>),
    (gear, terms): (&State<S, N, L>, &[TermState<S>]),
    trial: &mut [TermState<S>],
    torque: S,
    sample: &Sample<S>,
) -> CompensatedSolution<S> {
    let none = Parts::default();
    let Some(found) = balance((inverse, stack), (gear, terms, &none), trial, (torque, Asked::Total), sample) else {
        return refused(inverse, gear, none);
    };
    let solution = inverse.peek(gear, found.carried);
    CompensatedSolution {
        measured: solution.theta + found.error,
        gear: solution,
        base_torque: found.carried,
        terms: found.parts,
        converged: found.converged,
    }
}

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

/// What a feed-forward gave last of terms.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Shares<S> {
    last: Parts<S>,
    /// What the terms take off the deflection.
    error: S,
    /// Error, G and J as they were fed forward last, before the gain; what they lost when the terms changed, and how much of that is still made up for.
    given: [S; 3],
    gap: [S; 3],
    bridge: S,
    offset: S,
    /// The terms are others than in the period before.
    renewed: bool,
}

/// A feed-forward and its terms, wherever they lie: what [`CompensatedFeedForward`] does, for a program that has memory of its own for terms.
#[derive(Debug, Clone, Copy)]
pub struct CompensatedFeedForwardView<'a, S: Float, L = AnyLaw<S>> {
    /// That of the base model.
    pub feed_forward: &'a FeedForward<S, L>,
    /// The plant terms.
    pub stack: StackView<'a, S>,
}

/// What the feed-forward of one joint remembers, wherever it lies.
pub struct CompensatedFeedForwardPast<'a, S: Float<Carry = S>, const N: usize, L: MemoryLaw<S> = AnyLaw<S>> {
    /// That of the base model.
    pub feed_forward: &'a mut FeedForwardState<S, N, L>,
    /// What each term remembers.
    pub terms: &'a mut [TermState<S>],
    /// As many places, whatever is in them.
    pub trial: &'a mut [TermState<S>],
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
    pub fn new(feed_forward: FeedForward<S, L>, stack: &Stack<S, K>) -> Self {
        Self { feed_forward, stack: stack.plant() }
    }

    /// The state at power-up: off, the gear where the encoders of the first sample show it, its past unknown. A sample that is none counts as one of zeros.
    pub fn start<const N: usize>(&self, sample: &Sample<S>) -> CompensatedFeedForwardState<S, N, L, K> {
        let mut terms = self.stack.start();
        let (feed_forward, shares) = self.view().begin(terms.states_mut(), sample);
        CompensatedFeedForwardState { feed_forward, terms, shares, last: Compensation::default() }
    }

    /// Feed-forward and terms, wherever they lie.
    #[inline]
    pub fn view(&self) -> CompensatedFeedForwardView<'_, S, L> {
        CompensatedFeedForwardView { feed_forward: &self.feed_forward, stack: self.stack.view() }
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
        state.shares.renewed = true;
    }

    /// Starts the memory of the gear anew where the encoders show it, its past unknown, with the loop running. The contribution does not jump.
    pub fn restart<const N: usize>(&self, state: &mut CompensatedFeedForwardState<S, N, L, K>, deflection: S) {
        self.view().restart(&mut state.feed_forward, &mut state.shares, deflection);
    }

    /// One control period. The sample holds the reference's angles, speeds and acceleration (or the measured ones) and the temperature; its deflection is not read.
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
            trial: trial.states_mut(),
            shares: &mut state.shares,
        };
        state.last = self.view().period(&mut past, controls, demand, sample);
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
        let (gear, last) = begin::<S, L, N>(self.feed_forward.inverse().gear(), self.stack, terms, sample);
        (self.feed_forward.start(gear.theta()), Shares { last, ..Shares::default() })
    }

    /// As [`CompensatedFeedForward::take_over`], from as many terms as `count`; behind what they remember there are places for new ones.
    pub fn take_over<const N: usize>(
        &self,
        before: &FeedForward<S, L>,
        past: &mut CompensatedFeedForwardPast<'_, S, N, L>,
        count: usize,
    ) {
        self.feed_forward.take_over(before, past.feed_forward);
        self.stack.take_over(past.terms, count);
        past.shares.renewed = true;
    }

    /// As [`CompensatedFeedForward::restart`].
    pub fn restart<const N: usize>(
        &self,
        state: &mut FeedForwardState<S, N, L>,
        shares: &mut Shares<S>,
        deflection: S,
    ) {
        self.feed_forward.restart(state, deflection - shares.error);
        shares.renewed = true;
    }

    /// As [`CompensatedFeedForward::step`].
    pub fn step<const N: usize>(
        &self,
        past: &mut CompensatedFeedForwardPast<'_, S, N, L>,
        controls: &Controls<S>,
        demand: &Demand<S>,
        sample: &Sample<S>,
    ) -> Compensation<S> {
        copy(past.trial, past.terms);
        self.period(past, controls, demand, sample)
    }

    /// A step from a copy of what the terms remember.
    fn period<const N: usize>(
        &self,
        past: &mut CompensatedFeedForwardPast<'_, S, N, L>,
        controls: &Controls<S>,
        demand: &Demand<S>,
        sample: &Sample<S>,
    ) -> Compensation<S> {
        let CompensatedFeedForwardPast { feed_forward, terms, trial, shares } = past;
        let asked = if self.stack.sigma() > S::ZERO { Asked::Carried } else { Asked::Total };
        let both = (self.feed_forward.inverse(), self.stack);
        let found = balance(both, (feed_forward.gear(), terms, &shares.last), trial, (demand.torque, asked), sample);
        let refused = found.is_none();
        let carried = match found {
            Some(found) => {
                // Not by `swap_with_slice`, which can panic.
                terms.iter_mut().zip(trial.iter_mut()).for_each(|(now, next)| core::mem::swap(now, next));
                (shares.last, shares.error) = (found.parts, found.error);
                found.carried
            }
            // No torque that the gear could be asked for.
            None => S::from_f64(f64::NAN),
        };
        let demand = Demand { torque: carried, deflection: demand.deflection - shares.error };
        let base = self.feed_forward.step(feed_forward, controls, &demand);
        let Parts { gear, joint } = shares.last;
        let [error, gear, joint] = shares.give([shares.error, gear, joint], self.feed_forward.gain_step());
        let offset = base.offset + base.gain * error;
        let change = offset - core::mem::replace(&mut shares.offset, offset);
        Compensation {
            base,
            offset,
            change,
            gear_torque: base.gain * gear,
            joint_torque: base.gain * joint,
            refused: refused || base.refused,
        }
    }
}

fn total<S: Float>(parts: &Parts<S>, asked: Asked) -> S {
    if asked == Asked::Total { parts.gear + parts.joint } else { parts.gear }
}

impl<S: Float<Carry = S>, const N: usize, L: MemoryLaw<S>, const K: usize> CompensatedFeedForwardState<S, N, L, K> {
    /// What was fed forward last.
    pub fn last(&self) -> &Compensation<S> {
        &self.last
    }

    /// The gear as the feed-forward believes it to be.
    pub fn gear(&self) -> &State<S, N, L> {
        self.feed_forward.gear()
    }
}

impl<S: Float> Shares<S> {
    /// What the terms add; behind other terms the gap between the two fades away by `step` a period.
    fn give(&mut self, wanted: [S; 3], step: S) -> [S; 3] {
        if self.renewed {
            let [error, gear, joint] = self.given;
            self.gap = [error - wanted[0], gear - wanted[1], joint - wanted[2]];
            (self.bridge, self.renewed) = (S::ONE, false);
        }
        self.bridge = towards(self.bridge, S::ZERO, step);
        let [error, gear, joint] = self.gap.map(|gap| gap * self.bridge);
        self.given = [wanted[0] + error, wanted[1] + gear, wanted[2] + joint];
        self.given
    }
}
