//! Settings that are probably wrong, and what shows it.

use gmhm::Law;

use crate::kinds::build::is_over_output;
use crate::model::{Model, TermValue, TorqueSide};

/// A setting of the model or the recording that should be another.
#[derive(Debug, Clone, PartialEq)]
pub enum Suggestion {
    /// Friction has the other sign: the torque is taken on this side.
    TorqueSide(TorqueSide),
    /// A line at so many periods a turn of the output, which is a few a turn of the motor at this ratio.
    Ratio {
        /// Motor turns per output turn.
        ratio: f64,
        /// Periods of the line a turn of the output.
        order: f64,
    },
    /// The simulated torque is too small or too large by this factor.
    Gain(f64),
    /// The hysteresis is of another nature than the law given: beside this law the terms found predict better.
    Law(Law),
    /// In another program's words.
    Written(String),
}

/// Reductions of one stage of strain wave gears.
const RATIOS: std::ops::RangeInclusive<f64> = 30.0..=320.0;
/// A line belongs to a whole ratio within this.
const NEAR_WHOLE: f64 = 0.15;

/// A suggestion rests on an effect of at least this share of the structure.
pub const LEAST_SHARE: f64 = 0.1;

/// What the terms that were found beside a base say of its settings.
pub fn of_model(model: &Model, base_terms: usize, reported: impl Fn(&str) -> bool) -> Vec<Suggestion> {
    let found = model.terms.iter().skip(base_terms).filter(|term| reported(&term.kind));
    let lines =
        found.clone().filter(|_| model.gear.ratio.is_none()).filter_map(|term| match term.values.get("orders") {
            Some(TermValue::List(orders)) if is_over_output(term) => Some(orders.clone()),
            _ => None,
        });
    // The wave generator's ellipse meshes twice a turn of the motor.
    let of_line = |order: f64| {
        let ratio = (0.5 * order).round();
        let near = (0.5 * order - ratio).abs() < NEAR_WHOLE && RATIOS.contains(&ratio);
        near.then_some(Suggestion::Ratio { ratio, order })
    };
    let ratio = lines.flatten().find_map(of_line);
    let gain = found.filter_map(|term| match term.values.get("gain_error") {
        Some(TermValue::Number(gain)) => Some(Suggestion::Gain(1.0 + gain)),
        _ => None,
    });
    ratio.into_iter().chain(gain).collect()
}
