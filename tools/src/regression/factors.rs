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
    /// Nuisances that the rows determine, all recordings together.
    pub nuisances: usize,
    parts: Vec<(Vec<usize>, Triangle)>,
    widths: (usize, usize, usize),
}

/// What recordings say of the parameters that they share, the nuisances of each eliminated. Those of disjoint recordings add up.
#[derive(Debug, Clone)]
pub struct Shared {
    triangle: Triangle,
    /// Squared norms of the columns before the nuisances were eliminated.
    squares: Vec<f64>,
    /// Rows that count.
    pub rows: usize,
    /// Nuisances that the rows determine.
    pub nuisances: usize,
    /// ln det of the nuisances' part of XᵀX.
    log_nuisances: f64,
}

impl Shared {
    /// Of no recording.
    fn nothing(columns: usize) -> Self {
        Self {
            triangle: Triangle::new(columns),
            squares: vec![0.0; columns - 1],
            rows: 0,
            nuisances: 0,
            log_nuisances: 0.0,
        }
    }

    fn add(&mut self, other: &Self) {
        self.triangle.merge(&other.triangle);
        self.squares.iter_mut().zip(&other.squares).for_each(|(own, other)| *own += other);
        self.rows += other.rows;
        self.nuisances += other.nuisances;
        self.log_nuisances += other.log_nuisances;
    }

    /// Both together.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        let mut sum = self.clone();
        sum.add(other);
        sum
    }

    /// Visits each part beside the sum of all others: what a visit returns takes the place of the part for those after it. Only one part at a time differs, so the others are added up
    /// once.
    pub fn each_beside_others(parts: &[Self], mut visit: impl FnMut(usize, &Self) -> Self) {
        let Some(first) = parts.first() else { return };
        let mut before = Self::nothing(first.triangle.columns());
        let mut after = vec![before.clone()];
        for part in parts[1..].iter().rev() {
            after.push(after[after.len() - 1].with(part));
        }
        for (index, after) in after.iter().rev().enumerate() {
            let own = visit(index, &before.with(after));
            before.add(&own);
        }
    }

    /// ln det XᵀX of the columns that are not held at a bound, the nuisances among them. Without derivatives.
    pub fn log_determinant(&self, at_bound: &[bool]) -> f64 {
        self.log_nuisances + log_determinant(&self.factor().0, at_bound)
    }

    /// The factor of the gear's columns, derivatives and torque, and the norms of all but the last before the nuisances were eliminated.
    pub fn factor(&self) -> (Triangle, Vec<f64>) {
        let mut triangle = self.triangle.clone();
        let norms: Vec<f64> = self.squares.iter().map(|square| square.sqrt()).collect();
        for (j, norm) in norms.iter().enumerate() {
            // What the nuisances leave of such a column is rounding.
            if triangle.norm(j) <= 1e-9 * norm {
                triangle.clear(j);
            }
        }
        (triangle, norms)
    }
}

impl Factors {
    /// Puts together the blocks (recording, block) that `keep` names.
    pub fn combine(&self, keep: impl Fn(usize, usize) -> bool) -> System {
        let mut sum = Shared::nothing(self.gear + self.derivatives + 1);
        let mut parts = Vec::with_capacity(self.triangles.len());
        for recording in 0..self.triangles.len() {
            let (shared, kept, whole) = self.eliminated(recording, |fold| keep(recording, fold));
            sum.add(&shared);
            parts.push((kept, whole));
        }
        let (shared, norms) = sum.factor();
        let widths = (self.nuisances, self.gear, self.derivatives);
        System { shared, norms, rows: sum.rows, nuisances: sum.nuisances, parts, widths }
    }

    /// What the blocks of a recording that `keep` names say of the shared parameters.
    pub fn shared(&self, recording: usize, keep: impl Fn(usize) -> bool) -> Shared {
        self.eliminated(recording, keep).0
    }

    /// The same, with the nuisances that the rows determine and the factor with them.
    fn eliminated(&self, recording: usize, keep: impl Fn(usize) -> bool) -> (Shared, Vec<usize>, Triangle) {
        let shared_columns = self.gear + self.derivatives + 1;
        let mut whole = Triangle::new(self.nuisances + shared_columns);
        let mut rows = 0;
        for (fold, (triangle, counted)) in self.triangles[recording].iter().enumerate() {
            if keep(fold) {
                whole.merge(triangle);
                rows += counted;
            }
        }
        let dependent =
            |whole: &Triangle, count: usize| (0..count).find(|&j| whole.get(j, j).abs() <= 1e-9 * whole.norm(j));
        let mut kept: Vec<usize> = (0..self.nuisances).collect();
        while let Some(j) = dependent(&whole, kept.len()) {
            kept.remove(j);
            let rest: Vec<usize> = (0..whole.columns()).filter(|&c| c != j).collect();
            whole = whole.select(&rest);
        }
        let squares = (0..shared_columns - 1).map(|j| whole.norm(kept.len() + j).powi(2)).collect();
        let log_nuisances = (0..kept.len()).map(|j| log_square(whole.get(j, j))).sum();
        let triangle = whole.tail(kept.len());
        let shared = Shared { triangle, squares, rows, nuisances: kept.len(), log_nuisances };
        (shared, kept, whole)
    }

    /// Squared error and number of rows of one block under given parameters; `step` moves the nonlinear ones along the derivatives.
    pub fn squared_error(
        &self,
        recording: usize,
        fold: usize,
        nuisances: &[f64],
        gear: &[f64],
        step: &[f64],
    ) -> (f64, usize) {
        let (triangle, rows) = &self.triangles[recording][fold];
        let mut x: Vec<f64> = nuisances.iter().chain(gear).copied().collect();
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
    /// The nuisances of each recording that belong to the given coefficients of the gear (followed by steps of the derivatives, if any).
    pub fn linear(&self, shared: &[f64]) -> Linear {
        let recordings = (0..self.parts.len()).map(|recording| self.nuisances_of(recording, shared)).collect();
        let gear = (0..self.widths.1).map(|j| shared.get(j).copied().unwrap_or(0.0)).collect();
        Linear { gear, recordings }
    }

    /// Those of one recording.
    pub fn nuisances_of(&self, recording: usize, shared: &[f64]) -> Vec<f64> {
        let (kept, whole) = &self.parts[recording];
        let (count, last) = (kept.len(), whole.columns() - 1);
        let of_row = |i: usize| {
            let known: f64 = shared.iter().enumerate().map(|(j, b)| whole.get(i, count + j) * b).sum();
            whole.get(i, last) - known
        };
        let rhs: Vec<f64> = (0..count).map(of_row).collect();
        let mut all = vec![0.0; self.widths.0];
        for (&j, value) in kept.iter().zip(bounded::back_substitute(whole, count, &rhs)) {
            all[j] = value;
        }
        all
    }
}

/// ln x², 0 where x is.
fn log_square(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { 2.0 * x.abs().ln() }
}

/// ln det XᵀX of the columns of a factor that are not held at a bound.
fn log_determinant(factor: &Triangle, at_bound: &[bool]) -> f64 {
    let free: Vec<usize> = (0..at_bound.len()).filter(|&j| !at_bound[j]).collect();
    let factor = factor.select(&free);
    (0..free.len()).map(|j| log_square(factor.get(j, j))).sum()
}
