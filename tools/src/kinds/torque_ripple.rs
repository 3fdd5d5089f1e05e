//! Torque ripple: harmonics of the motor turn in the torque.

use rand_chacha::ChaCha8Rng;

use super::build::{harmonics, pick, waves, waves_of_both};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `torque_ripple`.
pub struct TorqueRipple;

impl Kind for TorqueRipple {
    fn name(&self) -> &'static str {
        "torque_ripple"
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
        waves(self.name(), &[&ranges.motor_orders[..], &[1.0, 2.0, 3.0, 4.0, 6.0]].concat())
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
        let highest = measures.highest_order().floor().max(1.0);
        let first = pick(&[1.0, 2.0, 3.0, 4.0, 6.0, 7.0, 12.0].map(|k: f64| k.min(highest)), random);
        harmonics(self.name(), "nm", &[first, if first > 1.0 { first - 1.0 } else { 2.0 }], 1.0, random)
    }
}
