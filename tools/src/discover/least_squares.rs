//! Least squares against coloured noise: whiten, project, and the likelihood with the noise fitted anew.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::estimate::columns::Mark;
use crate::estimate::noise::{Noise, runs};

/// Marks and spans of the rows that are fitted together.
#[derive(Clone, Copy)]
pub struct Layout<'a> {
    /// The rows of each recording.
    pub spans: &'a [Range<usize>],
    /// What each row is used for.
    pub marks: &'a [Vec<Mark>],
}

/// An orthonormal basis of whitened columns; at first the span of nothing.
#[derive(Default)]
pub struct Basis {
    columns: Vec<Vec<f64>>,
}

/// What is left of a column whose share below this is in the span of others already.
const DEPENDENT: f64 = 1e-5;

/// Σ a·b.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    crate::estimate::triangle::dot(a, b)
}

impl Basis {
    /// Takes a column in; false where it is in the span already.
    pub fn add(&mut self, column: &[f64]) -> bool {
        let before = dot(column, column).sqrt();
        let mut rest = column.to_vec();
        // Twice is enough (Kahan, Parlett).
        self.reduce(&mut rest);
        self.reduce(&mut rest);
        let after = dot(&rest, &rest).sqrt();
        if after.is_nan() || after <= DEPENDENT * before || before == 0.0 {
            return false;
        }
        rest.iter_mut().for_each(|x| *x /= after);
        self.columns.push(rest);
        true
    }

    /// Takes the span out of a column.
    pub fn reduce(&self, column: &mut [f64]) {
        for q in &self.columns {
            let share = dot(q, column);
            column.iter_mut().zip(q).for_each(|(x, q)| *x -= share * q);
        }
    }

    /// How much of the squared length of `y`, which has nothing in this basis, the columns explain beyond it, and by how many of them.
    pub fn gain(&self, columns: &[Vec<f64>], y: &[f64]) -> (f64, usize) {
        let mut own = Self::default();
        for column in columns {
            let before = dot(column, column).sqrt();
            let mut rest = column.clone();
            self.reduce(&mut rest);
            self.reduce(&mut rest);
            if dot(&rest, &rest).sqrt() > DEPENDENT * before {
                own.add(&rest);
            }
        }
        (own.columns.iter().map(|q| dot(q, y).powi(2)).sum(), own.columns.len())
    }
}

impl Layout<'_> {
    /// A column as the noise filters leave it.
    pub fn whiten(&self, noise: &[Noise], column: &[f64]) -> Vec<f64> {
        let mut out = Vec::with_capacity(column.len());
        for ((span, marks), noise) in self.spans.iter().zip(self.marks).zip(noise) {
            noise.whiten(marks, &column[span.clone()], &mut out);
        }
        out
    }

    /// A column with the rows that do not count set to 0.
    pub fn masked(&self, column: &[f64]) -> Vec<f64> {
        let white: Vec<Noise> = self.spans.iter().map(|_| Noise::unit()).collect();
        self.whiten(&white, column)
    }

    /// The noise of each recording's residual.
    pub fn noise(&self, residual: &[f64], used_columns: usize) -> Vec<Noise> {
        let used = used_columns.div_ceil(self.spans.len());
        let of = |(span, marks): (&Range<usize>, &Vec<Mark>)| Noise::of_residual(&residual[span.clone()], marks, used);
        self.spans.iter().zip(self.marks).map(of).collect()
    }

    /// Rows that count, recording by recording.
    pub fn counted(&self) -> Vec<usize> {
        let counts = |marks: &Vec<Mark>| marks.iter().filter(|m| matches!(m, Mark::Used | Mark::First)).count();
        self.marks.iter().map(counts).collect()
    }

    /// −2 ln L of a residual whose noise is as given, without constants.
    pub fn minus_two_log_likelihood(&self, noise: &[Noise], residual: &[f64]) -> f64 {
        let white = self.whiten(noise, residual);
        let mut sum = dot(&white, &white);
        for ((noise, marks), counted) in noise.iter().zip(self.marks).zip(self.counted()) {
            sum +=
                2.0 * counted as f64 * noise.innovation_sd.max(1e-12).ln() + noise.log_determinant(runs(marks).len());
        }
        sum
    }

    /// [`profile`](Self::profile) from the given noise and from white noise, whichever ends better: a noise that has taken structure for colour holds on to it.
    pub fn best_profile(&self, columns: &[&[f64]], y: &[f64], from: &[Noise]) -> Profile {
        let white: Vec<Noise> = self.spans.iter().map(|_| Noise::unit()).collect();
        let (direct, fresh) = (self.profile(columns, y, from, 3), self.profile(columns, y, &white, 3));
        if fresh.minus_two_log_likelihood < direct.minus_two_log_likelihood { fresh } else { direct }
    }

    /// Fits columns to `y` with the colour of the noise fitted in turn. `from` is where the noise starts.
    pub fn profile(&self, columns: &[&[f64]], y: &[f64], from: &[Noise], rounds: usize) -> Profile {
        let mut noise = from.to_vec();
        let mut coefficients = Vec::new();
        let mut residual = y.to_vec();
        for _ in 0..rounds {
            let whitened: Vec<Vec<f64>> = columns.iter().map(|c| self.whiten(&noise, c)).collect();
            coefficients = solve(&whitened, &self.whiten(&noise, y));
            residual.copy_from_slice(y);
            for (column, weight) in columns.iter().zip(&coefficients) {
                residual.iter_mut().zip(*column).for_each(|(r, x)| *r -= weight * x);
            }
            noise = self.noise(&residual, 0);
        }
        let minus_two_log_likelihood = self.minus_two_log_likelihood(&noise, &residual);
        Profile { coefficients, noise, residual, minus_two_log_likelihood }
    }
}

/// A fit with its own noise.
pub struct Profile {
    /// The weight of each column.
    pub coefficients: Vec<f64>,
    /// The noise of each recording.
    pub noise: Vec<Noise>,
    /// What is left, not whitened.
    pub residual: Vec<f64>,
    /// −2 ln L.
    pub minus_two_log_likelihood: f64,
}

/// Columns scaled to unit length, their Gram matrix and the scales.
pub fn normal_matrix(columns: &[Vec<f64>]) -> (DMatrix<f64>, Vec<f64>) {
    let scales: Vec<f64> = columns.iter().map(|c| dot(c, c).sqrt().max(1e-150)).collect();
    let count = columns.len();
    let mut gram = DMatrix::zeros(count, count);
    for i in 0..count {
        for j in 0..=i {
            let value = dot(&columns[i], &columns[j]) / (scales[i] * scales[j]);
            gram[(i, j)] = value;
            gram[(j, i)] = value;
        }
    }
    (gram, scales)
}

/// Weights of least squares; directions that the columns do not tell apart get none.
pub fn solve(columns: &[Vec<f64>], y: &[f64]) -> Vec<f64> {
    if columns.is_empty() {
        return Vec::new();
    }
    let (gram, scales) = normal_matrix(columns);
    let rhs = DVector::from_iterator(columns.len(), columns.iter().zip(&scales).map(|(c, s)| dot(c, y) / s));
    let weights = pseudo_inverse(&gram) * rhs;
    weights.iter().zip(&scales).map(|(w, s)| w / s).collect()
}

/// Weights of least squares on some of the rows, those that these rows hardly tell held back by what all rows tell of them.
pub fn solve_held(columns: &[Vec<f64>], all: &[Vec<f64>], y: &[f64]) -> Vec<f64> {
    let scales: Vec<f64> = all.iter().map(|c| dot(c, c).sqrt().max(1e-150)).collect();
    let count = columns.len();
    let element = |i: usize, j: usize| dot(&columns[i], &columns[j]) / (scales[i] * scales[j]);
    let mut gram = DMatrix::from_fn(count, count, |i, j| if i <= j { element(i, j) } else { 0.0 });
    gram.fill_lower_triangle_with_upper_triangle();
    (0..count).for_each(|i| gram[(i, i)] += HELD);
    let rhs = DVector::from_iterator(count, columns.iter().zip(&scales).map(|(c, s)| dot(c, y) / s));
    let weights = pseudo_inverse(&gram) * rhs;
    weights.iter().zip(&scales).map(|(w, s)| w / s).collect()
}

/// How much the rows left out count in [`solve_held`].
const HELD: f64 = 1e-4;

/// Steps of least squares that none of the lower bounds forbids, one for each damping (Levenberg, Marquardt): a weight that would pass its bound is put on it
/// and the others are solved anew.
pub fn bounded_steps(columns: &[Vec<f64>], y: &[f64], lowest: &[f64], damping: &[f64]) -> Vec<Vec<f64>> {
    let (gram, scales) = normal_matrix(columns);
    let rhs: Vec<f64> = columns.iter().zip(&scales).map(|(c, s)| dot(c, y) / s).collect();
    damping.iter().map(|&damping| bounded_step(&gram, &scales, &rhs, lowest, damping)).collect()
}

fn bounded_step(gram: &DMatrix<f64>, scales: &[f64], rhs: &[f64], lowest: &[f64], damping: f64) -> Vec<f64> {
    let count = rhs.len();
    let mut step = vec![0.0; count];
    let mut held = vec![false; count];
    loop {
        let free: Vec<usize> = (0..count).filter(|&i| !held[i]).collect();
        let known = |i: usize| (0..count).filter(|&j| held[j]).map(|j| gram[(i, j)] * step[j]).sum::<f64>();
        let right = DVector::from_iterator(free.len(), free.iter().map(|&i| rhs[i] - known(i)));
        let eigen = gram.select_rows(&free).select_columns(&free).symmetric_eigen();
        let turned = eigen.eigenvectors.transpose() * right;
        let share = |t: f64, v: f64| if v + damping > 1e-12 { t / (v + damping) } else { 0.0 };
        let solved = &eigen.eigenvectors * turned.zip_map(&eigen.eigenvalues, share);
        for (&i, value) in free.iter().zip(solved.iter()) {
            step[i] = *value;
        }
        let forbidden: Vec<usize> = free.into_iter().filter(|&i| step[i] < lowest[i] * scales[i] - 1e-12).collect();
        if forbidden.is_empty() {
            break;
        }
        for i in forbidden {
            held[i] = true;
            step[i] = lowest[i] * scales[i];
        }
    }
    step.iter().zip(scales).map(|(w, s)| w / s).collect()
}

/// The inverse of a Gram matrix on the directions that it tells apart.
pub fn pseudo_inverse(gram: &DMatrix<f64>) -> DMatrix<f64> {
    if gram.is_empty() {
        return gram.clone();
    }
    let eigen = gram.clone().symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    let inverted = eigen.eigenvalues.map(|v| if v > 1e-11 * largest { v.recip() } else { 0.0 });
    &eigen.eigenvectors * DMatrix::from_diagonal(&inverted) * eigen.eigenvectors.transpose()
}
