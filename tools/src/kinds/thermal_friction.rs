//! Friction that changes with the temperature: a factor on the friction of the model.

use rand_chacha::ChaCha8Rng;

use super::build::{number, reference_c, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind, accepts_positive_only};
use crate::model::{Model, Term};
use gmhm::terms::KeyInfo;

const PER_K: &str = "per_k";

/// Kind `thermal_friction`.
pub struct ThermalFriction;

impl Kind for ThermalFriction {
    fn name(&self) -> &'static str {
        "thermal_friction"
    }

    fn family(&self) -> Family {
        Family::Friction
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Cycle]
    }

    fn candidates(&self, ranges: &Ranges, model: &Model) -> Vec<Term> {
        let is_scalable = |kind: &str| ["coulomb_friction", "stribeck_friction", "viscous_friction"].contains(&kind);
        if !model.terms.iter().any(|term| is_scalable(&term.kind)) {
            return Vec::new();
        }
        let of = |c| term(self.name(), &[(PER_K, number(0.0)), ("reference_c", c)]);
        reference_c(ranges).map(of).into_iter().collect()
    }

    fn refines(&self) -> &'static [&'static str] {
        &["coulomb_friction", "viscous_friction", "stribeck_friction"]
    }

    fn draft(&self, _shape: &str, measures: &Measures, _random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name()).number(PER_K, 1.0 / measures.warming_k()).fixed("reference_c", measures.temperature_c.0)
    }

    fn growth(&self, _term: &Term, _ranges: &Ranges) -> Option<(&'static str, f64)> {
        Some((PER_K, 1e-3))
    }

    /// Temperature may act either way.
    fn has_to_be_positive(&self, key: &KeyInfo) -> bool {
        accepts_positive_only(key)
    }
}
