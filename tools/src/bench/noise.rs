//! What the sensors add: the grammar of `--noise`.

use std::fmt;
use std::str::FromStr;

/// Faults of the sensors that are noise and not physics; by default none.
///
/// Written as `none`, or as `KEY=VALUE,…`; a key that is not named adds nothing:
///
/// | key | what | range |
/// |---|---|---|
/// | `torque` | rms of the torque noise, N·m | ≥ 0 |
/// | `ar` | coefficient a of that noise from sample to sample, n_k = a·n_(k−1) + white | 0 to below 1 |
/// | `torque_step` | step of the torque sensor's converter, N·m | > 0 |
/// | `encoder_bits` | resolution of both encoders, counts a turn = 2^bits | 8 to 40 |
/// | `outliers` | `RATE:SIZE`, share of torque samples that are off by ±SIZE N·m | 0 to 1, ≥ 0 |
/// | `velocity` | rms of white noise on the output velocity, rad/s | ≥ 0 |
/// | `temperature` | rms of white noise on the temperature, K | ≥ 0 |
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Noise {
    /// Rms of the torque noise, N·m.
    pub torque_nm: f64,
    /// Coefficient of the first-order autoregression that the torque noise is, 0 (white) to below 1.
    pub autoregression: f64,
    /// Step of the torque converter, N·m.
    pub torque_step_nm: Option<f64>,
    /// Bits a turn of both encoders.
    pub encoder_bits: Option<u32>,
    /// Share of torque samples that are outliers.
    pub outlier_rate: f64,
    /// Their size, N·m.
    pub outlier_nm: f64,
    /// Rms of the noise on the output velocity, rad/s.
    pub velocity_rad_per_s: f64,
    /// Rms of the noise on the temperature, K.
    pub temperature_k: f64,
}

/// Why a `--noise` was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoiseError {
    /// Not of the form KEY=VALUE.
    #[error("noise {0:?}: write KEY=VALUE, such as torque=0.1, separated by commas, or none")]
    Form(String),
    /// No such key.
    #[error(
        "noise {0:?}: no such key; known are torque, ar, torque_step, encoder_bits, outliers, velocity and temperature"
    )]
    Key(String),
    /// Named twice.
    #[error("noise {0:?}: named twice")]
    Twice(String),
    /// A value outside its range.
    #[error("noise {key}={value}: must be {must}")]
    Value {
        /// The key.
        key: String,
        /// What was written.
        value: String,
        /// What it must be.
        must: &'static str,
    },
}

impl Noise {
    /// A good bench: torque noise of 0.1 % of the rated torque with a = 0.9, 26-bit encoders, a converter of 16 bits over twice the range, 0.02 K.
    pub fn typical(rated_torque_nm: f64) -> Self {
        let rated_torque_nm = rated_torque_nm.abs();
        Self {
            torque_nm: 1e-3 * rated_torque_nm,
            autoregression: 0.9,
            torque_step_nm: (rated_torque_nm > 0.0).then_some(rated_torque_nm / f64::from(1u32 << 14)),
            encoder_bits: Some(26),
            temperature_k: 0.02,
            ..Self::default()
        }
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), NoiseError> {
        let refuse = |must| NoiseError::Value { key: key.to_owned(), value: value.to_owned(), must };
        let number = |text: &str, must, holds: fn(f64) -> bool| {
            text.parse::<f64>().ok().filter(|x| x.is_finite() && holds(*x)).ok_or_else(|| refuse(must))
        };
        let size = |text: &str| number(text, "a number of at least 0", |x| x >= 0.0);
        match key {
            "torque" => self.torque_nm = size(value)?,
            "ar" => {
                self.autoregression = number(value, "a number from 0 to below 1", |x| (0.0..1.0).contains(&x))?;
            }
            "torque_step" => {
                self.torque_step_nm = Some(number(value, "a number greater than 0", |x| x > 0.0)?);
            }
            "encoder_bits" => {
                let bits = value.parse::<u32>().ok().filter(|bits| (8..=40).contains(bits));
                self.encoder_bits = Some(bits.ok_or_else(|| refuse("a whole number from 8 to 40"))?);
            }
            "outliers" => {
                let (rate, off) = value.split_once(':').ok_or_else(|| refuse("RATE:SIZE, such as 0.001:5"))?;
                self.outlier_rate = number(rate, "a rate from 0 to 1 before the colon", |x| (0.0..=1.0).contains(&x))?;
                self.outlier_nm = size(off)?;
            }
            "velocity" => self.velocity_rad_per_s = size(value)?,
            "temperature" => self.temperature_k = size(value)?,
            _ => return Err(NoiseError::Key(key.to_owned())),
        }
        Ok(())
    }
}

impl FromStr for Noise {
    type Err = NoiseError;

    fn from_str(text: &str) -> Result<Self, NoiseError> {
        let mut noise = Self::default();
        if text.trim() == "none" {
            return Ok(noise);
        }
        let mut seen = Vec::new();
        for entry in text.split(',') {
            let (key, value) = entry.split_once('=').ok_or_else(|| NoiseError::Form(entry.trim().to_owned()))?;
            let (key, value) = (key.trim(), value.trim());
            noise.set(key, value)?;
            if seen.contains(&key) {
                return Err(NoiseError::Twice(key.to_owned()));
            }
            seen.push(key);
        }
        Ok(noise)
    }
}

/// As `--noise` reads it back.
impl fmt::Display for Noise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut words = Vec::new();
        let mut number = |key: &str, value: f64| {
            if value != 0.0 {
                words.push(format!("{key}={value:?}"));
            }
        };
        number("torque", self.torque_nm);
        number("ar", self.autoregression);
        number("torque_step", self.torque_step_nm.unwrap_or(0.0));
        number("velocity", self.velocity_rad_per_s);
        number("temperature", self.temperature_k);
        if let Some(bits) = self.encoder_bits {
            words.push(format!("encoder_bits={bits}"));
        }
        if self.outlier_rate != 0.0 {
            words.push(format!("outliers={:?}:{:?}", self.outlier_rate, self.outlier_nm));
        }
        f.write_str(&if words.is_empty() { "none".to_owned() } else { words.join(",") })
    }
}
