//! How the parameters of a fit scatter: by the noise, and by what else is unsure.

use nalgebra::{DMatrix, DVector};

use crate::numerics::autoregression::Noise;
use crate::numerics::svd::Singular;
use crate::regression::problem::{Linear, Problem, Sweep, Tangent};
use crate::regression::uncertainty::SINGULAR;

/// Covariance with the directions that the data leave open.
pub struct Spread {
    /// Its `known` is a factor of the covariance over `variance`.
    directions: Singular,
    variance: f64,
}

/// Blocks into which the recordings are cut, all together, where the noise has no model.
const SCORES: usize = 32;

impl Spread {
    /// The spread of those columns of a fitted problem (the gear's linear parameters, then the nonlinear ones) that are `free`.
    ///
    /// Against a noise model: σ²(JᵀJ)⁻¹ of the filtered rows. Without: (JᵀJ)⁻¹ (Σ g gᵀ) (JᵀJ)⁻¹ with the scores g = Jᵀr of contiguous blocks, which holds whatever
    /// the residual is made of (Liang, Zeger, *Biometrika* 73, 1986).
    pub fn of(
        problem: &Problem<'_>,
        nonlinear: &[f64],
        linear: &Linear,
        noise: Option<&[Noise]>,
        free: &[usize],
    ) -> Self {
        let folds = if noise.is_some() { 1 } else { SCORES.div_ceil(problem.rows.len()).max(2) };
        let all: Vec<usize> = (0..nonlinear.len()).collect();
        let tangent = Tangent { parameters: &all, linear };
        let factors = problem.factor(nonlinear, Some(tangent), Sweep { noise, folds, stride: 1 });
        let system = factors.combine(|_, _| true);
        let mut at = linear.gear.clone();
        at.resize(linear.gear.len() + nonlinear.len(), 0.0);
        at.push(-1.0);
        let rss = system.shared.squared_norm_of_product(&at);
        let torque = system.shared.columns() - 1;
        let chosen: Vec<usize> = free.iter().copied().chain([torque]).collect();
        let norms: Vec<f64> = free.iter().map(|&k| system.norms[k]).collect();
        let mut directions = Singular::of(&system.shared.select(&chosen), &norms, SINGULAR);
        let freedom = system.rows.saturating_sub(free.len() + system.nuisances).max(1);
        let mut variance = rss / freedom as f64;
        if noise.is_none() {
            let scores = factors.scores(&system, linear);
            let scaled = DMatrix::from_fn(free.len(), scores.len(), |i, b| scores[b][free[i]] * directions.scale[i]);
            directions.known = &directions.known * directions.known.tr_mul(&scaled);
            variance = scores.len() as f64 / (scores.len() - 1) as f64;
        }
        Self { directions, variance }
    }

    /// Adds what is uncertain beside the noise: its scores, one a column, whose outer products add up to their covariance.
    pub fn widen(&mut self, scores: &DMatrix<f64>) {
        let Singular { known, scale, .. } = &mut self.directions;
        let scaled = DMatrix::from_fn(scores.nrows(), scores.ncols(), |i, j| scores[(i, j)] * scale[i]);
        let moves = &*known * known.tr_mul(&scaled);
        let of_noise = &*known * self.variance.sqrt();
        let columns: Vec<_> = of_noise.column_iter().chain(moves.column_iter()).collect();
        *known = DMatrix::from_columns(&columns);
        self.variance = 1.0;
    }

    /// A combination of parameters; `None` where the data leave it open.
    pub fn direction(&self, gradient: &DVector<f64>) -> Option<DVector<f64>> {
        self.directions.direction(gradient)
    }

    /// The standard deviation of a combination along its [direction](Self::direction).
    pub fn sd(&self, direction: &DVector<f64>) -> f64 {
        direction.norm() * self.variance.sqrt()
    }
}
