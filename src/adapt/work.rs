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
//! | a quantity is held against its limit, in the first of these [`STEPS`] and the last | [`CHECK`] | `health` |
//! | the next shadow: e and h not negative | [`LIFT`] | `bounds` |
//! | a bound on the shadow | [`BOUND`] | `bounds` |

use super::bounds::BOUNDS;
use super::estimate;
use super::health::QUANTITIES;
use super::state::AdaptationState;
use super::trial::{LEADS, limited};
use super::triangle::{add, clear, dot, fold, root, rotate, row};
use super::{Adaptation, COEFFICIENTS, Change, LEAST_TOLD};
use crate::scalar::Float;

/// Entries of a block's row, and rows of the triangle: the residual, the coefficients, level, delay.
pub(super) const ROWS: usize = COEFFICIENTS + 3;
/// Deviations by which the level misses where the offset has jumped.
const JUMP: f64 = 8.0;
/// Steps of learning from a row: it begins, is projected on the columns, columns forget, columns learn, the estimate follows.
const STEPS: usize = 3 * estimate::LEARNT + 2;
/// Steps of holding a quantity: it begins, is projected on the columns, and checked.
const HELD: usize = estimate::LEARNT + 2;

/// Counts at which a piece of each kind is the last of its kind.
const END: usize = 1;
const NOISE: usize = END + 1;
const BOUND: usize = NOISE + 1;
const LIFT: usize = BOUND + BOUNDS;
const CHECK: usize = LIFT + COEFFICIENTS;
const LEARN: usize = CHECK + QUANTITIES * HELD;
const DECIDE: usize = LEARN + estimate::LEARNT * STEPS;
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
            fold(row(&mut state.triangle, count - FOLD + 1), &mut state.sums);
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
            self.step(state, count - CHECK);
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
    fn step(&self, state: &mut AdaptationState<S>, count: usize) {
        const PROJECT: usize = FORGET + estimate::LEARNT;
        const FORGET: usize = FOLLOW + estimate::LEARNT;
        const FOLLOW: usize = 1;
        const FIRST: usize = LEARN - CHECK;
        let (number, step) = if count >= FIRST {
            ((count - FIRST) / STEPS + QUANTITIES, (count - FIRST) % STEPS)
        } else {
            let step = count % HELD;
            (count / HELD, if step > 0 { step + PROJECT - 1 } else { 0 })
        };
        let AdaptationState { triangle, estimate, noise, sums, work, .. } = state;
        let length = match number {
            // The shortest first, that of the level last.
            QUANTITIES.. => QUANTITIES + ROWS - 1 - number,
            0 => ROWS,
            _ => ROWS - 1,
        };
        let learnt = row(triangle, length);
        let [value, r @ ..] = &*learnt else { return };
        let (is_learnt, is_level) = (number >= QUANTITIES, number == QUANTITIES);
        if step == STEPS - 1 {
            clear(sums);
            let [w @ .., total] = sums;
            *total = S::ONE;
            if is_learnt {
                let prior = self.deviation * self.deviation;
                let square = dot(r, r);
                // What this step leaves in `sums` is then cleared by the next row.
                if prior * square < S::from_f64(LEAST_TOLD) * noise.variance {
                    *work -= STEPS as u8 - 1;
                }
                let pace = self.drift.over(root(square));
                *total = -pace.over(prior);
                add(w, r, pace);
            } else if let Ok(row) = learnt.try_into() {
                // That of the delay is longer. What was learnt from is needed no more.
                self.quantity(number, row);
            }
            return;
        }
        let [gain @ .., total] = sums;
        if step == 0 {
            let off = *value - dot(r, &estimate.value);
            let diagonal = *learnt.last().unwrap_or(value);
            if is_learnt {
                let innovation = off.over(*total);
                if is_level && innovation.abs() > S::from_f64(JUMP) {
                    // The gain undoes what the row has taught of the covariance.
                    let [.., of_level, _] = gain;
                    *of_level = off.over(diagonal);
                    *work += PROJECT as u8;
                    return;
                }
                let innovation = limited(innovation);
                add(&mut estimate.value, gain, innovation);
                noise.note(innovation);
            } else {
                let spread = dot(r, gain);
                self.check(state, number, [off, spread, diagonal]);
            }
            return;
        }
        // From the longest to the shortest, but where columns learn.
        let place = if step >= PROJECT { step - estimate::LEARNT } else { step };
        let column = row(&mut estimate.factor, (2 * place).abs_diff(2 * FORGET - 1) / 2 + 1);
        if (FORGET..PROJECT).contains(&step) {
            fold(column, sums);
            // What was folded in is zero now.
            if step == FORGET {
                let [.., total] = sums;
                *total = root(noise.variance);
            }
        } else {
            let seen = dot(column, r);
            if step >= PROJECT {
                add(gain, column, *total * seen);
            } else {
                *total = rotate(*total, seen, gain, column);
            }
        }
    }
}
