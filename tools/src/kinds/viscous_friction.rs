//! Viscous friction at the output.

use rand_chacha::ChaCha8Rng;

use super::build::{number, term};
use super::coulomb_friction::coulomb_friction;
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

const EXPONENT: &str = "exponent";

/// Coulomb friction in the place of viscous friction begins to be fitted with a sign smoothed over this part of the speed.
const SHARP: f64 = 0.1;

/// Kind `viscous_friction`.
pub struct ViscousFriction;

/// A term of this kind: its damping, N·m·s/rad, exponent 1.
pub fn viscous_friction(damping_nms_per_rad: f64) -> Term {
    term(ViscousFriction.name(), &[("damping_nms_per_rad", number(damping_nms_per_rad))])
}

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

    fn price(&self) -> f64 {
        0.004
    }

    fn is_common(&self) -> bool {
        true
    }

    fn joint_candidates(&self, ranges: &Ranges, model: &Model) -> Vec<Term> {
        let mut terms = self.candidates(ranges, model);
        if !terms.is_empty() {
            terms.extend([0.7, 0.85, 1.2].map(|p| term(self.name(), &[(EXPONENT, number(p))])));
        }
        terms
    }

    fn shape_price(&self, term: &Term) -> f64 {
        if term.values.contains_key(EXPONENT) { 0.002 } else { 0.0 }
    }

    fn shape_refines(&self, term: &Term) -> Option<&'static str> {
        term.values.contains_key(EXPONENT).then_some("coulomb_friction")
    }

    fn at_one_speed(&self, torque_nm: f64, speed_rad_per_s: f64) -> Option<Term> {
        Some(coulomb_friction(torque_nm, SHARP * speed_rad_per_s))
    }

    fn at_locked_input(&self, term: &Term) -> Option<&'static str> {
        (!term.values.contains_key(EXPONENT)).then_some("viscous_damping")
    }

    fn draft(&self, _shape: &str, measures: &Measures, _random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name()).number("damping_nms_per_rad", 1.0 / measures.velocity)
    }
}
