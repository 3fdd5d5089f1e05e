//! The acceleration of a motion that was recorded with noise.
//!
//! A second derivative amplifies the noise of an angle by the fourth power of the frequency: what is left of one that was smoothed well enough for an angle is still mostly
//! noise, and what is smoothed harder loses its corners. Either biases what follows the acceleration: noise makes an inertia too small, lost corners make it too large. Wiener's
//! filter (1949) does neither: it is what the acceleration is expected to be, given the record, so regressions on it are not biased (regression calibration; Carroll,
//! Ruppert, Stefanski, Crainiceanu, *Measurement Error in Nonlinear Models*, 2006, chapter 4). The power of the motion is that of the record, band by band, less that of
//! the noise.

use std::f64::consts::TAU;

use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

use crate::model::{Model, TorqueSide};
use crate::numerics::vector::dot;
use crate::physics::Signals;
use crate::physics::signals::{curvature, rate};
use crate::recording::Recording;
use crate::signal::denoise::{FEWEST_ROWS, pieces, white_sd};

/// Rows that are filtered together, and bins on both sides over which their power is averaged.
const STRETCH: usize = 256;
const BINS: usize = 4;

/// Power that does not stand out of the noise by this factor is taken for noise, and so is all above that frequency: counts of an even motion have lines of their own there. What is
/// left of a motion then is less, but no more biased.
const STANDS_OUT: f64 = 3.0;

/// Two records of one motion share what they tell of it: their squared coherence is at least this. Of two that have nothing in common it is 0.1 over so many bins.
const COHERENT: f64 = 0.3;

/// An acceleration that follows from an angle has at most so many times the power of the derivative of the velocity. A difference over two samples loses that
/// much at a quarter of the sampling rate.
const MOST_OF_OTHER: f64 = 1.5;

/// The acceleration that a model sees, freed of the noise of the angle or the velocity that it follows from, whichever tells more of it; `None` without either. `motion`
/// is the recording after `denoise::uncounted`.
///
/// A record without noise is differentiated as it stands.
pub fn acceleration(recording: &Recording, motion: &Recording, model: &Model) -> Option<Vec<f64>> {
    let time_s = &*recording.time_s;
    let of_angle = |q: &[f64], uncounted: &[f64], other: Option<&[f64]>| {
        // A difference of two samples has the weights 1, −2, 1 over the period squared.
        let gain = |w: f64, period_s: f64| (2.0 * (0.5 * w).sin() / period_s).powi(4);
        expected(curvature(uncounted, time_s), other, white_sd(q), time_s, gain)
    };
    let input = recording.theta_in_rad.as_deref().zip(motion.theta_in_rad.as_deref());
    if let (TorqueSide::Motor, Some((q_m, uncounted)), Some(ratio)) = (model.gear.torque_side, input, model.gear.ratio)
    {
        let at_output = |q: &[f64]| q.iter().map(|q| q / ratio).collect::<Vec<f64>>();
        return Some(of_angle(&at_output(q_m), &at_output(uncounted), None));
    }
    let of_velocity = |rate: Vec<f64>, sd: f64, other: Option<&[f64]>| {
        let gain = |w: f64, period_s: f64| (w.sin() / period_s).powi(2);
        expected(rate, other, sd, time_s, gain)
    };
    let (signals, smooth) = (Signals::new(recording, model), Signals::new(motion, model));
    let output = signals.output_angle_rad.as_deref().zip(smooth.output_angle_rad.as_deref());
    let recorded = recording.velocity_out_rad_per_s.as_deref().map(|v| (v, white_sd(v)));
    match (output, recorded) {
        (Some((q, uncounted)), Some((v, sd))) if sd > 0.0 => {
            let power = |line: &[f64]| dot(line, line);
            let unfiltered = rate(v, time_s);
            let most = MOST_OF_OTHER * power(&unfiltered);
            let angle = of_angle(q, uncounted, Some(&unfiltered));
            let velocity = of_velocity(unfiltered, sd, Some(&curvature(uncounted, time_s)));
            // What is expected varies the less the less is known. Nor is there more of it than the velocity has, noise and all: the rest is errors of an encoder that are not white.
            let is_of_velocity = power(&velocity) > power(&angle) || power(&angle) > most;
            Some(if is_of_velocity { velocity } else { angle })
        }
        (_, Some((v, sd))) => Some(of_velocity(rate(v, time_s), sd, None)),
        (output, None) => output.map(|(q, uncounted)| of_angle(q, uncounted, None)),
    }
}

/// What a derivative is expected to be without its noise: white noise of standard deviation `sd`, its power at `w` radians a sample multiplied by `gain`. What another sensor of
/// the same motion does not follow is noise too: a line of an encoder is not white.
fn expected(
    mut values: Vec<f64>,
    other: Option<&[f64]>,
    sd: f64,
    time_s: &[f64],
    gain: impl Fn(f64, f64) -> f64,
) -> Vec<f64> {
    for piece in pieces(time_s).into_iter().filter(|piece| piece.len() >= FEWEST_ROWS && sd > 0.0) {
        let period_s = (time_s[piece.end - 1] - time_s[piece.start]) / (piece.len() - 1) as f64;
        wiener(&mut values[piece.clone()], other.map(|o| &o[piece]), |w| sd * sd * gain(w, period_s));
    }
    values
}

/// Filters a line with noise of the given power at each frequency, stretch by stretch: where the motion turns the corner is kept, where it runs evenly the noise goes.
fn wiener(line: &mut [f64], other: Option<&[f64]>, noise: impl Fn(f64) -> f64) {
    let mut planner = RealFftPlanner::<f64>::new();
    let (forth, back) = (planner.plan_fft_forward(STRETCH), planner.plan_fft_inverse(STRETCH));
    let (mut transform, mut of_other) = (forth.make_output_vec(), forth.make_output_vec());
    let bins = transform.len();
    let around = |line: &[f64], k: usize| line[k.saturating_sub(BINS)..(k + BINS + 1).min(bins)].iter().sum::<f64>();
    let noise: Vec<f64> = (0..bins).map(|k| noise(TAU * k as f64 / STRETCH as f64)).collect();
    let level: Vec<f64> = (0..bins).map(|k| around(&noise, k)).collect();
    // Half a wave, squared by going there and back: stretches that overlap by half add up to one.
    let window: Vec<f64> = (0..STRETCH).map(|i| (0.5 * TAU * (i as f64 + 0.5) / STRETCH as f64).sin()).collect();
    let hop = STRETCH / 2;
    let at = |i: usize| i as isize - hop as isize;
    let mut filtered = vec![0.0; line.len()];
    for first in (0..line.len() + hop).step_by(hop) {
        let rows = || (first..first + STRETCH).map(at);
        let windowed = |line: &[f64]| -> Vec<f64> {
            rows().zip(&window).map(|(row, w)| w * line[mirrored(row, line.len())]).collect()
        };
        let mut own = windowed(line);
        if forth.process(&mut own, &mut transform).is_err() {
            return;
        }
        let mut common = vec![1.0; bins];
        if let Some(other) = other {
            if forth.process(&mut windowed(other), &mut of_other).is_err() {
                return;
            }
            common = (0..bins).map(|k| common_part(&transform, &of_other, k)).collect();
        }
        let power: Vec<f64> = transform.iter().map(|x| 2.0 * x.norm_sqr() / STRETCH as f64).collect();
        let mut lost = false;
        for (k, (x, level)) in transform.iter_mut().zip(&level).enumerate() {
            let power = around(&power, k);
            lost |= power <= STANDS_OUT * level;
            let kept = if lost { 0.0 } else { (1.0 - level / power).min(common[k]) };
            *x *= kept / STRETCH as f64;
        }
        if back.process(&mut transform, &mut own).is_err() {
            return;
        }
        for ((row, w), x) in rows().zip(&window).zip(&own) {
            if let Some(sum) = usize::try_from(row).ok().and_then(|row| filtered.get_mut(row)) {
                *sum += w * x;
            }
        }
    }
    line.copy_from_slice(&filtered);
}

/// The part of a line's power about a bin that a second line shares with it; none where they are hardly coherent.
fn common_part(own: &[Complex<f64>], other: &[Complex<f64>], k: usize) -> f64 {
    let near = k.saturating_sub(BINS)..(k + BINS + 1).min(own.len());
    let mut sums = (Complex::new(0.0, 0.0), 0.0, 0.0);
    for (x, y) in own[near.clone()].iter().zip(&other[near]) {
        sums = (sums.0 + x * y.conj(), sums.1 + x.norm_sqr(), sums.2 + y.norm_sqr());
    }
    let cross = sums.0.norm();
    let coherent = cross * cross > COHERENT * sums.1 * sums.2;
    if coherent { (cross / sums.1.max(f64::MIN_POSITIVE)).min(1.0) } else { 0.0 }
}

/// A row beyond the ends of a line, mirrored there: a motion that begins or ends under way has no step.
fn mirrored(row: isize, rows: usize) -> usize {
    let period = 2 * rows as isize;
    let row = row.rem_euclid(period);
    row.min(period - 1 - row) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::denoise::uncounted;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// A triangular motion with soft corners, and its acceleration.
    fn motion(rows: usize, period_s: f64) -> Recording {
        let time_s: Vec<f64> = (0..rows).map(|k| period_s * k as f64).collect();
        let angle = time_s.iter().map(|t| (0.98 * (3.0 * t).sin()).asin()).collect();
        Recording { time_s: time_s.into(), theta_out_rad: Some(angle), ..Recording::default() }
    }

    #[test]
    fn regressions_on_it_are_not_biased() {
        let clean = motion(6000, 2e-3);
        let model = Model::default();
        let truth = acceleration(&clean, &clean, &model).unwrap();
        assert_eq!(truth, curvature(clean.theta_out_rad.as_deref().unwrap(), &clean.time_s));
        // Noise of a five-hundredth, a quarter and twenty-six times the power of the acceleration.
        for (seed, sd, within) in [(1, 1e-6, 0.002), (2, 1e-5, 0.01), (3, 1e-4, 0.2)] {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let mut noisy = clean.clone();
            for q in noisy.theta_out_rad.iter_mut().flatten() {
                let normal: f64 = StandardNormal.sample(&mut random);
                *q += sd * normal;
            }
            let found = acceleration(&noisy, &uncounted(&noisy), &model).unwrap();
            let slope = dot(&truth, &found) / dot(&found, &found);
            assert!((slope - 1.0).abs() < within, "sd {sd}: {slope}");
        }
    }

    #[test]
    fn lines_of_a_slowly_counted_angle_are_no_acceleration() {
        let clean = motion(6000, 2e-3);
        let count = 2e-3;
        let counted = |q: &f64| (q / count).round() * count;
        let angle = clean.theta_out_rad.as_deref().map(|q| q.iter().map(counted).collect());
        let rough = Recording { theta_out_rad: angle, ..clean.clone() };
        let model = Model::default();
        let truth = acceleration(&clean, &clean, &model).unwrap();
        let alike = |found: &[f64]| dot(&truth, found) / (dot(&truth, &truth) * dot(found, found)).sqrt();
        let found = acceleration(&rough, &uncounted(&rough), &model).unwrap();
        assert!(alike(&found) > 0.97, "{}", alike(&found));
        let of_counts = acceleration(&rough, &rough, &model).unwrap();
        assert!(alike(&of_counts) < 0.9, "{}", alike(&of_counts));
    }

    #[test]
    fn errors_of_an_encoder_that_its_filtered_velocity_hardly_has_are_no_acceleration() {
        let clean = motion(3000, 4e-3);
        let model = Model::default();
        let truth = acceleration(&clean, &clean, &model).unwrap();
        // An encoder's errors of 0.2 mrad, 100 waves a radian, some 50 Hz; the velocity is a mean over 8 samples.
        let angle: Vec<f64> =
            clean.theta_out_rad.as_deref().unwrap().iter().map(|q| q + 2e-4 * (100.0 * q).sin()).collect();
        let of_eight = |row: usize| {
            let (from, to) = (row.saturating_sub(4), (row + 4).min(angle.len() - 1));
            (angle[to] - angle[from]) / (clean.time_s[to] - clean.time_s[from])
        };
        let velocity: Vec<f64> =
            (0..angle.len()).map(|row| of_eight(row) + 0.01 * ((row * row) as f64).sin()).collect();
        let recording = Recording {
            theta_out_rad: Some(angle.into()),
            velocity_out_rad_per_s: Some(velocity.into()),
            ..clean.clone()
        };
        let found = acceleration(&recording, &uncounted(&recording), &model).unwrap();
        let slope = dot(&truth, &found) / dot(&found, &found);
        assert!((slope - 1.0).abs() < 0.1, "{slope}");
    }
}
