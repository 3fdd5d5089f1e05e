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

#![allow(clippy::needless_range_loop, reason = "indices as in the sources")]

use super::Coefficients;
use super::stretch::dot;
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

/// What a row told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Told<S> {
    /// Innovation over its standard deviation, squared, limited.
    pub(super) surprise: S,
    /// ζ.
    pub(super) spread: S,
}

impl<S: Float> Estimate<S> {
    /// Zero with independent prior variances.
    pub(super) fn new(variance: &Coefficients<S>) -> Self {
        let mut factor = [[S::ZERO; N]; N];
        for j in 0..N {
            factor[j][j] = variance[j];
        }
        Self { value: [S::ZERO; N], factor, room: [S::ZERO; N] }
    }

    /// Uᵀr.
    #[inline]
    fn seen(&self, row: &Coefficients<S>) -> Coefficients<S> {
        let mut seen = *row;
        for j in 0..N {
            for i in 0..j {
                seen[j] = seen[j] + self.factor[j][i] * row[i];
            }
        }
        seen
    }

    /// rᵀPr.
    #[inline(never)]
    pub(super) fn spread(&self, row: &Coefficients<S>) -> S {
        let seen = self.seen(row);
        (0..N).fold(S::ZERO, |sum, j| sum + seen[j] * seen[j] * self.factor[j][j])
    }

    /// Pr and rᵀPr.
    #[inline]
    fn gain(&self, seen: &Coefficients<S>) -> (Coefficients<S>, S) {
        let (mut gain, mut spread) = ([S::ZERO; N], S::ZERO);
        for j in 0..N {
            let scaled = self.factor[j][j] * seen[j];
            spread = spread + seen[j] * scaled;
            for i in 0..j {
                gain[i] = gain[i] + self.factor[j][i] * scaled;
            }
            gain[j] = gain[j] + scaled;
        }
        (gain, spread)
    }

    /// The covariance of one coefficient with all.
    pub(super) fn covariance(&self, of: usize) -> Coefficients<S> {
        let mut unit = [S::ZERO; N];
        if let Some(one) = unit.get_mut(of) {
            *one = S::ONE;
        }
        self.gain(&self.seen(&unit)).0
    }

    /// The variance of each coefficient.
    #[inline(never)]
    pub(super) fn variances(&self) -> Coefficients<S> {
        let mut variances = [S::ZERO; N];
        for j in 0..N {
            for i in 0..j {
                variances[i] = variances[i] + self.factor[j][i] * self.factor[j][i] * self.factor[j][j];
            }
            variances[j] = variances[j] + self.factor[j][j];
        }
        variances
    }

    /// Looks at the variances before a stretch is learnt from, whose rows share what they lack of the prior.
    #[inline(never)]
    pub(super) fn look(&mut self, prior: &Coefficients<S>) {
        let variances = self.variances();
        for j in 0..N {
            self.room[j] = (prior[j] - variances[j]).max(S::ZERO) * S::from_f64(1.0 / N as f64);
        }
    }

    /// Forgets along a row. `drift` is κ.
    #[inline(never)]
    pub(super) fn forget(&mut self, prior: &Coefficients<S>, drift: S, row: &Coefficients<S>) {
        let (mut along, mut at_first) = ([S::ZERO; N], S::ZERO);
        for j in 0..N {
            along[j] = prior[j] * row[j];
            at_first = at_first + along[j] * row[j];
        }
        let mut c = drift.over(at_first.max(S::from_f64(1e-12)));
        for j in 0..N {
            let square = along[j] * along[j];
            if c * square > self.room[j] {
                c = self.room[j].over(square);
            }
        }
        // Agee and Turner's rank-one update.
        for j in (0..N).rev() {
            let (old, at) = (self.factor[j][j], along[j]);
            let new = old + c * at * at;
            let share = new.recip();
            let slope = c * at * share;
            self.factor[j][j] = new;
            c = c * old * share;
            for i in 0..j {
                along[i] = along[i] - at * self.factor[j][i];
                self.factor[j][i] = self.factor[j][i] + slope * along[i];
            }
        }
    }

    /// Learns from a row whose value has variance 1.
    #[inline(never)]
    pub(super) fn learn(&mut self, row: &Coefficients<S>, value: S) -> Told<S> {
        let seen = self.seen(row);
        let (gain, spread) = self.gain(&seen);
        let total = S::ONE + spread;
        let limit = S::from_f64(LARGEST_INNOVATION) * total.sqrt();
        let innovation = (value - dot(row, &self.value)).clamp(-limit, limit);
        let step = innovation.over(total);
        for j in 0..N {
            self.value[j] = self.value[j] + gain[j] * step;
        }
        // Bierman's update.
        let mut before = S::ONE;
        let mut partial = [S::ZERO; N];
        for j in 0..N {
            let scaled = self.factor[j][j] * seen[j];
            let after = before + seen[j] * scaled;
            let slope = -seen[j].over(before);
            self.factor[j][j] = (self.factor[j][j] * before).over(after);
            for i in 0..j {
                let old = self.factor[j][i];
                self.factor[j][i] = old + partial[i] * slope;
                partial[i] = partial[i] + old * scaled;
            }
            partial[j] = scaled;
            before = after;
        }
        Told { surprise: innovation * step, spread }
    }
}
