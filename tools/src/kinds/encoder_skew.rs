//! Delay of the output encoder against the motor encoder.

use rand_chacha::ChaCha8Rng;

use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `encoder_skew`.
pub struct EncoderSkew;

impl Kind for EncoderSkew {
    fn name(&self) -> &'static str {
        "encoder_skew"
    }

    fn family(&self) -> Family {
        Family::Measurement
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Running]
    }

    /// Not searched for yet.
    fn candidates(&self, _ranges: &Ranges, _model: &Model) -> Vec<Term> {
        Vec::new()
    }

    fn draft(&self, _shape: &str, measures: &Measures, _random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name()).number("delay_s", 1.0 / (measures.stiffness() * measures.velocity))
    }
}
