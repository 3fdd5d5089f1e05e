//! The recursion of the adaptation against batch least squares of the same rows and weights, written apart.

use crate::common::adapting;
use crate::common::adapting::{PERIOD_S, block};
use gmhm::Gear;
use gmhm::adapt::{Adaptation, BLOCK_S, LEAST_TOLD, Settings};
use gmhm::memory::masing::Masing;
use gmhm::scalar::Float;
use gmhm_host_tests::Constants;
use gmhm_host_tests::drift::{self, Fault, Motion, Mover, Sensor};

const SAMPLES: u32 = 100_000;
/// Offset, delay, five coefficients, value.
type Row = [f64; 8];

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
fn solve(mut matrix: [[f64; 5]; 5], right: [f64; 5]) -> ([f64; 5], [f64; 5]) {
    let mut inverse = [[0.0; 5]; 5];
    for (k, row) in inverse.iter_mut().enumerate() {
        row[k] = 1.0;
    }
    for k in 0..5 {
        let pivot = matrix[k][k];
        for j in 0..5 {
            matrix[k][j] /= pivot;
            inverse[k][j] /= pivot;
        }
        for i in (0..5).filter(|i| *i != k) {
            let factor = matrix[i][k];
            for j in 0..5 {
                matrix[i][j] -= factor * matrix[k][j];
                inverse[i][j] -= factor * inverse[k][j];
            }
        }
    }
    let solution = [0, 1, 2, 3, 4].map(|i| (0..5).map(|j| inverse[i][j] * right[j]).sum());
    (solution, [0, 1, 2, 3, 4].map(|i| inverse[i][i]))
}

/// The largest difference to the batch, in its standard deviations, after [`SAMPLES`].
fn largest_difference<S: Float>(motion: Motion) -> f64 {
    let block = block();
    let (a, rated) = (block.rated_deflection_rad(), block.torque_scale_nm());
    let settings = Settings { period_s: PERIOD_S, drift: 0.0, ..Settings::default() };
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
    let nominal_change = adapting::change(&block, &nominal);
    assert_eq!(nominal_change, [0.0; 5]);
    let own = {
        let c = Constants::PUBLISHED;
        [c.c1 * a, c.c2 * a.powi(3), c.c3 * a.powi(5), c.e() * a, c.h() * a].map(|k| k / rated)
    };
    let per_block = (BLOCK_S / PERIOD_S).round() as u32;
    let prior = (0.5 * settings.largest_change).powi(2);
    let mut information = [[0.0; 5]; 5];
    for (k, row) in information.iter_mut().enumerate() {
        row[k] = 1.0 / prior;
    }
    let mut right = [0.0; 5];
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
        let taken = state.takes_samples();
        adaptation.period(&mut state, &path, says);
        if state.stretches() > stretches {
            // v is learnt from what the stretch told, after it.
            for row in &triangle(&rows)[2..] {
                if row[2..7].iter().map(|x| x * x * prior).sum::<f64>() >= LEAST_TOLD * variance {
                    for i in 0..5 {
                        for j in 0..5 {
                            information[i][j] += row[2 + i] * row[2 + j] / variance;
                        }
                        right[i] += row[2 + i] * row[7] / variance;
                    }
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
            [1.0, before.map_or(0.0, |before| p - before), x[0], x[1], x[2], x[3], x[4], says.to_f64() / rated - p];
        before = Some(p);
        let square = (row[7] - centre).powi(2) / about;
        about += (about * (square.min(9.0) - 1.0) + 1e-10) / 256.0;
        for (sum, x) in sums.iter_mut().zip(row) {
            *sum += x * (9.0 / square).min(1.0);
        }
        samples += 1;
        if samples == per_block {
            samples = 0;
            centre = sums[7] / sums[0];
            rows.push(sums.map(|sum| sum / f64::from(per_block).sqrt()));
            sums = [0.0; 8];
        }
    }
    assert_eq!(state.warnings().bits() & 0x1f, 0, "a stretch was refused: {:?}", state.warnings());
    assert!(state.stretches() > 30, "{}", state.stretches());
    let (batch, variances) = solve(information, right);
    let (estimate, of_state) = (state.estimate(), state.variances());
    (0..5)
        .map(|k| {
            let sd = variances[k].sqrt();
            assert!((of_state[k].to_f64().sqrt() / sd - 1.0).abs() < 0.01, "sd {k}");
            (estimate[k].to_f64() - batch[k]).abs() / sd
        })
        .fold(0.0, f64::max)
}

/// Measured: see the assertion; stated in `docs/adaptation.md`.
#[test]
fn the_recursion_is_batch_least_squares() {
    for motion in [Motion::Sine, Motion::Tones, Motion::Moves] {
        let double = largest_difference::<f64>(motion);
        let single = largest_difference::<f32>(motion);
        println!("{motion:?}: {double:e} in f64, {single:e} in f32");
        assert!(double < 1e-4, "{motion:?}: {double} standard deviations in f64");
        assert!(single < 0.1, "{motion:?}: {single} standard deviations in f32");
    }
}
