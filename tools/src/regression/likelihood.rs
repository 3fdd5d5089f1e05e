//! Fits of columns that stand ready, and their likelihood with the noise fitted in turn.
//!
//! The comparison of models asks for the likelihood, so the noise is that of the residual as it is; the uncertainty of parameters is another question, see
//! [`uncertainty`](crate::regression::uncertainty).

use std::borrow::Cow;
use std::ops::Range;

use nalgebra::DVector;

use crate::numerics::autoregression::{Noise, runs};
use crate::numerics::bounded;
use crate::numerics::bounded::Bound;
use crate::numerics::mark::Mark;
use crate::numerics::svd::Singular;
use crate::numerics::vector::dot;
use crate::recording::Recording;
use crate::regression::columns::Column;
use crate::regression::factors::System;
use crate::regression::heldout::{Blocks, FOLDS};
use crate::regression::problem::{Linear, Problem, Sweep};
use crate::regression::ready::Ready;
use crate::regression::rows::{Past, Rows};
use crate::regression::uncertainty::SINGULAR;

/// Rows of several recordings in one line.
#[derive(Clone, Copy)]
pub struct Layout<'a> {
    /// The recordings.
    pub recordings: &'a [Cow<'a, Recording>],
    /// The rows of each recording.
    pub spans: &'a [Range<usize>],
    /// What each row is used for.
    pub marks: &'a [Vec<Mark>],
    /// What each recording adds that is no property of the gear: as many columns of the whole line for each, recording after recording.
    pub nuisances: &'a [Vec<f64>],
}

/// Directions of columns that these rows determine have a singular value above this share of the largest.
const DETERMINED: f64 = 3e-6;

/// Columns beside a fit leave so many times its squares at most.
const TRADED: f64 = 1.1;

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
        self.whiten(&self.white(), column)
    }

    /// The squares of the rows of a column that count.
    pub fn squares(&self, column: &[f64]) -> f64 {
        let of = |(span, marks): (&Range<usize>, &Vec<Mark>)| -> f64 {
            let own = column[span.clone()].iter().zip(marks);
            own.filter(|(_, mark)| mark.counts()).map(|(x, _)| x * x).sum()
        };
        self.spans.iter().zip(self.marks).map(of).sum()
    }

    /// White noise of standard deviation 1.
    pub fn white(&self) -> Vec<Noise> {
        self.spans.iter().map(|_| Noise::unit()).collect()
    }

    /// The noise of each recording's residual.
    pub fn noise(&self, residual: &[f64], used_columns: usize) -> Vec<Noise> {
        let used = used_columns.div_ceil(self.spans.len());
        let of = |(span, marks): (&Range<usize>, &Vec<Mark>)| {
            Noise::of_residual(&residual[span.clone()], marks, used).in_units_of_itself()
        };
        self.spans.iter().zip(self.marks).map(of).collect()
    }

    /// Rows that count, recording by recording.
    pub fn counted(&self) -> Vec<usize> {
        let counts = |marks: &Vec<Mark>| marks.iter().filter(|mark| mark.counts()).count();
        self.marks.iter().map(counts).collect()
    }

    /// −2 ln L of a residual whose noise is as given, without constants. Rows behind an outlier, of which the filter needs as many as the noise has orders, count with the square that they are
    /// expected to have: 1.
    pub fn minus_two_log_likelihood(&self, noise: &[Noise], residual: &[f64]) -> f64 {
        let white = self.whiten(noise, residual);
        let mut sum = dot(&white, &white);
        for ((noise, marks), counted) in noise.iter().zip(self.marks).zip(self.counted()) {
            sum += 2.0 * counted as f64 * noise.innovation_sd.max(1e-12).ln()
                + noise.log_determinant(runs(marks).len())
                + noise.unfiltered(marks) as f64;
        }
        sum
    }

    /// The factor of columns and `y` against the noise, the nuisances of each recording eliminated.
    pub fn system(&self, columns: &[&[f64]], y: &[f64], noise: &[Noise]) -> System {
        self.with_problem(columns, y, |problem| Self::factored(problem, noise))
    }

    /// A line with the nuisances of each recording taken out as the noise asks, and the squares of it that are left, filtered.
    pub fn without_nuisances(&self, noise: &[Noise], y: &[f64]) -> (Vec<f64>, f64) {
        self.with_problem(&[], y, |problem| {
            let system = Self::factored(problem, noise);
            (problem.residuals(&[], &system.linear(&[])).concat(), system.shared.norm(0).powi(2))
        })
    }

    /// The nuisances of a recording, over all rows.
    pub fn nuisances_of(&self, recording: usize) -> &[Vec<f64>] {
        let each = self.nuisances.len() / self.spans.len();
        &self.nuisances[recording * each..][..each]
    }

    /// Takes nuisances of given size out of a line.
    pub fn less_nuisances(&self, linear: &Linear, y: &mut [f64]) {
        for (index, (span, weights)) in self.spans.iter().zip(&linear.recordings).enumerate() {
            for (nuisance, weight) in self.nuisances_of(index).iter().zip(weights) {
                y[span.clone()].iter_mut().zip(&nuisance[span.clone()]).for_each(|(y, x)| *y -= weight * x);
            }
        }
    }

    /// [`profile`](Self::profile) from the given noise and from white noise, whichever ends better: a noise that has taken structure for colour holds on to it.
    ///
    /// What only trades structure for slow noise, and leaves more than there was, is no fit.
    pub fn best_profile(&self, columns: &[&[f64]], y: &[f64], from: &[Noise]) -> Profile {
        self.better_profile(self.plain_profile(columns, y), columns, y, from)
    }

    /// The fit by plain least squares: none leaves less.
    pub fn plain_profile(&self, columns: &[&[f64]], y: &[f64]) -> Profile {
        self.profile(columns, y, &self.white(), 1)
    }

    /// [`best_profile`](Self::best_profile) where the one by plain least squares is known.
    pub fn better_profile(&self, plain: Profile, columns: &[&[f64]], y: &[f64], from: &[Noise]) -> Profile {
        let fresh = self.profile(columns, y, &plain.noise, 2);
        let direct = self.profile(columns, y, from, 3);
        let most = TRADED * self.squares(y);
        let sound = [direct, fresh].into_iter().filter(|p| self.squares(&p.residual) <= most);
        sound.fold(plain, |a, b| if b.minus_two_log_likelihood < a.minus_two_log_likelihood { b } else { a })
    }

    /// Fits columns and the nuisances to `y` with the colour of the noise fitted in turn. `from` is where the noise starts. Directions that the rows do not
    /// determine get nothing.
    pub fn profile(&self, columns: &[&[f64]], y: &[f64], from: &[Noise], rounds: usize) -> Profile {
        self.with_problem(columns, y, |problem| {
            let mut noise = from.to_vec();
            let mut linear = Linear::default();
            let mut residual = y.to_vec();
            for _ in 0..rounds {
                let system = Self::factored(problem, &noise);
                let directions = Singular::of(&system.shared, &system.norms, DETERMINED);
                linear = system.linear(&directions.solve(&system.shared));
                residual = problem.residuals(&[], &linear).concat();
                noise = self.noise(&residual, 0);
            }
            let minus_two_log_likelihood = self.minus_two_log_likelihood(&noise, &residual);
            Profile { coefficients: linear.gear, noise, residual, minus_two_log_likelihood }
        })
    }

    /// Standard deviation of the weight of each column, given all others and the nuisances free; `None` where the rows do not distinguish it from others.
    pub fn standard_deviations(&self, columns: &[&[f64]], residual: &[f64]) -> Vec<Option<f64>> {
        let noise = self.noise(residual, columns.len() + self.nuisances.len());
        let system = self.system(columns, residual, &noise);
        let directions = Singular::of(&system.shared, &system.norms, SINGULAR);
        let unit = |k: usize| DVector::from_fn(columns.len(), |i, _| if i == k { 1.0 } else { 0.0 });
        (0..columns.len()).map(|k| directions.direction(&unit(k)).map(|d| d.norm())).collect()
    }

    /// What the weights of columns are without each block of the recordings.
    pub fn without_blocks(&self, columns: &[&[f64]], y: &[f64], noise: &[Noise]) -> Vec<Vec<f64>> {
        let sweep = Sweep { noise: Some(noise), folds: FOLDS, stride: 1 };
        let factors = self.with_problem(columns, y, |problem| problem.factor(&[], None, sweep));
        let all: Vec<usize> = (0..columns.len()).collect();
        let rest = Blocks::of(&factors);
        let solved = |block: usize| bounded::solve_subset(&rest.without(|_, fold| fold == block), &all);
        (0..FOLDS).map(|block| solved(block).coefficients).collect()
    }

    /// The rows of a block, recording by recording.
    pub fn rows_of_block(&self, block: usize) -> Vec<Range<usize>> {
        let part = |span: &Range<usize>, block: usize| span.start + span.len() * block / FOLDS;
        self.spans.iter().map(|span| part(span, block)..part(span, block + 1)).collect()
    }

    fn factored(problem: &Problem<'_>, noise: &[Noise]) -> System {
        problem.factor(&[], None, Sweep { noise: Some(noise), ..Sweep::PLAIN }).combine(|_, _| true)
    }

    fn with_problem<T>(&self, columns: &[&[f64]], y: &[f64], work: impl FnOnce(&Problem<'_>) -> T) -> T {
        let names = self.nuisances_of(0).iter().map(|_| Column::of_recording("nuisance", "1"));
        let names = names.chain(columns.iter().map(|_| Column::of_gear("column", "1", Bound::Free))).collect();
        let of_recording = |(index, span): (usize, &Range<usize>)| {
            let nuisances = self.nuisances_of(index).iter().map(Vec::as_slice);
            nuisances.chain(columns.iter().copied()).map(|c| &c[span.clone()]).collect()
        };
        let ready = Ready::new(names, self.spans.iter().enumerate().map(of_recording).collect());
        let rows: Vec<Rows<'_>> = (0..self.spans.len())
            .map(|index| Rows {
                recording: &self.recordings[index],
                deflection_rad: Cow::Borrowed(&[]),
                torque: Cow::Borrowed(&y[self.spans[index].clone()]),
                marks: self.marks[index].clone(),
                past: Past::Rest,
                counts: None,
            })
            .collect();
        work(&Problem { rows: &rows, corrections: Vec::new(), contributions: vec![&ready] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn noise_of_another_order_gains_nothing_by_the_rows_behind_outliers() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let residual: Vec<f64> = (0..4000).map(|_| StandardNormal.sample(&mut random)).collect();
        let mark = |row: usize| if row.is_multiple_of(40) { Mark::Outlier } else { Mark::Used };
        let marks = [(0..4000).map(mark).collect()];
        let layout = Layout { recordings: &[], spans: std::slice::from_ref(&(0..4000)), marks: &marks, nuisances: &[] };
        let of_order = |order: usize| Noise {
            coefficients: vec![0.0; order],
            reflections: vec![0.0; order],
            starts: (0..order).map(|k| (vec![0.0; k], 1.0)).collect(),
            ..Noise::unit()
        };
        let [white, fifth] = [0, 5].map(|order| layout.minus_two_log_likelihood(&[of_order(order)], &residual));
        // 500 rows, whose squares have a standard deviation of √2.
        assert!((white - fifth).abs() < 100.0, "{white} and {fifth}");
    }
}
