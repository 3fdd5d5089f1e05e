//! Wrong scale of the torque against a simulation.

use rand_chacha::ChaCha8Rng;

use super::build::{sign, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `torque_scale`.
pub struct TorqueScale;

impl Kind for TorqueScale {
    fn name(&self) -> &'static str {
        "torque_scale"
    }

    fn family(&self) -> Family {
        Family::Measurement
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Running]
    }

    /// Not searched for yet.
    fn candidates(&self, _ranges: &Ranges, model: &Model) -> Vec<Term> {
        if model.is_simulation() { vec![term(self.name(), &[])] } else { Vec::new() }
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name()).number("gain_error", sign(random) / measures.torque_nm)
    }
}
