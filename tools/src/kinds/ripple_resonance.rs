//! Torque ripple through a structural mode: the line swells near the frequency of the mode.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::build::harmonics;
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `ripple_resonance`.
pub struct RippleResonance;

impl Kind for RippleResonance {
    fn name(&self) -> &'static str {
        "ripple_resonance"
    }

    fn family(&self) -> Family {
        Family::Transmission
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Running]
    }

    /// Not searched for yet.
    fn candidates(&self, _ranges: &Ranges, _model: &Model) -> Vec<Term> {
        Vec::new()
    }

    fn extends(&self) -> bool {
        true
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        let order = 2.0_f64.min(measures.highest_order().floor().max(1.0));
        // The line passes the mode below the highest speed.
        let frequency = random.random_range(0.4..0.8) * order * measures.motor_turns_per_s;
        harmonics(self.name(), "nm", &[order], 1.0, random)
            .fixed("frequency_hz", frequency.max(1.0))
            .fixed("damping_ratio", random.random_range(0.05..0.3))
    }
}
