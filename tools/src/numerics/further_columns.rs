//! What further columns save of held-out errors beside a set of columns that stays, for many targets at once.
//!
//! With the base's columns X, further ones C and, in the rows that predict a block, G = XᵀX + ridge: the further weights are w = (CᵀC + ridge − CᵀX B)⁻¹ Cᵀ(y − Xβ) with B = G⁻¹XᵀC and β = G⁻¹Xᵀy, and those of
//! the base become β − B w (the block inverse; Golub, Van Loan, Matrix Computations, section 2.1). Held out the error falls by 2 wᵀC̃ᵀ(y − Xβ) − wᵀC̃ᵀC̃ w with C̃ = C − X B. Only a few columns are solved for each, in
//! place of all for every target.

use nalgebra::{Cholesky, DMatrix, Dyn};
use rayon::prelude::*;

use super::block_gram::{BLOCKS, BlockGram, Chosen, Targets, among};

/// A base fitted to the rows that predict a block.
struct Base {
    factor: Cholesky<f64, Dyn>,
    /// β of each target.
    weights: DMatrix<f64>,
    /// The base's Gram matrix held out,
    held: DMatrix<f64>,
    /// and its products with what is left of each target there.
    left: DMatrix<f64>,
}

impl BlockGram {
    /// What each group of further columns saves of the squared error of each target beside base columns, held out, all blocks together; columns without a ridge.
    pub fn savings(&self, targets: &Targets, base: &[usize], further: &[&[usize]]) -> Vec<Vec<f64>> {
        let bases: Option<Vec<Base>> = (0..BLOCKS).map(|block| self.base(targets, base, block)).collect();
        let total = |columns: &[usize]| -> Vec<f64> {
            let blocks = self.errors(targets, &Chosen::plain(columns));
            (0..targets.count()).map(|k| blocks.iter().map(|b| b[k]).sum()).collect()
        };
        let savings = |own: &&[usize]| -> Vec<f64> {
            let new: Vec<usize> = own.iter().copied().filter(|c| !base.contains(c)).collect();
            let mut sum = vec![0.0; targets.count()];
            for (block, beside) in bases.iter().flatten().enumerate() {
                if !self.add_savings(targets, base, &new, (block, beside), &mut sum) {
                    sum.clear();
                    break;
                }
            }
            if bases.is_some() && !sum.is_empty() {
                return sum;
            }
            // Columns that are not independent take a larger ridge.
            let all: Vec<usize> = base.iter().chain(&new).copied().collect();
            total(base).iter().zip(total(&all)).map(|(without, with)| without - with).collect()
        };
        further.par_iter().map(savings).collect()
    }

    fn base(&self, targets: &Targets, columns: &[usize], block: usize) -> Option<Base> {
        let (training, held) = self.of_block(block);
        let (h_training, h_held) = targets.of_block(block);
        let mut gram = among(training, columns, columns);
        (0..columns.len()).for_each(|at| gram[(at, at)] += self.ridge_of_plain());
        let factor = Cholesky::new(gram)?;
        let weights = factor.solve(&h_training.select_rows(columns));
        let held = among(held, columns, columns);
        let left = h_held.select_rows(columns) - &held * &weights;
        Some(Base { factor, weights, held, left })
    }

    /// Adds what further columns save in a block to a sum of each target; `false` where they depend on the base.
    fn add_savings(
        &self,
        targets: &Targets,
        base: &[usize],
        own: &[usize],
        (block, beside): (usize, &Base),
        sum: &mut [f64],
    ) -> bool {
        let (training, held) = self.of_block(block);
        let (h_training, h_held) = targets.of_block(block);
        let across = among(training, base, own);
        let in_base = beside.factor.solve(&across);
        let mut inner = among(training, own, own) - across.tr_mul(&in_base);
        (0..own.len()).for_each(|at| inner[(at, at)] += self.ridge_of_plain());
        let Some(inner) = Cholesky::new(inner) else { return false };
        let weights = inner.solve(&(h_training.select_rows(own) - across.tr_mul(&beside.weights)));
        let across = among(held, base, own);
        let left = h_held.select_rows(own) - across.tr_mul(&beside.weights) - in_base.tr_mul(&beside.left);
        let mixed = in_base.tr_mul(&across);
        let squares = among(held, own, own) - &mixed - mixed.transpose() + in_base.tr_mul(&(&beside.held * &in_base));
        let taken = squares * &weights;
        for (target, sum) in sum.iter_mut().enumerate() {
            let weights = weights.column(target);
            *sum += 2.0 * weights.dot(&left.column(target)) - weights.dot(&taken.column(target));
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn further_columns_save_the_difference_of_two_errors() {
        let rows = 400;
        let column = |k: usize| (0..rows).map(|r| ((r * (3 * k + 7) + k * k * r * r) % 211) as f64 - 105.0).collect();
        let mut columns: Vec<Vec<f64>> = (0..9).map(column).collect();
        // A copy: beside the column itself there is no factor.
        columns.push(columns[1].clone());
        let target = |k: usize| (0..rows).map(|r| columns[k][r] + ((r * r) % (17 + k)) as f64).collect::<Vec<f64>>();
        let all = [target(1), target(5), target(8)];
        let counts = vec![true; rows];
        let gram = BlockGram::new(&columns, std::slice::from_ref(&(0..rows)), &counts);
        let targets = gram.targets(&columns, &all, &counts);
        let base = [0, 1, 2];
        let further: [&[usize]; 4] = [&[5], &[2, 8, 5], &[9], &[]];
        for (own, savings) in further.iter().zip(gram.savings(&targets, &base, &further)) {
            let mut with: Vec<usize> = base.iter().chain(*own).copied().collect();
            with.dedup();
            with.sort_unstable();
            with.dedup();
            let [without, with] = [&base[..], &with].map(|c| gram.errors(&targets, &Chosen::plain(c)));
            for (k, savings) in savings.iter().enumerate() {
                let expected: f64 = without.iter().zip(&with).map(|(without, with)| without[k] - with[k]).sum();
                let size: f64 = without.iter().map(|without| without[k]).sum();
                assert!((savings - expected).abs() < 1e-6 * size, "{own:?}: {savings}, not {expected} of {size}");
            }
        }
    }
}
