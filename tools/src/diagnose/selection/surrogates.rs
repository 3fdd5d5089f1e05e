//! Series with the spectrum of a residual and no structure: what they give to a kind, noise gives.

use std::ops::Range;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// How many are made of a residual.
pub const SURROGATES: usize = 39;

/// Order of the autoregression that surrogates follow.
const ORDER: usize = 12;

/// Series with the spectrum of a residual and no structure: an autoregression driven by white noise, recording by recording.
pub fn surrogates(residual: &[f64], spans: &[Range<usize>], seed: u64) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut all = vec![vec![0.0; residual.len()]; SURROGATES];
    for span in spans {
        let own = &residual[span.clone()];
        let n = own.len();
        let mean = own.iter().sum::<f64>() / n as f64;
        let e: Vec<f64> = own.iter().map(|x| x - mean).collect();
        let r: Vec<f64> =
            (0..=ORDER).map(|k| e.iter().zip(&e[k.min(n)..]).map(|(a, b)| a * b).sum::<f64>() / n as f64).collect();
        let coefficients = levinson(&r);
        let warm_up = n.min(2000);
        for surrogate in &mut all {
            let mut past = [0.0; ORDER];
            let mut squares = 0.0;
            for k in 0..n + warm_up {
                let mut x: f64 = StandardNormal.sample(&mut random);
                x += coefficients.iter().zip(&past).map(|(a, p)| a * p).sum::<f64>();
                past.rotate_right(1);
                past[0] = x;
                if k >= warm_up {
                    surrogate[span.start + k - warm_up] = x;
                    squares += x * x;
                }
            }
            let factor = (r[0] * n as f64 / squares.max(f64::MIN_POSITIVE)).sqrt();
            surrogate[span.clone()].iter_mut().for_each(|x| *x *= factor);
        }
    }
    all
}

/// Coefficients of the autoregression with given autocovariances (Levinson 1947, Durbin 1960).
fn levinson(r: &[f64]) -> Vec<f64> {
    let mut a: Vec<f64> = Vec::new();
    let mut error = r[0] * (1.0 + 1e-9);
    for k in 1..r.len() {
        if error <= 0.0 {
            break;
        }
        let next = (r[k] - a.iter().enumerate().map(|(i, a)| a * r[k - 1 - i]).sum::<f64>()) / error;
        let reflected: Vec<f64> = (0..a.len()).map(|i| a[i] - next * a[a.len() - 1 - i]).collect();
        a = reflected;
        a.push(next);
        error *= 1.0 - next * next;
    }
    a
}
