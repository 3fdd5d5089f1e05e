//! Time courses: strokes between turning points, random loads, speeds.

use std::f64::consts::{PI, TAU};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::options::Waveform;

/// One stroke from wherever the last one ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stroke {
    pub to: f64,
    pub seconds: f64,
}

/// Cycles of an amplitude at a rate: up to +a and down to −a, `count` times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cycles {
    pub amplitude: f64,
    pub rate_hz: f64,
    pub count: u32,
}

/// Strokes through the cycles in turn, from 0 to the last +a: half a period each, the first a quarter. Turning points lie on samples.
pub(super) fn strokes(series: &[Cycles], sample_rate_hz: f64) -> Vec<Stroke> {
    let stroke = |to: f64, seconds: f64| {
        let samples = (seconds * sample_rate_hz).round().max(1.0);
        Stroke { to, seconds: samples / sample_rate_hz }
    };
    let mut strokes = Vec::new();
    for cycles in series {
        for _ in 0..cycles.count {
            let periods = if strokes.is_empty() { 0.25 } else { 0.5 };
            strokes.push(stroke(cycles.amplitude, periods / cycles.rate_hz));
            strokes.push(stroke(-cycles.amplitude, 0.5 / cycles.rate_hz));
        }
    }
    strokes.extend(series.last().map(|last| stroke(last.amplitude, 0.5 / last.rate_hz)));
    strokes
}

/// Time that the strokes take, s.
pub(super) fn length_s(strokes: &[Stroke]) -> f64 {
    strokes.iter().map(|stroke| stroke.seconds).sum()
}

/// The strokes at each time, from 0. `step` is the height of one step of the load.
pub(super) fn follow(strokes: &[Stroke], waveform: Waveform, step: f64, time_s: &[f64]) -> Vec<f64> {
    let mut left = strokes.iter();
    let mut from = 0.0;
    let (mut begin, mut end) = (0.0, 0.0);
    let mut stroke = Stroke { to: 0.0, seconds: 0.0 };
    time_s
        .iter()
        .map(|&t| {
            // A sample at the very end of a stroke is a turning point, whatever the rounding of time.
            while t > end + 1e-9 {
                let Some(next) = left.next() else { break };
                (from, stroke) = (stroke.to, *next);
                (begin, end) = (end, end + stroke.seconds);
            }
            let share = if stroke.seconds > 0.0 { ((t - begin) / stroke.seconds).clamp(0.0, 1.0) } else { 1.0 };
            if share >= 1.0 - 1e-12 {
                stroke.to
            } else {
                from + (stroke.to - from) * rise(share, waveform, (stroke.to - from) / step)
            }
        })
        .collect()
}

/// How much of a stroke is done after a share of its time.
fn rise(share: f64, waveform: Waveform, steps: f64) -> f64 {
    match waveform {
        Waveform::Sine => cosine(share),
        Waveform::Triangle => share,
        Waveform::Steps => {
            // A quarter of each step is the change, the rest is rest.
            let count = steps.abs().round().max(1.0);
            let at = (share * count).min(count);
            (at.floor() + cosine((4.0 * at.fract()).min(1.0))) / count
        }
    }
}

/// From 0 to 1 along half a cosine.
fn cosine(share: f64) -> f64 {
    0.5 * (1.0 - (PI * share).cos())
}

/// A random load within [`low_hz`, `high_hz`]: a sum of tones of equal size and random phases, which starts from 0 within `fade_s`, and
/// reaches +1 and −1.
pub(super) fn random_load(low_hz: f64, high_hz: f64, fade_s: f64, time_s: &[f64], random: &mut ChaCha8Rng) -> Vec<f64> {
    const TONES: u32 = 48;
    let tones: Vec<(f64, f64)> = (0..TONES)
        .map(|k| {
            // One tone at a random place of each of as many equal shares of the band, so that no two beat against each other for long.
            let place = (f64::from(k) + random.random::<f64>()) / f64::from(TONES);
            (TAU * (low_hz + (high_hz - low_hz) * place), random.random_range(0.0..TAU))
        })
        .collect();
    let mut load: Vec<f64> =
        time_s.iter().map(|t| tones.iter().map(|(speed, phase)| (speed * t + phase).sin()).sum()).collect();
    let settled = time_s.partition_point(|&t| t < fade_s).min(load.len().saturating_sub(2));
    let extremes =
        |load: &[f64]| load.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &x| (x.min(a), x.max(b)));
    let (lowest, highest) = extremes(&load[settled..]);
    let (middle, half) = (0.5 * (highest + lowest), 0.5 * (highest - lowest));
    for (load, t) in load.iter_mut().zip(time_s) {
        let fade = cosine((t / fade_s).min(1.0));
        *load = (fade * (*load - middle) / half).clamp(-1.0, 1.0);
    }
    load
}

/// Output speeds, as shares of the fastest, one after the other: slow, fast and middling, both ways.
const LEVELS: [f64; 6] = [0.2, 1.0, 0.5, -0.2, -1.0, -0.5];

/// The output angle of a motor that runs through [`LEVELS`] in equal times, from rest. Speed changes along half a cosine within a tenth of that time.
pub(super) fn running_angle(fastest_rad_per_s: f64, duration_s: f64, time_s: &[f64]) -> Vec<f64> {
    let section_s = duration_s / LEVELS.len() as f64;
    let change_s = 0.1 * section_s;
    let mut angle = 0.0;
    let mut before: Option<(f64, f64)> = None;
    time_s
        .iter()
        .map(|&t| {
            let section = ((t / section_s) as usize).min(LEVELS.len() - 1);
            let from = if section == 0 { 0.0 } else { LEVELS[section - 1] };
            let share = cosine(((t - section as f64 * section_s) / change_s).clamp(0.0, 1.0));
            let speed = fastest_rad_per_s * (from + (LEVELS[section] - from) * share);
            if let Some((t_before, speed_before)) = before {
                angle += 0.5 * (speed + speed_before) * (t - t_before);
            }
            before = Some((t, speed));
            angle
        })
        .collect()
}
