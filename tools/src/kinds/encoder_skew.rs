//! Delay of the output encoder against the motor encoder.

use gmhm::terms::KeyInfo;
use rand_chacha::ChaCha8Rng;

use super::build::term;
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::{Extent, Ranges};
use super::{Family, Kind, is_within_limits};
use crate::model::{Model, Term};

/// By how much the output's reading is older than the motor's.
const DELAY: &str = "delay_s";

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

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        if ranges.rated_rad > 0.0 && ranges.velocity_rad_per_s > 0.0 {
            vec![term(self.name(), &[])]
        } else {
            Vec::new()
        }
    }

    /// Encoders are not read further apart than the core's range says: a longer skew is a delay of something else.
    fn limits(&self, key: &KeyInfo) -> (f64, f64) {
        key.plausible
    }

    fn is_of_kind(&self, term: &Term, _extent: &Extent) -> bool {
        is_within_limits(self, term)
    }

    fn draft(&self, _shape: &str, measures: &Measures, _random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name()).number(DELAY, 1.0 / (measures.stiffness() * measures.velocity))
    }
}
