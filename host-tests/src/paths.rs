//! Deflection paths from a seed, the first sample being the start.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A sampled deflection path.
#[derive(Debug, Clone)]
pub struct Path {
    /// What it is.
    pub name: &'static str,
    /// Deflections, rad.
    pub theta: Vec<f64>,
    /// Width of the input play it asks for, rad.
    pub play: f64,
}

impl Path {
    /// The same path in single precision, widened again. The play too, as the core holds it in that precision.
    pub fn rounded(mut self) -> Self {
        for theta in &mut self.theta {
            *theta = f64::from(*theta as f32);
        }
        self.play = f64::from(self.play as f32);
        self
    }
}

/// One path of each kind for a rated deflection.
pub fn every(seed: u64, a: f64) -> Vec<Path> {
    let mut dice = ChaCha8Rng::seed_from_u64(seed);
    let quiet = |name, shape: Vec<f64>| Path { name, theta: shape.into_iter().map(|u| u * a).collect(), play: 0.0 };
    let noisy = flicker(&mut dice);
    vec![
        quiet("multi-sine", multi_sine(&mut dice, 0.99)),
        quiet("nested loops", nested_loops(&mut dice)),
        quiet("stops", stops(&mut dice)),
        quiet("steps", steps(&mut dice)),
        quiet("full stack", full_stack(&mut dice, 20)),
        quiet("overfull host stack", full_stack(&mut dice, 140)),
        quiet("tips touched", tips(&mut dice, 0.0)),
        quiet("tips grazed", tips(&mut dice, 1e-3)),
        quiet("beyond the range", multi_sine(&mut dice, 1.6)),
        Path { play: 4e-3 * a, ..quiet("noise within the play", noisy) },
    ]
}

/// Five sines of random frequency and phase, the largest value that of `peak`.
fn multi_sine(dice: &mut ChaCha8Rng, peak: f64) -> Vec<f64> {
    let tones: Vec<(f64, f64)> =
        (0..5).map(|_| (dice.random_range(0.002..0.02), dice.random_range(0.0..TAU))).collect();
    let sum: Vec<f64> =
        (0..1500).map(|k| tones.iter().map(|&(f, p)| (TAU * f * f64::from(k) + p).sin()).sum()).collect();
    let largest = sum.iter().fold(0.0, |a, b: &f64| f64::max(a, b.abs()));
    sum.into_iter().map(|v| peak * v / largest).collect()
}

/// A random walk between random turning points: each stroke aims somewhere inside the last two, or now and then outside them.
fn nested_loops(dice: &mut ChaCha8Rng) -> Vec<f64> {
    let mut path: Vec<f64> = vec![dice.random_range(-0.5..0.5)];
    let (mut low, mut high) = (-0.98, 0.98);
    while path.len() < 1500 {
        if dice.random_bool(0.15) {
            (low, high) = (-0.98, 0.98);
        }
        let from = path[path.len() - 1];
        let to = dice.random_range(low..high);
        (low, high) = if from < to { (from.max(low), to) } else { (to, from.min(high)) };
        if high - low < 1e-3 {
            (low, high) = (-0.98, 0.98);
        }
        stroke(dice, &mut path, to);
    }
    path
}

/// Strokes with rests between them.
fn stops(dice: &mut ChaCha8Rng) -> Vec<f64> {
    let mut path = vec![0.0];
    while path.len() < 1000 {
        let to = dice.random_range(-0.95..0.95);
        stroke(dice, &mut path, to);
        let rest = dice.random_range(1..40);
        path.extend(std::iter::repeat_n(to, rest));
    }
    path
}

/// Jumps from anywhere to anywhere.
fn steps(dice: &mut ChaCha8Rng) -> Vec<f64> {
    (0..600).map(|_| dice.random_range(-0.99..0.99)).collect()
}

/// Ever smaller strokes, `pairs` up and down, then ever larger ones that wipe them out again, twice.
fn full_stack(dice: &mut ChaCha8Rng, pairs: i32) -> Vec<f64> {
    let mut path = vec![dice.random_range(-0.1..0.1)];
    for _ in 0..2 {
        let shrink = f64::powf(0.02, 1.0 / f64::from(pairs));
        let centre = dice.random_range(-0.05..0.05);
        let amplitude = |k: i32| 0.9 * shrink.powi(k);
        for k in (0..pairs).chain((0..pairs).rev()) {
            // Off the old turning points, so that some are passed and some are only approached.
            let size = amplitude(k) * dice.random_range(1.0..1.02);
            stroke(dice, &mut path, centre + size);
            stroke(dice, &mut path, centre - size * shrink.sqrt());
        }
    }
    path
}

/// Full strokes that end on a tip, or `short` of it and down to a 10⁻⁵th of that, and random ones between.
fn tips(dice: &mut ChaCha8Rng, short: f64) -> Vec<f64> {
    let mut path = vec![0.0];
    while path.len() < 1000 {
        for side in [1.0, -1.0] {
            let tip = 1.0 - short * f64::powf(10.0, dice.random_range(-5.0..0.0));
            stroke(dice, &mut path, side * tip);
            let inside = dice.random_range(-0.9..0.9);
            stroke(dice, &mut path, inside);
        }
    }
    path
}

/// A slow sine under noise of up to ±0.0015 A.
fn flicker(dice: &mut ChaCha8Rng) -> Vec<f64> {
    (0..2000).map(|k| 0.95 * (TAU * f64::from(k) / 700.0).sin() + dice.random_range(-0.0015..0.0015)).collect()
}

/// A straight stroke to `to` in a random number of samples.
fn stroke(dice: &mut ChaCha8Rng, path: &mut Vec<f64>, to: f64) {
    let from = path[path.len() - 1];
    let samples = dice.random_range(1..12);
    path.extend((1..samples).map(|k| from + (to - from) * f64::from(k) / f64::from(samples)));
    path.push(to);
}
