//! The gear on the bench, ready to be run, and the streams of random choices.

use gmhm::Params;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::bench::error::BenchError;
use crate::bench::machine;
use crate::bench::plan::Plan;
use crate::model::Model;
use crate::physics;
use crate::progress::Progress;
use crate::recording::Recording;

/// A source of random choices of its own for each purpose.
#[derive(Debug, Clone, Copy)]
pub(super) enum Stream {
    Motion = 1,
    Torque,
    Velocity,
    Temperature,
    Identification,
    Hidden,
    Joint,
}

pub(super) fn random(seed: u64, stream: Stream) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream as u64);
    random
}

/// The gear of a model file.
pub(super) fn gear_of(model: &Model) -> Result<Params, BenchError> {
    let rated_deflection_rad = model.gear.rated_deflection_rad.ok_or(BenchError::NoRatedDeflection)?;
    Ok(model.drive_params(rated_deflection_rad).ok_or(BenchError::NoGear)??)
}

/// An experiment on the bench, ready to be run on variants of one gear.
pub(super) struct Stage {
    pub params: Params,
    pub plan: Plan,
    pub stand_rad: f64,
    pub warm_up_k: f64,
}

impl Stage {
    /// The recording of perfect sensors.
    pub fn record(&self, model: &Model) -> Result<Recording, BenchError> {
        self.record_under(model, &())
    }

    /// [`record`](Self::record) with its progress.
    pub fn record_under(&self, model: &Model, progress: &dyn Progress) -> Result<Recording, BenchError> {
        let time_s = &self.plan.time_s;
        let zero_rad = model.gear.deflection_zero_rad;
        let input_rad: Vec<f64> = self.plan.travel_rad.iter().map(|travel| self.stand_rad + travel).collect();
        let deflection_rad = machine::deflections(model, &self.params, &self.plan, &input_rad, progress)?;
        let deflection_rad: Vec<f64> = deflection_rad.iter().map(|theta| theta + zero_rad).collect();
        let output_rad: Vec<f64> = input_rad.iter().zip(&deflection_rad).map(|(q, theta)| q - theta).collect();
        let mut recording = Recording {
            time_s: time_s.clone().into(),
            theta_in_rad: model.gear.ratio.map(|ratio| input_rad.iter().map(|q| q * ratio).collect()),
            velocity_out_rad_per_s: Some(machine::rate(&output_rad, time_s).into()),
            theta_out_rad: Some(output_rad.into()),
            deflection_rad: Some(deflection_rad.into()),
            temperature_c: Some(machine::temperatures(self.warm_up_k, time_s).into()),
            ..Recording::default()
        };
        recording.torque = Some(physics::predict(model, None, &recording)?.torque.into());
        Ok(recording)
    }
}
