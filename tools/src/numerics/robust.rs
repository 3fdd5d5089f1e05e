//! Statistics that single large values hardly move.

/// The median absolute value of standard normal noise, Φ⁻¹(3/4).
const OF_NORMAL: f64 = 0.6745;

/// The middle one of the values in order, of an even count the upper of the two in the middle; 0 of none. Reorders the values.
pub fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// The standard deviation of normal noise of these absolute values, from their median (Hampel 1974); 0 of none. Reorders the values.
pub fn standard_deviation(sizes: &mut [f64]) -> f64 {
    median(sizes) / OF_NORMAL
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_far_value_moves_neither() {
        assert_eq!(median(&mut [3.0, 1e9, 1.0]), 3.0);
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 3.0]), 3.0);
        assert_eq!(median(&mut []), 0.0);
        assert!((standard_deviation(&mut [0.6745, 0.1, 1e9]) - 1.0).abs() < 1e-12);
    }
}
