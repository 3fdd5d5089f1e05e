//! Memory of several slip elements: minor loops that the base model does not draw.

use rand_chacha::ChaCha8Rng;

use super::build::{list, memory_radii, slip_elements, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term, TermValue};

/// Kind `nonlocal_memory`.
pub struct NonlocalMemory;

impl Kind for NonlocalMemory {
    fn name(&self) -> &'static str {
        "nonlocal_memory"
    }

    fn family(&self) -> Family {
        Family::Memory
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Amplitudes]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        let a = ranges.rated_rad;
        if a <= 0.0 {
            return Vec::new();
        }
        let radii = [0.03, 0.05, 0.08, 0.13, 0.2, 0.32, 0.5, 0.8];
        radii.map(|share| term(self.name(), &[("radius_rad", list(share * a))])).to_vec()
    }

    fn extends(&self) -> bool {
        true
    }

    fn is_of_slip_elements(&self) -> bool {
        true
    }

    fn joint_candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        if ranges.rated_rad <= 0.0 {
            return Vec::new();
        }
        // Fewer elements, further apart, keep positive torques where the memory is small.
        let few = [0.01, 0.06, 0.4].map(|share| share * ranges.rated_rad).to_vec();
        let lists = memory_radii(ranges).into_iter().chain([few]);
        lists.map(|radii| term(self.name(), &[("radius_rad", TermValue::List(radii))])).collect()
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        slip_elements(self.name(), measures, random)
    }
}
