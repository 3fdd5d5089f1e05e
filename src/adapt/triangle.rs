//! Rows of numbers and packed triangles of rows. All of the adaptation is made of these loops, each of which is once in flash.
//!
//! A triangle has rows of lengths 1, 2, …, one after the other; the last entry of a row is on its diagonal. A plane rotation of a row and a new one turns the new one's last entry to
//! zero (Givens), so a new row folded into the rows from the longest to the shortest is zero in the end, and the triangle has the same squares as all rows together.
//!
//! A loop over two slices has two ends, so the compiler does not unroll it; one over a single slice counts by a length that goes through `black_box`.

use core::hint::black_box;
use core::ops::Range;

use super::work::ROWS;
use crate::scalar::Float;

/// What a diagonal is short of zero by: a rotation needs no case for rows of zeros.
const TINY: f64 = 1e-14;

/// Σ a·b over the shorter of both.
#[inline(never)]
pub(super) fn dot<S: Float>(a: &[S], b: &[S]) -> S {
    let mut sum = S::ZERO;
    for (a, b) in a.iter().zip(b) {
        sum = sum + *a * *b;
        black_box(());
    }
    sum
}

/// a ← a + b·factor over the shorter of both.
#[inline(never)]
pub(super) fn add<S: Float>(a: &mut [S], b: &[S], factor: S) {
    for (a, b) in black_box(a).iter_mut().zip(b) {
        *a = *a + *b * factor;
        black_box(());
    }
}

/// a ← 0. The barrier keeps the run-time library's routine out, which is longer.
#[inline(never)]
pub(super) fn clear<S: Float>(a: &mut [S]) {
    for a in a {
        *a = S::ZERO;
        black_box(());
    }
}

/// √x.
#[inline(never)]
pub(super) fn root<S: Float>(x: S) -> S {
    x.sqrt()
}

/// Rotates a and b, over the shorter of both, as it takes to turn the pair (x, y) into (√(x² + y²), 0). Returns that root.
#[inline(never)]
pub(super) fn rotate<S: Float>(x: S, y: S, a: &mut [S], b: &mut [S]) -> S {
    let x = x + S::from_f64(TINY);
    let root = (x * x + y * y).sqrt();
    let (cosine, sine) = (x.over(root), y.over(root));
    for (a, b) in a.iter_mut().zip(b) {
        (*a, *b) = (cosine * *a + sine * *b, cosine * *b - sine * *a);
        black_box(());
    }
    root
}

/// Where the row of a length is.
pub(super) fn places(length: usize) -> Range<usize> {
    let end = length * (length + 1) / 2;
    end - length..end
}

/// The row of a length.
#[inline(never)]
pub(super) fn row<S>(packed: &mut [S], length: usize) -> &mut [S] {
    let start = places(length).start.min(packed.len());
    let rest = &mut packed[start..];
    let length = length.min(rest.len());
    &mut rest[..length]
}

/// Folds a new row into one.
#[inline(never)]
pub(super) fn fold<S: Float>(row: &mut [S], new: &mut [S; ROWS]) {
    let length = row.len();
    if let (Some(&diagonal), Some(&entry)) = (row.last(), new.get(length - 1)) {
        rotate(diagonal, entry, row, new);
        // The rotation leaves a rounding error here, which later sums would include.
        if let Some(entry) = new.get_mut(length - 1) {
            *entry = S::ZERO;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_has_the_squares_of_its_rows() {
        let rows = [[1.0, -2.0, 0.5], [0.0, 3.0, 0.0], [4.0, 0.25, -1.0], [0.5, 0.5, 2.0]];
        let mut packed = [0.0_f64; 6];
        for [a, b, c] in rows {
            let mut new = [0.0_f64; ROWS];
            new[..3].copy_from_slice(&[a, b, c]);
            for length in (1..=3).rev() {
                fold(row(&mut packed, length), &mut new);
            }
            assert!(new.iter().all(|entry| entry.abs() < 1e-11), "{new:?}");
        }
        for i in 0..3 {
            for j in 0..=i {
                let of_rows: f64 = rows.iter().map(|row| row[i] * row[j]).sum();
                let of_triangle: f64 =
                    (i + 1..=3).map(|length| &packed[places(length)]).map(|row| row[i] * row[j]).sum();
                assert!((of_rows - of_triangle).abs() < 1e-10, "{i} {j}: {of_rows} and {of_triangle}");
            }
        }
    }
}
