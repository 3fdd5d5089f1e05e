//! Columns as least squares shall see them: filtered by the noise model.
//!
//! A row is filtered by 1 − Σ φ_i L^i. The first rows of a run use the predictors of lower order; rows that do not count are 0. Which rows those are depends on
//! the marks alone, so it is found once and the filter itself runs straight through every column.

use crate::numerics::autoregression::Noise;
use crate::numerics::mark::Mark;
use crate::numerics::vector::axpy;

/// The way of the noise filter along a recording.
#[derive(Debug, Clone, Copy)]
pub struct Filter {
    /// Counted rows since the last break, as far as the order.
    clean: usize,
    /// Whether the run began where the noise before is unknown, not at an outlier.
    exact_start: bool,
}

/// A row that the full predictor does not serve: with the order of the one that does, or none where the row does not count.
pub type Exception = (usize, Option<usize>);

impl Filter {
    /// At the first row.
    pub fn start() -> Self {
        Self { clean: 0, exact_start: true }
    }

    /// Goes on along rows, and names the exceptions among them.
    pub fn exceptions(&mut self, order: usize, marks: &[Mark]) -> Vec<Exception> {
        let mut exceptions = Vec::new();
        for (row, mark) in marks.iter().enumerate() {
            match mark {
                Mark::Skipped | Mark::First => (self.clean, self.exact_start) = (0, true),
                Mark::Outlier => (self.clean, self.exact_start) = (0, self.clean < order && self.exact_start),
                Mark::Used => {}
            }
            let usable = mark.counts();
            if usable && self.clean == order {
                continue;
            }
            exceptions.push((row, (usable && self.exact_start).then_some(self.clean)));
            self.clean += usize::from(usable);
        }
        exceptions
    }
}

impl Noise {
    /// Filters the rows of `from` after the first `history` ones into `to`.
    pub(crate) fn filter(&self, exceptions: &[Exception], from: &[f64], history: usize, to: &mut [f64]) {
        let count = to.len();
        to.copy_from_slice(&from[history..][..count]);
        for (i, phi) in self.coefficients.iter().enumerate() {
            let first = (i + 1).saturating_sub(history).min(count);
            let lagged = &from[history + first - (i + 1).min(history + first)..];
            axpy(-phi, lagged, &mut to[first..]);
        }
        if self.weight != 1.0 {
            to.iter_mut().for_each(|y| *y *= self.weight);
        }
        for &(row, start) in exceptions {
            to[row] = start.map_or(0.0, |order| {
                let (predictor, factor) = &self.starts[order];
                let at = history + row;
                let past: f64 = predictor.iter().enumerate().map(|(i, a)| a * from[at - 1 - i]).sum();
                self.weight * factor * (from[at] - past)
            });
        }
    }

    /// How many rows that count are 0 in a filtered column: those behind an outlier.
    pub(crate) fn unfiltered(&self, marks: &[Mark]) -> usize {
        let exceptions = Filter::start().exceptions(self.order(), marks);
        exceptions.iter().filter(|(row, start)| start.is_none() && marks[*row].counts()).count()
    }

    /// A whole column, filtered.
    pub fn whiten(&self, marks: &[Mark], column: &[f64], out: &mut Vec<f64>) {
        let exceptions = Filter::start().exceptions(self.order(), marks);
        let before = out.len();
        out.resize(before + column.len(), 0.0);
        self.filter(&exceptions, column, 0, &mut out[before..]);
    }

    /// The transpose of [`whiten`](Self::whiten): u with Σ u·x = Σ white·whiten(x) for every column x.
    pub fn whiten_transposed(&self, marks: &[Mark], white: &[f64], out: &mut [f64]) {
        let exceptions = Filter::start().exceptions(self.order(), marks);
        let mut served: Vec<f64> = white.iter().map(|w| self.weight * w).collect();
        for &(row, start) in &exceptions {
            let value = std::mem::take(&mut served[row]);
            let Some((predictor, factor)) = start.map(|order| &self.starts[order]) else { continue };
            out[row] += factor * value;
            predictor.iter().enumerate().for_each(|(i, a)| out[row - 1 - i] -= a * factor * value);
        }
        out.iter_mut().zip(&served).for_each(|(u, w)| *u += w);
        for (i, phi) in self.coefficients.iter().enumerate() {
            out.iter_mut().zip(served.iter().skip(i + 1)).for_each(|(u, w)| *u -= phi * w);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise() -> Noise {
        let series: Vec<f64> =
            (0..4000).map(|k: i32| f64::from((k * k % 1009 * 31 + k * 7) % 1009) / 1009.0 - 0.5).collect();
        let mut slow = vec![0.0; series.len()];
        for k in 2..slow.len() {
            slow[k] = 1.2 * slow[k - 1] - 0.5 * slow[k - 2] + series[k];
        }
        let noise = Noise::of_residual(&slow, &vec![Mark::Used; slow.len()], 0);
        assert!(noise.order() >= 2);
        noise
    }

    /// A run with a gap, outliers and rows that only the memory passes through.
    fn marks() -> Vec<Mark> {
        let mut marks = vec![Mark::Used; 120];
        marks[..7].fill(Mark::Skipped);
        (marks[9], marks[40], marks[41], marks[80]) = (Mark::Outlier, Mark::Outlier, Mark::Outlier, Mark::First);
        marks
    }

    #[test]
    fn filtering_in_stretches_is_filtering_at_once() {
        let (noise, marks) = (noise(), marks());
        let column: Vec<f64> = (0..marks.len()).map(|k| (0.3 * k as f64).sin() + 0.01 * k as f64).collect();
        let mut whole = Vec::new();
        noise.whiten(&marks, &column, &mut whole);
        let (order, mut filter) = (noise.order(), Filter::start());
        let padded: Vec<f64> = std::iter::repeat_n(f64::NAN, order).chain(column.iter().copied()).collect();
        for range in [0..3, 3..10, 10..11, 11..90, 90..120] {
            let exceptions = filter.exceptions(order, &marks[range.clone()]);
            let mut part = vec![0.0; range.len()];
            noise.filter(&exceptions, &padded[range.start..], order, &mut part);
            assert_eq!(part, whole[range]);
        }
    }

    #[test]
    fn the_transpose_is_the_transpose() {
        let (noise, marks) = (noise(), marks());
        let x: Vec<f64> = (0..marks.len()).map(|k| (0.7 * k as f64).cos()).collect();
        let y: Vec<f64> = (0..marks.len()).map(|k| (0.2 * k as f64).sin()).collect();
        let (mut white, mut back) = (Vec::new(), vec![0.0; x.len()]);
        noise.whiten(&marks, &x, &mut white);
        noise.whiten_transposed(&marks, &y, &mut back);
        let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        assert!((sum(&white, &y) - sum(&x, &back)).abs() < 1e-12 * sum(&white, &white));
    }
}
