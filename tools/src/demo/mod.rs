//! The main job from end to end on a built-in recording: identify, write the model, evaluate it as the drive would, see what is left.

mod plots;
mod story;

use gmhm::{Gear, ParamError, Params};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Normal};

use crate::baselines::{spring, two_lines};
use crate::fit;
use crate::fit::Fit;
use crate::fit::FitOptions;
use crate::fit::comparison::fitted;
use crate::fit::paper;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::regression::error::EstimateError;

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
        time_s: time_s.into(),
        torque: Some(torque.into()),
        deflection_rad: Some(deflection_rad.into()),
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

/// Everything that the demo found.
#[derive(Debug, Clone)]
pub struct Demo {
    /// The recording.
    pub built_in: BuiltIn,
    /// The model identified from it.
    pub fit: Fit,
    /// That model's parameters.
    pub params: Params,
    /// The torque by the core in `f32`, N·m.
    pub drive_nm: Vec<f64>,
    /// The torque of the best linear spring, N·m.
    pub spring_nm: Vec<f64>,
    /// The torque of the best two lines, N·m.
    pub lines_nm: Vec<f64>,
    /// Torque error left by each model.
    pub left: [Left; 3],
    /// Table 1 with the published gear and with the identified one.
    pub table_1: Vec<(paper::Row, paper::Row)>,
    /// Table 3 measured on the published cycle.
    pub table_3: Vec<TwoLines>,
}

/// What a model leaves of the torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Left {
    /// Which model.
    pub model: &'static str,
    /// Root mean square against the recording, N·m.
    pub recorded_rms_nm: f64,
    /// Root mean square against the torque before the noise was added, N·m.
    pub noise_free_rms_nm: f64,
}

/// Two lines on the published cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoLines {
    /// Points on the cycle.
    pub points: usize,
    /// Residual sum of squares of the best two lines, N²·m².
    pub rss: f64,
}

/// Runs the chain: recording → fit → the core in `f32` → what is left, beside two baselines, and the paper's tables.
///
/// # Errors
/// What `fit` refuses.
pub fn run(seed: u64, progress: &dyn Progress) -> Result<Demo, EstimateError> {
    let built_in = built_in(seed)?;
    let options = FitOptions { seed, ..FitOptions::default() };
    let fit = fit::fit(std::slice::from_ref(&built_in.recording), &options, progress)?;
    let rated = fit.model.gear.rated_deflection_rad.unwrap_or(paper::RATED_DEFLECTION_RAD);
    let identified = fit.model.params(rated).unwrap_or_else(paper::published)?;

    let deflection = built_in.recording.deflection_rad.as_deref().unwrap_or_default();
    let torque = built_in.recording.torque.as_deref().unwrap_or_default();
    let drive_nm = on_the_drive(&identified, deflection);
    let spring_nm = fitted(&spring(), &built_in.recording, seed)?;
    let lines_nm = fitted(&two_lines(), &built_in.recording, seed)?;
    let left = |model, predicted: &[f64]| Left {
        model,
        recorded_rms_nm: rms(torque, predicted),
        noise_free_rms_nm: rms(&built_in.noise_free_nm, predicted),
    };
    let left = [left("GMHM, core in f32", &drive_nm), left("two lines", &lines_nm), left("linear spring", &spring_nm)];
    let published = paper::published()?;
    let table_1 = paper::table_1(&published).into_iter().zip(paper::table_1(&identified)).collect();
    let table_3 = [paper::TABLE_1_POINTS, 2000].map(|points| two_lines_on_the_cycle(&published, points, seed));
    let table_3 = table_3.into_iter().collect::<Result<_, _>>()?;
    Ok(Demo { built_in, fit, params: identified, drive_nm, spring_nm, lines_nm, left, table_1, table_3 })
}

/// Two lines fitted to the steady cycle of a gear.
fn two_lines_on_the_cycle(params: &Params, points: usize, seed: u64) -> Result<TwoLines, EstimateError> {
    let (deflection, torque) = paper::steady_cycle(params, points);
    let cycle = Recording {
        name: "the published cycle".to_owned(),
        time_s: (0..points).map(|k| k as f64).collect(),
        torque: Some(torque.clone().into()),
        deflection_rad: Some(deflection.into()),
        ..Recording::default()
    };
    let lines = fitted(&two_lines(), &cycle, seed)?;
    Ok(TwoLines { points, rss: rss(&torque, &lines) })
}

/// Residual sum of squares, in the square of the torque's unit.
fn rss(measured: &[f64], model: &[f64]) -> f64 {
    measured.iter().zip(model).map(|(a, b)| (a - b).powi(2)).sum()
}

/// Root mean square of the residual, in the torque's unit.
fn rms(measured: &[f64], model: &[f64]) -> f64 {
    (rss(measured, model) / measured.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_lines_on_the_published_cycle_leave_what_model_md_says() {
        let params = paper::published().unwrap();
        for points in [64, 2000] {
            let share = two_lines_on_the_cycle(&params, points, 1).unwrap().rss / points as f64;
            // MODEL.md section 2, finding 7: 2.4 to 2.8 N²m² a point, by spacing.
            assert!((2.3..2.9).contains(&share), "{points} points: {share}");
        }
    }
}
