//! The main job from end to end on a built-in recording: identify, write the model, evaluate it as the drive would, see what is left.

pub mod paper;
pub mod rivals;

use gmhm::{Gear, ParamError, Params};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Normal};

use crate::recording::Recording;

/// Standard deviation of the noise on the built-in recording's torque, N·m.
pub const NOISE_NM: f64 = 0.1;
const RATE_HZ: f64 = 100.0;
const CYCLE_HZ: f64 = 0.1;
const CYCLES: f64 = 3.0;

/// The built-in recording, and the torque without its noise.
#[derive(Debug, Clone)]
pub struct BuiltIn {
    /// Synthetic: the published gear on a quasi-static sine to ±A, from rest, with white noise on the torque.
    pub recording: Recording,
    /// Its torque before the noise was added, N·m.
    pub noise_free_nm: Vec<f64>,
}

/// Makes the built-in recording.
///
/// # Errors
/// None in practice: the published parameters are accepted.
pub fn built_in(seed: u64) -> Result<BuiltIn, ParamError> {
    let params = paper::published()?;
    let gear = Gear::<f64>::new(&params);
    let mut state = gear.start::<16>(0.0);
    let rows = (CYCLES / CYCLE_HZ * RATE_HZ) as usize + 1;
    let time_s: Vec<f64> = (0..rows).map(|k| k as f64 / RATE_HZ).collect();
    let deflection_rad: Vec<f64> =
        time_s.iter().map(|t| params.rated_deflection_rad() * (std::f64::consts::TAU * CYCLE_HZ * t).sin()).collect();
    let noise_free_nm: Vec<f64> = deflection_rad.iter().map(|x| gear.step(&mut state, *x).torque).collect();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let torque = match Normal::new(0.0, NOISE_NM) {
        Ok(noise) => noise_free_nm.iter().map(|t| t + noise.sample(&mut random)).collect(),
        Err(_) => noise_free_nm.clone(),
    };
    let recording = Recording {
        name: format!("built-in recording (synthetic, seed {seed})"),
        time_s,
        torque: Some(torque),
        deflection_rad: Some(deflection_rad),
        ..Recording::default()
    };
    Ok(BuiltIn { recording, noise_free_nm })
}

/// The torque as the drive computes it: in `f32`, with 16 turning points.
pub fn on_the_drive(params: &Params, deflection_rad: &[f64]) -> Vec<f64> {
    let gear = Gear::<f32>::new(params);
    let mut state = gear.start::<16>(deflection_rad.first().map_or(0.0, |x| *x as f32));
    deflection_rad.iter().map(|x| f64::from(gear.step(&mut state, *x as f32).torque)).collect()
}
