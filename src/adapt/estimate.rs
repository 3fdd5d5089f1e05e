//! Recursive least squares in square-root form, with forgetting along the directions that rows inform.
//!
//! The covariance is kept as P = U·Uᵀ, U upper triangular by columns, so that it stays symmetric and positive in `f32` after any number of rows. P_0 is the prior's, diagonal. A row r,
//! its value y of variance v, does
//!
//! ```text
//! forget      P ← P + w·wᵀ                        w = (P_0 − P)r·√(κ/(rᵀP_0r))
//! learn       x ← x + Pr·(y − rᵀx)/(v + rᵀPr)     P ← P − Pr·rᵀP/(v + rᵀPr)
//! ```
//!
//! Both are plane rotations of columns (Kailath, Sayed, Hassibi, *Linear Estimation*, 2000, chapter 12): w is folded into U as a block is into the [triangle](super::triangle) of its stretch; and the
//! rotations that turn (√v, rᵀU) into (√(v + rᵀPr), 0), applied to (0, U), leave (Pr/√(v + rᵀPr), the new U).
//!
//! Where P is small, the variance along r grows as that of a random walk whose steps have κ times the prior's variance: the memory is short where rows tell much and long where they tell little. What no
//! row informs forgets nothing. P never passes P_0: with M = P_0 − P, κ ≤ 1 and rᵀMr ≤ rᵀP_0r, what is left of it, M − Mr·rᵀM·κ/(rᵀP_0r), is not negative (Cauchy–Schwarz). So no excitation, however little,
//! lets the covariance grow without bound.
//!
//! The rows of a stretch are learnt from the shortest to that of the level. Where the level misses by more than 8 deviations, the offset has jumped: its variance alone grows, by the square of the jump, beyond the prior's
//! where the jump is, and the row of the level is learnt from once more.

use core::hint::black_box;

use super::COEFFICIENTS;
use super::triangle::places;
use crate::scalar::Float;

/// What is learnt: the coefficients, and the offset of the signal behind them.
pub(super) const LEARNT: usize = COEFFICIENTS + 1;

/// An estimate with its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Estimate<S> {
    /// x.
    pub(super) value: [S; LEARNT],
    /// U by columns.
    pub(super) factor: [S; LEARNT * (LEARNT + 1) / 2],
}

impl<S: Float> Estimate<S> {
    /// Before it is started.
    pub(super) const NEW: Self = Self { value: [S::ZERO; LEARNT], factor: [S::ZERO; LEARNT * (LEARNT + 1) / 2] };

    /// Independent prior deviations.
    #[inline]
    pub(super) fn begin(&mut self, deviation: S) {
        for diagonal in [0, 2, 5, 9, 14, 20] {
            self.factor[diagonal] = deviation;
        }
    }

    /// The variance of a coefficient.
    #[inline]
    pub(super) fn variance(&self, number: usize) -> S {
        let mut variance = S::ZERO;
        // From one entry in the row of the coefficient to the next.
        let (mut at, mut length) = (places(number + 1).end - 1, number + 1);
        while let Some(u) = self.factor.get(at) {
            variance = variance + *u * *u;
            at += length;
            length += 1;
            black_box(());
        }
        variance
    }
}

#[cfg(test)]
mod tests {
    use super::super::triangle::{add, dot, fold, rotate, row};
    use super::super::work::ROWS;
    use super::*;

    const PRIOR: f64 = 0.25;
    type Row = [f64; LEARNT];

    /// Pr.
    fn project(estimate: &mut Estimate<f64>, r: &Row) -> Row {
        let mut sum = [0.0; LEARNT];
        for length in 1..=LEARNT {
            let column = row(&mut estimate.factor, length);
            let seen = dot(column, r);
            add(&mut sum, column, seen);
        }
        sum
    }

    fn spread(estimate: &mut Estimate<f64>, r: &Row) -> f64 {
        dot(r, &project(estimate, r))
    }

    fn forget(estimate: &mut Estimate<f64>, r: &Row) {
        let pace = (0.5 / (PRIOR * dot(r, r))).sqrt();
        let mut w = [0.0; ROWS];
        for ((w, r), known) in w.iter_mut().zip(r).zip(project(estimate, r)) {
            *w = pace * (PRIOR * r - known);
        }
        (1..=LEARNT).rev().for_each(|length| fold(row(&mut estimate.factor, length), &mut w));
    }

    fn learn(estimate: &mut Estimate<f64>, r: &Row, value: f64) {
        const VARIANCE: f64 = 2.0;
        let before = spread(estimate, r);
        let (mut total, mut gain) = (VARIANCE.sqrt(), [0.0; LEARNT]);
        for length in 1..=LEARNT {
            let column = row(&mut estimate.factor, length);
            let seen = dot(column, r);
            total = rotate(total, seen, &mut gain, column);
        }
        assert!((total * total - VARIANCE - before).abs() < 1e-9 && (dot(r, &gain) * total - before).abs() < 1e-9);
        assert!((spread(estimate, r) - VARIANCE * before / (VARIANCE + before)).abs() < 1e-9);
        let missed = value - dot(r, &estimate.value);
        add(&mut estimate.value, &gain, missed / total);
    }

    #[test]
    fn what_is_forgotten_never_passes_the_prior() {
        let mut estimate = Estimate::NEW;
        estimate.begin(PRIOR.sqrt());
        let rows = [[3.0, 1.0, 0.5, -2.0, 1.0, 0.0], [1.0, -2.0, 4.0, 0.1, 0.0, 0.5]];
        for _ in 0..1000 {
            for row in &rows {
                forget(&mut estimate, row);
                learn(&mut estimate, row, 0.3);
            }
        }
        let variances = |estimate: &Estimate<f64>| [0, 1, 2, 3, 4, 5].map(|number| estimate.variance(number));
        let learnt = variances(&estimate);
        for _ in 0..10_000 {
            rows.iter().for_each(|row| forget(&mut estimate, row));
        }
        let variances = variances(&estimate);
        let within = |variance: &f64| *variance > 0.0 && *variance <= PRIOR * (1.0 + 1e-9);
        assert!(learnt.iter().chain(&variances).all(within), "{learnt:?} {variances:?}");
        assert!(variances.iter().any(|variance| *variance > 0.99 * PRIOR), "{variances:?}");
        for (number, variance) in variances.into_iter().enumerate() {
            let unit: Row = core::array::from_fn(|k| f64::from(u8::from(k == number)));
            assert!((spread(&mut estimate, &unit) - variance).abs() < 1e-12);
        }
    }
}
