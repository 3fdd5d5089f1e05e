//! Wear: a stiffness that falls at a time, at once or over a while.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::build::{number, number_of, term, text};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::{Extent, Ranges};
use super::{Family, Kind, saturates};
use crate::model::{Model, Term};

const START: &str = "start_s";
const DURATION: &str = "duration_s";

/// Wear may begin or end outside of the recordings by this share of their length.
const SLACK: f64 = 0.1;

/// Kind `wear`.
pub struct Wear;

impl Kind for Wear {
    fn name(&self) -> &'static str {
        "wear"
    }

    fn family(&self) -> Family {
        Family::Elastic
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Cycle]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        let duration_s = ranges.end_s - ranges.start_s;
        let ramp = |start_s: f64, duration_s: f64| {
            let values = [("shape", text("ramp")), (START, number(start_s)), (DURATION, number(duration_s))];
            term(self.name(), &values)
        };
        let mut terms = Vec::new();
        for share in [0.0, 0.12, 0.25, 0.35, 0.45, 0.55, 0.65, 0.8] {
            let start_s = ranges.start_s + share * duration_s;
            terms.push(term(self.name(), &[("shape", text("step")), (START, number(start_s))]));
            terms.extend([0.15, 0.3].map(|share| ramp(start_s, share * duration_s)));
        }
        terms.push(ramp(ranges.start_s, duration_s));
        terms
    }

    fn hidden_shapes(&self) -> &'static [&'static str] {
        &["step", "ramp"]
    }

    fn price(&self) -> f64 {
        0.025
    }

    fn draft(&self, shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        let start_s = random.random_range(0.3..0.6) * measures.duration_s;
        let length_s = if shape == "ramp" { random.random_range(0.15..0.4) * measures.duration_s } else { 0.0 };
        Draft::new(self.name())
            .text("shape", shape)
            .number("stiffness_drop_nm_per_rad", 1.0 / measures.deflection_rad)
            .fixed(START, start_s)
            .fixed(DURATION, length_s)
    }

    /// Wear that began long before the recordings is stiffness.
    fn is_of_kind(&self, term: &Term, extent: &Extent) -> bool {
        let length_s = extent.end_s - extent.start_s;
        let slack_s = SLACK * length_s;
        let begins = number_of(term, START) >= extent.start_s - slack_s;
        saturates(term, extent.fastest_rad_per_s) && begins && number_of(term, DURATION) <= length_s + 2.0 * slack_s
    }
}
