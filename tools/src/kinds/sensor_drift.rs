//! A zero of the torque sensor that drifts with time.

use rand_chacha::ChaCha8Rng;

use super::build::{sign, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `sensor_drift`.
pub struct SensorDrift;

impl Kind for SensorDrift {
    fn name(&self) -> &'static str {
        "sensor_drift"
    }

    fn family(&self) -> Family {
        Family::Measurement
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Cycle]
    }

    fn candidates(&self, _ranges: &Ranges, _model: &Model) -> Vec<Term> {
        vec![term(self.name(), &[])]
    }

    fn price(&self) -> f64 {
        0.025
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name()).number("nm_per_s", sign(random) / measures.duration_s)
    }
}
