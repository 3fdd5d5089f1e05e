//! Angles and temperatures freed of their own noise before anything is computed from them.
//!
//! What follows a noisy temperature is lost among coloured noise, whose filter leaves of a slow signal little more than its noise. A noisy deflection disturbs
//! the model's torque and every column made of its derivatives alike, and what is common to both looks like inertia, damping or a delay. Each sample is replaced by a local parabola through as many neighbours as agree with each other: the rule of intersecting confidence
//! intervals (Goldenshluger, Nemirovski 1997; Katkovnik 1999), so that reversals keep their corners.

use std::borrow::Cow;
use std::ops::Range;

use crate::numerics::autoregression::quantisation_step;
use crate::numerics::robust;
use crate::numerics::smoothing::{Graduation, noise_taken_by, unround};
use crate::physics::signals::rate;
use crate::recording::{Recording, Samples};

/// Half-widths of the windows, samples.
const HALF_WIDTHS: [usize; 7] = [2, 3, 4, 6, 8, 11, 15];
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
    let deflection = derived.as_deref().and_then(|x| smoothed(x, &recording.time_s)).map(Samples::from);
    let deflection = deflection.or(derived.filter(|_| recording.deflection_rad.is_none()));
    let smooth =
        |channel: &Option<Samples>| channel.as_deref().and_then(|x| whittaker(x, channel_sd(x), &recording.time_s));
    let (input, output, mut velocity) =
        (smooth(&recording.theta_in_rad), smooth(&recording.theta_out_rad), smooth(&recording.velocity_out_rad_per_s));
    let temperature = recording.temperature_c.as_deref().and_then(|x| whittaker(x, sd_of_slow(x), &recording.time_s));
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
    if deflection.is_none() && [&input, &output, &velocity, &temperature].iter().all(|channel| channel.is_none()) {
        return Cow::Borrowed(recording);
    }
    let mut clean = recording.clone();
    clean.deflection_rad = deflection.or(clean.deflection_rad);
    clean.theta_in_rad = input.map(Samples::from).or(clean.theta_in_rad);
    clean.theta_out_rad = output.map(Samples::from).or(clean.theta_out_rad);
    clean.velocity_out_rad_per_s = velocity.map(Samples::from).or(clean.velocity_out_rad_per_s);
    clean.temperature_c = temperature.map(Samples::from).or(clean.temperature_c);
    Cow::Owned(clean)
}

/// The standard deviation of the white noise of an angle or a velocity, that of its resolution included; 0 where it has none. Noise is what third differences hold as much of as
/// sixth ones do: those of a movement without noise fall from order to order.
pub(crate) fn white_sd(x: &[f64]) -> f64 {
    let largest = x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let (third, sixth) = (sd_by(3, x), sd_by(6, x));
    if third <= 1e-9 * largest || sixth <= 0.5 * third { 0.0 } else { sixth.min(third).max(resolution_sd(x)) }
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
    sd_by(3, x)
}

/// The same from differences of any order.
fn sd_by(order: usize, x: &[f64]) -> f64 {
    let mut weights = vec![1.0];
    let mut gain = 1.0;
    for k in 1..=order {
        weights.push(-weights[k - 1] * (order + 1 - k) as f64 / k as f64);
        gain *= (order + k) as f64 / k as f64;
    }
    let difference = |w: &[f64]| w.iter().rev().zip(&weights).map(|(x, c)| c * x).sum::<f64>().abs();
    // Less is the rounding of the numbers themselves.
    let rounding = 64.0 * f64::EPSILON * x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let mut differences: Vec<f64> = x.windows(order + 1).map(difference).filter(|d| *d > rounding).collect();
    if differences.len() < 32 {
        return 0.0;
    }
    let moving = differences.len() as f64 / x.len() as f64;
    // The variance of a difference is σ² times the sum of its squared weights.
    moving * robust::standard_deviation(&mut differences) / gain.sqrt()
}

/// The standard deviation of a channel's noise, that of its resolution included.
pub(crate) fn channel_sd(x: &[f64]) -> f64 {
    noise_sd(x).max(resolution_sd(x))
}

/// The same of a slow signal. Were the estimate from differences too small, be it by one per cent, no smoothing but the lightest would leave so little; within its error the noise is what a graduation takes
/// out.
fn sd_of_slow(x: &[f64]) -> f64 {
    let sd = channel_sd(x);
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    let centred: Vec<f64> = x.iter().map(|x| x - mean).collect();
    let most = sd * (1.0 + MOST_OF_ERROR * ERROR_OF_SD / (x.len() as f64).sqrt());
    noise_taken_by(&centred, WEIGHT_OF_SLOW).max(sd).min(most)
}

/// The weight at which a graduation takes half of a wave of 20 samples.
const WEIGHT_OF_SLOW: f64 = 1e3;
/// The standard deviation of white noise from the median of n third differences is unsure by this part of it over √n (simulated with n = 1000 and 5000: 1.5 and 1.4),
const ERROR_OF_SD: f64 = 1.5;
/// and not too small by more than so many times that.
const MOST_OF_ERROR: f64 = 3.0;

fn resolution_sd(x: &[f64]) -> f64 {
    quantisation_step(x).unwrap_or(0.0) / 12.0_f64.sqrt()
}

fn smoothed(x: &[f64], time_s: &[f64]) -> Option<Vec<f64>> {
    let sd = channel_sd(x);
    let range = x.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x)) - x.iter().fold(f64::INFINITY, |m, x| m.min(*x));
    if sd <= 1e-9 * range {
        return None;
    }
    // A movement without corners is smoothed as a whole.
    if let Some(whole) = whittaker(x, sd, time_s).filter(|whole| only_noise(x, whole, sd)) {
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
pub(crate) const FEWEST_ROWS: usize = 32;

/// The smoothest signal that differs from the recorded one by no more than its noise: Whittaker's graduation with third differences (1923), its weight by
/// Morozov's discrepancy principle, of the noise only what the graduation takes out. For angles and speeds, whose derivatives count and whose corners are of no consequence.
fn whittaker(x: &[f64], sd: f64, time_s: &[f64]) -> Option<Vec<f64>> {
    let range = x.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x)) - x.iter().fold(f64::INFINITY, |m, x| m.min(*x));
    if sd <= 1e-9 * range {
        return None;
    }
    let resolution = step_of_counts(x);
    let mut smooth = x.to_vec();
    for piece in pieces(time_s).into_iter().filter(|piece| piece.len() >= FEWEST_ROWS) {
        let (rows, out) = (&x[piece.clone()], &mut smooth[piece]);
        match resolution {
            Some(step) => out.copy_from_slice(
                unround(rows.as_chunks::<1>().0, 0.5 * step, sd.min(MOST_OF_A_COUNT * step)).as_flattened(),
            ),
            None => graduate(rows, sd, out),
        }
    }
    Some(smooth)
}

/// Of a channel whose counts are all the noise it has, at most this part of a count is noise.
const MOST_OF_A_COUNT: f64 = 0.45;
/// A noise is estimated of at least so many samples.
const FEWEST_OF_NOISE: usize = 256;

/// The step of a channel whose counts are all the noise it has, which is bounded then. At half a count a sample rounding alternates, which differences take for more noise than it is; of every second
/// or third sample it does not.
fn step_of_counts(x: &[f64]) -> Option<f64> {
    let of_every = |stride: usize| noise_sd(&x.iter().step_by(stride).copied().collect::<Vec<f64>>());
    let strides = [2, 3].into_iter().filter(|stride| x.len() >= FEWEST_OF_NOISE * stride);
    let least = || strides.map(of_every).fold(noise_sd(x), f64::min);
    quantisation_step(x).filter(|step| least() < MOST_OF_A_COUNT * step)
}

/// The recording with each angle whose counts are all the noise it has replaced by the smoothest motion that gives these counts: the counts of a slow motion have a rate in one row of
/// many, and lines instead of white noise.
pub fn uncounted(recording: &Recording) -> Cow<'_, Recording> {
    let motion = |channel: &Option<Samples>| {
        channel
            .as_deref()
            .filter(|x| step_of_counts(x).is_some())
            .and_then(|x| whittaker(x, channel_sd(x), &recording.time_s))
    };
    let (input, output) = (motion(&recording.theta_in_rad), motion(&recording.theta_out_rad));
    if input.is_none() && output.is_none() {
        return Cow::Borrowed(recording);
    }
    let mut smooth = recording.clone();
    smooth.theta_in_rad = input.map(Samples::from).or(smooth.theta_in_rad);
    smooth.theta_out_rad = output.map(Samples::from).or(smooth.theta_out_rad);
    Cow::Owned(smooth)
}

/// The rows between gaps in time.
pub(crate) fn pieces(time_s: &[f64]) -> Vec<Range<usize>> {
    let mut periods: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
    let median = robust::median(&mut periods);
    let gaps = (1..time_s.len()).filter(|&k| time_s[k] - time_s[k - 1] > 2.5 * median);
    let ends: Vec<usize> = gaps.chain([time_s.len()]).collect();
    let starts = [0].into_iter().chain(ends.iter().copied());
    starts.zip(&ends).map(|(from, to)| from..*to).collect()
}

fn graduate(x: &[f64], sd: f64, out: &mut [f64]) {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    out.iter_mut().zip(x).for_each(|(out, x)| *out = x - mean);
    Graduation::of_noise(out, sd).smooth(out);
    out.iter_mut().for_each(|x| *x += mean);
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
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

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
    fn a_slow_angle_is_uncounted_at_half_a_count_a_sample_too() {
        // At half a count a sample third differences of the counts look like noise of half a count.
        let step = 3.8e-4;
        for counts_a_sample in [0.2, 0.47, 0.5, 0.53, 0.9, 1.5] {
            let time: Vec<f64> = (0..3000).map(|k| 0.002 * f64::from(k)).collect();
            let speed = counts_a_sample * step / 0.002;
            let angle: Vec<f64> = time.iter().map(|t| speed * (t + 0.05 * t.sin())).collect();
            let counted = angle.iter().map(|q| (q / step).round() * step).collect::<Vec<f64>>();
            let recording =
                Recording { theta_out_rad: Some(counted.into()), time_s: time.clone().into(), ..Recording::default() };
            let found = rate(uncounted(&recording).theta_out_rad.as_deref().unwrap(), &time);
            let off =
                found[100..2900].iter().zip(&time[100..]).map(|(v, t)| (v - speed * (1.0 + 0.05 * t.cos())).abs());
            let most = off.fold(0.0, f64::max);
            assert!(most < 0.15 * step / 0.002, "{most} rad/s at {counts_a_sample} counts a sample");
        }
    }

    #[test]
    fn a_slow_temperature_loses_its_noise_however_that_is_estimated() {
        for seed in 0..20_u64 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let mut noise = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
            let time: Vec<f64> = (0..5000).map(|k| 0.01 * f64::from(k)).collect();
            let truth: Vec<f64> = time.iter().map(|t| 20.0 + 5.0 * (0.3 * t).sin()).collect();
            let recorded: Vec<f64> = truth.iter().map(|x| (100.0 * (x + 0.05 * noise())).round() / 100.0).collect();
            let recording =
                Recording { temperature_c: Some(recorded.into()), time_s: time.into(), ..Recording::default() };
            let clean = denoised(&recording, None);
            let temperature = clean.temperature_c.as_deref().unwrap();
            let squares: f64 = temperature.iter().zip(&truth).map(|(a, b)| (a - b).powi(2)).sum();
            let off = (squares / 5000.0).sqrt();
            assert!(off < 0.015, "{off} K with seed {seed}");
        }
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
