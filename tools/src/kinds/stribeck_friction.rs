//! Stribeck friction: Coulomb and viscous friction, and a static friction that decays with the velocity.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::build::{number, number_of, smoothed, term};
use super::coulomb_friction::{CoulombFriction, coulomb_friction};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::{Extent, Ranges, Speeds};
use super::viscous_friction::ViscousFriction;
use super::{Family, Kind, SMOOTHING, accepts_positive_only, saturates};
use crate::model::{Model, Term, TermValue};
use gmhm::terms::KeyInfo;

const COULOMB: &str = "coulomb_nm";
const STATIC: &str = "static_nm";
const DAMPING: &str = "damping_nms_per_rad";

/// Static over Coulomb friction, at least, for the dip to be named.
const SMALLEST_STATIC_RATIO: f64 = 1.17;

/// Static friction that decays over more than so many times the largest velocity is Coulomb friction within the recordings: nobody has seen its dip.
const BEYOND_SPEEDS: f64 = 3.0;

/// Kind `stribeck_friction`.
pub struct StribeckFriction;

impl Kind for StribeckFriction {
    fn name(&self) -> &'static str {
        "stribeck_friction"
    }

    fn family(&self) -> Family {
        Family::Friction
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Running]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        let fastest = ranges.velocity_rad_per_s;
        if fastest <= 0.0 {
            return Vec::new();
        }
        let mut terms = Vec::new();
        for smoothing in [0.01, 0.03].map(|share| share * fastest) {
            for velocity in [0.05, 0.12, 0.28].map(|share| share * fastest) {
                for exponent in [0.7, 1.0, 2.0] {
                    let values = [
                        ("stribeck_velocity_rad_per_s", number(velocity)),
                        ("exponent", number(exponent)),
                        ("smoothing_rad_per_s", number(smoothing)),
                    ];
                    terms.push(term(self.name(), &values));
                }
            }
        }
        terms
    }

    fn price(&self) -> f64 {
        0.0075
    }

    fn refines(&self) -> &'static [&'static str] {
        &["coulomb_friction"]
    }

    fn most_of_refined(&self) -> f64 {
        6.0
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        let draft = Draft::new(self.name())
            .number("coulomb_nm", 0.6)
            .number("static_nm", random.random_range(1.0..1.4))
            .number("damping_nms_per_rad", random.random_range(0.2..0.6) / measures.velocity)
            .fixed("stribeck_velocity_rad_per_s", random.random_range(0.08..0.25) * measures.velocity)
            .fixed("exponent", random.random_range(0.7..2.0));
        smoothed(draft, measures, random)
    }

    /// Beside Coulomb friction in the model, only what differs from it.
    fn only_free_key(&self, model: &Model) -> Option<&'static str> {
        model.has_term(CoulombFriction.name()).then_some(STATIC)
    }

    fn repeats_another(&self, model: &Model, key: &KeyInfo) -> bool {
        key.name == COULOMB && model.has_term(CoulombFriction.name())
            || key.name == DAMPING && model.has_term(ViscousFriction.name())
    }

    fn complete(&self, term: &mut Term) {
        term.values.entry(COULOMB.to_owned()).or_insert(number(0.0));
    }

    fn has_to_be_positive(&self, key: &KeyInfo) -> bool {
        accepts_positive_only(key) || key.plausible.0 >= 0.0 && key.name != COULOMB && !key.optional
    }

    fn is_of_kind(&self, term: &Term, extent: &Extent) -> bool {
        saturates(term, extent.fastest_rad_per_s) && number_of(term, STATIC) > number_of(term, COULOMB)
    }

    fn degenerates_to(&self, term: &Term, speeds: Speeds) -> Option<Term> {
        let is_unseen = number_of(term, "stribeck_velocity_rad_per_s") > BEYOND_SPEEDS * speeds.output_rad_per_s;
        let is_all = number_of(term, COULOMB) == 0.0 && number_of(term, DAMPING) == 0.0;
        (is_unseen && is_all).then(|| coulomb_friction(number_of(term, STATIC), number_of(term, SMOOTHING)))
    }

    fn contains(&self) -> &'static [&'static str] {
        &["coulomb_friction", "viscous_friction"]
    }

    fn exceeds_what_it_contains(&self, term: &Term) -> bool {
        number_of(term, STATIC) > SMALLEST_STATIC_RATIO * number_of(term, COULOMB)
    }

    fn special_cases(&self, own: &Term) -> Vec<Vec<Term>> {
        let value = |key: &str| own.values.get(key).cloned();
        if matches!(value(COULOMB), None | Some(TermValue::Number(0.0))) {
            return Vec::new();
        }
        let smoothing = value("smoothing_rad_per_s").unwrap_or(number(0.0));
        let dry = value(COULOMB)
            .map(|torque| term(CoulombFriction.name(), &[("torque_nm", torque), ("smoothing_rad_per_s", smoothing)]));
        let viscous = value(DAMPING).map(|damping| term(ViscousFriction.name(), &[(DAMPING, damping)]));
        let both = dry.clone().zip(viscous.clone()).map(|(dry, viscous)| vec![dry, viscous]);
        [both, dry.map(|t| vec![t]), viscous.map(|t| vec![t])].into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dip_beyond_the_speeds_recorded_is_coulomb_friction() {
        let of = |velocity: f64| {
            let values = [(COULOMB, 0.0), (STATIC, 0.4), ("stribeck_velocity_rad_per_s", velocity), (SMOOTHING, 0.1)];
            let own = term(StribeckFriction.name(), &values.map(|(key, value)| (key, number(value))));
            StribeckFriction.degenerates_to(&own, Speeds { output_rad_per_s: 2.0, motor_rad_per_s: 2.0 })
        };
        assert!(of(2.5).is_none());
        assert_eq!(of(157.0), Some(coulomb_friction(0.4, 0.1)));
    }
}
