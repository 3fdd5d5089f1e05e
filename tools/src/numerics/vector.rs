//! Sums and updates of long columns, with the vector unit that the processor has; the last digits of a sum depend on it.

use pulp::{Arch, Simd, WithSimd};

/// Runs a loop over columns with the widest vectors of this processor. What it calls has to be `inline(always)`.
pub fn wide<Loop: WithSimd>(work: Loop) -> Loop::Output {
    Arch::new().dispatch(work)
}

/// Σ a·b over the rows that both have.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    wide(Dot(a, b))
}

/// y += factor·x over the rows that both have.
pub fn axpy(factor: f64, x: &[f64], y: &mut [f64]) {
    wide(Axpy(factor, x, y));
}

/// (a, b) ← (a − factor·b, b − factor·a) over the rows that both have: a step of a lattice filter.
pub fn lattice(factor: f64, a: &mut [f64], b: &mut [f64]) {
    wide(Lattice(factor, a, b));
}

/// [`dot`] within [`wide`]: four sums at a time, which hides the latency of an addition.
#[inline(always)]
pub fn dot_within<S: Simd>(simd: S, a: &[f64], b: &[f64]) -> f64 {
    let rows = a.len().min(b.len());
    let ((a, a_rest), (b, b_rest)) = (S::as_simd_f64s(&a[..rows]), S::as_simd_f64s(&b[..rows]));
    let (a4, a_last) = a.as_chunks::<4>();
    let (b4, b_last) = b.as_chunks::<4>();
    let mut sums = [simd.splat_f64s(0.0); 4];
    for (x, y) in a4.iter().zip(b4) {
        sums[0] = simd.mul_add_f64s(x[0], y[0], sums[0]);
        sums[1] = simd.mul_add_f64s(x[1], y[1], sums[1]);
        sums[2] = simd.mul_add_f64s(x[2], y[2], sums[2]);
        sums[3] = simd.mul_add_f64s(x[3], y[3], sums[3]);
    }
    for (x, y) in a_last.iter().zip(b_last) {
        sums[0] = simd.mul_add_f64s(*x, *y, sums[0]);
    }
    let (low, high) = (simd.add_f64s(sums[0], sums[1]), simd.add_f64s(sums[2], sums[3]));
    let mut sum = simd.reduce_sum_f64s(simd.add_f64s(low, high));
    for (x, y) in a_rest.iter().zip(b_rest) {
        sum += x * y;
    }
    sum
}

/// [`axpy`] within [`wide`].
#[inline(always)]
pub fn axpy_within(factor: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

struct Dot<'a>(&'a [f64], &'a [f64]);

impl WithSimd for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        dot_within(simd, self.0, self.1)
    }
}

struct Axpy<'a>(f64, &'a [f64], &'a mut [f64]);

impl WithSimd for Axpy<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        axpy_within(self.0, self.1, self.2);
    }
}

struct Lattice<'a>(f64, &'a mut [f64], &'a mut [f64]);

impl WithSimd for Lattice<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self(factor, a, b) = self;
        for (a, b) in a.iter_mut().zip(b) {
            (*a, *b) = (*a - factor * *b, *b - factor * *a);
        }
    }
}
