//! The recursion of the adaptation against least squares of the same rows and weights, written apart: batch where nothing is forgotten, the equations of its documentation where it forgets.

use core::array::from_fn;

use crate::common::adapting;
use crate::common::adapting::{PERIOD_S, block};
use gmhm::Gear;
use gmhm::adapt::{Adaptation, BLOCK_S, LEAST_TOLD, Settings};
use gmhm::memory::masing::Masing;
use gmhm::scalar::Float;
use gmhm_host_tests::Constants;
use gmhm_host_tests::drift::{self, Fault, Motion, Mover, Sensor};

const SAMPLES: u32 = 100_000;
/// Variance of the prior: half the largest change, squared.
const PRIOR: f64 = 0.125 * 0.125;
/// What is learnt: five coefficients, and the offset of the signal.
const LEARNT: usize = 6;
/// What the offset is multiplied by in a row.
const LEVEL: f64 = 0.1875;
/// Delay, offset, five coefficients, value.
type Row = [f64; 8];
type Vector = [f64; LEARNT];
type Matrix = [Vector; LEARNT];

/// What is left of rows by orthogonalising their columns in turn: the triangle, each row from its diagonal.
fn triangle(rows: &[Row]) -> Vec<Row> {
    let mut rows = rows.to_vec();
    (0..7)
        .map(|column| {
            let norm = rows.iter().map(|row| row[column].powi(2)).sum::<f64>().sqrt();
            let mut result = [0.0; 8];
            for other in column..8 {
                result[other] = rows.iter().map(|row| row[column] * row[other]).sum::<f64>() / norm;
            }
            for row in &mut rows {
                let unit = row[column] / norm;
                for other in column..8 {
                    row[other] -= unit * result[other];
                }
            }
            result
        })
        .collect()
}

/// Solves a symmetric positive system and returns the solution and the inverse's diagonal.
fn solve(mut matrix: Matrix, right: Vector) -> [Vector; 2] {
    let mut inverse = [[0.0; LEARNT]; LEARNT];
    for (k, row) in inverse.iter_mut().enumerate() {
        row[k] = 1.0;
    }
    for k in 0..LEARNT {
        let pivot = matrix[k][k];
        for j in 0..LEARNT {
            matrix[k][j] /= pivot;
            inverse[k][j] /= pivot;
        }
        for i in (0..LEARNT).filter(|i| *i != k) {
            let factor = matrix[i][k];
            for j in 0..LEARNT {
                matrix[i][j] -= factor * matrix[k][j];
                inverse[i][j] -= factor * inverse[k][j];
            }
        }
    }
    [from_fn(|i| (0..LEARNT).map(|j| inverse[i][j] * right[j]).sum()), from_fn(|i| inverse[i][i])]
}

/// Runs an adaptation of this drift for [`SAMPLES`] and tells of every row that it learns from: what the offset and the coefficients count in it, value, variance. Returns its estimate and variances.
fn adapt<S: Float>(motion: Motion, drift: f64, mut learn: impl FnMut(Vector, f64, f64)) -> [[f64; 5]; 2] {
    let block = block();
    let (a, rated) = (block.rated_deflection_rad(), block.torque_scale_nm());
    let settings = Settings { period_s: PERIOD_S, drift, ..Settings::default() };
    let adaptation = Adaptation::<S>::new(&block, &settings).expect("law masing");
    let gear = Gear::<S, _>::with_law(&block, Masing::new(&block));
    let (mut state, mut path) = (adaptation.start(), gear.start::<16>(S::ZERO));
    let nominal = drift::Coefficients::of(&Constants::PUBLISHED);
    let other = nominal.scaled(0.99, 1.02);
    let (mut plant, mut shape) =
        (drift::Gear::new(&Constants::PUBLISHED, 0.0), drift::Gear::new(&Constants::PUBLISHED, 0.0));
    let unit_loop = drift::Coefficients { elastic: [0.0; 3], e: 0.0, h: 1.0 / a };
    let mut mover = Mover::new(motion, 3);
    let mut sensor = Sensor::new(0.0, [0.0; 2], rated, 3);
    let mut noise = 12345_u64;
    let nominal_change = adapting::change(&block, [&nominal; 2]);
    assert_eq!(nominal_change, [0.0; 5]);
    let own = {
        let c = Constants::PUBLISHED;
        [c.c1 * a, c.c2 * a.powi(3), c.c3 * a.powi(5), c.e() * a, c.h() * a].map(|k| k / rated)
    };
    let per_block = (BLOCK_S / PERIOD_S).round() as u32;
    let (mut rows, mut sums, mut before, mut variance) = (Vec::<Row>::new(), [0.0; 8], None, 0.0);
    // Weights: mean residual of the block before, and variance of samples about it.
    let (mut centre, mut about) = (0.0, 1.0 / 2048.0);
    let (start, mut samples) = (2_000, 0);
    // To the end of the stretch that the last of them is in.
    for k in 0.. {
        let u = mover.at(f64::from(k) * PERIOD_S);
        let theta = S::from_f64(a * u);
        let exact = theta.to_f64();
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let torque = plant.step(&other, exact) + 0.01 * rated * ((noise >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
        let says = S::from_f64(sensor.read(torque, Fault::None, PERIOD_S)[1]);
        let eta = shape.step(&unit_loop, exact);
        gear.step(&mut path, theta);
        if k < start {
            continue;
        }
        let stretches = state.stretches();
        variance = if state.variance() > S::ZERO { state.variance().to_f64() } else { variance };
        // The first period finds the gear at places where it has not been before: it begins a stretch and takes no sample.
        let taken = k > start && state.takes_samples();
        let _ = adaptation.period(&mut state, &path, says);
        if state.stretches() > stretches {
            // v is learnt from what the stretch told, after it.
            // What a delay explains is not learnt from; the level comes last.
            for row in triangle(&rows)[1..].iter().rev() {
                let [_, x @ .., value] = *row;
                if x.iter().map(|x| x * x * PRIOR).sum::<f64>() >= LEAST_TOLD * variance {
                    learn(x, value, variance);
                }
            }
            rows.clear();
            // What was begun of a block is dropped.
            (sums, samples) = ([0.0; 8], 0);
            if k >= SAMPLES + start {
                break;
            }
        }
        if !taken {
            before = None;
            continue;
        }
        let u = exact / a;
        let x = [u, u.powi(3), u.powi(5), -u * (1.0 - u * u).max(0.0).sqrt(), eta];
        let p: f64 = x.iter().zip(own).map(|(x, own)| x * own).sum();
        let row =
            [before.map_or(0.0, |before| p - before), LEVEL, x[0], x[1], x[2], x[3], x[4], says.to_f64() / rated - p];
        before = Some(p);
        let square = (row[7] - centre).powi(2) / about;
        about += (about * (square.min(9.0) - 1.0) + 1e-10) / 256.0;
        for (sum, x) in sums.iter_mut().zip(row) {
            *sum += x * (9.0 / square).min(1.0);
        }
        samples += 1;
        if samples == per_block {
            samples = 0;
            centre = sums[7] / sums[1] * LEVEL;
            rows.push(sums.map(|sum| sum / f64::from(per_block).sqrt()));
            sums = [0.0; 8];
        }
    }
    assert_eq!(state.warnings().bits() & 0x1f, 0, "a stretch was refused: {:?}", state.warnings());
    assert!(state.stretches() > 30, "{}", state.stretches());
    [state.estimate(), state.variances()].map(|of| of.map(S::to_f64))
}

/// The largest difference of the coefficients' estimates in standard deviations, and of standard deviations in parts of them.
fn difference([estimate, variances]: [[f64; 5]; 2], [reference, of_reference]: [Vector; 2]) -> [f64; 2] {
    let ([_, reference @ ..], [_, of_reference @ ..]) = (reference, of_reference);
    let sd = of_reference.map(f64::sqrt);
    let apart = (0..5).map(|k| (estimate[k] - reference[k]).abs() / sd[k]);
    let sd_apart = (0..5).map(|k| (variances[k].sqrt() / sd[k] - 1.0).abs());
    [apart.fold(0.0, f64::max), sd_apart.fold(0.0, f64::max)]
}

/// Least squares of all rows together, nothing forgotten.
fn against_batch<S: Float>(motion: Motion) -> [f64; 2] {
    let mut information: Matrix = from_fn(|i| from_fn(|j| if i == j { 1.0 / PRIOR } else { 0.0 }));
    let mut right = [0.0; LEARNT];
    let adapted = adapt::<S>(motion, 0.0, |x, value, variance| {
        for i in 0..LEARNT {
            for j in 0..LEARNT {
                information[i][j] += x[i] * x[j] / variance;
            }
            right[i] += x[i] * value / variance;
        }
    });
    difference(adapted, solve(information, right))
}

/// Row by row with the whole covariance, as the documentation states it.
fn against_equations<S: Float>(motion: Motion, drift: f64) -> [f64; 2] {
    let kappa = drift * drift / PRIOR;
    let mut estimate = [0.0; LEARNT];
    let mut covariance: Matrix = from_fn(|i| from_fn(|j| if i == j { PRIOR } else { 0.0 }));
    let adapted = adapt::<S>(motion, drift, |r, value, variance| {
        let dot = |a: &Vector, b: &Vector| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let seen = covariance.map(|row| dot(&row, &r));
        let pace = (kappa / (PRIOR * dot(&r, &r))).sqrt();
        let w: Vector = from_fn(|k| pace * (PRIOR * r[k] - seen[k]));
        for i in 0..LEARNT {
            for j in 0..LEARNT {
                covariance[i][j] += w[i] * w[j];
            }
        }
        let seen = covariance.map(|row| dot(&row, &r));
        let total = variance + dot(&r, &seen);
        let off = value - dot(&r, &estimate);
        assert!(r[0] == 0.0 || off.abs() < 8.0 * total.sqrt(), "the level does not jump");
        // No row counts for more than four standard deviations.
        let off = off.clamp(-4.0 * total.sqrt(), 4.0 * total.sqrt());
        for i in 0..LEARNT {
            estimate[i] += seen[i] * off / total;
            for j in 0..LEARNT {
                covariance[i][j] -= seen[i] * seen[j] / total;
            }
        }
    });
    difference(adapted, [estimate, from_fn(|k| covariance[k][k])])
}

/// Measured: see the assertion; stated in `docs/adaptation.md`.
#[test]
fn the_recursion_is_batch_least_squares() {
    for motion in [Motion::Sine, Motion::Tones, Motion::Moves] {
        let [double, double_sd] = against_batch::<f64>(motion);
        let [single, single_sd] = against_batch::<f32>(motion);
        println!("{motion:?}: {double:e} in f64, {single:e} in f32");
        assert!(double < 1e-4, "{motion:?}: {double} standard deviations in f64");
        assert!(single < 0.1, "{motion:?}: {single} standard deviations in f32");
        assert!(double_sd.max(single_sd) < 0.01, "{motion:?}: {double_sd} {single_sd}");
    }
}

#[test]
fn it_forgets_as_the_equations_say() {
    for motion in [Motion::Sine, Motion::Tones, Motion::Moves] {
        for drift in [1e-3, 0.1] {
            let [double, double_sd] = against_equations::<f64>(motion, drift);
            let [single, single_sd] = against_equations::<f32>(motion, drift);
            println!("{motion:?}, drift {drift}: {double:e} {double_sd:e} in f64, {single:e} {single_sd:e} in f32");
            assert!(double < 1e-6 && double_sd < 1e-6, "{motion:?}, {drift}: {double} {double_sd} in f64");
            assert!(single < 0.1 && single_sd < 0.01, "{motion:?}, {drift}: {single} {single_sd} in f32");
        }
    }
}
