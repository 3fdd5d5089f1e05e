//! What a real bench adds: coloured noise, quantisation, outliers; and the residual of a real recording in its place.

use std::path::Path;

use crate::prove::generator::rng::Rng;

/// The disturbance of one case.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// A name for tables: `white`, `ar1 0.97`, `ar3`, `real`.
    pub name: String,
    /// Root mean square of the torque noise, N·m.
    pub rms_nm: f64,
    /// Autoregressive coefficients: n_k = Σ a_i n_{k−i} + white.
    pub autoregression: Vec<f64>,
    /// Torque resolution, N·m; 0 for none.
    pub torque_step_nm: f64,
    /// Share of rows that are outliers.
    pub outliers: f64,
    /// White noise of the deflection, rad.
    pub deflection_rms_rad: f64,
    /// Resolution of the deflection, rad; 0 for none.
    pub deflection_step_rad: f64,
    /// Residual of a real recording, of unit variance, that stands in for the torque noise.
    pub real: Option<Vec<f64>>,
}

/// Which colours may be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// Any, white included.
    Any,
    /// Autocorrelated.
    Coloured,
}

impl Noise {
    /// Draws the noise of a case.
    pub fn draw(rng: &mut Rng, colour: Colour) -> Self {
        let choice = if colour == Colour::Any { rng.uniform(0.0, 1.0) } else { rng.uniform(0.25, 1.0) };
        let (name, autoregression) = if choice < 0.25 {
            ("white".to_owned(), Vec::new())
        } else if choice < 0.75 {
            let a = 1.0 - rng.log_uniform(0.01, 0.5);
            (format!("ar1 {a:.3}"), vec![a])
        } else {
            // A slow real pole and a damped resonance: what structures and filters leave behind.
            let (slow, radius, angle) = (rng.uniform(0.5, 0.97), rng.uniform(0.7, 0.97), rng.uniform(0.2, 2.0));
            let (b, c) = (2.0 * radius * f64::cos(angle), -radius * radius);
            ("ar3".to_owned(), vec![slow + b, c - slow * b, -slow * c])
        };
        let quantised = rng.chance(0.4);
        Self {
            name,
            rms_nm: rng.log_uniform(0.03, 0.1),
            autoregression,
            torque_step_nm: if rng.chance(0.4) { rng.log_uniform(0.01, 0.08) } else { 0.0 },
            outliers: if rng.chance(0.25) { rng.log_uniform(2e-4, 2e-3) } else { 0.0 },
            deflection_rms_rad: rng.log_uniform(0.02e-6, 0.4e-6),
            deflection_step_rad: if quantised { rng.log_uniform(0.1e-6, 1.0e-6) } else { 0.0 },
            real: None,
        }
    }

    /// The torque noise of `rows` rows, without quantisation.
    pub fn torque(&self, rng: &mut Rng, rows: usize) -> Vec<f64> {
        let mut noise = if let Some(real) = &self.real {
            // The real residual from a random row on, reflected at its ends, either way round in sign.
            let (start, sign) = (rng.uniform(0.0, real.len() as f64) as usize, rng.sign());
            (0..rows)
                .map(|i| {
                    let k = (start + i) % (2 * real.len());
                    sign * real[if k < real.len() { k } else { 2 * real.len() - 1 - k }]
                })
                .collect()
        } else {
            let warm_up = 1500;
            let mut x = vec![0.0; warm_up + rows];
            for i in 0..x.len() {
                let past: f64 =
                    self.autoregression.iter().enumerate().filter(|(k, _)| *k < i).map(|(k, a)| a * x[i - 1 - k]).sum();
                x[i] = past + rng.normal();
            }
            let rms = rms(&x[warm_up / 2..]);
            x[warm_up..].iter().map(|x| x / rms).collect::<Vec<f64>>()
        };
        for x in &mut noise {
            *x *= self.rms_nm;
            if rng.chance(self.outliers) {
                *x += rng.sign() * rng.uniform(6.0, 15.0) * self.rms_nm;
            }
        }
        noise
    }

    /// The width of play that a sane engineer gives the turning-point tracker for this encoder, rad.
    pub fn play_rad(&self) -> f64 {
        4.0 * self.deflection_rms_rad + 1.01 * self.deflection_step_rad
    }
}

/// Rounds to multiples of `step`, or not at all for step 0.
pub fn quantise(x: f64, step: f64) -> f64 {
    if step > 0.0 { (x / step).round() * step } else { x }
}

/// Root mean square.
pub fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// The residual noise of real recordings under `folder`, of unit variance: the torque or current of each known file
/// after gravity, inertia and friction columns and a slow trend are taken out. Missing files are left out.
pub fn real_residuals(folder: &Path) -> Vec<Vec<f64>> {
    let files = [
        ("ur10e_joint1_sine.csv", "theta_out_rad", "velocity_out_rad_per_s", "current_a"),
        ("ur10e_joint2_sine.csv", "theta_out_rad", "velocity_out_rad_per_s", "current_a"),
        ("kinova_gen3_joint7_0.10radps.csv", "theta_out_rad", "velocity_out_rad_per_s", "torque_nm"),
        ("kinova_gen3_joint7_0.30radps.csv", "theta_out_rad", "velocity_out_rad_per_s", "torque_nm"),
        ("kinova_gen3_joint7_0.90radps.csv", "theta_out_rad", "velocity_out_rad_per_s", "torque_nm"),
    ];
    files
        .iter()
        .filter_map(|(file, angle, velocity, torque)| {
            let read = |name: &str| column(&folder.join(file), name);
            let (q, v, t) = (read(angle)?, read(velocity)?, read(torque)?);
            let rows = t.len();
            let along = |k: f64| (0..rows).map(|i| (k * std::f64::consts::PI * i as f64 / rows as f64).cos()).collect();
            let mut columns: Vec<Vec<f64>> = vec![
                q.iter().map(|q| q.cos()).collect(),
                q.iter().map(|q| q.sin()).collect(),
                v.iter().map(|v| (v / 0.01).tanh()).collect(),
                v.clone(),
                vec![1.0; rows],
            ];
            columns.extend((1..40).map(|k| along(f64::from(k))));
            let left = super::linear::residual(&columns, &t);
            let scale = rms(&left);
            Some(left.iter().map(|x| x / scale).collect())
        })
        .collect()
}

/// One numeric column of a CSV file; nothing where the file or the column is missing or holds anything else.
fn column(path: &Path, name: &str) -> Option<Vec<f64>> {
    let mut reader = csv::Reader::from_path(path).ok()?;
    let index = reader.headers().ok()?.iter().position(|h| h == name)?;
    reader.records().map(|row| row.ok()?.get(index)?.parse().ok()).collect()
}
