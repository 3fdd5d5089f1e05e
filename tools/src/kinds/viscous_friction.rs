//! Viscous friction at the output.

use rand_chacha::ChaCha8Rng;

use super::build::term;
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `viscous_friction`.
pub struct ViscousFriction;

impl Kind for ViscousFriction {
    fn name(&self) -> &'static str {
        "viscous_friction"
    }

    fn family(&self) -> Family {
        Family::Friction
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Running, Experiment::Rates]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        if ranges.velocity_rad_per_s > 0.0 { vec![term(self.name(), &[])] } else { Vec::new() }
    }

    fn draft(&self, _shape: &str, measures: &Measures, _random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name()).number("damping_nms_per_rad", 1.0 / measures.velocity)
    }
}
