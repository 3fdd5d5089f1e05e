//! The torque that a gear carries beside its terms.

use crate::gear::State;
use crate::inverse::{Inverse, Invertible};
use crate::scalar::Float;
use crate::terms::view::View;
use crate::terms::{Sample, StackView, TermState};

/// The most inverses of the gear for one sample.
pub const MOST_TRIALS: u8 = 8;

/// Terms that come to more than this many torque scales T_A are refused: no joint loses as much, and its speed or its temperature was misread.
pub const ABSURD_BEYOND: f64 = 64.0;

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

/// Places for what the terms would remember.
#[derive(Debug)]
pub struct Trial<'a, S: Float<Carry = S>> {
    states: &'a mut [TermState<S>],
    is_copy: bool,
}

impl<'a, S: Float<Carry = S>> Trial<'a, S> {
    /// As many as there are terms, whatever is in them.
    pub fn in_places(states: &'a mut [TermState<S>]) -> Self {
        Self { states, is_copy: false }
    }

    /// Places that hold what the terms remember.
    pub(super) fn in_copy(states: &'a mut [TermState<S>]) -> Self {
        Self { states, is_copy: true }
    }

    /// Another trial from what the terms remember.
    fn begin(&mut self, terms: &[TermState<S>]) -> &mut [TermState<S>] {
        if !core::mem::take(&mut self.is_copy) {
            self.states.iter_mut().zip(terms).for_each(|(to, from)| to.clone_from(from));
        }
        self.states
    }

    /// Takes the last trial for what the terms remember.
    pub(super) fn keep(&mut self, terms: &mut [TermState<S>]) {
        // Not by `swap_with_slice`, which can panic.
        terms.iter_mut().zip(self.states.iter_mut()).for_each(|(now, next)| core::mem::swap(now, next));
    }
}

/// What the gear has to carry at a sample.
pub(super) struct Balance<S> {
    pub(super) carried: S,
    /// What stands between the gear's θ and the encoders'.
    pub(super) error: S,
    pub(super) parts: Parts<S>,
    pub(super) converged: bool,
}

/// Which terms stand between T* and the gear.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Asked {
    /// All: T* is the torque of the model.
    Total,
    /// Those of the gear: T* is what the gear carries.
    Carried,
}

impl<S: Float> Parts<S> {
    /// What of them stands between T* and the gear.
    fn asked(&self, asked: Asked) -> S {
        if asked == Asked::Total { self.gear + self.joint } else { self.gear }
    }
}

impl<S: Float<Carry = S>, L: Invertible<S>> View<'_, Inverse<S, L>, S> {
    /// Finds the torque that the gear carries when T* is asked for. Nothing of a state moves; what the terms remember then is in `trial`. `None` where a number of the torque, the sample or the terms is NaN, infinite or absurd.
    pub(super) fn balance<const N: usize>(
        &self,
        (gear, terms, last): (&State<S, N, L>, &[TermState<S>], &Parts<S>),
        trial: &mut Trial<'_, S>,
        (torque, asked): (S, Asked),
        sample: &Sample<S>,
    ) -> Option<Balance<S>> {
        let Self { base: inverse, stack } = *self;
        if !torque.is_finite() || !sample.is_finite() {
            return None;
        }
        let searches = stack.follows_gear();
        let mut at = |carried: S| {
            let theta = if searches { inverse.peek(gear, carried).theta } else { gear.theta() };
            let rate = if sample.period > S::ZERO { (theta - gear.theta()).over(sample.period) } else { S::ZERO };
            stack.parts(
                trial.begin(terms),
                &Sample { deflection: theta, deflection_rate: rate, base_torque: carried, ..*sample },
            )
        };
        let of = |parts: &Parts<S>| parts.asked(asked);
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
                Some((last, last_excess)) if last_excess != excess => {
                    (last - taken).over(last_excess - excess) * -excess
                }
                _ => excess,
            };
            taken = taken + step;
            parts = at(torque - taken);
        }
        let converged = !searches || (of(&parts) - taken).abs() <= tolerance;
        let (carried, error) = (torque - of(&parts), deflection_error(stack, sample));
        let most = S::from_f64(ABSURD_BEYOND) * inverse.gear().frame().torque_scale();
        // A NaN compares false.
        let accepted =
            carried.is_finite() && error.is_finite() && parts.gear.abs() <= most && parts.joint.abs() <= most;
        accepted.then_some(Balance { carried, error, parts, converged })
    }
}

/// Σ of what stands between the gear's θ and the encoders', as far as the sample tells it.
pub(super) fn deflection_error<S: Float<Carry = S>>(stack: StackView<'_, S>, sample: &Sample<S>) -> S {
    stack.terms().iter().fold(S::ZERO, |sum, term| sum + term.deflection_error(sample))
}
