//! Recursive least squares in square-root form, with forgetting along the directions that rows inform.
//!
//! The covariance is kept as P = U·Uᵀ, U upper triangular by columns, so that it stays symmetric and positive in `f32` after any number of rows. P_0 is the prior's, diagonal. A row r,
//! its value y of variance 1, does
//!
//! ```text
//! forget      P ← P + w·wᵀ                        w = P_0r·√(κ/(rᵀP_0r))
//! learn       x ← x + Pr·(y − rᵀx)/(1 + rᵀPr)     P ← P − Pr·rᵀP/(1 + rᵀPr)
//! ```
//!
//! Both are plane rotations of columns (Kailath, Sayed, Hassibi, *Linear Estimation*, 2000, chapter 12): w is folded into U as a block is into the [triangle](super::triangle) of its stretch; and the
//! rotations that turn (1, rᵀU) into (√(1 + rᵀPr), 0), applied to (0, U), leave (Pr/√(1 + rᵀPr), the new U).
//!
//! The variance along r grows as that of a random walk whose steps have κ times the prior's variance: the memory is short where rows tell much and long where they tell little. What no row
//! informs forgets nothing. w is limited to what keeps every variance within its prior: no excitation, however little, lets the covariance grow without bound.

use core::hint::black_box;

use super::triangle::{add, dot, fold, places, root, rotate, row, scale};
use super::{COEFFICIENTS, Coefficients};
use crate::scalar::Float;

/// An innovation beyond this many standard deviations counts as one of this many.
const LARGEST_INNOVATION: f64 = 4.0;

/// An estimate with its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Estimate<S> {
    /// x.
    pub(super) value: Coefficients<S>,
    /// U by columns.
    factor: [S; COEFFICIENTS * (COEFFICIENTS + 1) / 2],
}

impl<S: Float> Estimate<S> {
    /// Zero with independent prior deviations.
    pub(super) fn new(deviation: S) -> Self {
        let mut factor = [S::ZERO; COEFFICIENTS * (COEFFICIENTS + 1) / 2];
        for diagonal in [0, 2, 5, 9, 14] {
            factor[diagonal] = deviation;
        }
        Self { value: [S::ZERO; COEFFICIENTS], factor }
    }

    /// rᵀPr.
    #[inline]
    pub(super) fn spread(&self, r: &[S]) -> S {
        let (mut spread, mut columns, mut length) = (S::ZERO, black_box(self.factor.as_slice()), 1);
        while let Some((column, longer)) = columns.split_at_checked(length) {
            let mut seen = S::ZERO;
            for (u, r) in column.iter().zip(r) {
                seen = seen + *u * *r;
                black_box(());
            }
            spread = spread + seen * seen;
            (columns, length) = (longer, length + 1);
        }
        spread
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

    /// Limits w to what the variance of a coefficient lacks of its prior.
    #[inline]
    pub(super) fn limit(&self, prior: S, number: usize, w: &mut [S]) {
        let room = prior - self.variance(number);
        if let Some(&entry) = w.get(number)
            && entry * entry > room
        {
            scale(w, root(room.max(S::ZERO)).over(entry.abs()));
        }
    }

    /// Folds w into a column, from the longest to the shortest.
    #[inline]
    pub(super) fn forget(&mut self, length: usize, w: &mut [S]) {
        fold(&mut self.factor, length, w);
    }

    /// Learns from r by a column, from the shortest to the longest: √(1 + rᵀPr) and Pr over it come of 1 and zeros.
    #[inline]
    pub(super) fn learn(&mut self, length: usize, r: &[S], total: &mut S, gain: &mut [S]) {
        let column = row(&mut self.factor, length);
        *total = rotate(*total, dot(column, r), gain, column);
    }

    /// Moves the estimate by what r and its value told, from what [`learn`](Self::learn) found. Returns the innovation over its standard deviation, limited.
    #[inline]
    pub(super) fn follow(&mut self, r: &[S], value: S, total: S, gain: &[S]) -> S {
        let limit = S::from_f64(LARGEST_INNOVATION);
        let innovation = (value - dot(r, &self.value)).over(total).clamp(-limit, limit);
        add(&mut self.value, gain, innovation);
        innovation
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRIOR: f64 = 0.25;

    fn forget(estimate: &mut Estimate<f64>, r: &Coefficients<f64>) {
        let told = PRIOR * dot(r, r);
        let mut w = r.map(|r| r * PRIOR * (0.5 / told).sqrt());
        (0..COEFFICIENTS).for_each(|number| estimate.limit(PRIOR, number, &mut w));
        (1..=COEFFICIENTS).rev().for_each(|length| estimate.forget(length, &mut w));
    }

    fn learn(estimate: &mut Estimate<f64>, r: &Coefficients<f64>, value: f64) {
        let before = estimate.spread(r);
        let (mut total, mut gain) = (1.0, [0.0; COEFFICIENTS]);
        (1..=COEFFICIENTS).for_each(|length| estimate.learn(length, r, &mut total, &mut gain));
        assert!((total * total - 1.0 - before).abs() < 1e-9 && (dot(r, &gain) * total - before).abs() < 1e-9);
        assert!((estimate.spread(r) - before / (1.0 + before)).abs() < 1e-9);
        estimate.follow(r, value, total, &gain);
    }

    #[test]
    fn what_is_forgotten_never_passes_the_prior() {
        let mut estimate = Estimate::new(PRIOR.sqrt());
        let rows = [[3.0, 1.0, 0.5, -2.0, 1.0], [1.0, -2.0, 4.0, 0.1, 0.0]];
        for _ in 0..1000 {
            for row in &rows {
                forget(&mut estimate, row);
                learn(&mut estimate, row, 0.3);
            }
        }
        let variances = |estimate: &Estimate<f64>| [0, 1, 2, 3, 4].map(|number| estimate.variance(number));
        let learnt = variances(&estimate);
        for _ in 0..1000 {
            rows.iter().for_each(|row| forget(&mut estimate, row));
        }
        let variances = variances(&estimate);
        let within = |variance: &f64| *variance > 0.0 && *variance <= PRIOR * (1.0 + 1e-9);
        assert!(learnt.iter().chain(&variances).all(within), "{learnt:?} {variances:?}");
        assert!(variances.iter().any(|variance| *variance > 0.99 * PRIOR), "{variances:?}");
        for (number, variance) in variances.into_iter().enumerate() {
            let unit: Coefficients<f64> = core::array::from_fn(|k| f64::from(u8::from(k == number)));
            assert!((estimate.spread(&unit) - variance).abs() < 1e-12);
        }
    }
}
