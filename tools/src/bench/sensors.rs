//! What the sensors make of the truth.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::noise::Noise;

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

/// The torque as measured: coloured noise, outliers, then the converter. N·m.
pub(super) fn torque(noise: &Noise, torque_nm: &mut [f64], random: &mut ChaCha8Rng) {
    let a = noise.autoregression;
    let fresh = (1.0 - a * a).sqrt();
    let mut coloured = normal(random);
    for torque in torque_nm {
        *torque += noise.torque_nm * coloured;
        coloured = a * coloured + fresh * normal(random);
        let (chance, sign): (f64, bool) = (random.random(), random.random());
        if chance < noise.outlier_rate {
            *torque += if sign { noise.outlier_nm } else { -noise.outlier_nm };
        }
        if let Some(step) = noise.torque_step_nm {
            *torque = (*torque / step).round() * step;
        }
    }
}

/// An angle as an encoder counts it, rad.
pub(super) fn encoder(noise: &Noise, angle_rad: &mut [f64]) {
    if let Some(bits) = noise.encoder_bits {
        let counts_per_rad = (1u64 << bits) as f64 / TAU;
        for angle in angle_rad {
            *angle = (*angle * counts_per_rad).round() / counts_per_rad;
        }
    }
}

/// White noise.
pub(super) fn white(rms: f64, values: &mut [f64], random: &mut ChaCha8Rng) {
    if rms > 0.0 {
        values.iter_mut().for_each(|value| *value += rms * normal(random));
    }
}
