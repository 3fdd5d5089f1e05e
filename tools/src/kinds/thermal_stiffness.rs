//! A stiffness that changes with the temperature.

use rand_chacha::ChaCha8Rng;

use super::build::{reference_c, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind, accepts_positive_only};
use crate::model::{Model, Term};
use gmhm::terms::KeyInfo;

/// Kind `thermal_stiffness`.
pub struct ThermalStiffness;

impl Kind for ThermalStiffness {
    fn name(&self) -> &'static str {
        "thermal_stiffness"
    }

    fn family(&self) -> Family {
        Family::Elastic
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Cycle]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        reference_c(ranges).map(|c| term(self.name(), &[("reference_c", c)])).into_iter().collect()
    }

    fn draft(&self, _shape: &str, measures: &Measures, _random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name())
            .number("per_k", 1.0 / (measures.torque_nm * measures.warming_k()))
            .fixed("reference_c", measures.temperature_c.0)
    }

    /// Temperature may act either way.
    fn has_to_be_positive(&self, key: &KeyInfo) -> bool {
        accepts_positive_only(key)
    }
}
