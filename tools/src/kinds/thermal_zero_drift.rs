//! A zero of the torque sensor that drifts with the temperature.

use rand_chacha::ChaCha8Rng;

use super::build::{reference_c, sign, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind, accepts_positive_only};
use crate::model::{Model, Term};
use gmhm::terms::KeyInfo;

/// Kind `thermal_zero_drift`.
pub struct ThermalZeroDrift;

impl Kind for ThermalZeroDrift {
    fn name(&self) -> &'static str {
        "thermal_zero_drift"
    }

    fn family(&self) -> Family {
        Family::Measurement
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Cycle]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        reference_c(ranges).map(|c| term(self.name(), &[("reference_c", c)])).into_iter().collect()
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name())
            .number("nm_per_k", sign(random) / measures.warming_k())
            .fixed("reference_c", measures.temperature_c.0)
    }

    /// Temperature may act either way.
    fn has_to_be_positive(&self, key: &KeyInfo) -> bool {
        accepts_positive_only(key)
    }
}
