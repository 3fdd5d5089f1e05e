//! Held-out errors of many sets of columns that have most of their columns in common, as the moves of a search have.
//!
//! The sets are taken in an order in which neighbours begin alike, the commonest columns first. The Cholesky factor of what a set has in common with the one before stays, and each further column is a row more of it
//! (Golub, Van Loan, Matrix Computations, section 4.2): n² operations in place of n³/3.

use rayon::prelude::*;

use super::block_gram::{BLOCKS, BlockGram, Chosen, Targets};
use super::vector::{axpy, dot};

impl BlockGram {
    /// The squared error of the first target in each block, for each set of columns without a ridge; the same as [`error`](Self::error) up to rounding.
    pub fn errors_of_sets(&self, targets: &Targets, sets: &[Vec<usize>]) -> Vec<[f64; BLOCKS]> {
        let ordered = in_common_order(sets, self.columns());
        let of_blocks: Vec<Vec<Option<f64>>> =
            (0..BLOCKS).into_par_iter().map(|block| self.errors_in_block(targets, &ordered, block)).collect();
        let mut errors = vec![[0.0; BLOCKS]; sets.len()];
        for (at, (_, set)) in ordered.iter().enumerate() {
            let own: Option<Vec<f64>> = of_blocks.iter().map(|block| block[at]).collect();
            errors[*set] = match own.and_then(|own| own.try_into().ok()) {
                Some(own) => own,
                // Columns that are not independent take a larger ridge.
                None => self.error(targets, &Chosen::plain(&sets[*set])),
            };
        }
        errors
    }

    /// The squared errors of one block; `None` where columns are not independent.
    fn errors_in_block(&self, targets: &Targets, ordered: &[(Vec<usize>, usize)], block: usize) -> Vec<Option<f64>> {
        let (training, held) = self.of_block(block);
        let (h_training, h_held, squares) = targets.first_of_block(block);
        let ridge = self.ridge_of_plain();
        let mut growing = Growing::default();
        let error = |(set, _): &(Vec<usize>, usize)| {
            let common = growing.columns.iter().zip(set).take_while(|(own, new)| own == new).count();
            growing.truncate(common);
            for &column in &set[common..] {
                let of = |gram: &nalgebra::DMatrix<f64>| growing.columns.iter().map(|c| gram[(*c, column)]).collect();
                let (row, held_row): (Vec<f64>, Vec<f64>) = (of(training), of(held));
                let diagonal = [training[(column, column)] + ridge, held[(column, column)]];
                growing.push(column, [row, held_row], diagonal, [h_training[column], h_held[column]]);
            }
            growing.error(squares)
        };
        ordered.iter().map(error).collect()
    }
}

/// The sets, each with the commonest of all columns first, in an order in which neighbours begin alike, and the place that each had.
fn in_common_order(sets: &[Vec<usize>], columns: usize) -> Vec<(Vec<usize>, usize)> {
    let mut count = vec![0_usize; columns];
    sets.iter().flatten().for_each(|column| count[*column] += 1);
    let rank = |column: &usize| (std::cmp::Reverse(count[*column]), *column);
    let mut ordered: Vec<(Vec<usize>, usize)> = sets.iter().cloned().zip(0..).collect();
    ordered.iter_mut().for_each(|(set, _)| set.sort_by_key(rank));
    ordered.sort_by(|(a, _), (b, _)| a.iter().map(rank).cmp(b.iter().map(rank)));
    ordered
}

/// The factor of a set of columns, to which columns are added at its end.
#[derive(Default)]
struct Growing {
    columns: Vec<usize>,
    /// L, row by row, below its diagonal.
    factor: Vec<Vec<f64>>,
    /// The diagonal of L; not a number from the first column on that depends on those before it.
    diagonal: Vec<f64>,
    /// L⁻¹ times the products with the target.
    solved: Vec<f64>,
    /// The held-out Gram matrix, row by row, below its diagonal; its diagonal; the products with the target there.
    held: Vec<Vec<f64>>,
    held_diagonal: Vec<f64>,
    held_products: Vec<f64>,
}

impl Growing {
    fn truncate(&mut self, count: usize) {
        self.columns.truncate(count);
        self.factor.truncate(count);
        self.held.truncate(count);
        for line in [&mut self.diagonal, &mut self.solved, &mut self.held_diagonal, &mut self.held_products] {
            line.truncate(count);
        }
    }

    /// Adds a column: its products with those before it, with itself, and with the target, in training and held out.
    fn push(
        &mut self,
        column: usize,
        [mut row, held_row]: [Vec<f64>; 2],
        [diagonal, held_diagonal]: [f64; 2],
        [product, held_product]: [f64; 2],
    ) {
        for at in 0..row.len() {
            row[at] = (row[at] - dot(&self.factor[at], &row[..at])) / self.diagonal[at];
        }
        let pivot = diagonal - dot(&row, &row);
        let pivot = if pivot > 0.0 { pivot.sqrt() } else { f64::NAN };
        self.solved.push((product - dot(&row, &self.solved)) / pivot);
        self.columns.push(column);
        self.factor.push(row);
        self.diagonal.push(pivot);
        self.held.push(held_row);
        self.held_diagonal.push(held_diagonal);
        self.held_products.push(held_product);
    }

    /// What the columns leave of so many held-out squares.
    fn error(&self, squares: f64) -> Option<f64> {
        let mut weights = self.solved.clone();
        for at in (0..weights.len()).rev() {
            let weight = weights[at] / self.diagonal[at];
            weights[at] = weight;
            axpy(-weight, &self.factor[at], &mut weights[..at]);
        }
        let mut error = squares;
        for (at, weight) in weights.iter().enumerate() {
            let others = dot(&self.held[at], &weights[..at]);
            error += weight * (self.held_diagonal[at] * weight + 2.0 * (others - self.held_products[at]));
        }
        error.is_finite().then(|| error.max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_sets_have_the_errors_of_each_alone() {
        let rows = 400;
        let column = |k: usize| (0..rows).map(|r| ((r * (3 * k + 7) + k * k * r * r) % 211) as f64 - 105.0).collect();
        let mut columns: Vec<Vec<f64>> = (0..12).map(column).collect();
        // A copy: with both there is no factor.
        columns.push(columns[4].clone());
        let target: Vec<f64> = (0..rows).map(|r| columns[1][r] + 0.5 * columns[5][r] + ((r * r) % 17) as f64).collect();
        let counts = vec![true; rows];
        let gram = BlockGram::new(&columns, std::slice::from_ref(&(0..rows)), &counts);
        let targets = gram.targets(&columns, std::slice::from_ref(&target), &counts);
        let sets =
            [vec![], vec![0, 1, 2], vec![0, 1, 2, 5], vec![0, 2, 5, 9, 11], vec![1, 4, 12], vec![0, 1, 2, 3, 4, 5, 6]];
        let errors = gram.errors_of_sets(&targets, &sets);
        for (set, errors) in sets.iter().zip(errors) {
            let alone = gram.error(&targets, &Chosen::plain(set));
            for (own, alone) in errors.iter().zip(alone) {
                assert!((own - alone).abs() <= 1e-6 * alone + 1e-6, "{set:?}: {own}, not {alone}");
            }
        }
    }
}
