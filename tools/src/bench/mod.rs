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
//! - `drift` prescribes the deflection, and the gear's coefficients go from the model's to those of a warm gear in proportion to time.
//! - [`joint`] puts the gear into a flexible joint under a drive.
//! - But for the joint, every torque is the core's, by the same path as `gmhm predict`; but for `drift` too, the key's model predicts the noise-free recording exactly.
//!
//! Random choices come from one seed, in a stream for the motion and one a sensor: another `--noise` leaves the motion as it was.

mod drift;
mod error;
pub mod hide;
pub mod joint;
mod key;
mod machine;
mod noise;
mod options;
mod plan;
mod profile;
mod sensors;
mod stage;

pub use error::BenchError;
pub use hide::{Hidden, Hide, HideError};
pub use key::Key;
pub use noise::{Noise, NoiseError};
pub use options::{Experiment, Options, Waveform};

use rand::RngExt;

use crate::model::Model;
use crate::progress::Progress;
use crate::recording::Recording;
use plan::Plan;
use stage::{Stage, Stream, gear_of, random};

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
    simulate_under(model, experiment, options, seed, &())
}

/// [`simulate`] with its progress.
///
/// # Errors
/// As there.
pub fn simulate_under(
    model: &Model,
    experiment: Experiment,
    options: &Options,
    seed: u64,
    progress: &dyn Progress,
) -> Result<(Recording, Key), BenchError> {
    let params = gear_of(model)?;
    if !experiment.input_locked() && model.gear.ratio.is_none() {
        return Err(BenchError::NoRatio(experiment));
    }
    plan::check(experiment, options)?;
    let mut motion = random(seed, Stream::Motion);
    let (perfect, truth, hidden) = if experiment == Experiment::Joint {
        let mut recording = joint::record(model, options, seed)?;
        recording.temperature_c = Some(machine::temperatures(options.warm_up_k, &recording.time_s).into());
        (recording, model.clone(), Vec::new())
    } else {
        let plan = Plan::new(experiment, options, &params, &mut motion)?;
        // Where the wave generator happens to stand, as q_m/N.
        let stand_rad = model.gear.ratio.map_or(0.0, |ratio| motion.random_range(0.0..std::f64::consts::TAU) / ratio);
        let stage = Stage { params, plan, stand_rad, warm_up_k: options.warm_up_k };
        let (truth, hidden) = hide::inject(model, &options.hide, &stage, &mut random(seed, Stream::Hidden), progress)?;
        if experiment == Experiment::Drift {
            let (recording, warm) = drift::record(&stage, &truth, options.plant.unwrap_or_default(), progress)?;
            (recording, warm, hidden)
        } else {
            (stage.record_under(&truth, progress)?, truth, hidden)
        }
    };
    let perfect = Recording { name: format!("simulated {experiment}"), torque_unit: model.torque_unit, ..perfect };
    let noise = options.noise.unwrap_or_else(|| match experiment {
        Experiment::Drift => Noise { torque_nm: drift::NOISE * params.rated_torque_nm(), ..Noise::default() },
        _ => Noise::typical(params.rated_torque_nm()),
    });
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
