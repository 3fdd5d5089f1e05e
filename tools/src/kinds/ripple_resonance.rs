//! Torque ripple through a structural mode: the line swells near the frequency of the mode.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::build::{harmonics, is_over_output, list, number, number_of, term, text};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::{Ranges, Speeds};
use super::torque_ripple::TorqueRipple;
use super::{Family, Kind};
use crate::model::{Model, ORDERS, Term, TermValue};

/// Lines that are tried with a mode.
const LINES: usize = 3;
/// A mode is seen up to so many times the highest frequency of a line.
const BEYOND_LINES: f64 = 1.5;

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
        let output = is_over_output(ripple);
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

    /// A mode far beyond what the lines pass only makes them grow a little with the speed.
    fn degenerates_to(&self, own: &Term, speeds: Speeds) -> Option<Term> {
        let Some(TermValue::List(orders)) = own.values.get(ORDERS) else { return None };
        let speed_rad_per_s = if is_over_output(own) { speeds.output_rad_per_s } else { speeds.motor_rad_per_s };
        let passed_hz = orders.iter().copied().fold(0.0, f64::max) * speed_rad_per_s / TAU;
        if number_of(own, "frequency_hz") <= BEYOND_LINES * passed_hz {
            return None;
        }
        let mut ripple = own.clone();
        ripple.kind = TorqueRipple.name().to_owned();
        ripple.values.retain(|key, _| !matches!(key.as_str(), "frequency_hz" | "damping_ratio"));
        Some(ripple)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mode_that_no_line_comes_near_is_a_ripple() {
        // Order 2 at 50 rad/s is 15.9 Hz.
        let speeds = Speeds { output_rad_per_s: 0.5, motor_rad_per_s: 50.0 };
        let kind_at = |frequency_hz: f64| {
            let own = term(
                "ripple_resonance",
                &[(ORDERS, list(2.0)), ("frequency_hz", number(frequency_hz)), ("damping_ratio", number(0.1))],
            );
            RippleResonance.degenerates_to(&own, speeds).map(|other| (other.kind, other.values.len()))
        };
        assert_eq!(kind_at(20.0), None);
        assert_eq!(kind_at(40.0), Some(("torque_ripple".to_owned(), 1)));
    }
}
