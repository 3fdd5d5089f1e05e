//! Damping of the deflection rate.

use rand_chacha::ChaCha8Rng;

use super::build::term;
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `viscous_damping`.
pub struct ViscousDamping;

impl Kind for ViscousDamping {
    fn name(&self) -> &'static str {
        "viscous_damping"
    }

    fn family(&self) -> Family {
        Family::Friction
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Rates, Experiment::Dynamic]
    }

    fn candidates(&self, _ranges: &Ranges, _model: &Model) -> Vec<Term> {
        vec![term(self.name(), &[])]
    }

    fn price(&self) -> f64 {
        0.005
    }

    fn at_locked_input(&self, _term: &Term) -> Option<&'static str> {
        Some("viscous_friction")
    }

    fn draft(&self, _shape: &str, measures: &Measures, _random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name()).number("damping_nms_per_rad", 1.0 / measures.deflection_rate)
    }
}
