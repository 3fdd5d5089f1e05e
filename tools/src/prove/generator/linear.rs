//! Small linear least squares: the projection that sizes an effect and computes its class.

use nalgebra::{DMatrix, DVector};

/// An orthonormal basis of the columns' span, columns that add nothing dropped.
#[derive(Debug, Clone)]
pub struct Span {
    basis: Vec<DVector<f64>>,
}

impl Span {
    /// The span of `columns`, by Gram–Schmidt with one repeat.
    pub fn new(columns: &[Vec<f64>]) -> Self {
        let mut span = Self { basis: Vec::new() };
        columns.iter().for_each(|c| span.add(c));
        span
    }

    /// Adds a column, unless all but 1e-9 of it lies in the span.
    pub fn add(&mut self, column: &[f64]) {
        let column = DVector::from_column_slice(column);
        let mut left = self.project_out(self.project_out(column.clone()));
        let norm = left.norm();
        if norm > 1e-9 * column.norm() {
            left /= norm;
            self.basis.push(left);
        }
    }

    fn project_out(&self, mut x: DVector<f64>) -> DVector<f64> {
        for b in &self.basis {
            let dot = b.dot(&x);
            x.axpy(-dot, b, 1.0);
        }
        x
    }

    /// What of `y` lies outside the span.
    pub fn residual(&self, y: &[f64]) -> Vec<f64> {
        self.project_out(DVector::from_column_slice(y)).as_slice().to_vec()
    }
}

/// What of `y` lies outside the span of `columns`.
pub fn residual(columns: &[Vec<f64>], y: &[f64]) -> Vec<f64> {
    Span::new(columns).residual(y)
}

/// The weights of `columns` that fit `y` best, by QR of the scaled columns.
pub fn weights(columns: &[Vec<f64>], y: &[f64]) -> Vec<f64> {
    let norms: Vec<f64> = columns.iter().map(|c| c.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-300)).collect();
    let matrix = DMatrix::from_fn(y.len(), columns.len(), |i, k| columns[k][i] / norms[k]);
    let svd = matrix.svd(true, true);
    let solution = svd.solve(&DVector::from_column_slice(y), 1e-10).unwrap_or_else(|_| DVector::zeros(columns.len()));
    solution.iter().zip(norms).map(|(x, n)| x / n).collect()
}

/// A whitening filter: x_k − Σ a_i x_{k−i}, over σ.
#[derive(Debug, Clone)]
pub struct Whitener {
    coefficients: Vec<f64>,
    sigma: f64,
}

impl Whitener {
    /// Fits an autoregression of `order` to `noise` by Levinson's recursion, outliers clipped at five deviations.
    pub fn fit(noise: &[f64], order: usize) -> Self {
        let mut sorted: Vec<f64> = noise.iter().map(|x| x.abs()).collect();
        sorted.sort_by(f64::total_cmp);
        let limit = (5.0 * 1.4826 * sorted[sorted.len() / 2]).max(1e-12);
        let x: Vec<f64> = noise.iter().map(|x| x.clamp(-limit, limit)).collect();
        let n = x.len();
        let r: Vec<f64> =
            (0..=order).map(|k| x[k..].iter().zip(&x).map(|(a, b)| a * b).sum::<f64>() / n as f64).collect();
        let mut a: Vec<f64> = Vec::new();
        let mut error = r[0] * (1.0 + 1e-9);
        for k in 1..=order {
            let reflection = (r[k] - a.iter().enumerate().map(|(i, a)| a * r[k - 1 - i]).sum::<f64>()) / error;
            let old = a.clone();
            a.iter_mut().enumerate().for_each(|(i, x)| *x -= reflection * old[k - 2 - i]);
            a.push(reflection);
            error *= 1.0 - reflection * reflection;
        }
        Self { coefficients: a, sigma: error.sqrt() }
    }

    /// `x` whitened and in units of σ; as many leading rows as the filter is long are dropped.
    pub fn apply(&self, x: &[f64]) -> Vec<f64> {
        let p = self.coefficients.len();
        (p..x.len())
            .map(|i| {
                (x[i] - self.coefficients.iter().enumerate().map(|(k, a)| a * x[i - 1 - k]).sum::<f64>()) / self.sigma
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prove::generator::rng::Rng;

    #[test]
    fn whitener_whitens_and_scales_to_one() {
        let mut rng = Rng::new(3);
        let mut x = vec![0.0_f64; 20_000];
        for i in 1..x.len() {
            x[i] = 0.95 * x[i - 1] + 0.2 * rng.normal();
        }
        let w = Whitener::fit(&x, 8).apply(&x);
        let power = w.iter().map(|x| x * x).sum::<f64>() / w.len() as f64;
        let lag = w.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / w.len() as f64;
        assert!((power - 1.0).abs() < 0.03 && lag.abs() < 0.03, "{power} {lag}");
    }

    #[test]
    fn weights_are_those_of_the_exact_line() {
        let x: Vec<f64> = (0..50).map(f64::from).collect();
        let y: Vec<f64> = x.iter().map(|x| 3.0 + 2.0 * x).collect();
        let w = weights(&[vec![1.0; 50], x.clone()], &y);
        assert!((w[0] - 3.0).abs() < 1e-9 && (w[1] - 2.0).abs() < 1e-9);
        assert!(residual(&[vec![1.0; 50], x], &y).iter().all(|r| r.abs() < 1e-9));
    }
}
