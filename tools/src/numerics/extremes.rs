//! Lowest and highest values.

/// Lowest and highest value.
pub fn range<'v>(values: impl IntoIterator<Item = &'v f64>) -> (f64, f64) {
    values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)))
}

/// Highest less lowest value; −∞ of none.
pub fn width(values: &[f64]) -> f64 {
    let (low, high) = range(values);
    high - low
}

/// Largest magnitude; 0 of none.
pub fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()))
}
