//! Friction that varies with the motor or the output angle.

use rand_chacha::ChaCha8Rng;

use super::build::{harmonics, list, number, pick, smoothed, smoothings, term, text};
use super::coulomb_friction::CoulombFriction;
use super::draft::Draft;
use super::experiment::Experiment;
use super::free_coordinate::FreeCoordinate;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, ORDERS, Term};

/// Kind `position_dependent_friction`.
pub struct PositionDependentFriction;

impl Kind for PositionDependentFriction {
    fn name(&self) -> &'static str {
        "position_dependent_friction"
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
        let mut terms = Vec::new();
        for &smoothing in &smoothings(ranges)[..3] {
            let mut add = |angle: &str, order: f64| {
                let values =
                    [("angle", text(angle)), (ORDERS, list(order)), ("smoothing_rad_per_s", number(smoothing))];
                terms.push(term(self.name(), &values));
            };
            if ranges.motor_turns_enough() {
                let mut orders = vec![1.0, 2.0];
                orders.extend(ranges.friction_orders.iter().filter(|o| **o != 1.0 && **o != 2.0));
                orders.into_iter().for_each(|order| add("motor", order));
            }
            if ranges.output_turns_enough() {
                [1.0, 2.0, 3.0].into_iter().for_each(|order| add("output", order));
            }
        }
        terms
    }

    fn extends(&self) -> bool {
        true
    }

    fn hidden_shapes(&self) -> &'static [&'static str] {
        &["motor", "output"]
    }

    fn price(&self) -> f64 {
        0.01
    }

    fn refines(&self) -> &'static [&'static str] {
        &["coulomb_friction", "presliding_friction"]
    }

    /// More than that drives the joint over much of the turn.
    fn most_of_refined(&self) -> f64 {
        3.0
    }

    fn imitates(&self) -> &'static [&'static str] {
        &["coulomb_friction"]
    }

    fn elements_are_effects(&self) -> bool {
        true
    }

    fn measured_by(&self) -> &'static [FreeCoordinate] {
        &[FreeCoordinate::AngleAndDirection]
    }

    fn draft(&self, shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        let order = if shape == "motor" { pick(&[1.0, 2.0], random) } else { pick(&[1.0, 2.0, 3.0], random) };
        let draft = harmonics(self.name(), "nm", &[order], 1.0, random).text("angle", shape);
        smoothed(draft, measures, random)
    }

    fn special_cases(&self, own: &Term) -> Vec<Vec<Term>> {
        let smoothing = own.values.get("smoothing_rad_per_s").cloned().unwrap_or(number(0.0));
        let values = [("torque_nm", number(0.0)), ("smoothing_rad_per_s", smoothing)];
        vec![vec![term(CoulombFriction.name(), &values)]]
    }
}
