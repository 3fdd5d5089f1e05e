//! Creep: torque that relaxes over seconds.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::build::{list, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind};
use crate::model::{Model, Term};

/// Kind `creep`.
pub struct Creep;

impl Kind for Creep {
    fn name(&self) -> &'static str {
        "creep"
    }

    fn family(&self) -> Family {
        Family::Memory
    }

    fn changes_spring(&self) -> bool {
        true
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Cycle]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        let mut terms = Vec::new();
        let mut tau_s = (30.0 * ranges.period_s).max(0.3);
        while tau_s < 0.7 * (ranges.end_s - ranges.start_s) {
            terms.push(term(self.name(), &[("tau_s", list(tau_s))]));
            tau_s *= 1.8;
        }
        terms
    }

    fn extends(&self) -> bool {
        true
    }

    fn price(&self) -> f64 {
        0.01
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        let tau_s = random.random_range(0.02_f64..0.08) * measures.duration_s;
        let stiffness = vec![0.6 / measures.deflection_rad, 0.4 / measures.deflection_rad];
        Draft::new(self.name()).list("stiffness_nm_per_rad", stiffness).fixed_list("tau_s", vec![tau_s, 4.0 * tau_s])
    }
}
