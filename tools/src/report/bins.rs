//! Rows in bins of a coordinate, for pictures.

/// Bins of a curve over a coordinate.
pub const BINS: usize = 60;

/// From where to where a coordinate is drawn: all of it, but not the far ends of which a row in a hundred makes a picture of nothing.
pub fn drawn_range(x: &[f64]) -> (f64, f64) {
    let mut sorted: Vec<f64> = x.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return (0.0, 0.0) };
    let (whole, core) = ((sorted[0], sorted[last]), (sorted[last / 200], sorted[last - last / 200]));
    if whole.1 - whole.0 > FAR * (core.1 - core.0) && core.1 > core.0 { core } else { whole }
}

/// Ends that stretch a coordinate by more than this are not drawn.
const FAR: f64 = 3.0;

/// Means of a residual over bins of a coordinate, with their standard errors.
pub fn binned(x: &[f64], y: &[f64]) -> (Vec<(f64, f64)>, Vec<f64>) {
    let (low, high) = drawn_range(x);
    let width = ((high - low) / BINS as f64).max(f64::MIN_POSITIVE);
    let mut sums = vec![(0.0, 0.0, 0.0); BINS];
    for i in (0..x.len()).filter(|&i| (low..=high).contains(&x[i])) {
        let bin = (((x[i] - low) / width) as usize).min(BINS - 1);
        let (n, sum, squares) = &mut sums[bin];
        (*n, *sum, *squares) = (*n + 1.0, *sum + y[i], *squares + y[i] * y[i]);
    }
    let filled = sums.iter().enumerate().filter(|(_, (n, ..))| *n >= 8.0);
    filled
        .map(|(bin, (n, sum, squares))| {
            let mean = sum / n;
            let sd = (squares / n - mean * mean).max(0.0).sqrt();
            ((low + (bin as f64 + 0.5) * width, mean), sd / n.sqrt())
        })
        .unzip()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_over_bins_average_noise_away() {
        let x: Vec<f64> = (0..6000).map(|i| f64::from(i % 60)).collect();
        let y: Vec<f64> = x.iter().enumerate().map(|(i, x)| x + if (i / 60) % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let (points, _) = binned(&x, &y);
        assert!(points.len() > 50);
        assert!(points.iter().all(|(x, y)| (x - y).abs() < 0.6));
    }
}
