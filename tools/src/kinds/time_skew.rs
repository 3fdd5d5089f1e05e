//! Delay of the torque channel.

use gmhm::terms::KeyInfo;
use rand_chacha::ChaCha8Rng;

use super::build::{number, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

const DELAY: &str = "delay_s";

/// Kind `time_skew`.
pub struct TimeSkew;

impl Kind for TimeSkew {
    fn name(&self) -> &'static str {
        "time_skew"
    }

    fn family(&self) -> Family {
        Family::Measurement
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Rates, Experiment::Dynamic]
    }

    fn candidates(&self, _ranges: &Ranges, _model: &Model) -> Vec<Term> {
        vec![term(self.name(), &[(DELAY, number(0.0))])]
    }

    fn is_common(&self) -> bool {
        true
    }

    fn draft(&self, _shape: &str, measures: &Measures, _random: &mut ChaCha8Rng) -> Draft {
        Draft::new(self.name()).number(DELAY, 1.0 / measures.torque_rate)
    }

    fn growth(&self, _term: &Term, ranges: &Ranges) -> Option<(&'static str, f64)> {
        Some((DELAY, 0.25 * ranges.period_s))
    }

    /// Much longer than the core accepts as plausible is no delay: along sines a friction or a damping leads the torque by a part of their period. The first estimate is off.
    fn limits(&self, key: &KeyInfo) -> (f64, f64) {
        (2.0 * key.plausible.0, 2.0 * key.plausible.1)
    }

    /// From one side, interpolation between rows would smooth the noise of the angles, and look like a gain.
    fn grows_both_ways(&self) -> bool {
        true
    }
}
