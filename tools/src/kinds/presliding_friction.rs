//! Friction that builds up over a distance of the output after each reversal.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `presliding_friction`.
pub struct PreslidingFriction;

impl Kind for PreslidingFriction {
    fn name(&self) -> &'static str {
        "presliding_friction"
    }

    fn family(&self) -> Family {
        Family::Friction
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Running]
    }

    /// Not searched for yet.
    fn candidates(&self, _ranges: &Ranges, _model: &Model) -> Vec<Term> {
        Vec::new()
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        let range = measures.output_angle.1 - measures.output_angle.0;
        let radius = random.random_range(0.01..0.05) * range;
        Draft::new(self.name()).number("torque_nm", 1.0).fixed("radius_rad", radius)
    }
}
