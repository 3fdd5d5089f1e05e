//! A stretch of motion compressed into seven rows: what its samples say of the coefficients, its offset and its delay apart.
//!
//! Samples are averaged over blocks of 25 ms, each with its weight w; a block is one row √Σw·[1, ṗ, x1 … x5 | r] of means: p the block's own torque, ṗ its change a period, x the regressors,
//! r the measured torque less p. Givens rotations keep the triangle of these rows. Whatever an offset or a delay of the signal explains is in the first two columns, so
//! the five rows below say what the coefficients alone can explain.

use core::hint::black_box;
use core::ops::Range;

use super::kernel::add;
use super::{COEFFICIENTS, Coefficients};
use crate::scalar::Float;

/// Columns before those of the coefficients: offset and delay.
pub(super) const NUISANCE: usize = 2;
/// Rows of the triangle.
pub(super) const ROWS: usize = NUISANCE + COEFFICIENTS;
/// A row with its value.
const WIDTH: usize = ROWS + 1;

/// Weighted sums of the samples of a block. While a stretch is worked on, a place to work in: what it has of the next block is lost.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Sums<S> {
    pub(super) weight: S,
    slope: S,
    pub(super) x: Coefficients<S>,
    residual: S,
}

impl<S: Float> Sums<S> {
    #[inline]
    pub(super) fn add(&mut self, weight: S, slope: S, x: &Coefficients<S>, residual: S) {
        self.weight = self.weight + weight;
        self.slope = self.slope + weight * slope;
        add(&mut self.x, x, weight);
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

    /// Works the pending block into a row, two entries from `from` on; says whether the row has more.
    #[inline(never)]
    pub(super) fn rotate(&mut self, number: usize, from: usize) -> bool {
        let (Some(row), Some(new)) = (self.packed.get_mut(places(number)), self.pending.get_mut(number..)) else {
            return false;
        };
        if from == 0 {
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
        for place in [from, from + 1] {
            if let (Some(old), Some(x)) = (row.get_mut(place), new.get_mut(place)) {
                (*old, *x) = (cosine * *old + sine * *x, cosine * *x - sine * *old);
            }
        }
        from + 2 < row.len()
    }

    /// Counts the block that was worked in.
    pub(super) fn count(&mut self) {
        let [.., left] = self.pending;
        self.unexplained = self.unexplained + left * left;
        self.blocks = self.blocks + S::ONE;
    }

    /// Coefficients in the place to work in.
    pub(super) fn scratch(&mut self) -> &mut Coefficients<S> {
        let [scratch @ .., _, _, _] = &mut self.pending;
        scratch
    }

    /// A row: its diagonal, its coefficients, and its value.
    #[inline(never)]
    pub(super) fn row(&self, number: usize) -> (S, Coefficients<S>, S) {
        let mut x = [S::ZERO; COEFFICIENTS];
        let row = self.packed.get(places(number)).unwrap_or(&[]);
        let (Some((value, row)), Some(&diagonal)) = (row.split_last(), row.first()) else {
            return (S::ZERO, x, S::ZERO);
        };
        for (x, entry) in black_box(x.as_mut_slice()).iter_mut().rev().zip(row.iter().rev()) {
            *x = *entry;
            black_box(());
        }
        (diagonal, x, *value)
    }
}

/// Where a row is.
fn places(number: usize) -> Range<usize> {
    let start = number * WIDTH - number * number.saturating_sub(1) / 2;
    start..start + WIDTH - number
}
