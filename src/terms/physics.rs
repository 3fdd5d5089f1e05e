//! What every kind of term answers.

use core::fmt::Debug;

use super::read::{Reader, TermError};
use super::registry::{KindInfo, Need};
use super::sample::Sample;
use crate::scalar::Float;

/// A kind of term: its registry entry, its coefficients and its equation. A kind implements what its domain asks for and leaves the rest. Sealed: blocks, estimators and docs know the
/// [`KINDS`](super::KINDS) of this crate alone.
pub trait Physics<S: Float>: Sized + crate::sealed::Sealed {
    /// Its entry in the registry.
    const INFO: KindInfo;

    /// What it remembers from sample to sample; its default is an unknown past.
    type State: Clone + Debug + Default;

    /// Reads and checks its keys.
    ///
    /// # Errors
    /// [`TermError`], with the key to blame.
    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError>;

    /// Signals that its choices ask for, beside those of [`INFO`](Self::INFO).
    fn needs_besides(&self) -> &'static [Need] {
        &[]
    }

    /// Whether it depends on T_base, the torque that the gear transmits, or on its parameters. Where a term does, T is linear in its numbers and in the gear's only
    /// while the others stay; else in all of role [`Linear`](super::Role::Linear) together, beyond the deflection that the terms of that domain leave.
    fn follows_base(&self) -> bool {
        false
    }

    /// Domain deflection: θ_measured − θ, where the sample alone tells it.
    #[inline]
    fn deflection_error(&self, _sample: &Sample<S>) -> S {
        S::ZERO
    }

    /// Domain deflection: θ, where it depends on the path or on the torque that the gear would transmit at a deflection.
    #[inline]
    fn correct(&self, _state: &mut Self::State, theta: S, _transmitted: &dyn Fn(S) -> S) -> S {
        theta
    }

    /// Domains torque, load and friction: what it adds to T, N·m. Moves the state to the sample.
    #[inline]
    fn torque(&self, _state: &mut Self::State, _sample: &Sample<S>) -> S {
        S::ZERO
    }

    /// Domain friction scale: what all friction is multiplied by.
    #[inline]
    fn friction_factor(&self, _sample: &Sample<S>) -> S {
        S::ONE
    }

    /// Domain delay: by how much the recorded torque is late, s.
    fn delay(&self) -> S {
        S::ZERO
    }
}
