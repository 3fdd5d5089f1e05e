//! The work on blocks and stretches: a countdown, one piece a period of 1 ms, in which no sample is taken.
//!
//! | piece | counts | file |
//! |---|---|---|
//! | the row of a block | [`TAKE`] | `samples` |
//! | it is folded into a row of the triangle | [`FOLD`] | `triangle` |
//! | a row of the stretch is predicted | [`ASSESS`] | `trial` |
//! | the stretch is judged, and what is in force decided | [`DECIDE`] | `supervision`, `trial` |
//! | a row is learnt from, in [`STEPS`] | [`LEARN`] | `estimate` |
//! | a quantity is held against its limit, in two pieces | [`CHECK`] | `health` |
//! | the next shadow: e and h not negative, no coefficient beyond its limit | [`LIFT`] | `bounds` |
//! | three bounds on the shadow | [`BOUND`] | `bounds` |

use core::hint::black_box;

use super::bounds::BOUNDS;
use super::health::QUANTITIES;
use super::state::AdaptationState;
use super::triangle::{add, clear, dot, fold, root, row, scale};
use super::{Adaptation, COEFFICIENTS, Change, LEAST_TOLD};
use crate::scalar::Float;

/// Entries of a block's row, and rows of the triangle: the residual, the coefficients, delay, offset.
pub(super) const ROWS: usize = COEFFICIENTS + 3;
/// The shortest rows are folded in pairs.
const PAIRS: usize = 2;
/// Bounds in a piece.
const BOUNDED: usize = 3;
/// Pieces that learn from a row: scaling it, limiting w by each coefficient, columns forgotten, columns learnt, following.
const STEPS: usize = 3 * COEFFICIENTS + 2;

/// Counts at which a piece of each kind is the last of its kind.
const END: usize = 1;
const BOUND: usize = END + 1;
const LIFT: usize = BOUND + BOUNDS / BOUNDED;
const CHECK: usize = LIFT + 1;
const LEARN: usize = CHECK + 2 * QUANTITIES;
const DECIDE: usize = LEARN + COEFFICIENTS * STEPS;
const ASSESS: usize = DECIDE + 1;
const FOLD: usize = ASSESS + ROWS - 1;
const TAKE: usize = FOLD + ROWS - PAIRS;
/// The count from which nothing is learnt from a stretch.
pub(super) const LEARNT: u8 = LEARN as u8 - 1;
/// The count at which a whole block is to be worked in.
pub(super) const BEGIN: u8 = TAKE as u8;

impl<S: Float> Adaptation<S> {
    /// The next piece.
    #[inline(never)]
    pub(super) fn piece(&self, state: &mut AdaptationState<S>) -> Change {
        let count = usize::from(state.work);
        state.work -= 1;
        if count >= TAKE {
            Self::take_block(state);
        } else if count >= FOLD {
            let (triangle, row) = (&mut state.triangle, &mut state.row);
            match count - FOLD {
                pair @ (0 | 1) => {
                    fold(triangle, 2 * pair + 2, row);
                    fold(triangle, 2 * pair + 1, row);
                }
                length => fold(triangle, length + PAIRS + 1, row),
            }
            if count == FOLD {
                self.end_block(state);
            }
        } else if count >= ASSESS {
            self.assess(state, FOLD + 1 - count);
        } else if count == DECIDE {
            return self.decide(state);
        } else if count >= LEARN {
            self.learn(state, (count - LEARN) / STEPS + 2, (count - LEARN) % STEPS);
        } else if count >= CHECK {
            self.check(state, count - CHECK);
        } else if count == LIFT {
            self.lift(state);
        } else if count >= BOUND {
            let first = BOUNDED * (count - BOUND);
            for number in first..black_box(first + BOUNDED) {
                self.bound(state, number);
            }
        } else {
            state.noise.learn();
            Self::begin_stretch(state);
        }
        Change::None
    }

    /// A step of learning from the row of a length. r is kept behind its value in `row`, w and then the gain behind the total in `sums`.
    #[inline]
    fn learn(&self, state: &mut AdaptationState<S>, length: usize, step: usize) {
        const SCALE: usize = STEPS - 1;
        const LIMIT: usize = SCALE - COEFFICIENTS;
        const FORGET: usize = LIMIT - COEFFICIENTS;
        let AdaptationState { estimate, noise, row: [value, r @ ..], sums: [total, gain @ ..], .. } = state;
        if step == SCALE {
            clear(&mut state.row);
            add(&mut state.row, row(&mut state.triangle, length), root(noise.variance).recip());
            let [_, r @ .., _, _] = &state.row;
            // Of a length that the compiler knows at every call, `dot` would be unrolled.
            let told = self.prior * dot(black_box(r), black_box(r));
            if told < S::from_f64(LEAST_TOLD) {
                state.work -= SCALE as u8;
                return;
            }
            state.sums = state.row;
            scale(&mut state.sums, self.prior * root(self.drift.over(told)));
        } else if step >= LIMIT {
            estimate.limit(self.prior, step - LIMIT, gain);
        } else if step >= FORGET {
            estimate.forget(step - FORGET + 1, gain);
            if step == FORGET {
                clear(gain);
                *total = S::ONE;
            }
        } else if step > 0 {
            estimate.learn(COEFFICIENTS + 1 - step, r, total, gain);
        } else {
            let surprise = estimate.follow(r, *value, *total, gain);
            noise.note(surprise, *total);
        }
    }
}
