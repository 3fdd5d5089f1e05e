//! Synthetic recordings for the tests, by the core.
#![allow(dead_code, reason = "the benchmarks compile this module, too, and each uses its own part")]

use std::f64::consts::TAU;

use gmhm::{Elastic, Gate, Gear, Kernel, Law, Memory, Params};
use gmhm_tools::fit::FitOptions;
use gmhm_tools::fit::{Fit, fit};
use gmhm_tools::model::{Model, Term, TermValue};
use gmhm_tools::physics::predict;
use gmhm_tools::recording::{Recording, Samples};
use gmhm_tools::regression::error::EstimateError;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// The published gear.
pub fn published() -> (Elastic, Memory) {
    let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
    let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
    (elastic, memory)
}

/// A deflection path at a constant sample period.
pub struct Path {
    pub theta: Vec<f64>,
    pub period_s: f64,
}

/// Sine cycles from zero.
pub fn cycle(amplitude: f64, count: usize, cycles: f64) -> Vec<f64> {
    (0..count).map(|k| amplitude * (TAU * cycles * k as f64 / count as f64).sin()).collect()
}

/// Strokes between random turning points within ±a, at random speeds.
pub fn walk(a: f64, count: usize, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut theta, mut target, mut step) = (0.0_f64, a, 0.02 * a);
    (0..count)
        .map(|k| {
            let here = theta;
            if (target - theta).abs() <= step {
                theta = target;
                target = if k % 400 < 100 { -target.signum() * a } else { random.random_range(-a..a) };
                step = a * random.random_range(0.005..0.04);
            } else {
                theta += step * (target - theta).signum();
            }
            here
        })
        .collect()
}

/// Eight harmonics of random size and phase, from zero, that reach ±a once.
pub fn band_limited(a: f64, count: usize, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let waves: [(f64, f64); 8] = [(); 8].map(|()| (StandardNormal.sample(&mut random), random.random_range(0.0..TAU)));
    let at = |row: usize| {
        let turn = TAU * row as f64 / count as f64;
        let wave = |(k, (size, phase)): (f64, &(f64, f64))| size * ((k * turn + phase).sin() - phase.sin());
        [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0].into_iter().zip(&waves).map(wave).sum()
    };
    let path: Vec<f64> = (0..count).map(at).collect();
    let most = path.iter().fold(0.0, |most: f64, theta| most.max(theta.abs()));
    path.iter().map(|theta| a / most * theta).collect()
}

/// The torque along a path, from an empty memory.
pub fn deflections(a: f64, elastic: Elastic, memory: Memory, theta: &[f64], period_s: f64) -> Vec<f64> {
    let gear = Gear::<f64>::new(&Params::new(a, elastic, memory).unwrap());
    let mut state = gear.start::<256>(theta[0]);
    theta
        .iter()
        .enumerate()
        .map(|(k, &theta)| gear.step_after(&mut state, theta, if k == 0 { 0.0 } else { period_s }).torque)
        .collect()
}

/// A recording of a path, with white noise of the given standard deviation on the torque.
pub fn record(a: f64, elastic: Elastic, memory: Memory, path: &Path, noise_nm: f64, seed: u64) -> Recording {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut torque = deflections(a, elastic, memory, &path.theta, path.period_s);
    for torque in &mut torque {
        let normal: f64 = StandardNormal.sample(&mut random);
        *torque += noise_nm * normal;
    }
    Recording {
        name: "synthetic".to_owned(),
        time_s: (0..torque.len()).map(|k| k as f64 * path.period_s).collect(),
        torque: Some(torque.into()),
        deflection_rad: Some(path.theta.clone().into()),
        ..Recording::default()
    }
}

/// A gear of 24 slip elements, their reaches spread over a decade and a half as asperities are, beside a hardening spring: nothing of GMHM's own.
pub fn foreign(a: f64, size: f64, seed: u64) -> Recording {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let theta = cycle(size * a, 1500, 2.5);
    let elements: Vec<(f64, f64)> = (0..24)
        .map(|k| {
            let reach = 2.0 * a * 10.0_f64.powf(-1.5 + 1.5 * f64::from(k) / 23.0);
            (reach, 120.0 * (1.0 + 3.0 * (f64::from(k) * 0.37).sin().powi(2)))
        })
        .collect();
    let mut stops = [0.0_f64; 24];
    let mut last = 0.0;
    let torque = theta.iter().map(|theta| {
        let mut sum = 2.1e4 * theta + 8e8 * theta.powi(3);
        for (stop, (reach, stiffness)) in stops.iter_mut().zip(&elements) {
            *stop = (*stop + theta - last).clamp(-reach, *reach);
            sum += stiffness * *stop;
        }
        last = *theta;
        let noise: f64 = StandardNormal.sample(&mut random);
        sum + 0.02 * noise
    });
    let torque = torque.collect();
    Recording {
        name: format!("24 slip elements, {size} of the rated deflection"),
        time_s: (0..theta.len()).map(|k| 1e-2 * k as f64).collect(),
        torque: Some(torque),
        deflection_rad: Some(theta.into()),
        ..Recording::default()
    }
}

/// Fits that keep a law and A.
pub fn given(a: f64, memory: Memory) -> FitOptions {
    let mut start = Model { elastic: Some(published().0), memory: Some(memory), ..Model::default() };
    start.gear.rated_deflection_rad = Some(a);
    FitOptions { start: Some(start), ..FitOptions::default() }
}

/// Two amplitudes at two rates.
pub fn stroke(a: f64, count: usize) -> Vec<f64> {
    let mut path = cycle(a, count / 2, 2.0);
    path.extend(cycle(0.6 * a, count - count / 2, 5.0));
    path
}

/// A running gear at 1 kHz under a slowly varying load, whose motor reaches 41 rad/s times `speed`: the published gear as a base model of ratio 100, and the recording without noise of
/// this gear with a kinematic error of order 2.
pub fn with_kinematic_error(rows: usize, speed: f64) -> (Model, Recording) {
    const A: f64 = 1.168e-3;
    const RATIO: f64 = 100.0;
    let (elastic, memory) = published();
    let mut base = Model { elastic: Some(elastic), memory: Some(memory), ..Model::default() };
    base.gear.rated_deflection_rad = Some(A);
    base.gear.ratio = Some(RATIO);
    let time_s: Vec<f64> = (0..rows).map(|k| k as f64 * 1e-3).collect();
    let deflection = |t: f64| A * (0.55 * (TAU * 0.21 * t).sin() + 0.38 * (TAU * 0.043 * t).sin());
    let input = |t: f64| speed * (0.3 * (0.7 * t).sin() + 0.2 * (0.31 * t).sin());
    let mut recording = Recording {
        name: "synthetic".to_owned(),
        theta_in_rad: Some(time_s.iter().map(|t| RATIO * input(*t)).collect()),
        theta_out_rad: Some(time_s.iter().map(|t| input(*t) - deflection(*t)).collect()),
        deflection_rad: Some(time_s.iter().map(|t| deflection(*t)).collect()),
        time_s: time_s.into(),
        ..Recording::default()
    };
    let list = |x: f64| TermValue::List(vec![x]);
    let values = [("orders", list(2.0)), ("cos_rad", list(6e-6)), ("sin_rad", list(-6e-6))];
    let values = values.map(|(key, value)| (key.to_owned(), value)).into();
    let truth = Model { terms: vec![Term { kind: "kinematic_error".to_owned(), values }], ..base.clone() };
    recording.torque = Some(predict(&truth, None, &recording).unwrap().torque.into());
    (base, recording)
}

/// The recording with AR(1) noise on its torque.
pub fn with_coloured_noise(recording: &Recording, phi: f64, sd: f64, seed: u64) -> Recording {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = 0.0;
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut recording = recording.clone();
    for (row, torque) in recording.torque.iter_mut().flatten().enumerate() {
        let start = if row == 0 { 1.0 / (1.0 - phi * phi).sqrt() } else { 1.0 };
        noise = phi * noise + sd * start * normal();
        *torque += noise;
    }
    recording
}

/// How a gear moves whose refits are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Two amplitudes at two rates.
    TwoAmplitudes,
    /// Another band-limited path for each refit.
    BandLimited,
    /// Strokes at constant speed between random turning points.
    Corners,
}

/// A gear and a noise whose refits are compared with their standard deviations.
#[derive(Clone, Copy)]
pub struct ScatterCase {
    pub memory: Memory,
    pub phi: f64,
    pub rows: usize,
    pub names: &'static [&'static str],
    /// Whether the gear has been through its rated cycle before the recording begins.
    pub settled: bool,
    pub motion: Motion,
    /// Steps of the recorded torque and deflection; 0 where they are not quantised.
    pub steps: (f64, f64),
}

impl std::fmt::Display for ScatterCase {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let start = if self.settled { ", settled" } else { "" };
        let motion = match self.motion {
            Motion::TwoAmplitudes => "",
            Motion::BandLimited => ", band-limited",
            Motion::Corners => ", corners",
        };
        let torque = if self.steps.0 > 0.0 { ", torque quantised" } else { "" };
        write!(f, "{:?}{start}{motion}{torque}", self.memory.law)?;
        if self.steps.1 > 0.0 {
            write!(f, ", deflection in {:.0} µrad", 1e6 * self.steps.1)?;
        }
        write!(f, ", AR(1) {}", self.phi)
    }
}

/// Each law, white and coloured.
pub fn scatter_cases() -> Vec<ScatterCase> {
    let masing = published().1;
    let phase = Memory { law: Law::Phase, ..masing };
    let names = &["c1_nm_per_rad", "c3_nm_per_rad5", "e", "h", "rho"];
    let (of_phase, of_time) = (&["c1_nm_per_rad", "h", "rho"], &["c1_nm_per_rad", "alpha", "beta_per_s"]);
    let plain = ScatterCase {
        memory: masing,
        phi: 0.0,
        rows: 400,
        names,
        settled: false,
        motion: Motion::TwoAmplitudes,
        steps: (0.0, 0.0),
    };
    let coloured = ScatterCase { phi: 0.9, rows: 1200, ..plain };
    let counted = ScatterCase { steps: (0.0, 8e-6), ..plain };
    vec![
        ScatterCase { settled: true, ..plain },
        ScatterCase { steps: (0.25, 0.0), ..plain },
        counted,
        ScatterCase { steps: (0.0, 15e-6), ..counted },
        ScatterCase { rows: 1000, motion: Motion::BandLimited, ..counted },
        ScatterCase { memory: phase, names: &["c1_nm_per_rad", "e", "h", "rho"], rows: 1200, ..counted },
        ScatterCase { steps: (0.25, 8e-6), ..coloured },
        ScatterCase { memory: phase, names: of_phase, ..coloured },
        ScatterCase { memory: with_rate(), names: of_time, ..coloured },
        coloured,
        plain,
    ]
}

/// What the motion behind counts is found less well for than it says: coarse counts on small loops, corners.
pub fn hard_cases() -> [ScatterCase; 2] {
    let plain = scatter_cases()[scatter_cases().len() - 1];
    [
        ScatterCase { rows: 600, names: &["h"], motion: Motion::BandLimited, steps: (0.0, 15e-6), ..plain },
        ScatterCase { rows: 800, names: &["c1_nm_per_rad", "e"], motion: Motion::Corners, steps: (0.0, 8e-6), ..plain },
    ]
}

/// The memory of a gear with a rate.
pub fn with_rate() -> Memory {
    let (alpha, beta_per_s) = (5e3, 2.5);
    Memory {
        law: Law::Time,
        kernel: Kernel::Rate,
        gate: Gate::None,
        alpha,
        beta_per_s,
        omega_per_s: 0.0,
        ..published().1
    }
}

/// The same motion fitted again and again, with other noise of 0.1 N·m. Where something is quantised its size differs by up to a percent, and so does the zero of
/// the deflection's counter within a count, lest the counts be the same.
pub fn refits(a: f64, case: &ScatterCase, count: usize) -> Result<Vec<Fit>, EstimateError> {
    let clean = |size: f64, seed: u64| {
        let mut theta = if case.settled { cycle(a, case.rows, 1.0) } else { Vec::new() };
        let before = theta.len();
        let motion = match case.motion {
            Motion::TwoAmplitudes => stroke(size * a, case.rows),
            Motion::BandLimited => band_limited(size * a, case.rows, seed),
            Motion::Corners => walk(size * a, case.rows, 9),
        };
        theta.extend(motion);
        let mut clean = record(a, published().0, case.memory, &Path { theta, period_s: 1e-2 }, 0.0, 0);
        clean.time_s.crop(&(0..case.rows));
        let columns = [&mut clean.torque, &mut clean.deflection_rad];
        columns.into_iter().flatten().for_each(|column| column.crop(&(before..column.len())));
        clean
    };
    let quantised = |column: &mut Option<Samples>, step: f64, zero: f64| {
        let to_count = |x: &mut f64| *x = ((*x / step - zero).round() + zero) * step;
        column.iter_mut().flatten().filter(|_| step > 0.0).for_each(to_count);
    };
    let whole = clean(1.0, 0);
    let noisy = |seed: u64| {
        let other = (case.steps != (0.0, 0.0)).then(|| clean(1.0 - 0.01 * (0.618 * seed as f64).fract(), seed));
        let mut noisy = with_coloured_noise(other.as_ref().unwrap_or(&whole), case.phi, 0.1, seed);
        quantised(&mut noisy.torque, case.steps.0, 0.0);
        quantised(&mut noisy.deflection_rad, case.steps.1, (0.414 * seed as f64).fract());
        noisy
    };
    (0..count as u64).into_par_iter().map(|seed| fit(&[noisy(seed)], &given(a, case.memory), &())).collect()
}

/// Scatter of the values over mean reported standard deviation; NaN where a fit reports none.
pub fn scatter_over_reported(fits: &[Fit], name: &str) -> f64 {
    let (values, reported) = values(fits, name);
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt() / reported
}

/// What the values are off by on average, over mean reported standard deviation.
pub fn off_over_reported(fits: &[Fit], name: &str, truth: f64) -> f64 {
    let (values, reported) = values(fits, name);
    (values.iter().sum::<f64>() / values.len() as f64 - truth) / reported
}

/// The values of a parameter, and the mean of their standard deviations.
fn values(fits: &[Fit], name: &str) -> (Vec<f64>, f64) {
    let found = |f: &Fit| f.parameter(name).map_or((f64::NAN, f64::NAN), |p| (p.value, p.sd.unwrap_or(f64::NAN)));
    let (values, reported): (Vec<f64>, Vec<f64>) = fits.iter().map(found).unzip();
    let mean = reported.iter().sum::<f64>() / reported.len() as f64;
    (values, mean)
}
