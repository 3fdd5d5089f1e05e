//! A control period: samples into blocks, blocks into stretches.

use super::kernel::dot;
use super::state::AdaptationState;
use super::stretch::{ROWS, Stretch, Sums};
use super::work::Work;
use super::{Adaptation, Change, LEAST_SPAN};
use crate::elastic::Polynomial;
use crate::gear::State;
use crate::memory::masing::{LoopPath, Masing, Path};
use crate::scalar::Float;

/// What is unknown of the loop may shrink by this within a stretch, of T_A.
const KNOWN_LOOP: f64 = 0.005;

impl<S: Float> Adaptation<S> {
    /// One control period: the gear after its step along the measured deflection, and the torque at the same time, N·m, terms taken off. Says what becomes of the parameters in force; the
    /// caller then changes them by [`take_over`](crate::feedforward::FeedForward::take_over).
    #[inline]
    pub fn period<L: LoopPath<S>, const N: usize>(
        &self,
        state: &mut AdaptationState<S>,
        gear: &State<S, N, L>,
        torque: S,
    ) -> Change {
        if !state.work.is_beside() {
            return self.work(state);
        }
        // The first period of a block looks back instead.
        if let Work::Rotate(number, from) = state.work
            && state.samples > 0
        {
            self.rotate(state, number, from);
        }
        let status = gear.status();
        let Some(path) = L::path(gear.memory()) else { return Change::None };
        if state.samples == 0 {
            self.look_back(state, path);
        }
        let theta = gear.theta();
        let taken = state.known && !(status.out_of_range || status.refused || status.quarantined || status.restarted);
        if taken {
            let u = self.frame.fraction(theta);
            let [a, b, c] = Polynomial::columns(u);
            let [d, e] = Masing::columns(&self.frame, path, theta);
            let x = [a, b, c, d, e];
            let p = dot(&x, &self.block);
            let residual = torque * self.inverse_torque - p;
            let weight = self.supervision.weigh(&mut state.noise, residual, &mut state.warnings);
            if weight > S::ZERO {
                let slope = if state.continues { p - state.last } else { S::ZERO };
                state.sums.add(weight, slope, &x, residual);
                state.range = [state.range[0].min(p), state.range[1].max(p)];
            }
            state.last = p;
        }
        state.continues = taken;
        state.samples += 1;
        if state.samples < self.samples {
            return Change::None;
        }
        self.end_block(state)
    }

    /// Whether the past of the loop lets the next block be learnt from.
    ///
    /// What is unknown of it stays the same while the deflection keeps within the places that it has been to: an offset of η, which a stretch is free of. Beyond them it changes.
    #[inline(never)]
    fn look_back<const N: usize>(&self, state: &mut AdaptationState<S>, path: &Path<S, N>) {
        let unknown = path.start_uncertainty(&self.frame) * self.block[4];
        if state.unknown - unknown > S::from_f64(KNOWN_LOOP) {
            state.unknown = unknown;
            self.begin_stretch(state);
            state.work = Work::None;
        }
        state.known = !path.is_merged();
    }

    /// The block is whole. The one before is worked in by then, unless blocks are shorter than that takes: then all its work is done here.
    #[inline(never)]
    fn end_block(&self, state: &mut AdaptationState<S>) -> Change {
        let sums = core::mem::take(&mut state.sums);
        let mut change = Change::None;
        while state.work != Work::None {
            let now = self.piece(state);
            change = if now == Change::None { change } else { now };
        }
        state.samples = 0;
        // A block without a quarter of its samples says too little.
        if sums.weight >= self.least_weight {
            state.noise.centre = sums.mean();
            state.stretch.push(&sums);
            state.work = Work::Rotate(0, 0);
        }
        change
    }

    /// A step of the pending block into the triangle; after the last, says whether the stretch is whole.
    #[inline(always)]
    pub(super) fn rotate(&self, state: &mut AdaptationState<S>, number: u8, from: u8) {
        if state.stretch.rotate(usize::from(number), usize::from(from)) {
            state.work = Work::Rotate(number, from + 2);
        } else if usize::from(number) + 1 < ROWS {
            state.work = Work::Rotate(number + 1, 0);
        } else {
            self.end_rotation(state);
        }
    }

    #[inline(never)]
    fn end_rotation(&self, state: &mut AdaptationState<S>) {
        state.stretch.count();
        let moved = state.range[1] - state.range[0] >= S::from_f64(LEAST_SPAN);
        let blocks = state.stretch.blocks;
        let whole = blocks >= self.fewest_blocks && moved;
        state.work = if whole { Work::Begin } else { Work::None };
        if !whole && blocks >= self.most_blocks {
            self.begin_stretch(state);
        }
    }

    #[inline(never)]
    pub(super) fn begin_stretch(&self, state: &mut AdaptationState<S>) {
        (state.stretch, state.sums, state.samples) = (Stretch::new(), Sums::default(), 0);
        state.noise.begin_stretch();
        state.continues = false;
        state.range = [state.last; 2];
    }
}
