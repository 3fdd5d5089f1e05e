//! Eccentricity of the output encoder: one period a turn of the output, in the deflection.

use rand_chacha::ChaCha8Rng;

use super::build::{once, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `encoder_eccentricity`.
pub struct EncoderEccentricity;

impl Kind for EncoderEccentricity {
    fn name(&self) -> &'static str {
        "encoder_eccentricity"
    }

    fn family(&self) -> Family {
        Family::Measurement
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Running]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        if ranges.output_turns_enough() { vec![term(self.name(), &[])] } else { Vec::new() }
    }

    fn price(&self) -> f64 {
        0.0075
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        once(self.name(), "cos_rad", "sin_rad", 1.0 / measures.stiffness(), random)
    }
}
