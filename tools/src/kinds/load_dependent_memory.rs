//! Memory of slip elements that grows with the load: loops wider at their tips.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::build::{memory_radii, number, slip_elements, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term, TermValue};

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

    fn joint_candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        if ranges.rated_rad <= 0.0 {
            return Vec::new();
        }
        let term = |radii: &Vec<f64>, growth: (f64, f64)| {
            let values = [
                ("radius_rad", TermValue::List(radii.clone())),
                ("load_linear", number(growth.0)),
                ("load_quadratic", number(growth.1)),
            ];
            term(self.name(), &values)
        };
        memory_radii(ranges)
            .iter()
            .flat_map(|radii| [(0.0, 1.0), (1.0, 0.0)].map(|growth| term(radii, growth)))
            .collect()
    }

    fn is_of_slip_elements(&self) -> bool {
        true
    }

    /// Elements that grow with the load and elements that do not are one memory.
    fn takes_in(&self) -> &'static [&'static str] {
        &["nonlocal_memory"]
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        slip_elements(self.name(), measures, random)
            .fixed("load_linear", random.random_range(0.2..0.6))
            .fixed("load_quadratic", random.random_range(0.1..0.4))
    }
}
