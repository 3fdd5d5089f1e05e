//! The directions that a triangular factor tells apart, its columns scaled.

use nalgebra::{DMatrix, DVector};

use crate::numerics::qr::Triangle;

/// Singular directions of the columns of a factor, its last one left out.
pub struct Singular {
    /// What each column is multiplied by.
    pub scale: DVector<f64>,
    /// V·Σ⁻¹ of the directions that the rows determine: a factor of the inverse Gram matrix.
    pub known: DMatrix<f64>,
    /// The directions that are not.
    pub open: DMatrix<f64>,
    /// Uᵀ of the directions that the rows determine.
    left: DMatrix<f64>,
}

impl Singular {
    /// The columns are measured in `norms`. Directions with a singular value above `tolerance` of the largest are determined; none of a factor that holds what is
    /// no number.
    pub fn of(factor: &Triangle, norms: &[f64], tolerance: f64) -> Self {
        let count = norms.len();
        let scale = DVector::from_fn(count, |j, _| if factor.norm(j) > 0.0 { norms[j].recip() } else { 0.0 });
        let scaled = DMatrix::from_fn(count, count, |i, j| if j >= i { factor.get(i, j) * scale[j] } else { 0.0 });
        let empty = || DMatrix::zeros(count, count);
        let sound = count > 0 && scaled.iter().all(|x| x.is_finite());
        let decomposed = || scaled.try_svd(true, true, SETTLED, ROUNDS * count);
        let (u, values, directions) = match sound.then(decomposed).flatten() {
            Some(svd) => (svd.u.unwrap_or_else(empty), svd.singular_values, svd.v_t.unwrap_or_else(empty)),
            None => (empty(), DVector::zeros(count), empty()),
        };
        let largest = values.iter().copied().fold(0.0, f64::max);
        let is_open = |i: usize| values[i] <= tolerance * largest;
        let pick = |open: bool| -> Vec<usize> { (0..count).filter(|&i| is_open(i) == open).collect() };
        let (known, open) = (pick(false), pick(true));
        Self {
            known: DMatrix::from_fn(count, known.len(), |j, i| directions[(known[i], j)] / values[known[i]]),
            open: DMatrix::from_fn(count, open.len(), |j, i| directions[(open[i], j)]),
            left: DMatrix::from_fn(known.len(), count, |i, j| u[(j, known[i])]),
            scale,
        }
    }

    /// The least-squares coefficients against the factor's last column; directions that are not determined get none.
    pub fn solve(&self, factor: &Triangle) -> Vec<f64> {
        let count = factor.columns() - 1;
        let right = DVector::from_fn(count, |i, _| factor.get(i, count));
        let scaled = &self.known * (&self.left * right);
        scaled.iter().zip(&self.scale).map(|(x, s)| x * s).collect()
    }

    /// A combination of coefficients, whose norm is its standard deviation for unit noise; `None` where the rows leave it open.
    pub fn direction(&self, gradient: &DVector<f64>) -> Option<DVector<f64>> {
        if gradient.iter().zip(&self.scale).any(|(g, s)| *g != 0.0 && *s == 0.0) {
            return None;
        }
        let scaled = gradient.component_mul(&self.scale);
        let leak = self.open.tr_mul(&scaled).norm();
        (leak <= LEAK * scaled.norm()).then(|| self.known.tr_mul(&scaled))
    }
}

/// What of an off-diagonal element beside its neighbours counts as nothing.
const SETTLED: f64 = 5.0 * f64::EPSILON;

/// Sweeps a column at most; two or three are usual.
const ROUNDS: usize = 100;

/// A combination with more than this share of its length in an open direction is open.
const LEAK: f64 = 1e-4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::bounded::factor_of_rows;

    #[test]
    fn what_two_columns_share_is_split_between_them_and_has_no_standard_deviation() {
        let row = |k: i32| {
            let (x, z) = (f64::from(k), f64::from(k * k % 5));
            vec![x, 2.0 * x, z, 3.0 * x - 2.0 * z]
        };
        let factor = factor_of_rows(&(1..9).map(row).collect::<Vec<_>>());
        let norms = [factor.norm(0), factor.norm(1), factor.norm(2)];
        let singular = Singular::of(&factor, &norms, 1e-7);
        let found = singular.solve(&factor);
        for (found, expected) in found.iter().zip([1.5, 0.75, -2.0]) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        let unit = |j: usize| DVector::from_fn(3, |i, _| if i == j { 1.0 } else { 0.0 });
        assert!(singular.direction(&unit(0)).is_none() && singular.direction(&unit(1)).is_none());
        assert!(singular.direction(&unit(2)).is_some());
        assert!(singular.direction(&(unit(0) + 2.0 * unit(1))).is_some());
    }
    #[test]
    fn of_what_is_no_number_nothing_is_told_apart() {
        let factor =
            factor_of_rows(&[vec![1.0, 2.0, f64::NAN, 1.0], vec![0.0, 1.0, 3.0, 2.0], vec![1.0, 0.0, 1.0, 0.0]]);
        let singular = Singular::of(&factor, &[1.0; 3], 1e-7);
        assert_eq!((singular.known.ncols(), singular.solve(&factor)), (0, vec![0.0; 3]));
    }
}
