//! Other parameters, other terms, another source: what that changes at once fades away.

use super::towards;
use crate::scalar::Scalar;

/// A gap `G` between what was given before a change and what is wanted behind it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Bridge<S, G> {
    /// Until the first period behind a change, what was given before it.
    gap: G,
    /// How much of the gap is left, 1 to 0. Until that period, 2.
    left: S,
}

impl<S: Scalar, const K: usize> Bridge<S, [S; K]> {
    /// No change so far.
    pub(super) const fn none() -> Self {
        Self { gap: [S::ZERO; K], left: S::ZERO }
    }

    /// What is wanted changes behind what was given last.
    pub(crate) fn begin(&mut self, given: [S; K]) {
        (self.gap, self.left) = (given, S::TWO);
    }

    /// What was given last, of what was wanted then.
    #[cfg(feature = "terms")]
    pub(crate) fn given(&self, wanted: [S; K]) -> [S; K] {
        if self.left > S::ONE { self.gap } else { self.over(wanted) }
    }

    /// What is given of what is wanted, the gap less by `step` than in the period before. A gap begins no larger than `most`.
    #[inline]
    pub(crate) fn follow(&mut self, wanted: [S; K], step: S, most: Option<[S; K]>) -> [S; K] {
        if self.left > S::ONE {
            self.gap.iter_mut().zip(wanted).for_each(|(gap, wanted)| *gap = *gap - wanted);
            if let Some(most) = most {
                self.gap.iter_mut().zip(most).for_each(|(gap, most)| *gap = gap.clamp(-most, most));
            }
            self.left = S::ONE;
        }
        self.left = towards(self.left, S::ZERO, step);
        self.over(wanted)
    }

    #[inline]
    fn over(&self, mut wanted: [S; K]) -> [S; K] {
        wanted.iter_mut().zip(self.gap).for_each(|(wanted, gap)| *wanted = *wanted + gap * self.left);
        wanted
    }
}
