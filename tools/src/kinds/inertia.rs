//! Inertia of the output.

use rand_chacha::ChaCha8Rng;

use super::build::term;
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `inertia`.
pub struct Inertia;

impl Kind for Inertia {
    fn name(&self) -> &'static str {
        "inertia"
    }

    fn family(&self) -> Family {
        Family::Load
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Rates, Experiment::Dynamic]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        if ranges.velocity_rad_per_s > 0.0 { vec![term(self.name(), &[])] } else { Vec::new() }
    }

    fn price(&self) -> f64 {
        0.005
    }

    fn is_common(&self) -> bool {
        true
    }

    fn draft(&self, _shape: &str, measures: &Measures, _random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name()).number("inertia_kgm2", 1.0 / measures.acceleration)
    }
}
