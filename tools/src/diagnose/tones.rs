//! Tones: what comes at a frequency of its own, for a while or all the time.
//!
//! An autoregression of the noise predicts a tone from the rows before as well as a curve follows it, so the likelihood does not tell the two apart. What does
//! is how long the phase is kept: a resonance excited by noise spreads its power over a band as wide as its damping, a tone puts it into one line.

use std::ops::Range;

use crate::diagnose::nonparametric::{Coordinates, Curve};
use crate::numerics::spectrum;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

/// Windows that a recording is searched for tones in.
const WINDOWS: usize = 12;

/// Tones that last for a part of the recording: the strongest of each of overlapping windows, the best two. And the best of all, as the noise leaves it and as it
/// is, with an amplitude and a phase of its own in every window, lest what is left of it pass for noise with a resonance.
pub fn tones(dataset: &Dataset<'_>, see: &Coordinates, fit: &Fitted) -> Vec<Curve> {
    let tone = |columns, coherent| Curve { coordinate: "frequency", columns, picked: 2, coherent };
    let wave = |rad_per_s: f64, rows: Range<usize>| {
        let (mut cos, mut sin) = (vec![0.0; dataset.len()], vec![0.0; dataset.len()]);
        for row in rows.clone() {
            (sin[row], cos[row]) = (rad_per_s * (see.time[row] - see.time[rows.start])).sin_cos();
        }
        [cos, sin]
    };
    let everywhere = |rad_per_s: f64| {
        let windows = dataset.spans.iter().flat_map(|span| {
            let at = |window: usize| span.start + span.len() * window / WINDOWS;
            (0..WINDOWS).map(move |window| at(window)..at(window + 1))
        });
        windows.flat_map(|rows| wave(rad_per_s, rows)).collect::<Vec<_>>()
    };
    let filtered =
        lines(dataset, see, &dataset.filtered_twice(fit), |recording, rad| Dataset::noise_gain(fit, recording, rad));
    let plain = lines(dataset, see, &dataset.layout().masked(&fit.residual), |_, _| 1.0);
    let mut curves: Vec<Curve> =
        filtered.iter().take(2).map(|line| tone(wave(line.rad_per_s, line.rows.clone()).into(), false)).collect();
    for line in [filtered.first(), plain.first()].into_iter().flatten() {
        curves.push(tone(everywhere(line.rad_per_s), false));
    }
    let kept = filtered.iter().take(STRONGEST).chain(plain.iter().take(STRONGEST));
    let kept = kept
        .filter_map(|line| coherent(&see.time[line.rows.clone()], &fit.residual[line.rows.clone()], line.rad_per_s));
    let strongest = kept.max_by(|a, b| a.power.total_cmp(&b.power));
    curves.extend(strongest.map(|line| tone(everywhere(line.rad_per_s), true)));
    curves
}

/// A line of the spectrum of some rows.
struct Line {
    power: f64,
    rad_per_s: f64,
    rows: Range<usize>,
}

/// The strongest line of each of overlapping windows, the strongest of all first. `gain` is what the noise filter of a recording does to a
/// frequency, in rad a row.
fn lines(dataset: &Dataset<'_>, see: &Coordinates, values: &[f64], gain: impl Fn(usize, f64) -> f64) -> Vec<Line> {
    let mut found = Vec::new();
    for (recording, span) in dataset.spans.iter().enumerate() {
        let time = &see.time[span.clone()];
        let period = (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64;
        let length = 2 * span.len() / WINDOWS;
        for window in 0..WINDOWS - 1 {
            let rows = span.start + window * length / 2..span.start + window * length / 2 + length;
            // An angle whose highest order is the highest frequency looked for.
            let scale = std::f64::consts::TAU * HIGHEST_SHARE / (period * spectrum::HIGHEST);
            let phase: Vec<f64> = see.time[rows.clone()].iter().map(|t| scale * (t - see.time[rows.start])).collect();
            let lines =
                spectrum::spectrum(&phase, &values[rows.clone()], |order| gain(recording, order * scale * period));
            let best = lines.into_iter().max_by(|a, b| a.power.total_cmp(&b.power));
            found.extend(best.map(|line| Line { power: line.power, rad_per_s: line.order * scale, rows }));
        }
    }
    found.sort_by(|a, b| b.power.total_cmp(&a.power));
    found
}

/// The highest frequency looked for, as a share of the sample rate: just below half of it.
const HIGHEST_SHARE: f64 = 0.48;
/// Lines that are looked at for a tone.
const STRONGEST: usize = 3;
/// Neighbours on either side, one over the window apart, that a line's power is compared with.
const NEIGHBOURS: i32 = 10;
/// Of the power of a line and its neighbours a tone holds this part; the line of a resonance that keeps a thirtieth of a window in mind does so once in a
/// hundred thousand windows.
const COHERENT: f64 = 0.85;
/// Turns of a tone in its window, lest a trend look like one.
const FEWEST_TURNS: f64 = 12.0;

/// A line of a window made a tone: its frequency where it is strongest, if it then holds the power of its neighbourhood.
fn coherent(time_s: &[f64], values: &[f64], near_rad_per_s: f64) -> Option<Tone> {
    let span = time_s[time_s.len() - 1] - time_s[0];
    let span = span * time_s.len() as f64 / (time_s.len() - 1) as f64;
    let cell = std::f64::consts::TAU / span;
    if near_rad_per_s < FEWEST_TURNS * cell {
        return None;
    }
    let power = |rad_per_s: f64| {
        let (mut re, mut im) = (0.0, 0.0);
        for (t, y) in time_s.iter().zip(values) {
            let (sin, cos) = (rad_per_s * (t - time_s[0])).sin_cos();
            re += cos * y;
            im += sin * y;
        }
        re * re + im * im
    };
    // The lobe of a line is two cells wide: thirds of what is left of it.
    let (mut low, mut high) = (near_rad_per_s - 0.6 * cell, near_rad_per_s + 0.6 * cell);
    for _ in 0..14 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if power(a) > power(b) { high = b } else { low = a }
    }
    let rad_per_s = 0.5 * (low + high);
    let own = power(rad_per_s);
    let around: f64 = (-NEIGHBOURS..=NEIGHBOURS).map(|k| power(rad_per_s + f64::from(k) * cell)).sum();
    (own > COHERENT * around).then_some(Tone { rad_per_s, power: own })
}

/// A tone in a window.
struct Tone {
    rad_per_s: f64,
    power: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_is_told_from_a_resonance() {
        let time: Vec<f64> = (0..600).map(|k| 0.01 * f64::from(k)).collect();
        let mut state = 1_u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24) - 0.5
        };
        let tone: Vec<f64> = time.iter().map(|t| (51.3 * t).sin() + 0.3 * noise()).collect();
        let found = coherent(&time, &tone, 51.0).map(|tone| tone.rad_per_s);
        assert!(found.is_some_and(|f| (f - 51.3).abs() < 0.05), "{found:?}");
        // A resonance at the same frequency whose noise dies away within 33 rows.
        let (mut last, mut before) = (0.0, 0.0);
        let resonance: Vec<f64> = time
            .iter()
            .map(|_| {
                let next = 2.0 * 0.97 * 0.513_f64.cos() * last - 0.97 * 0.97 * before + noise();
                (before, last) = (last, next);
                next
            })
            .collect();
        for near in 0..24 {
            assert!(coherent(&time, &resonance, 46.0 + 0.5 * f64::from(near)).is_none());
        }
    }
}
