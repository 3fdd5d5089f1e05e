//! Graduation: the smoothest signal near a recorded one.
//!
//! Least Σ (s − x)² + w·Σ (Δ³s)² (Whittaker 1923), a system of seven diagonals.

use std::array;

/// The factor L·D·Lᵀ of the equations of a graduation.
pub struct Graduation {
    rows: Vec<Row>,
}

/// A row of L left of its unit diagonal, nearest first, and the reciprocal of D there.
#[derive(Clone, Copy)]
struct Row {
    lower: [f64; 3],
    inverse: f64,
}

/// What lies before the first row.
const NONE: Row = Row { lower: [0.0; 3], inverse: 0.0 };

impl Graduation {
    /// Of `n` samples, the third differences weighted by `weight`.
    pub fn new(n: usize, weight: f64) -> Self {
        const DIFFERENCE: [f64; 4] = [-1.0, 3.0, -3.0, 1.0];
        let element = |i: usize, k: usize| {
            let differences = (k..=3.min(i)).filter(|a| i - a + 3 < n);
            let sum: f64 = differences.map(|a| DIFFERENCE[a] * DIFFERENCE[a - k]).sum();
            weight * sum + if k == 0 { 1.0 } else { 0.0 }
        };
        let mut rows: Vec<Row> = Vec::with_capacity(n);
        let mut settled = false;
        for i in 0..n {
            let back = |k: usize| if k <= i { rows[i - k] } else { NONE };
            let (first, second, third) = (back(1), back(2), back(3));
            if settled && i + 3 < n {
                rows.push(first);
                continue;
            }
            let far = element(i, 3);
            let middle = element(i, 2) - far * second.lower[0];
            let near = element(i, 1) - middle * first.lower[0] - far * first.lower[1];
            let lower = [near * first.inverse, middle * second.inverse, far * third.inverse];
            let pivot = element(i, 0) - near * lower[0] - middle * lower[1] - far * lower[2];
            rows.push(Row { lower, inverse: pivot.max(1e-300).recip() });
            // Away from its ends the factor repeats itself.
            settled = i >= 6 && (rows[i].inverse - first.inverse).abs() <= 1e-15 * first.inverse;
        }
        Self { rows }
    }

    /// Of a record about its mean with white noise of standard deviation `sd`: the weight at which it takes as much out of the record as it would of that noise.
    pub fn of_noise(centred: &[f64], sd: f64) -> Self {
        let chance = 1.0 + (2.0 / centred.len() as f64).sqrt();
        let weight = discrepant_weight(centred, |weight| sd * (chance * noise_left(weight)).sqrt());
        Self::new(centred.len(), weight)
    }

    /// Replaces a record by its graduation.
    pub fn smooth(&self, x: &mut [f64]) {
        self.smooth_abreast(x.as_chunks_mut::<1>().0);
    }

    /// Replaces records, abreast, by their graduations.
    fn smooth_abreast<const N: usize>(&self, x: &mut [[f64; N]]) {
        let [mut a, mut b, mut c] = [[0.0; N]; 3];
        for (x, Row { lower: [near, middle, far], .. }) in x.iter_mut().zip(&self.rows) {
            *x = array::from_fn(|n| x[n] - far * c[n] - middle * b[n] - near * a[n]);
            (a, b, c) = (*x, a, b);
        }
        let [mut a, mut b, mut c] = [([0.0; N], [0.0; 3]); 3];
        for (x, Row { lower, inverse }) in x.iter_mut().zip(&self.rows).rev() {
            *x = array::from_fn(|n| x[n] * inverse - c.1[2] * c.0[n] - b.1[1] * b.0[n] - a.1[0] * a.0[n]);
            (a, b, c) = ((*x, *lower), a, b);
        }
    }
}

/// The weight at which a graduation differs from counts as much as counting takes, `sd`.
pub fn weight_of_counts(centred: &[f64], sd: f64) -> f64 {
    discrepant_weight(centred, |_| sd)
}

/// The highest weight at which a graduation differs from the record by no more than `misfit` of that weight: Morozov's discrepancy principle.
fn discrepant_weight(centred: &[f64], misfit: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (-2.0_f64, 12.0_f64);
    for _ in 0..18 {
        let middle = 0.5 * (low + high);
        let weight = 10.0_f64.powf(middle);
        if taken_by(centred, weight) > misfit(weight) { high = middle } else { low = middle }
    }
    10.0_f64.powf(low)
}

/// The standard deviation of the white noise of a record about its mean, from what a graduation of this weight takes out of it: waves of far more than 2π weight^(1/6) samples do not count.
pub fn noise_taken_by(centred: &[f64], weight: f64) -> f64 {
    taken_by(centred, weight) / noise_left(weight).sqrt()
}

/// What a graduation takes out of a record, rms.
fn taken_by(record: &[f64], weight: f64) -> f64 {
    let mut smooth = record.to_vec();
    Graduation::new(record.len(), weight).smooth(&mut smooth);
    (smooth.iter().zip(record).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / record.len() as f64).sqrt()
}

/// Which part of the variance of white noise a graduation takes out of a record: the mean of (1 − H)² over all frequencies.
fn noise_left(weight: f64) -> f64 {
    const FREQUENCIES: usize = 512;
    let left = (0..FREQUENCIES).map(|k| {
        let w = std::f64::consts::PI * (k as f64 + 0.5) / FREQUENCIES as f64;
        let kept = 1.0 / (1.0 + weight * (2.0 * (0.5 * w).sin()).powi(6));
        (1.0 - kept) * (1.0 - kept)
    });
    left.sum::<f64>() / FREQUENCIES as f64
}

/// Steps of the method of multipliers, and its relaxation: longer strides end nearer in fewer steps.
const ROUNDS: usize = 100;
const RELAXATION: f64 = 1.6;

/// The highest weight of its graduation: beyond, its end is far away and rounding shows.
const HEAVIEST: f64 = 1e9;

/// The smoothest signals that round to recorded ones, which go abreast and differ by little: least Σ (Δ³s)² with abs(s − x) ≤ half a count, by the alternating
/// direction method of multipliers (Boyd and others 2011). Standstill stays standstill, and corners stay within half a count.
pub fn unround<const N: usize>(x: &[[f64; N]], half: f64, sd: f64) -> Vec<[f64; N]> {
    let mean = x.iter().map(|x| x[0]).sum::<f64>() / x.len() as f64;
    let centred: Vec<[f64; N]> = x.iter().map(|x| x.map(|x| x - mean)).collect();
    let first: Vec<f64> = centred.iter().map(|x| x[0]).collect();
    let graduation = Graduation::new(x.len(), weight_of_counts(&first, sd).min(HEAVIEST));
    let mut multiplier = vec![[0.0; N]; x.len()];
    let mut inside = centred.clone();
    let mut out = vec![[0.0; N]; x.len()];
    for _ in 0..ROUNDS {
        out.iter_mut().zip(&inside).zip(&multiplier).for_each(|((aim, z), u)| *aim = array::from_fn(|n| z[n] - u[n]));
        graduation.smooth_abreast(&mut out);
        for (((z, u), s), x) in inside.iter_mut().zip(&mut multiplier).zip(&out).zip(&centred) {
            let reached: [f64; N] = array::from_fn(|n| RELAXATION * s[n] + (1.0 - RELAXATION) * z[n] + u[n]);
            *z = array::from_fn(|n| reached[n].clamp(x[n] - half, x[n] + half));
            *u = array::from_fn(|n| reached[n] - z[n]);
        }
    }
    out.iter_mut().for_each(|s| *s = s.map(|s| s + mean));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn graduation_solves_its_equations_and_keeps_parabolas() {
        let x: Vec<f64> = (0..400).map(|k| ((k * 37) % 17) as f64).collect();
        let mut s = x.clone();
        Graduation::new(400, 7.0).smooth(&mut s);
        let third = |k: usize| s[k + 3] - 3.0 * s[k + 2] + 3.0 * s[k + 1] - s[k];
        for i in 0..400_usize {
            let gradient: f64 = (0..4)
                .filter_map(|a| i.checked_sub(a).filter(|k| k + 3 < 400).map(|k| [-1.0, 3.0, -3.0, 1.0][a] * third(k)))
                .sum();
            assert!((s[i] - x[i] + 7.0 * gradient).abs() < 1e-9);
        }
        let parabola: Vec<f64> = (0..40).map(|k| 0.5 * (k * k) as f64 - 3.0).collect();
        let mut kept = parabola.clone();
        Graduation::new(40, 1e6).smooth(&mut kept);
        assert!(kept.iter().zip(&parabola).all(|(a, b)| (a - b).abs() < 1e-4));
    }

    #[test]
    fn signals_abreast_are_unrounded_as_each_alone() {
        let counts =
            |by: f64| -> Vec<f64> { (0..300).map(|k| (9.0 * (0.05 * f64::from(k)).sin() + by).round()).collect() };
        let [x, y] = [counts(0.0), counts(0.3)];
        let both: Vec<[f64; 2]> = x.iter().zip(&y).map(|(x, y)| [*x, *y]).collect();
        let both = unround(&both, 0.5, 0.29);
        let alone = unround(x.as_chunks::<1>().0, 0.5, 0.29);
        assert!(both.iter().zip(&alone).all(|(both, alone)| (both[0] - alone[0]).abs() < 1e-12));
        let off =
            both.iter().zip(0..).map(|(s, k)| (s[1] - 0.3 - 9.0 * (0.05 * f64::from(k)).sin()).powi(2)).sum::<f64>();
        assert!((off / 300.0).sqrt() < 0.1, "{off}");
    }
}
