//! Loops over a few numbers, one copy of each in flash. Where the compiler unrolled them in every place that uses them, the adaptation took twice as much.
//!
//! Elsewhere a slice that goes through `black_box` has a length that the compiler does not know, and `black_box(())` within a loop keeps it from unrolling by parts.

use super::Coefficients;
use crate::scalar::Float;

/// Σ a·b.
#[inline(never)]
pub(super) fn dot<S: Float>(a: &Coefficients<S>, b: &Coefficients<S>) -> S {
    a.iter().zip(b).fold(S::ZERO, |sum, (a, b)| sum + *a * *b)
}

/// a ← a + b·factor.
#[inline(never)]
pub(super) fn add<S: Float>(a: &mut Coefficients<S>, b: &Coefficients<S>, factor: S) {
    for (a, b) in a.iter_mut().zip(b) {
        *a = *a + *b * factor;
    }
}

/// (a, b) ← (p·a + q·b, b + r·a) but for the last ones.
#[inline(never)]
pub(super) fn mix<S: Float>([a @ .., _]: &mut Coefficients<S>, [b @ .., _]: &mut Coefficients<S>, p: S, q: S, r: S) {
    for (a, b) in a.iter_mut().zip(b) {
        (*a, *b) = (p * *a + q * *b, *b + r * *a);
    }
}
