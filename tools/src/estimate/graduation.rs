//! Graduation: the smoothest signal near a recorded one.
//!
//! Least Σ (s − x)² + w·Σ (Δ³s)² (Whittaker 1923), a system of seven diagonals. The same quadratic form is that of the probability of a signal whose third
//! differences are white, once x was recorded with white noise; so it also says how far the signal may be from its graduation.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

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
        let [mut a, mut b, mut c] = [0.0; 3];
        for (x, Row { lower: [near, middle, far], .. }) in x.iter_mut().zip(&self.rows) {
            *x = *x - far * c - middle * b - near * a;
            (a, b, c) = (*x, a, b);
        }
        x.iter_mut().zip(&self.rows).for_each(|(x, row)| *x *= row.inverse);
        self.back_substitute(x);
    }

    /// What the signal may differ from its graduation by, where white noise of standard deviation `sd` was recorded with it: normal with covariance sd²·(LDLᵀ)⁻¹.
    pub fn draw(&self, sd: f64, random: &mut ChaCha8Rng) -> Vec<f64> {
        let normal = |row: &Row| {
            let normal: f64 = StandardNormal.sample(&mut *random);
            sd * row.inverse.sqrt() * normal
        };
        let mut x: Vec<f64> = self.rows.iter().map(normal).collect();
        self.back_substitute(&mut x);
        x
    }

    /// Solves Lᵀ·s = x.
    fn back_substitute(&self, x: &mut [f64]) {
        let [mut a, mut b, mut c] = [(0.0, [0.0; 3]); 3];
        for (x, row) in x.iter_mut().zip(&self.rows).rev() {
            *x = *x - c.1[2] * c.0 - b.1[1] * b.0 - a.1[0] * a.0;
            (a, b, c) = ((*x, row.lower), a, b);
        }
    }
}

/// The weight at which a graduation differs from counts as much as counting takes, `sd`.
pub fn weight_of_counts(centred: &[f64], sd: f64) -> f64 {
    discrepant_weight(centred, |_| sd)
}

/// The highest weight at which a graduation differs from the record by no more than `misfit` of that weight: Morozov's discrepancy principle.
fn discrepant_weight(centred: &[f64], misfit: impl Fn(f64) -> f64) -> f64 {
    let rms = |smooth: &[f64]| {
        (smooth.iter().zip(centred).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / centred.len() as f64).sqrt()
    };
    let (mut low, mut high) = (-2.0_f64, 12.0_f64);
    for _ in 0..18 {
        let middle = 0.5 * (low + high);
        let weight = 10.0_f64.powf(middle);
        let mut smooth = centred.to_vec();
        Graduation::new(centred.len(), weight).smooth(&mut smooth);
        if rms(&smooth) > misfit(weight) { high = middle } else { low = middle }
    }
    10.0_f64.powf(low)
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

/// The smoothest signal that rounds to the recorded one: least Σ (Δ³s)² with abs(s − x) ≤ half a count, by the alternating direction method of multipliers
/// (Boyd and others 2011). Standstill stays standstill, and corners stay within half a count.
pub fn unround(x: &[f64], half: f64, sd: f64, out: &mut [f64]) {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    let centred: Vec<f64> = x.iter().map(|x| x - mean).collect();
    let graduation = Graduation::new(x.len(), weight_of_counts(&centred, sd).min(HEAVIEST));
    let mut multiplier = vec![0.0; x.len()];
    let mut inside = centred.clone();
    for _ in 0..ROUNDS {
        out.iter_mut().zip(&inside).zip(&multiplier).for_each(|((aim, z), u)| *aim = z - u);
        graduation.smooth(out);
        for (((z, u), s), x) in inside.iter_mut().zip(&mut multiplier).zip(&*out).zip(&centred) {
            let reached = RELAXATION * s + (1.0 - RELAXATION) * *z + *u;
            *z = reached.clamp(x - half, x + half);
            *u = reached - *z;
        }
    }
    out.iter_mut().for_each(|s| *s += mean);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

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
    fn draws_scatter_by_the_inverse_of_the_equations() {
        let graduation = Graduation::new(60, 30.0);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let draws: Vec<Vec<f64>> = (0..20_000).map(|_| graduation.draw(2.0, &mut random)).collect();
        for (i, j) in [(0, 0), (1, 4), (30, 30), (30, 33), (59, 58)] {
            let mut unit = vec![0.0; 60];
            unit[j] = 4.0;
            graduation.smooth(&mut unit);
            let found = draws.iter().map(|d| d[i] * d[j]).sum::<f64>() / draws.len() as f64;
            assert!((found - unit[i]).abs() < 0.06, "{i} {j}: {found} {}", unit[i]);
        }
    }
}
