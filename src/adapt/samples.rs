//! A control period: a sample, or a piece of work. Samples become blocks, blocks a stretch.
//!
//! A sample is a row [r, x5 … x1, l, ṗ] with a weight w: p the block's own torque, ṗ its change a period, l a constant, x the regressors, r the measured torque less p. A block is one row of
//! them, Σw·row/√n for n samples, and a stretch the triangle of its blocks. What a delay of the signal explains is in the longest row of the triangle, what the level tells in the next, so the five below
//! say what the coefficients alone can explain, and the shortest what nothing explains.

use super::state::AdaptationState;
use super::triangle::{add, clear, dot};
use super::work::{BEGIN, DROPPED};
use super::{Adaptation, Change};
use crate::elastic::Polynomial;
use crate::gear::{State, Status};
use crate::memory::masing::{LoopPath, Masing, Path};
use crate::scalar::Float;

/// What the span of all places that the gear has been to may grow by within a stretch, over A.
const SAME_PLACES: f64 = 0.05;

/// l: the standard deviations of the offset, those of its prior and of its walk a stretch, are so much of a coefficient's. With more a gear whose level moves is taken for an offset, with less an offset that grows is
/// taken for the gear.
pub(super) const LEVEL: f64 = 0.1875;
/// Whether a sample was ever taken: the state is begun.
const EVER: u8 = 1;
/// Whether the last period took one.
const LAST: u8 = 2;

impl<S: Float> Adaptation<S> {
    /// One control period: the gear after its step along the measured deflection, and the torque at the same time, N·m, terms taken off. Says what becomes of the parameters in force; the
    /// caller then changes them by [`take_over`](crate::feedforward::FeedForward::take_over).
    #[inline]
    #[must_use]
    pub fn period<L: LoopPath<S>, const N: usize>(
        &self,
        state: &mut AdaptationState<S>,
        gear: &State<S, N, L>,
        torque: S,
    ) -> Change {
        let sampled = state.sampled;
        state.sampled &= EVER;
        let mut pieces = self.pieces;
        while state.work > 0 {
            let change = self.piece(state);
            pieces -= 1;
            // A period of work takes no sample, nor one that changes what is in force.
            if pieces == 0 || change != Change::None {
                return change;
            }
        }
        let Some(path) = L::path(gear.memory()) else { return Change::None };
        if state.samples == 0 {
            if state.sampled == 0 {
                self.begin(state);
            }
            clear(&mut state.sums);
            if self.looks_farther(state, path) {
                state.work = DROPPED;
                return Change::None;
            }
        }
        if gear.status() != Status::default() || path.may_lack_pairs() {
            return Change::None;
        }
        let theta = gear.theta();
        let u = self.frame.fraction(theta);
        let [a, b, c] = Polynomial::columns(u);
        let [d, e] = Masing::columns(&self.frame, path, theta);
        let mut row = [S::ZERO, e, d, c, b, a, S::from_f64(LEVEL), S::ZERO];
        let [residual, x @ .., _, slope] = &mut row;
        let p = dot(x, &self.block);
        *residual = torque.over(self.frame.torque_scale()) - p;
        *slope = if sampled & LAST != 0 { p - state.last } else { S::ZERO };
        state.last = p;
        state.sampled = EVER | LAST;
        if let Some(weight) = state.noise.weigh(*residual, &mut state.spikes, &mut state.warnings) {
            add(&mut state.sums, &row, weight * self.share);
            state.samples += 1;
            if state.samples == self.samples {
                Self::take_block(state);
                state.work = BEGIN;
            }
        }
        Change::None
    }

    /// Whether the past of the loop lets the next block be learnt from.
    ///
    /// What is unknown of it stays the same while the deflection keeps within the places that it has been to: an offset of η, which a stretch is free of. Beyond them it changes.
    #[inline]
    fn looks_farther<const N: usize>(&self, state: &mut AdaptationState<S>, path: &Path<S, N>) -> bool {
        let [falling, rising] = path.reach();
        let span = self.frame.fraction(falling + rising);
        let is_farther = span - state.span > S::from_f64(SAME_PLACES);
        if is_farther {
            state.span = span;
        }
        is_farther
    }

    /// A block is whole: its row.
    #[inline]
    pub(super) fn take_block(state: &mut AdaptationState<S>) {
        let [residual, .., weight, _] = state.sums;
        state.noise.centre = residual.over(weight) * S::from_f64(LEVEL);
        // The centre was that of a block before the work on a stretch: the gear has moved since.
        if state.blocks == 0 {
            state.spikes = 0;
        }
    }

    /// A block was folded in: the stretch goes on, or is assessed.
    #[inline]
    pub(super) fn end_block(&self, state: &mut AdaptationState<S>) {
        state.samples = 0;
        state.blocks += 1;
        if state.blocks < self.fewest_blocks {
            state.work = 0;
        }
    }
}
