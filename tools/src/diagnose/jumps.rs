//! Jumps: rows from which on the torque is another by a constant. An autoregression follows a jump at the price of one row, which stands out of what it brings anew.

use crate::numerics::robust;
use crate::numerics::vector::dot;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

/// A jump stands out of the other rows by so many standard deviations,
const STANDS_OUT: f64 = 7.0;

/// and gains so much more than a fault of that row alone.
const STAYS: f64 = 20.0;

/// Jumps of a recording at most.
const MOST: usize = 3;

/// A step for each jump in what a fit leaves, the highest jumps of each recording.
pub fn steps(dataset: &Dataset<'_>, fit: &Fitted) -> Vec<Vec<f64>> {
    let layout = dataset.layout();
    let white = layout.whiten(&fit.noise, &fit.residual);
    let mut sizes: Vec<f64> = white.iter().map(|w| w.abs()).filter(|w| *w > 0.0).collect();
    if sizes.len() < 32 {
        return Vec::new();
    }
    let sd = robust::standard_deviation(&mut sizes);
    let mut found = Vec::new();
    for span in &dataset.spans {
        let mut rows: Vec<usize> = span.clone().skip(2).filter(|row| white[*row].abs() > STANDS_OUT * sd).collect();
        rows.sort_by(|a, b| white[*b].abs().total_cmp(&white[*a].abs()));
        for row in rows.into_iter().take(MOST) {
            let line = |end: usize| {
                let mut line = vec![0.0; white.len()];
                line[row..end].fill(1.0);
                line
            };
            let gain = |line: &[f64]| {
                let own = layout.whiten(&fit.noise, line);
                dot(&own, &white).powi(2) / dot(&own, &own).max(f64::MIN_POSITIVE)
            };
            let step = line(span.end);
            if gain(&step) > gain(&line(row + 1)).max(gain(&line((row + 2).min(span.end)))) + STAYS * sd * sd {
                found.push(step);
            }
        }
    }
    found
}
