//! What the terms of a feed-forward gave last.

use super::balance::Parts;
use crate::feedforward::Bridge;
use crate::scalar::Float;

/// What a feed-forward gave last of terms.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Shares<S> {
    pub(super) last: Parts<S>,
    /// What the terms take off the deflection.
    pub(super) error: S,
    /// From other terms.
    bridge: Bridge<S, [S; 3]>,
}

impl<S: Float> Shares<S> {
    /// Before the first period.
    pub(super) fn of_start(last: Parts<S>) -> Self {
        Self { last, ..Self::default() }
    }

    /// Error, G and J as the terms give them.
    fn wanted(&self) -> [S; 3] {
        [self.error, self.last.gear, self.last.joint]
    }

    /// The error as it was fed forward last, before the gain.
    pub(super) fn given_error(&self) -> S {
        let [error, ..] = self.bridge.given(self.wanted());
        error
    }

    /// The terms are others than in the period before.
    pub(super) fn renew(&mut self) {
        self.bridge.begin(self.bridge.given(self.wanted()));
    }

    /// What is fed forward, before the gain; behind other terms the gap between the two fades away by `step` a period.
    pub(super) fn give(&mut self, step: S) -> [S; 3] {
        self.bridge.follow(self.wanted(), step, None)
    }
}
