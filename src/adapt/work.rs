//! The work on a stretch, in pieces, one a period of 1 ms: samples are taken beside none of them but the rotations.

use core::hint::black_box;

use super::bounds::Bounds;
use super::kernel::{add, dot};
use super::state::AdaptationState;
use super::stretch::{NUISANCE, ROWS, Stretch, Sums};
use super::trial::Losses;
use super::{Adaptation, COEFFICIENTS, Change, LEAST_TOLD, Warning};
use crate::scalar::Float;

/// What is to be done next: on a block beside the samples, on a stretch instead of them, one piece a period (of 1 ms; more in a longer one).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Work {
    None,
    /// The pending block into a row, from an entry on.
    Rotate(u8, u8),
    Begin,
    /// A row.
    Weigh(u8),
    Judge,
    Free(u8),
    Shrink,
    /// A row.
    Compare(u8),
    Decide,
    Look,
    Share,
    /// A row, and a step.
    Forget(u8, u8),
    /// A row, and two columns.
    Learn(u8, u8),
    /// A row.
    Row(u8),
    Spread(u8),
    WatchOffset,
    WatchDelay,
    Check,
    End,
}

impl Work {
    /// Whether samples are taken beside it.
    pub(super) fn is_beside(self) -> bool {
        matches!(self, Self::None | Self::Rotate(..))
    }
}

impl<S: Float> Adaptation<S> {
    /// As many pieces of work as the period has milliseconds.
    #[inline]
    pub(super) fn work(&self, state: &mut AdaptationState<S>) -> Change {
        let mut change = Change::None;
        for _ in 0..self.pieces {
            if state.work == Work::None {
                break;
            }
            let now = self.piece(state);
            change = if now == Change::None { change } else { now };
        }
        change
    }

    #[inline(never)]
    pub(super) fn piece(&self, state: &mut AdaptationState<S>) -> Change {
        let AdaptationState { sums, stretch, estimate, trial, losses, noise, warnings, .. } = state;
        match state.work {
            Work::None => {}
            Work::Rotate(number, from) => self.rotate(state, number, from),
            Work::Begin => {
                *sums = Sums::default();
                *losses = [Losses::default(); 3];
                // An offset of the signal is no part of its moments.
                state.work = Work::Weigh(1);
            }
            Work::Weigh(number) => {
                let (_, x, y) = stretch.row(usize::from(number));
                let p = dot(&x, &self.block);
                let [square, product, ..] = &mut sums.x;
                (*square, *product) = (*square + p * p, *product + p * y);
                state.work = if usize::from(number) + 1 < ROWS { Work::Weigh(number + 1) } else { Work::Judge };
            }
            Work::Judge => {
                let fit = self.supervision.judge(noise, stretch, [sums.x[0], sums.x[1]], warnings);
                sums.x = estimate.value;
                if !fit {
                    self.begin_stretch(state);
                }
                state.work = if fit { Work::Free(0) } else { Work::None };
            }
            Work::Free(number) => {
                Bounds::lift(&self.block, estimate, &mut sums.x, usize::from(number));
                state.work = if number == 0 { Work::Free(1) } else { Work::Shrink };
            }
            Work::Shrink => {
                trial.held = self.bounds.shrink(&self.block, &self.common, &mut sums.x);
                state.work = Work::Compare(0);
            }
            Work::Compare(number) => {
                let (_, x, y) = stretch.row(usize::from(number));
                let of_coefficients = usize::from(number) >= NUISANCE;
                let predicted = [dot(&x, &trial.in_force), dot(&x, &sums.x), S::ZERO];
                for (losses, predicted) in losses.iter_mut().zip(predicted) {
                    losses.note(y - predicted, of_coefficients);
                }
                state.work = if usize::from(number) + 1 < ROWS { Work::Compare(number + 1) } else { Work::Decide };
            }
            Work::Decide => {
                state.work = Work::Look;
                if !noise.holds() {
                    let change = trial.decide(self.threshold, noise.variance, stretch.unexplained, &sums.x, losses);
                    warnings.latch(change == Change::TakenOver && trial.held, Warning::Bound);
                    return change;
                }
            }
            Work::Look => {
                estimate.look();
                state.work = Work::Share;
            }
            Work::Share => {
                estimate.share(self.prior);
                state.work = Work::Forget(NUISANCE as u8, 0);
            }
            Work::Forget(number, step) => {
                if step == 0 {
                    sums.weight = self.tell(noise.variance, stretch, number);
                    let learns = !noise.holds() && sums.weight >= S::from_f64(LEAST_TOLD);
                    state.work = if learns { Work::Forget(number, 1) } else { Self::after(number) };
                    return Change::None;
                }
                let columns = match step {
                    1 => {
                        let row = stretch.scratch();
                        sums.weight = estimate.begin_forgetting(self.prior, self.drift, row, sums.weight, &mut sums.x);
                        0..0
                    }
                    2 => 2..COEFFICIENTS,
                    _ => 0..2,
                };
                for column in black_box(columns).rev() {
                    estimate.forget(column, &mut sums.weight, &mut sums.x);
                }
                state.work = Work::Forget(number, step + 1);
                if step == 3 {
                    (sums.weight, sums.x) = (S::ONE, [S::ZERO; COEFFICIENTS]);
                    state.work = Work::Learn(number, 0);
                }
            }
            Work::Learn(number, from) => {
                let [.., value] = stretch.pending;
                let row = stretch.scratch();
                for column in black_box(from..from + 2) {
                    estimate.learn(usize::from(column), row, &mut sums.weight, &mut sums.x);
                }
                state.work = Work::Learn(number, from + 2);
                if usize::from(from) + 2 >= COEFFICIENTS {
                    let surprise = estimate.follow(row, value, sums.weight, &sums.x);
                    noise.note(surprise, sums.weight);
                    state.work = Self::after(number);
                }
            }
            Work::Row(number) => {
                (_, sums.x, _) = stretch.row(usize::from(number));
                state.work = Work::Spread(number);
            }
            Work::Spread(number) => {
                sums.weight = estimate.spread(&sums.x);
                state.work = if number == 0 { Work::WatchOffset } else { Work::WatchDelay };
            }
            Work::WatchOffset => {
                self.supervision.watch_offset(noise, stretch, estimate, sums.weight, warnings);
                state.work = Work::Row(1);
            }
            Work::WatchDelay => {
                self.supervision.watch_delay(noise, stretch, estimate, sums.weight, warnings);
                state.work = Work::Check;
            }
            Work::Check => {
                if let Some(warning) = self.health.check(estimate, &mut state.passed) {
                    warnings.latch(true, warning);
                }
                state.work = Work::End;
            }
            Work::End => {
                self.begin_stretch(state);
                state.work = Work::None;
            }
        }
        Change::None
    }

    /// Puts a row of a stretch and its value, over the deviation of the noise, into the place to work in. Returns rᵀP_0r.
    #[inline]
    fn tell(&self, variance: S, stretch: &mut Stretch<S>, number: u8) -> S {
        let (_, row, value) = stretch.row(usize::from(number));
        let scale = variance.sqrt().recip();
        let mut scaled = [S::ZERO; COEFFICIENTS];
        add(&mut scaled, &row, scale);
        *stretch.scratch() = scaled;
        let [.., last] = &mut stretch.pending;
        *last = value * scale;
        self.prior * dot(&scaled, &scaled)
    }

    /// What follows the learning of a row.
    fn after(number: u8) -> Work {
        if usize::from(number) + 1 < ROWS { Work::Forget(number + 1, 0) } else { Work::Row(0) }
    }
}
