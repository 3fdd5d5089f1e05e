//! A stiffness that differs between the two directions of load.

use rand_chacha::ChaCha8Rng;

use super::build::{sign, term, text};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `stiffness_asymmetry`.
pub struct StiffnessAsymmetry;

impl Kind for StiffnessAsymmetry {
    fn name(&self) -> &'static str {
        "stiffness_asymmetry"
    }

    fn family(&self) -> Family {
        Family::Elastic
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Amplitudes]
    }

    fn candidates(&self, _ranges: &Ranges, _model: &Model) -> Vec<Term> {
        ["square", "abs"].map(|shape| term(self.name(), &[("shape", text(shape))])).to_vec()
    }

    fn hidden_shapes(&self) -> &'static [&'static str] {
        &["square", "abs"]
    }

    fn draft(&self, shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        let (key, power) = if shape == "square" { ("stiffness_nm_per_rad2", 2) } else { ("stiffness_nm_per_rad", 1) };
        let per_nm = sign(random) / measures.deflection_rad.powi(power);
        Draft::new(self.name()).text("shape", shape).number(key, per_nm)
    }
}
