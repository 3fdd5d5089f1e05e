//! A stretch of motion compressed into seven rows: what its samples say of the coefficients, its offset and its delay apart.
//!
//! Samples are averaged over blocks of 25 ms, each with its weight w; a block is one row √Σw·[1, ṗ, x1 … x5 | r] of means: p the block's own torque, ṗ its change a period, x the regressors,
//! r the measured torque less p. Givens rotations keep the triangle of these rows. Whatever an offset or a delay of the signal explains is in the first two columns, so
//! the five rows below say what the coefficients alone can explain.

use super::{COEFFICIENTS, Coefficients};
use crate::scalar::Float;

/// Columns before those of the coefficients: offset and delay.
pub(super) const NUISANCE: usize = 2;
/// Rows of the triangle.
pub(super) const ROWS: usize = NUISANCE + COEFFICIENTS;
/// A row with its value.
const WIDTH: usize = ROWS + 1;
/// Entries of a row that a step works on.
const HALF: usize = WIDTH / 2;
/// Steps in which a block is worked into the rows.
pub(super) const STEPS: usize = 2 * ROWS;

/// Weighted sums of the samples of a block.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Sums<S> {
    pub(super) weight: S,
    slope: S,
    x: Coefficients<S>,
    residual: S,
}

impl<S: Float> Sums<S> {
    #[inline]
    pub(super) fn add(&mut self, weight: S, slope: S, x: &Coefficients<S>, residual: S) {
        self.weight = self.weight + weight;
        self.slope = self.slope + weight * slope;
        for (sum, x) in self.x.iter_mut().zip(x) {
            *sum = *sum + weight * *x;
        }
        self.residual = self.residual + weight * residual;
    }

    /// The mean residual.
    #[inline]
    pub(super) fn mean(&self) -> S {
        self.residual.over(self.weight)
    }

    fn row(&self) -> [S; WIDTH] {
        let root = self.weight.sqrt();
        let scale = root.recip();
        let mut row = [root, self.slope, S::ZERO, S::ZERO, S::ZERO, S::ZERO, S::ZERO, self.residual];
        for (entry, x) in row.iter_mut().skip(NUISANCE).zip(self.x) {
            *entry = x;
        }
        for entry in row.iter_mut().skip(1) {
            *entry = *entry * scale;
        }
        row
    }
}

/// The triangle of a stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stretch<S> {
    /// Rows one after the other, each from its diagonal to its value.
    packed: [S; ROWS * (ROWS + 3) / 2],
    /// The block that is worked in; once the stretch is whole, a place to work in.
    pub(super) pending: [S; WIDTH],
    /// Cosine and sine of the present rotation.
    turn: [S; 2],
    /// What no row explains, squared and summed.
    pub(super) unexplained: S,
    /// Blocks, a whole number.
    pub(super) blocks: S,
}

impl<S: Float> Stretch<S> {
    pub(super) fn new() -> Self {
        Self {
            packed: [S::ZERO; ROWS * (ROWS + 3) / 2],
            pending: [S::ZERO; WIDTH],
            turn: [S::ZERO; 2],
            unexplained: S::ZERO,
            blocks: S::ZERO,
        }
    }

    /// Takes a block in; [`rotate`](Self::rotate) works it into each row in turn.
    pub(super) fn push(&mut self, sums: &Sums<S>) {
        self.pending = sums.row();
    }

    /// Works the pending block into the rows, in [`STEPS`] steps of two a row; the last counts it.
    #[inline(never)]
    pub(super) fn rotate(&mut self, step: usize) {
        let (number, rest) = (step / 2, step % 2 == 1);
        let start = number * WIDTH - number * number.saturating_sub(1) / 2;
        let (Some(row), Some(new)) =
            (self.packed.get_mut(start..start + WIDTH - number), self.pending.get_mut(number..))
        else {
            return;
        };
        if !rest {
            self.turn = [S::ONE, S::ZERO];
            if let (Some(&old), Some(&x)) = (row.first(), new.first()) {
                let square = old * old + x * x;
                // What is smaller rounds away beside any other entry.
                if square > S::from_f64(1e-24) {
                    let inverse = square.sqrt().recip();
                    self.turn = [old * inverse, x * inverse];
                }
            }
        }
        let [cosine, sine] = self.turn;
        let half = if rest { HALF..row.len() } else { 0..row.len().min(HALF) };
        if let (Some(row), Some(new)) = (row.get_mut(half.clone()), new.get_mut(half)) {
            for (old, x) in row.iter_mut().zip(new) {
                (*old, *x) = (cosine * *old + sine * *x, cosine * *x - sine * *old);
            }
        }
        if step + 1 == STEPS {
            let [.., left] = self.pending;
            self.unexplained = self.unexplained + left * left;
            self.blocks = self.blocks + S::ONE;
        }
    }

    /// Coefficients in the place to work in.
    pub(super) fn scratch(&mut self) -> &mut Coefficients<S> {
        let [scratch @ .., _, _, _] = &mut self.pending;
        scratch
    }

    /// A row: its diagonal, its coefficients, and its value.
    #[inline]
    pub(super) fn row(&self, number: usize) -> (S, Coefficients<S>, S) {
        let start = number * WIDTH - number * number.saturating_sub(1) / 2;
        let mut x = [S::ZERO; COEFFICIENTS];
        let row = self.packed.get(start..start + WIDTH - number).unwrap_or(&[]);
        let (Some((value, row)), Some(&diagonal)) = (row.split_last(), row.first()) else {
            return (S::ZERO, x, S::ZERO);
        };
        for (x, entry) in x.iter_mut().rev().zip(row.iter().rev()) {
            *x = *entry;
        }
        (diagonal, x, *value)
    }

    /// What coefficients leave of each row, squared: of the offset's and the delay's rows, and of the others.
    #[inline(never)]
    pub(super) fn loss(&self, value: &Coefficients<S>) -> [S; 2] {
        let mut loss = [S::ZERO; 2];
        for number in 0..ROWS {
            let (_, x, y) = self.row(number);
            let left = y - dot(&x, value);
            let of = &mut loss[usize::from(number >= NUISANCE)];
            *of = *of + left * left;
        }
        loss
    }

    /// Sums of p², and of p·r, about their means: p is the torque of these coefficients.
    #[inline(never)]
    pub(super) fn about_mean(&self, block: &Coefficients<S>) -> [S; 2] {
        let mut sums = [S::ZERO; 2];
        for number in 1..ROWS {
            let (_, x, y) = self.row(number);
            let p = dot(&x, block);
            sums = [sums[0] + p * p, sums[1] + p * y];
        }
        sums
    }
}

/// Σ a·b.
#[inline]
pub(super) fn dot<S: Float>(a: &Coefficients<S>, b: &Coefficients<S>) -> S {
    a.iter().zip(b).fold(S::ZERO, |sum, (a, b)| sum + *a * *b)
}
