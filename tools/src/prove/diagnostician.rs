//! The diagnosis as the proof of `gmhm prove` sees it.

use crate::diagnose::pipeline::{Options, diagnose};
use crate::model::Model;
use crate::prove::{Detector, Found};
use crate::recording::Recording;
use crate::signal::recorded::predict;

/// `gmhm diagnose`, for the proof.
#[derive(Debug, Clone, Copy, Default)]
pub struct Diagnostician;

impl Detector for Diagnostician {
    fn diagnose(&self, recordings: &[Recording], base: &Model, removed: &[String]) -> Result<Found, String> {
        let options = Options { removed: removed.to_vec(), ..Options::default() };
        let finding = diagnose(recordings, base, &[], &options, &()).map_err(|e| e.to_string())?;
        Ok(Found { diagnosis: finding.diagnosis, model: finding.model })
    }

    fn predict(&self, model: &Model, recording: &Recording) -> Result<Vec<f64>, String> {
        let mut torque = predict(model, None, recording).map_err(|e| e.to_string())?.torque;
        // A gear's model beside a simulation, as older ones are, predicts what the simulation leaves out.
        if let (false, Some(simulated)) = (model.is_simulation(), &recording.torque_sim_nm) {
            torque.iter_mut().zip(simulated).for_each(|(t, s)| *t += s);
        }
        Ok(torque)
    }
}
