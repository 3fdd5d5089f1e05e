//! The work on blocks and stretches: a countdown, one piece a period of 1 ms, in which no sample is taken.
//!
//! | piece | counts | file |
//! |---|---|---|
//! | a block is folded into a row of the triangle | [`FOLD`] | `triangle` |
//! | a row of the stretch is predicted | [`ASSESS`] | `trial` |
//! | the stretch is judged | [`JUDGE`] | `supervision` |
//! | a gain is added to a lead | [`LEAD`] | `trial` |
//! | what is in force is decided | [`DECIDE`] | `trial` |
//! | a row is learnt from, in [`STEPS`] | [`LEARN`] | `estimate` |
//! | a quantity is held against its limit, in the first of these [`STEPS`] and one more | [`CHECK`] | `health` |
//! | the next shadow: e and h not negative | [`LIFT`] | `bounds` |
//! | a bound on the shadow | [`BOUND`] | `bounds` |

use core::hint::black_box;

use super::bounds::BOUNDS;
use super::health::{OF_SIGNAL, QUANTITIES};
use super::state::AdaptationState;
use super::trial::LEADS;
use super::triangle::{add, clear, dot, fold, root, rotate, row};
use super::{Adaptation, COEFFICIENTS, Change, LEAST_TOLD};
use crate::scalar::Float;

/// Entries of a block's row, and rows of the triangle: the residual, the coefficients, delay, offset.
pub(super) const ROWS: usize = COEFFICIENTS + 3;
/// The shortest row that is learnt from.
const SHORTEST: usize = 2;
/// Steps of learning from a row: it is projected on the columns, columns forget, columns learn, the estimate follows.
const STEPS: usize = 3 * COEFFICIENTS + 1;

/// Counts at which a piece of each kind is the last of its kind.
const END: usize = 1;
const NOISE: usize = END + 1;
const BOUND: usize = NOISE + 1;
const LIFT: usize = BOUND + BOUNDS;
const CHECK: usize = LIFT + COEFFICIENTS;
const LEARN: usize = CHECK + STEPS * QUANTITIES;
const DECIDE: usize = LEARN + COEFFICIENTS * STEPS;
const LEAD: usize = DECIDE + 1;
const JUDGE: usize = LEAD + LEADS;
const ASSESS: usize = JUDGE + 1;
const FOLD: usize = ASSESS + ROWS - 1;
/// The count from which nothing is learnt from a stretch.
pub(super) const LEARNT: u8 = LEARN as u8 - 1;
/// The count from which a stretch is dropped.
pub(super) const DROPPED: u8 = END as u8;
/// The count at which a whole block is to be folded in.
pub(super) const BEGIN: u8 = (FOLD + ROWS - 1) as u8;

impl<S: Float> Adaptation<S> {
    /// The next piece.
    #[inline(never)]
    pub(super) fn piece(&self, state: &mut AdaptationState<S>) -> Change {
        let count = usize::from(state.work);
        state.work -= 1;
        if count >= FOLD {
            fold(&mut state.triangle, count - FOLD + 1, &mut state.sums);
            if count == FOLD {
                self.end_block(state);
            }
        } else if count >= ASSESS {
            self.assess(state, FOLD + 1 - count);
        } else if count == JUDGE {
            self.judge(state);
        } else if count >= LEAD {
            Self::advance(state, count - LEAD);
        } else if count == DECIDE {
            return Self::decide(state);
        } else if count >= CHECK {
            self.step(state, (count - CHECK) / STEPS, (count - CHECK) % STEPS);
        } else if count >= LIFT {
            self.lift(state, count - LIFT);
        } else if count >= BOUND {
            self.bound(state, count - BOUND);
        } else if count == NOISE {
            state.noise.learn();
        } else {
            clear(&mut state.triangle);
            state.blocks = 0;
        }
        Change::None
    }

    /// A step of the work on a row: the rows that hold a quantity, then those that are learnt from. `sums` keeps w, Pr or the gain, and at its end a factor or the total.
    #[inline(always)]
    fn step(&self, state: &mut AdaptationState<S>, number: usize, step: usize) {
        const PROJECT: usize = FORGET + COEFFICIENTS;
        const FORGET: usize = LEARN + COEFFICIENTS;
        const LEARN: usize = 1;
        let AdaptationState { triangle, estimate, noise, sums, work, .. } = state;
        let length = match number {
            QUANTITIES.. => number + SHORTEST - QUANTITIES,
            OF_SIGNAL.. => COEFFICIENTS + 1,
            _ => number + COEFFICIENTS + 2,
        };
        let row = row(triangle, length);
        // Only those of the gear are as long. What was learnt from is needed no more.
        if number < QUANTITIES
            && let Ok(row) = row.try_into()
        {
            self.quantity(number, row);
        }
        let [value, r @ ..] = &*row else { return };
        let is_learnt = number >= QUANTITIES;
        if step == STEPS - 1 {
            let [w @ .., total] = sums;
            // Not by `clear`: this is the step of most instructions.
            for w in w.iter_mut() {
                *w = S::ZERO;
                black_box(());
            }
            let mut factor = S::ONE;
            if is_learnt {
                let prior = self.deviation * self.deviation;
                let told = prior * dot(r, r);
                // What this step leaves in `sums` is then cleared by the next row.
                if told < S::from_f64(LEAST_TOLD) * noise.variance {
                    *work -= STEPS as u8 - 1;
                }
                factor = -root(self.drift.over(told));
                add(w, r, -prior * factor);
            }
            *total = factor;
        }
        let [gain @ .., total] = sums;
        if step == 0 {
            let off = *value - dot(r, &estimate.value);
            if is_learnt {
                let innovation = estimate.follow(off, *total, gain);
                noise.note(innovation);
            } else {
                let (spread, diagonal) = (dot(r, gain), *row.last().unwrap_or(value));
                let lag = root(dot(gain, &gain[..COEFFICIENTS]));
                self.check(state, number, [off, spread, diagonal, lag]);
            }
        } else if (FORGET..PROJECT).contains(&step) {
            estimate.forget(step - FORGET + 1, sums);
            if step == FORGET {
                clear(sums);
                let [.., total] = sums;
                *total = root(noise.variance);
            }
        } else {
            let (column, seen) = estimate.seen(if step >= PROJECT { STEPS - step } else { COEFFICIENTS + 1 - step }, r);
            if step >= PROJECT {
                add(gain, column, *total * seen);
                // What is not learnt from is then checked.
                if step == PROJECT && !is_learnt {
                    *work -= PROJECT as u8 - 1;
                }
            } else {
                *total = rotate(*total, seen, gain, column);
            }
        }
    }
}
