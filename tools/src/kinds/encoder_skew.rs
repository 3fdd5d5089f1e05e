//! Delay of the output encoder against the motor encoder.

use rand_chacha::ChaCha8Rng;

use super::build::term;
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
    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        if ranges.rated_rad > 0.0 && ranges.velocity_rad_per_s > 0.0 {
            vec![term(self.name(), &[])]
        } else {
            Vec::new()
        }
    }

    fn draft(&self, _shape: &str, measures: &Measures, _random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name()).number("delay_s", 1.0 / (measures.stiffness() * measures.velocity))
    }
}
