//! Kinematic error of the transmission: harmonics of the motor turn in the deflection.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::build::{harmonics, waves, waves_of_both};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `kinematic_error`.
pub struct KinematicError;

impl Kind for KinematicError {
    fn name(&self) -> &'static str {
        "kinematic_error"
    }

    fn family(&self) -> Family {
        Family::Transmission
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Running]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        if !ranges.motor_turns_enough() {
            return Vec::new();
        }
        waves(self.name(), &[&ranges.motor_orders[..], &[1.0, 2.0, 4.0]].concat())
    }

    fn extends(&self) -> bool {
        true
    }

    fn elements_are_effects(&self) -> bool {
        true
    }

    fn joint_candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        waves_of_both(self.name(), ranges)
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        let orders = [[1.0, 2.0], [2.0, 4.0], [2.0, 1.0]][random.random_range(0..3)];
        harmonics(self.name(), "rad", &orders, 1.0 / measures.stiffness(), random)
    }
}
