//! Friction that builds up over a distance of the output after each reversal.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::build::{number, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::free_coordinate::FreeCoordinate;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Distances over which friction is tried to reverse, shares of the travel.
const TRAVEL_SHARES: [f64; 6] = [3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1];

/// Kind `presliding_friction`.
pub struct PreslidingFriction;

impl Kind for PreslidingFriction {
    fn name(&self) -> &'static str {
        "presliding_friction"
    }

    fn family(&self) -> Family {
        Family::Friction
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Running]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        let travel = TAU * ranges.output_turns;
        if ranges.velocity_rad_per_s <= 0.0 || travel <= 0.0 {
            return Vec::new();
        }
        TRAVEL_SHARES.map(|share| term(self.name(), &[("radius_rad", number(share * travel))])).to_vec()
    }

    fn price(&self) -> f64 {
        0.0125
    }

    fn contains(&self) -> &'static [&'static str] {
        &["coulomb_friction"]
    }

    fn at_locked_input(&self, _term: &Term) -> Option<&'static str> {
        Some("nonlocal_memory")
    }

    fn measured_by(&self) -> &'static [FreeCoordinate] {
        &[FreeCoordinate::OutputReversal, FreeCoordinate::Velocity]
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        let range = measures.output_angle.1 - measures.output_angle.0;
        let radius = random.random_range(0.01..0.05) * range;
        Draft::new(self.name()).number("torque_nm", 1.0).fixed("radius_rad", radius)
    }
}
