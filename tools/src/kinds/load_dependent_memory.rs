//! Memory of slip elements that grows with the load: loops wider at their tips.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::build::slip_elements;
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `load_dependent_memory`.
pub struct LoadDependentMemory;

impl Kind for LoadDependentMemory {
    fn name(&self) -> &'static str {
        "load_dependent_memory"
    }

    fn family(&self) -> Family {
        Family::Memory
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Amplitudes]
    }

    /// Not searched for yet.
    fn candidates(&self, _ranges: &Ranges, _model: &Model) -> Vec<Term> {
        Vec::new()
    }

    fn extends(&self) -> bool {
        true
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        slip_elements(self.name(), measures, random)
            .fixed("load_linear", random.random_range(0.2..0.6))
            .fixed("load_quadratic", random.random_range(0.1..0.4))
    }
}
