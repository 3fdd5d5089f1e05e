//! The terms of one gear, in the order of its model file.

use core::mem::discriminant;

use heapless::Vec;

use super::feedforward::Parts;
use super::{Domain, Need, Sample, Setting, Side, Source, Term, TermError, TermState};
use crate::scalar::Float;

/// What the terms of a stack are added to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Base {
    /// A gear's elastic and hysteresis torque.
    Gear,
    /// Nothing: a joint without motor-side angle.
    Joint,
    /// Another simulator's torque.
    Simulation,
}

/// Up to `K` terms.
#[derive(Debug, Clone, PartialEq)]
pub struct Stack<S: Float, const K: usize = 8> {
    terms: Vec<Term<S>, K>,
    setting: Setting<S>,
    base: Base,
}

/// The terms of a stack, wherever they lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StackView<'a, S: Float> {
    terms: &'a [Term<S>],
    sigma: S,
    base: Base,
}

/// What the terms of a stack remember.
#[derive(Debug, Clone)]
pub struct StackState<S: Float<Carry = S>, const K: usize = 8> {
    states: Vec<TermState<S>, K>,
}

impl<S: Float<Carry = S>, const K: usize> Stack<S, K> {
    /// No terms yet, for a gear.
    #[must_use]
    pub fn of_gear(setting: Setting<S>) -> Self {
        Self { terms: Vec::new(), setting, base: Base::Gear }
    }

    /// No terms yet, for a joint without motor-side angle: T_base is gravity and inertia.
    #[must_use]
    pub fn of_joint(setting: Setting<S>) -> Self {
        Self { terms: Vec::new(), setting: Setting { c1: S::ZERO, ..setting }, base: Base::Joint }
    }

    /// No terms yet, for a model that adds its terms to another simulator's torque: T_base is that torque.
    #[must_use]
    pub fn of_simulation(setting: Setting<S>) -> Self {
        Self { terms: Vec::new(), setting: Setting { c1: S::ZERO, ..setting }, base: Base::Simulation }
    }

    /// No terms any more, for a gear or for a joint without motor-side angle.
    #[cfg(feature = "block")]
    pub(crate) fn renew(&mut self, setting: Setting<S>, has_gear: bool) {
        self.terms.clear();
        self.setting = if has_gear { setting } else { Setting { c1: S::ZERO, ..setting } };
        self.base = if has_gear { Base::Gear } else { Base::Joint };
    }

    /// Adds a term by its keys.
    ///
    /// # Errors
    /// A key that cannot be, or no room.
    pub fn add(&mut self, kind: &str, source: &dyn Source<S>) -> Result<(), TermError> {
        self.push(Term::read(kind, source, self.setting)?)
    }

    /// Adds a term.
    ///
    /// # Errors
    /// No room.
    pub fn push(&mut self, term: Term<S>) -> Result<(), TermError> {
        self.terms.push(term).map_err(|_| TermError::StackFull)
    }

    /// The terms that a drive feeds forward.
    #[must_use]
    pub fn plant(&self) -> Self {
        self.only(|term| term.side() == Side::Plant)
    }

    /// Some of the terms.
    #[must_use]
    pub fn only(&self, keep: impl Fn(&Term<S>) -> bool) -> Self {
        let mut some = self.clone();
        some.terms.retain(keep);
        some
    }

    /// The terms.
    #[must_use]
    pub fn terms(&self) -> &[Term<S>] {
        &self.terms
    }

    /// The terms, wherever they lie.
    #[inline]
    #[must_use]
    pub fn view(&self) -> StackView<'_, S> {
        StackView { terms: &self.terms, sigma: self.setting.sigma, base: self.base }
    }

    /// Whether T_base is that of a gear.
    #[must_use]
    pub fn has_gear(&self) -> bool {
        self.base == Base::Gear
    }

    /// Whether T_base is that of another simulator.
    #[must_use]
    pub fn has_simulation(&self) -> bool {
        self.base == Base::Simulation
    }

    /// σ, c1 and A.
    #[must_use]
    pub fn setting(&self) -> Setting<S> {
        self.setting
    }

    /// Whether some term cannot do without a signal.
    #[must_use]
    pub fn needs(&self, need: Need) -> bool {
        self.view().needs(need)
    }

    /// What the terms remember before the first sample.
    #[must_use]
    pub fn start(&self) -> StackState<S, K> {
        let mut states = Vec::new();
        for term in &self.terms {
            // There is room: both hold K.
            let _ = states.push(term.start());
        }
        StackState { states }
    }

    /// Makes a state of these terms of one that other terms had: a term goes on with what one of its kind remembers, the others start.
    pub(super) fn take_over(&self, state: &mut StackState<S, K>) {
        let states = &mut state.states;
        let count = states.len();
        for term in &self.terms {
            // Places for new ones, as far as there are any.
            let _ = states.push(term.start());
        }
        self.view().take_over(states, count);
        states.truncate(self.terms.len());
    }

    /// As [`StackView::correct`].
    pub fn correct(&self, state: &mut StackState<S, K>, sample: &Sample<S>, transmitted: &dyn Fn(S) -> S) -> S {
        self.view().correct(&mut state.states, sample, transmitted)
    }

    /// As [`StackView::torque`].
    pub fn torque(&self, state: &mut StackState<S, K>, sample: &Sample<S>) -> S {
        self.view().torque(&mut state.states, sample)
    }

    /// As [`StackView::load`].
    pub fn load(&self, state: &mut StackState<S, K>, sample: &Sample<S>) -> S {
        self.view().load(&mut state.states, sample)
    }

    /// By how much the recorded torque is late, s.
    #[must_use]
    pub fn delay(&self) -> S {
        self.terms.iter().fold(S::ZERO, |sum, term| sum + term.delay())
    }
}

impl<S: Float<Carry = S>, const K: usize> StackState<S, K> {
    /// What each term remembers.
    pub(super) fn states(&self) -> &[TermState<S>] {
        &self.states
    }

    /// As above.
    pub(super) fn states_mut(&mut self) -> &mut [TermState<S>] {
        &mut self.states
    }
}

impl<'a, S: Float<Carry = S>> StackView<'a, S> {
    /// Terms of a gear whose torque is taken on the side σ.
    #[must_use]
    pub fn of_gear(terms: &'a [Term<S>], sigma: S) -> Self {
        Self { terms, sigma, base: Base::Gear }
    }

    /// The terms.
    #[must_use]
    pub fn terms(&self) -> &'a [Term<S>] {
        self.terms
    }

    /// σ.
    #[must_use]
    pub fn sigma(&self) -> S {
        self.sigma
    }

    /// Whether some term cannot do without a signal.
    #[must_use]
    pub fn needs(&self, need: Need) -> bool {
        self.terms.iter().any(|term| term.needs().contains(&need) || term.needs_besides().contains(&need))
    }

    /// What the terms remember before the first sample.
    pub fn start(&self, states: &mut [TermState<S>]) {
        self.terms.iter().zip(states).for_each(|(term, state)| *state = term.start());
    }

    /// Makes the states of these terms of those that other terms had, the first `count`; behind them there are places for new ones. A term goes on with what one of its kind remembers, the others start.
    pub fn take_over(&self, states: &mut [TermState<S>], mut count: usize) {
        for (k, term) in self.terms.iter().enumerate() {
            let start = term.start();
            let is_alike = |state: &TermState<S>| discriminant(state) == discriminant(&start);
            match states.iter().take(count).skip(k).position(is_alike) {
                Some(further) => exchange(states, k, k + further),
                None => {
                    // Where all places are taken, one makes room that no later term goes on with.
                    let place = if count < states.len() {
                        count += 1;
                        count - 1
                    } else {
                        let is_free = |state: &TermState<S>| !is_wanted(self.terms, k, state);
                        states.iter().skip(k).position(is_free).map_or(count.saturating_sub(1), |further| k + further)
                    };
                    if let Some(place) = states.get_mut(place) {
                        *place = start;
                    }
                    exchange(states, k, place);
                }
            }
        }
    }

    /// The true deflection of a sample, rad. `transmitted` tells the torque that the gear would transmit if it moved to a deflection; it is asked for backlash of shape
    /// `clearance` only. The first call after the start is the start.
    pub fn correct(self, states: &mut [TermState<S>], sample: &Sample<S>, transmitted: &dyn Fn(S) -> S) -> S {
        let error = |theta: S, term: &Term<S>| theta - term.deflection_error(sample);
        let theta = self.terms.iter().fold(sample.deflection, error);
        let pairs = self.terms.iter().zip(states);
        pairs.fold(theta, |theta, (term, state)| match term.domain() {
            Domain::Deflection => term.correct(state, theta, transmitted),
            _ => theta,
        })
    }

    /// Σ of the torque terms at a sample whose deflection is corrected and whose base torque is known, N·m. Without a gear the base torque is set to
    /// gravity and inertia, or to T_sim where that is the base.
    pub fn torque(self, states: &mut [TermState<S>], sample: &Sample<S>) -> S {
        match self.base {
            Base::Gear => self.sum(states, sample),
            Base::Joint | Base::Simulation => self.torque_over_load(states, sample),
        }
    }

    /// Without a gear. A frame of its own: the sample is copied.
    #[inline(never)]
    fn torque_over_load(self, states: &mut [TermState<S>], sample: &Sample<S>) -> S {
        let base_torque =
            if self.base == Base::Simulation { sample.simulated_torque } else { self.load(states, sample) };
        self.sum(states, &Sample { base_torque, ..*sample })
    }

    fn sum(self, states: &mut [TermState<S>], sample: &Sample<S>) -> S {
        let factor = self.terms.iter().fold(S::ONE, |product, term| product * term.friction_factor(sample));
        let pairs = self.terms.iter().zip(states);
        pairs.fold(S::ZERO, |sum, (term, state)| {
            let torque = term.torque(state, sample);
            sum + if term.domain() == Domain::Friction { factor * torque } else { torque }
        })
    }

    /// As [`torque`](Self::torque), the terms of the gear apart from those of the joint.
    pub(super) fn parts(self, states: &mut [TermState<S>], sample: &Sample<S>) -> Parts<S> {
        let factor = self.terms.iter().fold(S::ONE, |product, term| product * term.friction_factor(sample));
        let mut parts = Parts::default();
        for (term, state) in self.terms.iter().zip(states) {
            let torque = term.torque(state, sample);
            match term.domain() {
                Domain::Friction => parts.joint = parts.joint + factor * torque,
                _ if term.is_of_gear() => parts.gear = parts.gear + torque,
                _ => parts.joint = parts.joint + torque,
            }
        }
        parts
    }

    /// Whether some term adds a torque that depends on the deflection or on the torque of the gear.
    pub(super) fn follows_gear(self) -> bool {
        self.terms.iter().any(|term| term.is_of_gear() || term.follows_base())
    }

    /// Gravity and inertia at a sample, N·m: T_base of a joint log. Neither remembers anything.
    pub fn load(self, states: &mut [TermState<S>], sample: &Sample<S>) -> S {
        let pairs = self.terms.iter().zip(states);
        pairs.fold(S::ZERO, |sum, (term, state)| match term.domain() {
            Domain::Load => sum + term.torque(state, sample),
            _ => sum,
        })
    }
}

/// Whether a term behind the `k`th goes on with a state.
fn is_wanted<S: Float<Carry = S>>(terms: &[Term<S>], k: usize, state: &TermState<S>) -> bool {
    terms.iter().skip(k).skip(1).any(|term| discriminant(&term.start()) == discriminant(state))
}

/// Exchanges an element with a later one, without the bounds check that would bring a panic into an image.
fn exchange<T>(all: &mut [T], early: usize, late: usize) {
    if let Some((before, after)) = all.split_at_mut_checked(late)
        && let (Some(early), Some(late)) = (before.get_mut(early), after.first_mut())
    {
        core::mem::swap(early, late);
    }
}
