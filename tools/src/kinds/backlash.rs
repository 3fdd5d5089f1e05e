//! Backlash: the output may move without the input.

use rand_chacha::ChaCha8Rng;

use super::build::{number, term, text};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

const HALF_GAP: &str = "half_gap_rad";

/// Kind `backlash`.
pub struct Backlash;

impl Kind for Backlash {
    fn name(&self) -> &'static str {
        "backlash"
    }

    fn family(&self) -> Family {
        Family::Transmission
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Amplitudes]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        if ranges.rated_rad <= 0.0 {
            return Vec::new();
        }
        ["clearance", "play"].map(|s| term(self.name(), &[("shape", text(s)), (HALF_GAP, number(0.0))])).to_vec()
    }

    fn hidden_shapes(&self) -> &'static [&'static str] {
        &["clearance", "play"]
    }

    fn price(&self) -> f64 {
        0.0075
    }

    fn draft(&self, shape: &str, measures: &Measures, _random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name()).text("shape", shape).number(HALF_GAP, 1.0 / measures.stiffness())
    }

    fn growth(&self, _term: &Term, ranges: &Ranges) -> Option<(&'static str, f64)> {
        Some((HALF_GAP, 2e-3 * ranges.rated_rad))
    }

    /// The gap is crossed where the torque changes its sign.
    fn soft_edge(&self) -> Option<&'static str> {
        Some("torque")
    }
}
