//! The triangular factor of a tall matrix, taken in blocks of rows.
//!
//! Householder QR of \[R; block\] replaces R (the sequential form of TSQR: Demmel, Grigori, Hoemmen, Langou, *Communication-optimal
//! parallel and sequential QR and LU factorizations*, SIAM J. Sci. Comput. 34, 2012). A recording of any length so costs the memory of
//! one block, and R is as accurate as the QR of the whole matrix; the normal equations, which square the condition number, are never
//! formed. The right-hand side is the last column, so the last diagonal element is the norm of the residual.

use pulp::{Simd, WithSimd};

use crate::numerics::vector::{axpy_within, dot, dot_within, wide};

/// Some rows of a matrix, column after column.
#[derive(Debug, Clone)]
pub struct Block {
    capacity: usize,
    rows: usize,
    data: Vec<f64>,
}

impl Block {
    /// Room for `capacity` rows of `columns` numbers, all zero.
    pub fn new(columns: usize, capacity: usize) -> Self {
        Self { capacity, rows: 0, data: vec![0.0; columns * capacity] }
    }

    /// Sets how many rows are in use.
    ///
    /// # Panics
    /// If there is no room for them.
    pub fn set_rows(&mut self, rows: usize) {
        assert!(rows <= self.capacity, "a block has a fixed number of rows");
        self.rows = rows;
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.data.len().checked_div(self.capacity).unwrap_or(0)
    }

    /// Column `j`, the rows in use.
    pub fn column(&self, j: usize) -> &[f64] {
        &self.data[j * self.capacity..][..self.rows]
    }

    /// Column `j`, the rows in use.
    pub fn column_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.data[j * self.capacity..][..self.rows]
    }
}

/// The upper triangular factor R of all rows absorbed so far; the last column is the right-hand side.
#[derive(Debug, Clone, PartialEq)]
pub struct Triangle {
    columns: usize,
    /// Column-major.
    r: Vec<f64>,
}

/// Squared norms below this are no numbers to work with.
const NOTHING: f64 = 1e-280;

impl Triangle {
    /// The factor of no rows.
    pub fn new(columns: usize) -> Self {
        Self { columns, r: vec![0.0; columns * columns] }
    }

    /// Number of columns, right-hand side included.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Element R_ij; zero below the diagonal.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        self.r[j * self.columns + i]
    }

    fn set(&mut self, i: usize, j: usize, value: f64) {
        self.r[j * self.columns + i] = value;
    }

    /// Makes column `j` one of zeros, as if it had been.
    pub(crate) fn clear(&mut self, j: usize) {
        let mut block = Block::new(self.columns, self.columns);
        block.set_rows(self.columns);
        block.data.copy_from_slice(&self.r);
        block.column_mut(j).fill(0.0);
        self.r.fill(0.0);
        self.absorb(&mut block);
    }

    /// The norm of column `j`, which is that of the column of the tall matrix.
    pub fn norm(&self, j: usize) -> f64 {
        let column = &self.r[j * self.columns..][..=j];
        dot(column, column).sqrt()
    }

    /// Adds the rows of a block. The block is used up.
    pub fn absorb(&mut self, block: &mut Block) {
        debug_assert_eq!(block.columns(), self.columns);
        wide(Reflect { r: &mut self.r, columns: self.columns, block });
    }

    /// Adds the rows of another factor of the same columns.
    pub fn merge(&mut self, other: &Self) {
        let n = self.columns;
        let mut block = Block::new(n, n);
        block.set_rows(n);
        block.data.copy_from_slice(&other.r);
        self.absorb(&mut block);
    }

    /// The factor of the same rows, each times `weight`.
    #[must_use]
    pub fn scaled(&self, weight: f64) -> Self {
        Self { columns: self.columns, r: self.r.iter().map(|x| weight * x).collect() }
    }

    /// The factor of some of the columns, in the given order.
    pub fn select(&self, columns: &[usize]) -> Self {
        let mut block = Block::new(columns.len(), self.columns);
        block.set_rows(self.columns);
        for (to, &from) in columns.iter().enumerate() {
            block.column_mut(to).copy_from_slice(&self.r[from * self.columns..][..self.columns]);
        }
        let mut selected = Self::new(columns.len());
        selected.absorb(&mut block);
        selected
    }

    /// What is left when the first `count` columns are eliminated: the rows and columns after them.
    pub fn tail(&self, count: usize) -> Self {
        let mut tail = Self::new(self.columns - count);
        for j in count..self.columns {
            for i in count..=j {
                tail.set(i - count, j - count, self.get(i, j));
            }
        }
        tail
    }

    /// The factor with a combination of the first columns taken out of the last one.
    #[must_use]
    pub fn less(&self, weights: &[f64]) -> Self {
        let mut less = self.clone();
        let last = self.columns - 1;
        for i in 0..self.columns {
            let sum: f64 = weights.iter().enumerate().skip(i).map(|(j, w)| w * self.get(i, j)).sum();
            less.set(i, last, self.get(i, last) - sum);
        }
        less
    }

    /// RᵀR·x.
    pub fn products(&self, x: &[f64]) -> Vec<f64> {
        let rows: Vec<f64> =
            (0..self.columns).map(|i| (i..self.columns).map(|j| self.get(i, j) * x[j]).sum()).collect();
        (0..self.columns).map(|j| (0..=j).map(|i| self.get(i, j) * rows[i]).sum()).collect()
    }

    /// The squared norm of R·x.
    pub fn squared_norm_of_product(&self, x: &[f64]) -> f64 {
        (0..self.columns)
            .map(|i| (i..self.columns).map(|j| self.get(i, j) * x[j]).sum::<f64>())
            .map(|row| row * row)
            .sum()
    }
}

/// Householder reflections of \[R; block\], column by column.
struct Reflect<'a> {
    r: &'a mut [f64],
    columns: usize,
    block: &'a mut Block,
}

impl WithSimd for Reflect<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { r, columns, block } = self;
        let (capacity, rows) = (block.capacity, block.rows);
        for j in 0..columns {
            let (left, right) = block.data.split_at_mut((j + 1) * capacity);
            let reflector = &left[j * capacity..][..rows];
            let below = dot_within(simd, reflector, reflector);
            // What is left of a dependent column may be too small to be squared and divided by.
            if below < NOTHING {
                continue;
            }
            let head = r[j * columns + j];
            let norm = (head * head + below).sqrt();
            let diagonal = if head > 0.0 { -norm } else { norm };
            let first = head - diagonal;
            let scale = 2.0 / (first * first + below);
            for l in j + 1..columns {
                let top = r[l * columns + j];
                let column = &mut right[(l - j - 1) * capacity..][..rows];
                let amount = scale * (first * top + dot_within(simd, reflector, column));
                axpy_within(-amount, reflector, column);
                r[l * columns + j] = top - amount * first;
            }
            r[j * columns + j] = diagonal;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hilbert_like(rows: usize) -> Block {
        let mut block = Block::new(4, rows);
        block.set_rows(rows);
        for j in 0..4 {
            for (i, value) in block.column_mut(j).iter_mut().enumerate() {
                *value = 1.0 / (1.0 + i as f64 + 2.0 * j as f64);
            }
        }
        block
    }

    #[test]
    fn blockwise_factor_has_the_gram_matrix_of_the_whole() {
        let whole = hilbert_like(37);
        let mut factor = Triangle::new(4);
        for range in [0..5, 5..6, 6..30, 30..37] {
            let mut block = Block::new(4, range.len());
            block.set_rows(range.len());
            for j in 0..4 {
                block.column_mut(j).copy_from_slice(&whole.column(j)[range.clone()]);
            }
            factor.absorb(&mut block);
        }
        for a in 0..4 {
            for b in 0..4 {
                let gram: f64 = (0..4).map(|i| factor.get(i, a) * factor.get(i, b)).sum();
                assert!((gram - dot(whole.column(a), whole.column(b))).abs() < 1e-14);
            }
        }
        let chosen = factor.select(&[2, 0]);
        assert!((chosen.norm(0) - factor.norm(2)).abs() < 1e-14);
        assert_eq!(chosen.get(1, 0), 0.0);
        let less = factor.less(&[0.5, -2.0]);
        let last: Vec<f64> =
            (0..37).map(|i| whole.column(3)[i] - 0.5 * whole.column(0)[i] + 2.0 * whole.column(1)[i]).collect();
        assert!((less.norm(3) - dot(&last, &last).sqrt()).abs() < 1e-14);
    }
}
