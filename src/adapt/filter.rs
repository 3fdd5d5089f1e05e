//! Recursive least squares in square-root form, with forgetting along the directions that rows inform.
//!
//! The covariance is kept as P = U·D·Uᵀ, U unit upper triangular and D > 0 (Bierman, *Factorization Methods for Discrete Sequential Estimation*, 1977), so that it
//! stays symmetric and positive in `f32` after any number of rows. P_0 is the prior's, diagonal. A row r, its value y of variance 1, does
//!
//! ```text
//! forget      P ← P + c·P_0r·rᵀP_0                c = κ/(rᵀP_0r)
//! learn       x ← x + Pr·(y − rᵀx)/(1 + rᵀPr)     P ← P − Pr·rᵀP/(1 + rᵀPr)
//! ```
//!
//! The variance along r grows as that of a random walk whose steps have κ times the prior's variance: the memory is short where rows tell much and long where they tell little. What no row
//! informs forgets nothing. c is limited to what keeps every variance within its prior: no excitation, however little, lets the covariance grow without bound.

use core::hint::black_box;

use super::Coefficients;
use super::kernel::{add, dot, mix};
use crate::scalar::Float;

/// Coefficients of a gear, in all.
const N: usize = super::COEFFICIENTS;

/// An innovation beyond this many standard deviations counts as one of this many.
const LARGEST_INNOVATION: f64 = 4.0;

/// An estimate with its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Estimate<S> {
    /// x.
    pub(super) value: Coefficients<S>,
    /// U by columns, D on its diagonal.
    factor: [[S; N]; N],
    /// How far each variance may grow by each row of a stretch.
    room: Coefficients<S>,
}

impl<S: Float> Estimate<S> {
    /// Zero with independent prior variances.
    pub(super) fn new(variance: S) -> Self {
        let mut factor = [[S::ZERO; N]; N];
        for (j, column) in factor.iter_mut().enumerate() {
            if let Some(diagonal) = column.get_mut(j) {
                *diagonal = variance;
            }
        }
        Self { value: [S::ZERO; N], factor, room: [S::ZERO; N] }
    }

    /// rᵀPr.
    #[inline(never)]
    pub(super) fn spread(&self, row: &Coefficients<S>) -> S {
        let mut spread = S::ZERO;
        for (j, column) in black_box(self.factor.as_slice()).iter().enumerate() {
            let j = black_box(j);
            if let (Some(diagonal), Some(own)) = (column.get(j), row.get(j)) {
                // The column holds D where U has its 1.
                let seen = *own * (S::ONE - *diagonal) + dot(column, row);
                spread = spread + seen * seen * *diagonal;
            }
        }
        spread
    }

    /// The covariance of one coefficient with all.
    #[inline(never)]
    pub(super) fn covariance(&self, of: usize) -> Coefficients<S> {
        let mut covariance = [S::ZERO; N];
        // The columns before have zeros in this row.
        for (j, column) in black_box(self.factor.as_slice()).iter().enumerate().skip(of) {
            let j = black_box(j);
            if let (Some(diagonal), Some(u)) = (column.get(j), column.get(of)) {
                let scaled = if j == of { *diagonal } else { *u * *diagonal };
                add(&mut covariance, column, scaled);
                if let Some(own) = covariance.get_mut(j) {
                    *own = scaled;
                }
            }
        }
        covariance
    }

    /// The variance of each coefficient.
    #[inline(never)]
    pub(super) fn variances(&self) -> Coefficients<S> {
        let mut variances = [S::ZERO; N];
        for (j, column) in black_box(self.factor.as_slice()).iter().enumerate() {
            let j = black_box(j);
            let Some((above, [diagonal, ..])) = column.split_at_checked(j) else { continue };
            for (variance, u) in black_box(variances.as_mut_slice()).iter_mut().zip(above) {
                *variance = *variance + *u * *u * *diagonal;
                black_box(());
            }
            if let Some(variance) = variances.get_mut(j) {
                *variance = *variance + *diagonal;
            }
        }
        variances
    }

    /// Looks at the variances before a stretch is learnt from.
    pub(super) fn look(&mut self) {
        self.room = self.variances();
    }

    /// Shares among the rows of a stretch what the variances lack of the prior.
    pub(super) fn share(&mut self, prior: S) {
        for room in black_box(self.room.as_mut_slice()) {
            *room = (prior - *room).max(S::ZERO) * S::from_f64(1.0 / N as f64);
            black_box(());
        }
    }

    /// Begins to forget along a row, of which rᵀP_0r is `at_first`: c, and P_0r in `along`. `drift` is κ.
    pub(super) fn begin_forgetting(
        &self,
        prior: S,
        drift: S,
        row: &Coefficients<S>,
        at_first: S,
        along: &mut Coefficients<S>,
    ) -> S {
        *along = *row;
        let mut c = drift.over(at_first.max(S::from_f64(1e-12)));
        for (along, room) in black_box(along.as_mut_slice()).iter_mut().zip(black_box(self.room.as_slice())) {
            *along = *along * prior;
            let square = *along * *along;
            if c * square > *room {
                c = room.over(square);
            }
            black_box(());
        }
        c
    }

    /// Agee and Turner's rank-one update of a column, from the last to the first.
    pub(super) fn forget(&mut self, j: usize, c: &mut S, along: &mut Coefficients<S>) {
        let (Some(column), Some(&at)) = (self.factor.get_mut(j), along.get(j)) else { return };
        let Some(&old) = column.get(j) else { return };
        let new = old + *c * at * at;
        let share = new.recip();
        let slope = *c * at * share;
        *c = *c * old * share;
        // u + slope·(along − at·u)
        mix(column, along, old * share, slope, -at);
        // Below the diagonal zeros stay: the columns before see nothing of this one.
        if let (Some(diagonal), Some(along)) = (column.get_mut(j), along.get_mut(j)) {
            (*diagonal, *along) = (new, S::ZERO);
        }
    }

    /// Bierman's update of a column by a row whose value has variance 1, from the first to the last. Pr and 1 + rᵀPr come of it, from zeros and 1.
    pub(super) fn learn(&mut self, j: usize, row: &Coefficients<S>, total: &mut S, gain: &mut Coefficients<S>) {
        let (Some(column), Some(own)) = (self.factor.get_mut(j), row.get(j)) else { return };
        let Some(&diagonal) = column.get(j) else { return };
        let seen = *own * (S::ONE - diagonal) + dot(column, row);
        let scaled = diagonal * seen;
        let after = *total + seen * scaled;
        mix(column, gain, S::ONE, -seen.over(*total), scaled);
        if let (Some(diagonal), Some(gain)) = (column.get_mut(j), gain.get_mut(j)) {
            (*diagonal, *gain) = ((*diagonal * *total).over(after), scaled);
        }
        *total = after;
    }

    /// Moves the estimate by what a row told, from what [`learn`](Self::learn) found. Returns the innovation over its standard deviation, squared, limited.
    pub(super) fn follow(&mut self, row: &Coefficients<S>, value: S, total: S, gain: &Coefficients<S>) -> S {
        let limit = S::from_f64(LARGEST_INNOVATION) * total.sqrt();
        let innovation = (value - dot(row, &self.value)).clamp(-limit, limit);
        let step = innovation.over(total);
        add(&mut self.value, gain, step);
        innovation * step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn forget(estimate: &mut Estimate<f64>, prior: f64, row: &Coefficients<f64>) {
        let mut along = [0.0; N];
        let mut c = estimate.begin_forgetting(prior, 0.5, row, prior * dot(row, row), &mut along);
        for j in (0..N).rev() {
            estimate.forget(j, &mut c, &mut along);
        }
    }

    fn learn(estimate: &mut Estimate<f64>, row: &Coefficients<f64>, value: f64) {
        let (mut total, mut gain) = (1.0, [0.0; N]);
        for j in 0..N {
            estimate.learn(j, row, &mut total, &mut gain);
        }
        assert!((total - 1.0 - dot(row, &gain)).abs() < 1e-12);
        estimate.follow(row, value, total, &gain);
    }

    #[test]
    fn what_is_forgotten_never_passes_the_prior() {
        let (prior, mut estimate) = (0.25, Estimate::new(0.25));
        let rows = [[3.0, 1.0, 0.5, -2.0, 1.0], [1.0, -2.0, 4.0, 0.1, 0.0]];
        rows.iter().for_each(|row| learn(&mut estimate, row, 0.3));
        for _ in 0..1000 {
            estimate.look();
            estimate.share(prior);
            rows.iter().for_each(|row| forget(&mut estimate, prior, row));
        }
        let variances = estimate.variances();
        assert!(variances.iter().all(|variance| *variance > 0.0 && *variance <= prior * (1.0 + 1e-9)), "{variances:?}");
        for (number, variance) in variances.into_iter().enumerate() {
            assert!((estimate.covariance(number)[number] - variance).abs() < 1e-12);
        }
    }
}
