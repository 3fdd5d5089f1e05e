//! What a pass over the recordings leaves: a triangular factor for each block of each recording, and their sums.
//!
//! Factors of disjoint rows add up, so leaving blocks or whole recordings out costs no further pass.

use crate::numerics::bounded;
use crate::numerics::qr::Triangle;
use crate::regression::problem::Linear;

/// The factors of one pass: recording by recording, block by block. Columns: the recording's nuisances, the gear's, derivatives, torque.
#[derive(Debug, Clone)]
pub struct Factors {
    pub(crate) nuisances: usize,
    pub(crate) gear: usize,
    pub(crate) derivatives: usize,
    pub(crate) triangles: Vec<Vec<(Triangle, usize)>>,
}

/// Factors put together, the nuisances eliminated.
#[derive(Debug, Clone)]
pub struct System {
    /// The gear's columns, derivatives, torque.
    pub shared: Triangle,
    /// Norms of the gear's columns and the derivatives before the nuisances were eliminated.
    pub norms: Vec<f64>,
    /// Rows that count.
    pub rows: usize,
    /// Nuisances that could be told apart, all recordings together.
    pub nuisances: usize,
    parts: Vec<(Vec<usize>, Triangle)>,
    widths: (usize, usize, usize),
}

impl Factors {
    /// Puts together the blocks (recording, block) that `keep` names.
    pub fn combine(&self, keep: impl Fn(usize, usize) -> bool) -> System {
        let shared_columns = self.gear + self.derivatives + 1;
        let mut shared = Triangle::new(shared_columns);
        let (mut rows, mut nuisances) = (0, 0);
        let mut parts = Vec::with_capacity(self.triangles.len());
        let mut squares = vec![0.0; shared_columns - 1];
        for (recording, blocks) in self.triangles.iter().enumerate() {
            let mut whole = Triangle::new(self.nuisances + shared_columns);
            for (fold, (triangle, counted)) in blocks.iter().enumerate() {
                if keep(recording, fold) {
                    whole.merge(triangle);
                    rows += counted;
                }
            }
            let told_apart =
                |whole: &Triangle, count: usize| (0..count).find(|&j| whole.get(j, j).abs() <= 1e-9 * whole.norm(j));
            let mut kept: Vec<usize> = (0..self.nuisances).collect();
            while let Some(j) = told_apart(&whole, kept.len()) {
                kept.remove(j);
                let rest: Vec<usize> = (0..whole.columns()).filter(|&c| c != j).collect();
                whole = whole.select(&rest);
            }
            shared.merge(&whole.tail(kept.len()));
            squares.iter_mut().enumerate().for_each(|(j, s)| *s += whole.norm(kept.len() + j).powi(2));
            nuisances += kept.len();
            parts.push((kept, whole));
        }
        let norms: Vec<f64> = squares.into_iter().map(f64::sqrt).collect();
        for (j, norm) in norms.iter().enumerate() {
            // What the nuisances leave of such a column is rounding.
            if shared.norm(j) <= 1e-9 * norm {
                shared.clear(j);
            }
        }
        System { shared, norms, rows, nuisances, parts, widths: (self.nuisances, self.gear, self.derivatives) }
    }

    /// Squared error and number of rows of one block under given parameters; `step` moves the nonlinear ones along the derivatives.
    pub fn squared_error(&self, recording: usize, fold: usize, linear: &Linear, step: &[f64]) -> (f64, usize) {
        let (triangle, rows) = &self.triangles[recording][fold];
        let mut x: Vec<f64> = linear.recordings[recording].clone();
        x.extend(&linear.gear);
        x.extend((0..self.derivatives).map(|k| step.get(k).copied().unwrap_or(0.0)));
        x.push(-1.0);
        (triangle.squared_norm_of_product(&x), *rows)
    }

    /// For each block the products of the columns with the residual, the nuisances eliminated: JᵀR of the gear's columns and derivatives.
    pub fn scores(&self, system: &System, linear: &Linear) -> Vec<Vec<f64>> {
        let mut scores = Vec::new();
        for (recording, blocks) in self.triangles.iter().enumerate() {
            let (kept, whole) = &system.parts[recording];
            let mut x: Vec<f64> = linear.recordings[recording].iter().chain(&linear.gear).map(|b| -b).collect();
            x.resize(self.nuisances + self.gear + self.derivatives, 0.0);
            x.push(1.0);
            for (triangle, _) in blocks {
                let all = triangle.products(&x);
                let own: Vec<f64> = kept.iter().map(|&j| all[j]).collect();
                // Each column less its projection on the nuisances.
                let weights = bounded::forward_substitute(whole, kept.len(), &own);
                let shared = (0..self.gear + self.derivatives).map(|j| {
                    let on: f64 = weights.iter().enumerate().map(|(i, w)| w * whole.get(i, kept.len() + j)).sum();
                    all[self.nuisances + j] - on
                });
                scores.push(shared.collect());
            }
        }
        scores
    }

    /// Blocks a recording.
    pub fn folds(&self) -> usize {
        self.triangles.first().map_or(0, Vec::len)
    }

    /// Number of recordings.
    pub fn recordings(&self) -> usize {
        self.triangles.len()
    }
}

impl System {
    /// ln det XᵀX of the columns that are not held at a bound, the nuisances among them. Without derivatives.
    pub fn log_determinant(&self, at_bound: &[bool]) -> f64 {
        let log = |value: f64| if value == 0.0 { 0.0 } else { 2.0 * value.abs().ln() };
        let nuisances: f64 =
            self.parts.iter().flat_map(|(kept, whole)| (0..kept.len()).map(|j| log(whole.get(j, j)))).sum();
        let free: Vec<usize> = (0..at_bound.len()).filter(|&j| !at_bound[j]).collect();
        let gear = self.shared.select(&free);
        nuisances + (0..free.len()).map(|j| log(gear.get(j, j))).sum::<f64>()
    }

    /// The nuisances of each recording that belong to the given coefficients of the gear (followed by steps of the derivatives, if any).
    pub fn linear(&self, shared: &[f64]) -> Linear {
        let (nuisances, gear, derivatives) = self.widths;
        let mut shared_all = shared.to_vec();
        shared_all.resize(gear + derivatives, 0.0);
        let recordings = self
            .parts
            .iter()
            .map(|(kept, whole)| {
                let count = kept.len();
                let last = whole.columns() - 1;
                let rhs: Vec<f64> = (0..count)
                    .map(|i| {
                        let known: f64 = shared_all.iter().enumerate().map(|(j, b)| whole.get(i, count + j) * b).sum();
                        whole.get(i, last) - known
                    })
                    .collect();
                let mut all = vec![0.0; nuisances];
                for (&j, value) in kept.iter().zip(bounded::back_substitute(whole, count, &rhs)) {
                    all[j] = value;
                }
                all
            })
            .collect();
        Linear { gear: shared_all[..gear].to_vec(), recordings }
    }
}
