//! Friction in proportion to the transmitted torque.

use rand_chacha::ChaCha8Rng;

use super::build::{number, smoothed, smoothings, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::free_coordinate::FreeCoordinate;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `load_dependent_friction`.
pub struct LoadDependentFriction;

impl Kind for LoadDependentFriction {
    fn name(&self) -> &'static str {
        "load_dependent_friction"
    }

    fn family(&self) -> Family {
        Family::Friction
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Running]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        if ranges.velocity_rad_per_s <= 0.0 {
            return Vec::new();
        }
        smoothings(ranges).map(|s| term(self.name(), &[("smoothing_rad_per_s", number(s))])).to_vec()
    }

    fn measured_by(&self) -> &'static [FreeCoordinate] {
        &[FreeCoordinate::LoadAndDirection]
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        smoothed(Draft::new(self.name()).number("mu", 1.0 / measures.torque_nm), measures, random)
    }
}
