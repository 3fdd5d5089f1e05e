//! Torque ripple through a structural mode: the line swells near the frequency of the mode.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::build::{harmonics, list, number, term, text};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::torque_ripple::TorqueRipple;
use super::{Family, Kind};
use crate::model::{Model, ORDERS, Term, TermValue};

/// Lines that are tried with a mode.
const LINES: usize = 3;

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

    /// The lines of a torque ripple in the model, beside modes that they pass within the speeds recorded.
    fn joint_candidates(&self, ranges: &Ranges, model: &Model) -> Vec<Term> {
        let Some(ripple) = model.terms.iter().find(|term| term.kind == TorqueRipple.name()) else { return Vec::new() };
        let Some(TermValue::List(orders)) = ripple.values.get(ORDERS) else { return Vec::new() };
        let output = matches!(ripple.values.get("angle"), Some(TermValue::Text(angle)) if angle == "output");
        let ratio = if output { 1.0 } else { model.gear.ratio.map_or(1.0, f64::abs) };
        let turns_per_s = ranges.velocity_rad_per_s * ratio / TAU;
        let mut terms = Vec::new();
        for &order in orders.iter().take(LINES) {
            for share in [0.35, 0.5, 0.62, 0.75, 0.88, 1.0, 1.2] {
                for damping in [0.03, 0.1, 0.3] {
                    let values = [
                        (ORDERS, list(order)),
                        ("angle", text(if output { "output" } else { "motor" })),
                        ("frequency_hz", number(share * order * turns_per_s)),
                        ("damping_ratio", number(damping)),
                    ];
                    terms.push(term(self.name(), &values));
                }
            }
        }
        terms
    }

    fn price(&self) -> f64 {
        0.01
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
