//! Angles and temperatures freed of their own noise before anything is computed from them.
//!
//! What follows a noisy temperature is lost among coloured noise, whose filter leaves of a slow signal little more than its noise. A noisy deflection disturbs
//! the model's torque and every column made of its derivatives alike, and what is common to both looks like inertia, damping or a delay. Each sample is replaced by a local parabola through as many neighbours as agree with each other: the rule of intersecting confidence
//! intervals (Goldenshluger, Nemirovski 1997; Katkovnik 1999), so that reversals keep their corners.

use std::borrow::Cow;
use std::ops::Range;

use rayon::prelude::*;

use super::noise::quantisation_step;
use crate::physics::signals::rate;
use crate::recording::Recording;

/// Half-widths of the windows, samples.
const HALF_WIDTHS: [usize; 8] = [1, 2, 3, 4, 6, 8, 11, 15];
/// How many standard deviations the confidence intervals reach.
const REACH: f64 = 2.2;

/// The recording with its angles, velocity and temperature smoothed as far as their noise allows. Where the deflection follows from two angles and the ratio, it is
/// written out first.
pub fn denoised(recording: &Recording, ratio: Option<f64>) -> Cow<'_, Recording> {
    let derived = match (&recording.deflection_rad, &recording.theta_in_rad, &recording.theta_out_rad, ratio) {
        (None, Some(input), Some(output), Some(ratio)) => {
            Some(input.iter().zip(output).map(|(q_m, q_o)| q_m / ratio - q_o).collect())
        }
        (deflection, ..) => deflection.clone(),
    };
    let deflection = derived.as_deref().and_then(|x| smoothed(x, &recording.time_s));
    let deflection = deflection.or(derived.filter(|_| recording.deflection_rad.is_none()));
    let smooth = |channel: &Option<Vec<f64>>| channel.as_deref().and_then(|x| whittaker(x, &recording.time_s));
    let (input, output, mut velocity) =
        (smooth(&recording.theta_in_rad), smooth(&recording.theta_out_rad), smooth(&recording.velocity_out_rad_per_s));
    let temperature = smooth(&recording.temperature_c);
    let output = consistent(recording, ratio, deflection.as_deref(), input.as_deref()).or(output);
    let angle = output.as_deref().or(recording.theta_out_rad.as_deref());
    if let (Some(angle), Some(recorded)) = (angle, recording.velocity_out_rad_per_s.as_deref()) {
        let derived = rate(angle, &recording.time_s);
        let apart = derived.iter().zip(recorded).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / derived.len() as f64;
        // A recorded velocity that differs from that of the angle by its own noise alone adds nothing but that noise.
        if apart.sqrt() < 1.5 * noise_sd(recorded) {
            velocity = Some(derived);
        }
    }
    if [&deflection, &input, &output, &velocity, &temperature].iter().all(|channel| channel.is_none()) {
        return Cow::Borrowed(recording);
    }
    let mut clean = recording.clone();
    clean.deflection_rad = deflection.or(clean.deflection_rad);
    clean.theta_in_rad = input.or(clean.theta_in_rad);
    clean.theta_out_rad = output.or(clean.theta_out_rad);
    clean.velocity_out_rad_per_s = velocity.or(clean.velocity_out_rad_per_s);
    clean.temperature_c = temperature.or(clean.temperature_c);
    Cow::Owned(clean)
}

/// The output angle that goes with the smoothed deflection, where the recorded one differs from it by noise alone: two smoothings of one sensor would look like two signals.
fn consistent(
    recording: &Recording,
    ratio: Option<f64>,
    deflection: Option<&[f64]>,
    input: Option<&[f64]>,
) -> Option<Vec<f64>> {
    let (deflection, ratio) = (deflection?, ratio?);
    let input = input.or(recording.theta_in_rad.as_deref())?;
    let recorded = recording.theta_out_rad.as_deref()?;
    let derived: Vec<f64> = input.iter().zip(deflection).map(|(q, theta)| q / ratio - theta).collect();
    let apart = derived.iter().zip(recorded).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / derived.len() as f64;
    (apart.sqrt() < 3.0 * channel_sd(recorded)).then_some(derived)
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

/// The standard deviation of a channel's noise, that of its resolution included.
fn channel_sd(x: &[f64]) -> f64 {
    let resolution = quantisation_step(x).unwrap_or(0.0) / 12.0_f64.sqrt();
    noise_sd(x).max(resolution)
}

fn smoothed(x: &[f64], time_s: &[f64]) -> Option<Vec<f64>> {
    let sd = channel_sd(x);
    let range = x.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x)) - x.iter().fold(f64::INFINITY, |m, x| m.min(*x));
    if sd <= 1e-9 * range {
        return None;
    }
    // A movement without corners is smoothed as a whole.
    if let Some(whole) = whittaker(x, time_s).filter(|whole| only_noise(x, whole, sd)) {
        return Some(whole);
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

/// Rows between two gaps in time are smoothed apart, and at least so many of them.
const FEWEST_ROWS: usize = 32;

/// The smoothest signal that differs from the recorded one by no more than its noise: Whittaker's graduation with third differences (1923), its weight by
/// Morozov's discrepancy principle, of the noise only what the graduation takes out. For angles and speeds, whose derivatives count and whose corners are of no consequence.
fn whittaker(x: &[f64], time_s: &[f64]) -> Option<Vec<f64>> {
    let sd = channel_sd(x);
    let range = x.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x)) - x.iter().fold(f64::INFINITY, |m, x| m.min(*x));
    if sd <= 1e-9 * range {
        return None;
    }
    // Where counts are all the noise there is, it is bounded.
    let resolution = quantisation_step(x).filter(|step| noise_sd(x) < 0.45 * step);
    let mut smooth = x.to_vec();
    for piece in pieces(time_s).into_iter().filter(|piece| piece.len() >= FEWEST_ROWS) {
        let (rows, out) = (&x[piece.clone()], &mut smooth[piece]);
        match resolution {
            Some(step) => unround(rows, 0.5 * step, sd, out),
            None => graduate(rows, sd, out),
        }
    }
    Some(smooth)
}

/// The rows between gaps in time.
fn pieces(time_s: &[f64]) -> Vec<Range<usize>> {
    let mut periods: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
    let middle = periods.len() / 2;
    let usual = *periods.select_nth_unstable_by(middle, f64::total_cmp).1;
    let gaps = (1..time_s.len()).filter(|&k| time_s[k] - time_s[k - 1] > 2.5 * usual);
    let ends: Vec<usize> = gaps.chain([time_s.len()]).collect();
    let starts = [0].into_iter().chain(ends.iter().copied());
    starts.zip(&ends).map(|(from, to)| from..*to).collect()
}

fn graduate(x: &[f64], sd: f64, out: &mut [f64]) {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    let centred: Vec<f64> = x.iter().map(|x| x - mean).collect();
    let chance = 1.0 + (2.0 / x.len() as f64).sqrt();
    let weight = discrepant_weight(&centred, |weight| sd * (chance * noise_left(weight)).sqrt());
    for (out, smooth) in out.iter_mut().zip(Graduation::new(x.len(), weight).smooth(&centred)) {
        *out = mean + smooth;
    }
}

/// Which part of the variance of white noise a graduation takes out of a record: the mean of (1 − H)² over all frequencies.
fn noise_left(weight: f64) -> f64 {
    const FREQUENCIES: usize = 512;
    let left = (0..FREQUENCIES).map(|k| {
        let w = std::f64::consts::PI * (k as f64 + 0.5) / FREQUENCIES as f64;
        let kept = 1.0 / (1.0 + weight * (2.0 * (0.5 * w).sin()).powi(6));
        (1.0 - kept) * (1.0 - kept)
    });
    left.sum::<f64>() / FREQUENCIES as f64
}

/// The highest weight at which a graduation differs from the record by no more than `misfit` of that weight.
fn discrepant_weight(centred: &[f64], misfit: impl Fn(f64) -> f64) -> f64 {
    let rms = |smooth: &[f64]| {
        (smooth.iter().zip(centred).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / centred.len() as f64).sqrt()
    };
    let (mut low, mut high) = (-2.0_f64, 12.0_f64);
    for _ in 0..18 {
        let middle = 0.5 * (low + high);
        let weight = 10.0_f64.powf(middle);
        let smooth = Graduation::new(centred.len(), weight).smooth(centred);
        if rms(&smooth) > misfit(weight) { high = middle } else { low = middle }
    }
    10.0_f64.powf(low)
}

/// Whether a smoothed signal differs from the record by white noise, nowhere by more.
fn only_noise(x: &[f64], smooth: &[f64], sd: f64) -> bool {
    let apart: Vec<f64> = x.iter().zip(smooth).map(|(a, b)| a - b).collect();
    [1_usize, 4, 12].into_iter().all(|width| {
        let most = FARTHEST * sd * (width as f64).sqrt();
        apart.windows(width).all(|w| w.iter().sum::<f64>().abs() < most)
    })
}

/// Standard deviations that one of ten thousand sums of noise may be away.
const FARTHEST: f64 = 4.8;

/// Steps of the method of multipliers.
const ROUNDS: usize = 150;

/// The smoothest signal that rounds to the recorded one: least Σ (Δ³s)² with abs(s − x) ≤ half a count, by the alternating direction method of multipliers
/// (Boyd and others 2011). Standstill stays standstill, and corners stay within half a count.
fn unround(x: &[f64], half: f64, sd: f64, out: &mut [f64]) {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    let centred: Vec<f64> = x.iter().map(|x| x - mean).collect();
    let graduation = Graduation::new(x.len(), discrepant_weight(&centred, |_| sd));
    let mut inside = centred.clone();
    let mut multiplier = vec![0.0; x.len()];
    let mut smooth = centred.clone();
    for _ in 0..ROUNDS {
        let aim: Vec<f64> = inside.iter().zip(&multiplier).map(|(z, u)| z - u).collect();
        smooth = graduation.smooth(&aim);
        for (((z, u), s), x) in inside.iter_mut().zip(&mut multiplier).zip(&smooth).zip(&centred) {
            *z = (s + *u).clamp(x - half, x + half);
            *u += s - *z;
        }
    }
    out.iter_mut().zip(&smooth).for_each(|(out, s)| *out = mean + s);
}

/// Rows that are unrounded together, and rows on both sides that only lead in and out.
const BLOCK: usize = 4096;
const LEAD: usize = 64;

/// A deflection that was counted in steps, as the smoothest motion that rounds to it; `None` where it was not, or where its steps are below `finest`.
pub fn unrounded(x: &[f64], time_s: &[f64], finest: f64) -> Option<Vec<f64>> {
    let step = quantisation_step(x).filter(|step| *step > finest)?;
    let runs = pieces(time_s);
    let blocks = runs.into_iter().flat_map(|run| {
        let count = run.len().div_ceil(BLOCK);
        (0..count)
            .map(move |k| (run.clone(), run.start + run.len() * k / count..run.start + run.len() * (k + 1) / count))
    });
    let blocks: Vec<(Range<usize>, Range<usize>)> = blocks.collect();
    let smooth = |(run, block): &(Range<usize>, Range<usize>)| {
        let wide = block.start.saturating_sub(LEAD).max(run.start)..(block.end + LEAD).min(run.end);
        let mut out = x[wide.clone()].to_vec();
        if wide.len() >= FEWEST_ROWS {
            unround(&x[wide.clone()], 0.5 * step, step / 12.0_f64.sqrt(), &mut out);
        }
        out[block.start - wide.start..][..block.len()].to_vec()
    };
    Some(blocks.par_iter().flat_map_iter(smooth).collect())
}

/// Minimises Σ (s − x)² + weight·Σ (Δ³s)²: a system of seven diagonals, by Cholesky.
struct Graduation {
    /// Lower band of the factor: `band[i][k]` is the element (i, i − k).
    band: Vec<[f64; 4]>,
}

impl Graduation {
    fn new(n: usize, weight: f64) -> Self {
        const DIFFERENCE: [f64; 4] = [-1.0, 3.0, -3.0, 1.0];
        let mut band = vec![[1.0, 0.0, 0.0, 0.0]; n];
        for row in 0..n.saturating_sub(3) {
            for a in 0..4 {
                for b in 0..=a {
                    band[row + a][a - b] += weight * DIFFERENCE[a] * DIFFERENCE[b];
                }
            }
        }
        for i in 0..n {
            for k in (1..=3.min(i)).rev() {
                let known: f64 = (k + 1..=3.min(i)).map(|l| band[i][l] * band[i - k][l - k]).sum();
                band[i][k] = (band[i][k] - known) / band[i - k][0];
            }
            let squares: f64 = (1..=3.min(i)).map(|k| band[i][k] * band[i][k]).sum();
            band[i][0] = (band[i][0] - squares).max(1e-300).sqrt();
        }
        Self { band }
    }

    fn smooth(&self, x: &[f64]) -> Vec<f64> {
        let mut y = x.to_vec();
        let mut before = [0.0; 3];
        for (y, [own, first, second, third]) in y.iter_mut().zip(&self.band) {
            let [a, b, c] = before;
            *y = (*y - (first * a + second * b + third * c)) / own;
            before = [*y, a, b];
        }
        let zero = [1.0, 0.0, 0.0, 0.0];
        let mut after = [(0.0, zero); 3];
        for (y, band) in y.iter_mut().zip(&self.band).rev() {
            let [(a, below), (b, second), (c, third)] = after;
            *y = (*y - (below[1] * a + second[2] * b + third[3] * c)) / band[0];
            after = [(*y, *band), (a, below), (b, second)];
        }
        y
    }
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
            let moment =
                |p: i32| -> f64 { weights.iter().enumerate().map(|(i, w)| w * (i as f64 - half as f64).powi(p)).sum() };
            assert!((moment(0) - 1.0).abs() < 1e-12 && moment(2).abs() < 1e-9);
        }
    }

    #[test]
    fn graduation_solves_its_equations_and_keeps_parabolas() {
        let x: Vec<f64> = (0..40).map(|k| ((k * 37) % 17) as f64).collect();
        let s = Graduation::new(40, 7.0).smooth(&x);
        let third = |k: usize| s[k + 3] - 3.0 * s[k + 2] + 3.0 * s[k + 1] - s[k];
        for i in 0..40_usize {
            let gradient: f64 = (0..4)
                .filter_map(|a| i.checked_sub(a).filter(|k| k + 3 < 40).map(|k| [-1.0, 3.0, -3.0, 1.0][a] * third(k)))
                .sum();
            assert!((s[i] - x[i] + 7.0 * gradient).abs() < 1e-9);
        }
        let parabola: Vec<f64> = (0..40).map(|k| 0.5 * (k * k) as f64 - 3.0).collect();
        let kept = Graduation::new(40, 1e6).smooth(&parabola);
        assert!(kept.iter().zip(&parabola).all(|(a, b)| (a - b).abs() < 1e-4));
    }

    #[test]
    fn a_counted_motion_is_found_within_its_counts() {
        let rows = 10_000;
        let time: Vec<f64> = (0..rows).map(|k| 0.01 * k as f64).collect();
        let motion: Vec<f64> = time.iter().map(|t| t.sin() + 0.3 * (0.31 * t).cos()).collect();
        let step = 0.007;
        let counts: Vec<f64> = motion.iter().map(|x| (x / step).round() * step).collect();
        let found = unrounded(&counts, &time, 1e-4).unwrap_or_default();
        let rms = |x: &[f64]| (x.iter().zip(&motion).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / rows as f64).sqrt();
        assert!(rms(&found) < 0.15 * rms(&counts), "{:e} of {:e}", rms(&found), rms(&counts));
        assert!(found.iter().zip(&counts).all(|(a, b)| (a - b).abs() < 0.6 * step));
        assert_eq!(unrounded(&motion, &time, 1e-4), None);
        assert_eq!(unrounded(&counts, &time, 0.01), None);
    }

    #[test]
    fn keeps_clean_signals_and_corners() {
        let time: Vec<f64> = (0..2000).map(|k| 0.01 * k as f64).collect();
        let sine: Vec<f64> = time.iter().map(|t| (0.3 * t).sin()).collect();
        let error = |x: &[f64], truth: &[f64]| {
            (x.iter().zip(truth).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / x.len() as f64).sqrt()
        };
        let noisy: Vec<f64> =
            sine.iter().enumerate().map(|(k, x)| x + 1e-4 * ((k * 7919) % 101) as f64 / 50.0).collect();
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
