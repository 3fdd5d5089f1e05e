//! Held-out errors of any subset of columns, from one Gram matrix a block.
//!
//! Each recording is cut into contiguous blocks. The normal equations of a subset of columns without a block are a difference of Gram matrices, so its
//! held-out error costs small linear algebra and no further pass over the rows. Between a block and the rows that predict it lies a gap, lest slow noise carry over.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, DVectorView};

/// Blocks that each recording is cut into.
pub const BLOCKS: usize = 8;

/// The part of a block at both ends that does not take part in predicting its neighbour.
const GAP: f64 = 1.0 / 12.0;

/// Ridge of a fit without a wish for smoothness: rounding only. Columns are scaled to a mean square of 1.
const NO_RIDGE: f64 = 1e-9;

/// Ridges of such columns, the least first; the larger ones keep near zero what a block does not determine.
const RIDGES: [f64; 7] = [NO_RIDGE, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3];

/// Columns of a fit: first those fitted as they are, then those of free functions, whose ridge keeps them smooth.
#[derive(Debug, Clone)]
pub struct Chosen {
    columns: Vec<usize>,
    plain: usize,
    ridge: f64,
}

impl Chosen {
    /// Columns without a ridge.
    pub fn plain(columns: &[usize]) -> Self {
        Self { columns: columns.to_vec(), plain: columns.len(), ridge: NO_RIDGE }
    }

    /// Columns without a ridge, and those of free functions with one; a column of both has none.
    pub fn with_free(plain: &[usize], free: &[usize], ridge: f64) -> Self {
        let smooth = free.iter().filter(|c| !plain.contains(c));
        Self { columns: plain.iter().chain(smooth).copied().collect(), plain: plain.len(), ridge }
    }

    /// All columns, those without a ridge first.
    pub fn columns(&self) -> &[usize] {
        &self.columns
    }

    /// Whether free functions add columns.
    pub fn has_free(&self) -> bool {
        self.columns.len() > self.plain
    }
}

/// Gram matrices of scaled columns and targets, block by block.
pub struct BlockGram {
    /// Number of rows that count.
    rows: usize,
    /// Ridge of columns fitted as they are.
    ridge: f64,
    /// Root mean square of each column.
    scale: Vec<f64>,
    /// The columns' Gram matrix of each block.
    held: Vec<DMatrix<f64>>,
    /// The columns' Gram matrix of the rows that predict each block.
    training: Vec<DMatrix<f64>>,
    /// The whole.
    total: DMatrix<f64>,
    /// The segments of each block: leading gap, core, trailing gap; rows of all recordings.
    segments: Vec<[Vec<Range<usize>>; 3]>,
}

/// Targets beside the columns of a [`BlockGram`]: one column or many.
pub struct Targets {
    held: Vec<DMatrix<f64>>,
    training: Vec<DMatrix<f64>>,
    total: DMatrix<f64>,
    squares: Vec<Vec<f64>>,
}

impl Targets {
    /// How many.
    pub fn count(&self) -> usize {
        self.total.ncols()
    }

    /// The products of the targets with the columns in the rows that predict a block, and in the block.
    pub(super) fn of_block(&self, block: usize) -> (&DMatrix<f64>, &DMatrix<f64>) {
        (&self.training[block], &self.held[block])
    }

    /// The products of the first target with the columns in the rows that predict a block, and in the block; its squares there.
    pub(super) fn first_of_block(&self, block: usize) -> (DVectorView<'_, f64>, DVectorView<'_, f64>, f64) {
        (self.training[block].column(0), self.held[block].column(0), self.squares[block][0])
    }
}

impl BlockGram {
    /// The Gram matrices of columns over recordings whose rows are `spans`; rows where `counts` is false take no part.
    pub fn new(columns: &[Vec<f64>], spans: &[Range<usize>], counts: &[bool]) -> Self {
        let rows = counts.iter().filter(|c| **c).count();
        let scale: Vec<f64> = columns
            .iter()
            .map(|c| {
                let squares: f64 = c.iter().zip(counts).filter(|(_, k)| **k).map(|(x, _)| x * x).sum();
                (squares / rows.max(1) as f64).sqrt().max(f64::MIN_POSITIVE)
            })
            .collect();
        let segments = segments(spans);
        let gram = |ranges: &[Range<usize>]| gram_of(&gather(columns, Some(&scale), ranges, counts));
        let parts: Vec<[DMatrix<f64>; 3]> = segments.iter().map(|s| [gram(&s[0]), gram(&s[1]), gram(&s[2])]).collect();
        let held: Vec<DMatrix<f64>> = parts.iter().map(|[a, b, c]| a + b + c).collect();
        let total = held.iter().fold(DMatrix::zeros(columns.len(), columns.len()), |sum, g| sum + g);
        let training = (0..BLOCKS).map(|b| without(&total, &held, &parts, b)).collect();
        Self { rows, ridge: NO_RIDGE, scale, held, training, total, segments }
    }

    /// Rows that count.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// How many columns.
    pub(super) fn columns(&self) -> usize {
        self.scale.len()
    }

    /// The Gram matrices of the rows that predict a block, and of the block.
    pub(super) fn of_block(&self, block: usize) -> (&DMatrix<f64>, &DMatrix<f64>) {
        (&self.training[block], &self.held[block])
    }

    /// What is added to the diagonal for columns fitted as they are.
    pub(super) fn ridge_of_plain(&self) -> f64 {
        self.rows as f64 * self.ridge
    }

    /// The root mean square of a column.
    pub fn scale_of(&self, column: usize) -> f64 {
        self.scale[column]
    }

    /// Gives all columns fitted as they are the least ridge at which some of them leave at most so many squares of a target on held-out blocks, or the largest ridge.
    /// Returns the squares that they leave at this ridge.
    pub fn steady(&mut self, targets: &Targets, columns: &[usize], most: f64) -> f64 {
        let mut left = f64::INFINITY;
        for ridge in RIDGES {
            self.ridge = ridge;
            left = self.error(targets, &Chosen::plain(columns)).iter().sum();
            if left <= most {
                break;
            }
        }
        left
    }

    /// Targets beside the columns.
    pub fn targets(&self, columns: &[Vec<f64>], targets: &[Vec<f64>], counts: &[bool]) -> Targets {
        let product = |ranges: &[Range<usize>]| {
            gather(columns, Some(&self.scale), ranges, counts).transpose() * gather(targets, None, ranges, counts)
        };
        let parts: Vec<[DMatrix<f64>; 3]> =
            self.segments.iter().map(|s| [product(&s[0]), product(&s[1]), product(&s[2])]).collect();
        let held: Vec<DMatrix<f64>> = parts.iter().map(|[a, b, c]| a + b + c).collect();
        let total = held.iter().fold(DMatrix::zeros(columns.len(), targets.len()), |sum, g| sum + g);
        let training = (0..BLOCKS).map(|b| without(&total, &held, &parts, b)).collect();
        let squares = self
            .segments
            .iter()
            .map(|s| {
                let of = |y: &Vec<f64>| {
                    s.iter().flatten().flat_map(Clone::clone).filter(|r| counts[*r]).map(|r| y[r] * y[r]).sum()
                };
                targets.iter().map(of).collect()
            })
            .collect();
        Targets { held, training, total, squares }
    }

    /// The squared error of each block (first index) and target, each block predicted by a fit of the chosen columns to the other blocks.
    pub fn errors(&self, targets: &Targets, chosen: &Chosen) -> Vec<Vec<f64>> {
        let all = chosen.columns();
        let error = |block: usize| {
            let h = targets.training[block].select_rows(all);
            let beta = solve(among(&self.training[block], all, all), &h, &self.ridges(chosen));
            let held = among(&self.held[block], all, all);
            let own = targets.held[block].select_rows(all);
            let predicted = &held * &beta;
            (0..targets.count())
                .map(|k| {
                    let b = beta.column(k);
                    let error = targets.squares[block][k] - 2.0 * b.dot(&own.column(k)) + b.dot(&predicted.column(k));
                    error.max(0.0)
                })
                .collect()
        };
        (0..BLOCKS).map(error).collect()
    }

    /// The squared error of one target in each block.
    pub fn error(&self, targets: &Targets, chosen: &Chosen) -> [f64; BLOCKS] {
        let all = chosen.columns();
        let ridges = self.ridges(chosen);
        let h = |m: &DMatrix<f64>| DMatrix::from_fn(all.len(), 1, |i, _| m[(all[i], 0)]);
        std::array::from_fn(|block| {
            let beta = solve(among(&self.training[block], all, all), &h(&targets.training[block]), &ridges);
            let held = among(&self.held[block], all, all);
            let b = beta.column(0);
            let own = h(&targets.held[block]);
            (targets.squares[block][0] - 2.0 * b.dot(&own.column(0)) + b.dot(&(&held * b))).max(0.0)
        })
    }

    /// The weights of the chosen columns over all rows, for the first target.
    pub fn weights(&self, targets: &Targets, chosen: &Chosen) -> Vec<f64> {
        let all = chosen.columns();
        let beta = solve(among(&self.total, all, all), &targets.total.select_rows(all), &self.ridges(chosen));
        all.iter().enumerate().map(|(i, c)| beta[(i, 0)] / self.scale[*c]).collect()
    }

    fn ridges(&self, chosen: &Chosen) -> Vec<f64> {
        let rows = self.rows as f64;
        let of = |at: usize| if at < chosen.plain { self.ridge_of_plain() } else { rows * chosen.ridge };
        (0..chosen.columns.len()).map(of).collect()
    }

    /// What the chosen columns leave of a target over all rows.
    pub fn residual(&self, columns: &[Vec<f64>], target: &[f64], weights: &[f64], chosen: &[usize]) -> Vec<f64> {
        let mut left = target.to_vec();
        for (c, w) in chosen.iter().zip(weights) {
            left.iter_mut().zip(&columns[*c]).for_each(|(l, x)| *l -= w * x);
        }
        left
    }
}

fn without(total: &DMatrix<f64>, held: &[DMatrix<f64>], parts: &[[DMatrix<f64>; 3]], block: usize) -> DMatrix<f64> {
    let mut rest = total - &held[block];
    if block > 0 {
        rest -= &parts[block - 1][2];
    }
    if block + 1 < BLOCKS {
        rest -= &parts[block + 1][0];
    }
    rest
}

/// Leading gap, core and trailing gap of each block, of every recording.
fn segments(spans: &[Range<usize>]) -> Vec<[Vec<Range<usize>>; 3]> {
    let edge = |span: &Range<usize>, b: usize| span.start + span.len() * b / BLOCKS;
    (0..BLOCKS)
        .map(|b| {
            let mut own = [Vec::new(), Vec::new(), Vec::new()];
            for span in spans {
                let (from, to) = (edge(span, b), edge(span, b + 1));
                let gap = ((to - from) as f64 * GAP) as usize;
                own[0].push(from..from + gap);
                own[1].push(from + gap..to - gap);
                own[2].push(to - gap..to);
            }
            own
        })
        .collect()
}

/// Rows of columns as a matrix; rows that do not count are left out.
fn gather(columns: &[Vec<f64>], scale: Option<&[f64]>, ranges: &[Range<usize>], counts: &[bool]) -> DMatrix<f64> {
    let rows: Vec<usize> = ranges.iter().flat_map(Clone::clone).filter(|r| counts[*r]).collect();
    let mut data = Vec::with_capacity(rows.len() * columns.len());
    for (k, column) in columns.iter().enumerate() {
        let factor = scale.map_or(1.0, |s| 1.0 / s[k]);
        data.extend(rows.iter().map(|r| column[*r] * factor));
    }
    DMatrix::from_vec(rows.len(), columns.len(), data)
}

/// Columns of a Gram matrix taken at a time.
const WIDTH: usize = 64;

/// XᵀX: below its diagonal as products, above it mirrored.
fn gram_of(x: &DMatrix<f64>) -> DMatrix<f64> {
    let (count, rows) = (x.ncols(), x.transpose());
    let mut gram = DMatrix::zeros(count, count);
    for from in (0..count).step_by(WIDTH) {
        let width = WIDTH.min(count - from);
        let below = rows.rows(from, count - from) * x.columns(from, width);
        gram.view_mut((from, from), (count - from, width)).copy_from(&below);
    }
    gram.fill_upper_triangle_with_lower_triangle();
    gram
}

/// Some rows and columns of a Gram matrix.
pub(super) fn among(gram: &DMatrix<f64>, rows: &[usize], columns: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), columns.len(), |i, j| gram[(rows[i], columns[j])])
}

/// Solves (G + ridges) β = h; the ridges grow until the factor exists.
fn solve(gram: DMatrix<f64>, h: &DMatrix<f64>, ridges: &[f64]) -> DMatrix<f64> {
    let mut factor = 1.0;
    for _ in 0..12 {
        let mut sum = gram.clone();
        for (i, ridge) in ridges.iter().enumerate() {
            sum[(i, i)] += factor * ridge.max(f64::MIN_POSITIVE);
        }
        if let Some(factor) = Cholesky::new(sum) {
            return factor.solve(h);
        }
        factor *= 100.0;
    }
    DMatrix::zeros(gram.nrows(), h.ncols())
}

/// Scatter of a gain over blocks: its sum over the root of the sum of its squares.
pub fn t_of_blocks(gains: &[f64]) -> f64 {
    let squares = DVector::from_column_slice(gains).norm();
    if squares > 0.0 { gains.iter().sum::<f64>() / squares } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_the_other_blocks_do_not_tell_apart_stay_near_zero() {
        let rows = 800;
        let wave = |row: usize| (0.1 * row as f64).sin();
        // Alike to a ten-thousandth, but ten times apart in the last block.
        let other =
            |row: usize| if row < 700 { wave(row) + 1e-4 * (0.37 * row as f64).cos() } else { 10.0 * wave(row) };
        let columns = [(0..rows).map(wave).collect::<Vec<f64>>(), (0..rows).map(other).collect()];
        let target: Vec<f64> = (0..rows).map(|row| 0.01 * (0.9 * row as f64).sin()).collect();
        let counts = vec![true; rows];
        let mut gram = BlockGram::new(&columns, std::slice::from_ref(&(0..rows)), &counts);
        let targets = gram.targets(&columns, std::slice::from_ref(&target), &counts);
        let error = |gram: &BlockGram| gram.error(&targets, &Chosen::plain(&[0, 1])).iter().sum::<f64>();
        let squares: f64 = target.iter().map(|y| y * y).sum();
        assert!(error(&gram) > 10.0 * squares, "{} of {squares}", error(&gram));
        let left = gram.steady(&targets, &[0, 1], 10.0 * squares);
        assert_eq!(left, error(&gram));
        assert!(error(&gram) <= 10.0 * squares, "{} of {squares}", error(&gram));
    }

    #[test]
    fn a_gram_matrix_is_the_product_of_its_columns() {
        let x = DMatrix::from_fn(31, 2 * WIDTH + 5, |i, j| ((7 * i + 3 * j * j) % 101) as f64 - 50.0);
        assert!((gram_of(&x) - x.transpose() * &x).amax() < 1e-9);
    }
}
