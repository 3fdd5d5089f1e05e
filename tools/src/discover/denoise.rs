//! Angles freed of their own noise before anything is computed from them.
//!
//! A noisy deflection disturbs the model's torque and every column made of its derivatives alike, and what is common to both looks like inertia, damping or
//! a delay. Each sample is replaced by a local parabola through as many neighbours as agree with each other: the rule of intersecting confidence
//! intervals (Goldenshluger, Nemirovski 1997; Katkovnik 1999), so that reversals keep their corners.

use std::borrow::Cow;

use crate::recording::Recording;

/// Half-widths of the windows, samples.
const HALF_WIDTHS: [usize; 8] = [1, 2, 3, 4, 6, 8, 11, 15];
/// How many standard deviations the confidence intervals reach.
const REACH: f64 = 2.2;

/// The recording with its angles and velocity smoothed as far as their noise allows.
pub fn denoised(recording: &Recording) -> Cow<'_, Recording> {
    let smooth = |channel: &Option<Vec<f64>>| channel.as_deref().and_then(|x| smoothed(x, &recording.time_s));
    let (deflection, input, output, velocity) = (
        smooth(&recording.deflection_rad),
        smooth(&recording.theta_in_rad),
        smooth(&recording.theta_out_rad),
        smooth(&recording.velocity_out_rad_per_s),
    );
    if deflection.is_none() && input.is_none() && output.is_none() && velocity.is_none() {
        return Cow::Borrowed(recording);
    }
    let mut clean = recording.clone();
    clean.deflection_rad = deflection.or(clean.deflection_rad);
    clean.theta_in_rad = input.or(clean.theta_in_rad);
    clean.theta_out_rad = output.or(clean.theta_out_rad);
    clean.velocity_out_rad_per_s = velocity.or(clean.velocity_out_rad_per_s);
    Cow::Owned(clean)
}

/// The standard deviation of white noise on a smooth signal, from third differences and their median; 0 where there is none.
pub fn noise_sd(x: &[f64]) -> f64 {
    let mut thirds: Vec<f64> =
        x.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).filter(|d| *d > 0.0).collect();
    if thirds.len() < 32 {
        return 0.0;
    }
    let middle = thirds.len() / 2;
    let median = *thirds.select_nth_unstable_by(middle, f64::total_cmp).1;
    let moving = thirds.len() as f64 / x.len() as f64;
    // Var = (1 + 9 + 9 + 1) σ²; the median of abs(N(0, 1)) is 0.6745.
    moving * median / (0.6745 * 20.0_f64.sqrt())
}

fn smoothed(x: &[f64], time_s: &[f64]) -> Option<Vec<f64>> {
    let sd = noise_sd(x);
    let range = x.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x)) - x.iter().fold(f64::INFINITY, |m, x| m.min(*x));
    if sd <= 1e-9 * range {
        return None;
    }
    let weights: Vec<Vec<f64>> = HALF_WIDTHS.iter().map(|&h| parabola(h)).collect();
    let last = x.len() - 1;
    let at = |k: usize| {
        let (mut low, mut high) = (x[k] - REACH * sd, x[k] + REACH * sd);
        let mut best = x[k];
        for (half, weights) in HALF_WIDTHS.iter().zip(&weights) {
            let half = *half;
            if half > k || k + half > last || !even(&time_s[k - half..=k + half]) {
                break;
            }
            let window = &x[k - half..=k + half];
            let estimate: f64 = window.iter().zip(weights).map(|(x, w)| w * x).sum();
            let reach = REACH * sd * weights[half].sqrt();
            low = low.max(estimate - reach);
            high = high.min(estimate + reach);
            if low > high {
                break;
            }
            best = estimate;
        }
        best
    };
    Some((0..x.len()).map(at).collect())
}

/// Whether samples are evenly spaced.
fn even(time_s: &[f64]) -> bool {
    let count = time_s.len() - 1;
    let mean = (time_s[count] - time_s[0]) / count as f64;
    let middle = time_s[count / 2] - time_s[0];
    (middle - mean * (count / 2) as f64).abs() < 0.2 * mean
        && (time_s[1] - time_s[0] - mean).abs() < 0.2 * mean
        && (time_s[count] - time_s[count - 1] - mean).abs() < 0.2 * mean
}

/// The weights with which a parabola through 2h + 1 even samples is read at the middle one (Savitzky, Golay 1964).
fn parabola(half: usize) -> Vec<f64> {
    let m = half as f64;
    let count = 2.0 * m + 1.0;
    let scale = (2.0 * m - 1.0) * count * (2.0 * m + 3.0);
    if half == 1 {
        // A parabola meets three samples: a line through them instead.
        return vec![1.0 / 3.0; 3];
    }
    let weight = |i: f64| 3.0 * (3.0 * m * m + 3.0 * m - 1.0 - 5.0 * i * i) / scale;
    (0..=2 * half).map(|i| weight(i as f64 - m)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_keep_parabolas() {
        for half in [2, 3, 8] {
            let weights = parabola(half);
            let moment = |p: i32| -> f64 {
                weights.iter().enumerate().map(|(i, w)| w * (i as f64 - half as f64).powi(p)).sum()
            };
            assert!((moment(0) - 1.0).abs() < 1e-12 && moment(2).abs() < 1e-9);
        }
    }

    #[test]
    fn keeps_clean_signals_and_corners() {
        let time: Vec<f64> = (0..2000).map(|k| 0.01 * k as f64).collect();
        let sine: Vec<f64> = time.iter().map(|t| (0.3 * t).sin()).collect();
        let error = |x: &[f64], truth: &[f64]| {
            (x.iter().zip(truth).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / x.len() as f64).sqrt()
        };
        let noisy: Vec<f64> = sine.iter().enumerate().map(|(k, x)| x + 1e-4 * ((k * 7919) % 101) as f64 / 50.0).collect();
        let clean = smoothed(&noisy, &time).unwrap_or_default();
        let shift = 1e-4;
        let truth: Vec<f64> = sine.iter().map(|x| x + shift).collect();
        assert!(error(&clean, &truth) < 0.5 * error(&noisy, &truth));
        let triangle: Vec<f64> = time.iter().map(|t| (t % 2.0 - 1.0).abs()).collect();
        let noisy: Vec<f64> =
            triangle.iter().enumerate().map(|(k, x)| x + 1e-4 * (((k * 7919) % 101) as f64 / 50.0 - 1.0)).collect();
        let clean = smoothed(&noisy, &time).unwrap_or_default();
        let worst = clean.iter().zip(&triangle).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(worst < 4e-4, "{worst}");
    }
}
