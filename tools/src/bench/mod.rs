//! The virtual test bench: motor, gear, torque sensor, two encoders and a load machine, as a program.
//!
//! The output carries a torque sensor and a machine that loads as well as brakes; the motor drives the wave generator, or is locked.
//! Encoders sit on both sides. [`simulate`] runs an [`Experiment`] on the gear of a model file and returns what the sensors say,
//! together with the [`Key`]: what was true.
//!
//! - The gear starts from rest at θ = 0 with an empty memory: the first loading curve is part of every recording.
//! - With the input locked the output angle alone moves, q_o = q_m/N − θ, and the output velocity is −θ̇. With the motor running,
//!   q_m = N·∫v dt for a prescribed v, and q_o follows from it and the deflection.
//! - `cycle`, `amplitudes` and `rates` prescribe the deflection (waveforms `sine`, `triangle`) or the load (`steps`); `running` and
//!   `dynamic` prescribe the load, and the deflection is the one at which the gear carries it.
//! - [`joint`] puts the gear into a flexible joint under a drive.
//! - But for the joint, every torque is the core's, by the same path as `gmhm predict`: the key's model predicts the noise-free recording exactly.
//!
//! Random choices come from one seed, in a stream for the motion and one a sensor: another `--noise` leaves the motion as it was.

pub mod hide;
pub mod joint;
mod key;
mod machine;
mod noise;
mod options;
mod plan;
mod profile;
mod sensors;

pub use hide::{Hidden, Hide, HideError};
pub use key::{Key, KeyError};
pub use noise::{Noise, NoiseError};
pub use options::{Experiment, Options, Waveform};

use gmhm::{ParamError, Params};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::device::DeviceError;
use crate::model::Model;
use crate::physics::{self, PredictError};
use crate::recording::Recording;
use crate::regression::error::EstimateError;
use plan::Plan;

/// Why nothing was simulated.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A joint log has no gear to put on the bench.
    #[error("the model has no [elastic] and [memory]: the bench needs a gear; fit one with gmhm fit")]
    NoGear,
    /// No rated deflection.
    #[error("the model has no rated_deflection_rad in [gear]: the bench scales its experiments by it")]
    NoRatedDeflection,
    /// The motor cannot run without a ratio.
    #[error("experiment {experiment} turns the motor: the model needs ratio in [gear]")]
    NoRatio {
        /// The experiment.
        experiment: Experiment,
    },
    /// The core refused the gear.
    #[error("the model's gear is none: {0}")]
    Params(#[from] ParamError),
    /// The experiment has no such option.
    #[error("{option} has no meaning in experiment {experiment}")]
    NotInExperiment {
        /// The option.
        option: &'static str,
        /// The experiment.
        experiment: Experiment,
    },
    /// A value that cannot be.
    #[error("{option} {value}: must be {must}")]
    Value {
        /// The option.
        option: &'static str,
        /// What was given.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// Too few samples for the motion.
    #[error("--sample-rate {sample_rate_hz}: too slow for this motion, at least {needed_hz} Hz are needed")]
    TooSlow {
        /// What was given, Hz.
        sample_rate_hz: f64,
        /// What is needed, Hz.
        needed_hz: f64,
    },
    /// Hardly any rows, or too many.
    #[error(
        "these options make {rows} rows, between 8 and {most} are possible: change --duration, --rate or --sample-rate"
    )]
    Rows {
        /// Rows asked for.
        rows: f64,
        /// Most rows.
        most: f64,
    },
    /// The gear cannot carry the load within its rated deflection.
    #[error(
        "at {time_s} s the gear does not carry {load_nm} N·m within its rated deflection (laws phase and time are not invertible there): lower --amplitude"
    )]
    LoadNotReached {
        /// When, s.
        time_s: f64,
        /// The load, N·m.
        load_nm: f64,
    },
    /// The torque could not be computed.
    #[error(transparent)]
    Predict(#[from] PredictError),
    /// The joint has no servo.
    #[error("servo of the joint: {0}")]
    Servo(#[from] gmhm::drive::ServoError),
    /// The drive at the end of the line did not answer.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// It answered that it cannot.
    #[error("the drive refused the joint: its firmware is of another version")]
    DriveRefused,
    /// An effect could not be hidden.
    #[error(transparent)]
    Hide(#[from] HideError),
    /// The gear of the joint could not be identified.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
}

/// A source of random choices of its own for each purpose.
#[derive(Debug, Clone, Copy)]
enum Stream {
    Motion = 1,
    Torque,
    Velocity,
    Temperature,
    Identification,
    Hidden,
    Joint,
}

fn random(seed: u64, stream: Stream) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream as u64);
    random
}

/// Runs an experiment on the gear of a model and returns what the sensors record, and the key.
///
/// Columns: time, torque, deflection, output velocity, temperature, and where the model has a ratio both angles. The deflection is that of the
/// measured angles, with the model's `deflection_zero_rad` in it. The torque has the model's unit. The key's `command` is left empty for the caller.
///
/// # Errors
/// [`BenchError`]: a model without a gear, options that do not fit.
pub fn simulate(
    model: &Model,
    experiment: Experiment,
    options: &Options,
    seed: u64,
) -> Result<(Recording, Key), BenchError> {
    let params = gear_of(model)?;
    if !experiment.input_locked() && model.gear.ratio.is_none() {
        return Err(BenchError::NoRatio { experiment });
    }
    plan::check(experiment, options)?;
    let mut motion = random(seed, Stream::Motion);
    let (perfect, truth, hidden) = if experiment == Experiment::Joint {
        let mut recording = joint::record(model, options, seed)?;
        recording.temperature_c = Some(machine::temperatures(options.warm_up_k, &recording.time_s));
        (recording, model.clone(), Vec::new())
    } else {
        let plan = Plan::new(experiment, options, &params, &mut motion)?;
        // Where the wave generator happens to stand, as q_m/N.
        let stand_rad = model.gear.ratio.map_or(0.0, |ratio| motion.random_range(0.0..std::f64::consts::TAU) / ratio);
        let stage = Stage { params, plan, stand_rad, warm_up_k: options.warm_up_k };
        let (truth, hidden) = hide::inject(model, &options.hide, &stage, &mut random(seed, Stream::Hidden))?;
        (stage.record(&truth)?, truth, hidden)
    };
    let perfect = Recording { name: format!("simulated {experiment}"), torque_unit: model.torque_unit, ..perfect };
    let noise = options.noise.unwrap_or_else(|| Noise::typical(params.rated_torque_nm()));
    let key = Key {
        seed,
        experiment,
        command: String::new(),
        rows: perfect.len(),
        duration_s: perfect.time_s.last().copied().unwrap_or(0.0),
        noise,
        plant: options.plant.unwrap_or_default(),
        hidden,
        truth,
    };
    Ok((measured(perfect, model, &noise, seed), key))
}

/// The gear of a model file.
fn gear_of(model: &Model) -> Result<Params, BenchError> {
    let rated_deflection_rad = model.gear.rated_deflection_rad.ok_or(BenchError::NoRatedDeflection)?;
    Ok(model.params(rated_deflection_rad).ok_or(BenchError::NoGear)??)
}

/// An experiment on the bench, ready to be run on variants of one gear.
struct Stage {
    params: Params,
    plan: Plan,
    stand_rad: f64,
    warm_up_k: f64,
}

impl Stage {
    /// The recording of perfect sensors.
    fn record(&self, model: &Model) -> Result<Recording, BenchError> {
        let time_s = &self.plan.time_s;
        let zero_rad = model.gear.deflection_zero_rad;
        let input_rad: Vec<f64> = self.plan.travel_rad.iter().map(|travel| self.stand_rad + travel).collect();
        let deflection_rad = machine::deflections(model, &self.params, &self.plan, &input_rad)?;
        let deflection_rad: Vec<f64> = deflection_rad.iter().map(|theta| theta + zero_rad).collect();
        let output_rad: Vec<f64> = input_rad.iter().zip(&deflection_rad).map(|(q, theta)| q - theta).collect();
        let mut recording = Recording {
            time_s: time_s.clone(),
            theta_in_rad: model.gear.ratio.map(|ratio| input_rad.iter().map(|q| q * ratio).collect()),
            velocity_out_rad_per_s: Some(machine::rate(&output_rad, time_s)),
            theta_out_rad: Some(output_rad),
            deflection_rad: Some(deflection_rad),
            temperature_c: Some(machine::temperatures(self.warm_up_k, time_s)),
            ..Recording::default()
        };
        recording.torque = Some(physics::predict(model, None, &recording)?.torque);
        Ok(recording)
    }
}

/// What real sensors make of it.
fn measured(mut truth: Recording, model: &Model, noise: &Noise, seed: u64) -> Recording {
    if let Some(torque) = &mut truth.torque {
        sensors::torque(noise, torque, &mut random(seed, Stream::Torque));
    }
    if let Some(velocity) = &mut truth.velocity_out_rad_per_s {
        sensors::white(noise.velocity_rad_per_s, velocity, &mut random(seed, Stream::Velocity));
    }
    if let Some(temperature) = &mut truth.temperature_c {
        sensors::white(noise.temperature_k, temperature, &mut random(seed, Stream::Temperature));
    }
    for angle in [&mut truth.theta_in_rad, &mut truth.theta_out_rad].into_iter().flatten() {
        sensors::encoder(noise, angle);
    }
    // The deflection is that of the encoders; without a ratio the locked input is the zero of the output encoder.
    match (&truth.theta_in_rad, model.gear.ratio) {
        (Some(_), Some(_)) if noise.encoder_bits.is_some() => {
            truth.deflection_rad = None;
            // Both angles and the ratio are there.
            let _ = truth.derive_deflection(model.gear.ratio);
        }
        (None, None) => truth.deflection_rad = truth.theta_out_rad.take().map(|q| q.iter().map(|q| -q).collect()),
        _ => {}
    }
    truth
}
