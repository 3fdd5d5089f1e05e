//! Coulomb friction at the output, its sign smoothed over a small velocity.

use rand_chacha::ChaCha8Rng;

use super::build::{number, smoothed, smoothings, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::{Ranges, Speeds};
use super::viscous_friction::viscous_friction;
use super::{Family, Kind, SMOOTHING, WIDER_THAN_SPEEDS, number_of};
use crate::model::{Model, Term};

/// Kind `coulomb_friction`.
pub struct CoulombFriction;

/// A term of this kind: its torque, N·m, and the velocity over which its sign is smoothed, rad/s.
pub fn coulomb_friction(torque_nm: f64, smoothing_rad_per_s: f64) -> Term {
    let values = [("torque_nm", number(torque_nm)), ("smoothing_rad_per_s", number(smoothing_rad_per_s))];
    term(CoulombFriction.name(), &values)
}

impl Kind for CoulombFriction {
    fn name(&self) -> &'static str {
        "coulomb_friction"
    }

    fn family(&self) -> Family {
        Family::Friction
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Running, Experiment::Rates]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        if ranges.velocity_rad_per_s <= 0.0 {
            return Vec::new();
        }
        smoothings(ranges).map(|s| term(self.name(), &[("smoothing_rad_per_s", number(s))])).to_vec()
    }

    fn degenerates_to(&self, term: &Term, speeds: Speeds) -> Option<Term> {
        let smoothing = number_of(term, SMOOTHING);
        let is_wide = smoothing > WIDER_THAN_SPEEDS * speeds.output_rad_per_s;
        is_wide.then(|| viscous_friction(number_of(term, "torque_nm") / smoothing))
    }

    fn price(&self) -> f64 {
        0.003
    }

    fn is_common(&self) -> bool {
        true
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        smoothed(Draft::new(self.name()).number("torque_nm", 1.0), measures, random)
    }
}
