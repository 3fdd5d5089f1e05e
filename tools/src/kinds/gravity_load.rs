//! Gravity of the link: one period a turn of the output, in the torque.

use rand_chacha::ChaCha8Rng;

use super::build::{once, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `gravity_load`.
pub struct GravityLoad;

impl Kind for GravityLoad {
    fn name(&self) -> &'static str {
        "gravity_load"
    }

    fn family(&self) -> Family {
        Family::Load
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Running]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        if ranges.output_turns_enough() { vec![term(self.name(), &[])] } else { Vec::new() }
    }

    fn price(&self) -> f64 {
        0.005
    }

    fn is_common(&self) -> bool {
        true
    }

    fn draft(&self, _shape: &str, _measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        once(self.name(), "cos_nm", "sin_nm", 1.0, random)
    }
}
