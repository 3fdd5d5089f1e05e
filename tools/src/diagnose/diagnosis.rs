//! What a diagnosis says: where a recording and its model differ, what physics was left out, and how much the fit improves.
//!
//! [`Diagnosis`] is, field for field, what `gmhm diagnose --json` writes. The detector fills it in; reports, and the
//! proof that scores the detector, read it. It holds no mathematics.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::diagnose::evidence::{Evidence, NextExperiment, Sight};
use crate::diagnose::suggestion::Suggestion;
pub use crate::kinds::UNKNOWN;

/// The rate of false alarms on coloured nulls: 4 of 300 by `gmhm prove --only null --cases 300 --seed 5003`, 3 of the 100 nulls of seed 5001.
pub const FALSE_ALARM_RATE: f64 = 0.02;

/// The verdict on one recording, or on several of one gear taken together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// Is there structure beyond noise?
    pub mismatch: bool,
    /// The rate of false alarms that `mismatch` was tuned to, 0 to 1.
    pub false_alarm_rate: f64,
    /// The unit of every torque below.
    pub unit: Unit,
    /// Root mean square of the (coloured) noise, as estimated; in [`unit`](Self::unit).
    pub noise_rms: f64,
    /// Residual of the recordings diagnosed.
    pub rms: Rms,
    /// Residual of rows that took no part in the fit.
    pub heldout: Heldout,
    /// Part of the refitted base's squared error, held out, that a free description of the recorded coordinates predicts, 0 to 1.
    #[serde(default)]
    pub predictable: f64,
    /// Part of it that the extended model predicts, 0 to 1.
    #[serde(default)]
    pub explained: f64,
    /// Part of it that the named and approximate effects predict without curves, 0 to 1.
    #[serde(default)]
    pub named: f64,
    /// Where the structured residual sits, largest share first; empty when there is no mismatch.
    #[serde(rename = "where")]
    pub locations: Vec<Location>,
    /// The physics left out, largest share first; empty when there is no mismatch.
    pub effects: Vec<Effect>,
    /// Kinds that these recordings could not have shown.
    pub undecidable: Vec<Undecidable>,
    /// Settings of the model or the recording that are probably wrong, each with what shows it.
    #[serde(default)]
    pub suggestions: Vec<Suggestion>,
    /// The experiment that best splits what is still open; in JSON as a command line and in words, empty when nothing is open.
    pub next_experiment: NextExperiment,
}

impl Diagnosis {
    /// The verdict "nothing beyond noise": no place, no effect, the base model kept.
    pub fn nothing(unit: Unit, noise_rms: f64, rms: Rms, heldout: Heldout) -> Self {
        Self {
            mismatch: false,
            false_alarm_rate: FALSE_ALARM_RATE,
            unit,
            noise_rms,
            rms,
            heldout,
            predictable: 0.0,
            explained: 0.0,
            named: 0.0,
            locations: Vec::new(),
            effects: Vec::new(),
            undecidable: Vec::new(),
            suggestions: Vec::new(),
            next_experiment: NextExperiment::None,
        }
    }
}

/// The unit of the torque column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Unit {
    /// Newton-metres.
    #[default]
    #[serde(rename = "nm")]
    NewtonMetre,
    /// Amperes: a motor current stands in for the torque.
    #[serde(rename = "a")]
    Ampere,
}

/// Root mean square residuals, in the unit of the diagnosis, a constant offset a recording taken out.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Rms {
    /// Of the model handed in.
    pub given: f64,
    /// Of that model, its own parameters refitted.
    pub refitted: f64,
    /// Of the model with what was found.
    pub extended: f64,
}

/// [`Rms`] on rows that took no part in the fit.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Heldout {
    /// The residuals.
    #[serde(flatten)]
    pub rms: Rms,
    /// Which rows those were.
    pub from: HeldoutFrom,
}

/// Where held-out rows come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum HeldoutFrom {
    /// Blocks of the recordings diagnosed, each predicted from the others.
    #[default]
    Blocks,
    /// Recordings of their own (`--holdout`).
    Recordings,
}

/// One place where the structured residual sits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Location {
    /// The coordinate, in the words of MODEL.md section 7: `motor_angle`, `output_angle`, `deflection`, `deflection_rate`,
    /// `output_velocity`, `acceleration`, `torque`, `torque_rate`, `temperature`, `time`, `reversal`, `amplitude`, `frequency`.
    pub coordinate: String,
    /// Share of the structured residual power (residual minus noise) that a function of this coordinate explains, 0 to 1.
    pub share: f64,
    /// What is seen there; in JSON in words, such as "order 2.00 of the motor turn".
    pub detail: Sight,
    /// The stretches of time concerned, s.
    pub seconds: Vec<[f64; 2]>,
}

/// One missing piece of physics, with every other that these recordings cannot tell from it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// The kind of MODEL.md section 7, or [`UNKNOWN`].
    pub name: String,
    /// Whether the kind's shape suffices.
    #[serde(default)]
    pub verdict: Naming,
    /// The part of what a free function of its coordinates predicts that the kind predicts, 0 to 1; `null` where the free function's own gain is not significant.
    #[serde(default)]
    pub fidelity: Option<f64>,
    /// The family of the kind: elastic, memory, friction, load, transmission, measurement; `unknown` without a name.
    #[serde(default)]
    pub family: String,
    /// The best kind, where the name is [`UNKNOWN`].
    #[serde(default)]
    pub closest: Option<Closest>,
    /// Every other kind that these recordings cannot tell from `name`.
    pub equivalents: Vec<String>,
    /// Posterior weight of the class {name, equivalents} among what was tried, 0 to 1.
    pub confidence: f64,
    /// Share of the structured residual power that it explains, 0 to 1.
    pub share: f64,
    /// The keys of the model file's `[[term]]`, with their uncertainty.
    pub parameters: BTreeMap<String, Parameter>,
    /// Is it to be compensated on the drive?
    pub side: Side,
    /// The evidence; in JSON in words.
    pub why: Evidence,
}

impl Effect {
    /// The class {name, equivalents}, the name first.
    pub fn class(&self) -> impl Iterator<Item = &str> {
        std::iter::once(self.name.as_str()).chain(self.equivalents.iter().map(String::as_str))
    }

    /// The empirical curve that stands in for an unknown effect; its knots and values stand in the model file.
    pub fn curve(&self) -> Option<EmpiricalCurve<'_>> {
        let ParameterValue::Text(coordinate) = &self.parameters.get("coordinate")?.value else { return None };
        Some(EmpiricalCurve { coordinate, knots: self.parameters.get("knots")?.value.numbers().len() })
    }
}

/// A curve that stands in for an unknown effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EmpiricalCurve<'e> {
    /// What it is over.
    pub coordinate: &'e str,
    /// Its number of knots.
    pub knots: usize,
}

/// How well a kind's shape follows what a free function of its coordinates shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Naming {
    /// Fidelity of at least 0.9, or likelihood has decided.
    Named,
    /// Fidelity of at least 0.7: the name is given, with what its shape misses.
    Approximate,
    /// Less: no kind suffices.
    #[default]
    Unknown,
}

impl Naming {
    /// The verdict of a fidelity.
    pub fn of(fidelity: Option<f64>) -> Self {
        match fidelity {
            None => Self::Named,
            Some(f) if f >= 0.9 => Self::Named,
            Some(f) if f >= 0.7 => Self::Approximate,
            Some(_) => Self::Unknown,
        }
    }
}

/// The kind that comes closest to an effect without a name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Closest {
    /// The kind.
    pub name: String,
    /// Its fidelity; `null` where likelihood has decided against it.
    pub fidelity: Option<f64>,
}

/// What kind of a fault an effect is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// Physics of the gear or the joint: compensated on the drive.
    Plant,
    /// A fault of the measurement: corrects the fit, never fed forward.
    Instrument,
    /// Not known which, for [`UNKNOWN`]: never fed forward.
    Unknown,
}

/// One parameter of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its value, of the same type as in the model file.
    pub value: ParameterValue,
    /// Its standard deviation, shaped like `value`; absent for a choice, such as a shape, and for what was held fixed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sd: Option<ParameterValue>,
    /// Unit of both; empty for a pure number or a choice.
    pub unit: String,
}

/// A number, a list of numbers, or a choice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ParameterValue {
    /// One number.
    Number(f64),
    /// As many numbers as the term has components.
    List(Vec<f64>),
    /// A choice, such as `tanh`.
    Text(String),
}

impl ParameterValue {
    /// The numbers held: one, several, or none for a choice.
    pub fn numbers(&self) -> &[f64] {
        match self {
            Self::Number(value) => std::slice::from_ref(value),
            Self::List(values) => values,
            Self::Text(_) => &[],
        }
    }
}

/// A kind that the recordings could not have shown.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Undecidable {
    /// The kind.
    pub name: String,
    /// The experiment that would show it.
    pub experiment: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of the interface's documentation, as another program would write it.
    const EXAMPLE: &str = r#"{ "mismatch": true, "false_alarm_rate": 0.01, "unit": "nm", "noise_rms": 0.08,
      "rms": { "given": 0.35, "refitted": 0.31, "extended": 0.083 },
      "heldout": { "given": 0.36, "refitted": 0.30, "extended": 0.085, "from": "blocks" },
      "predictable": 0.94, "explained": 0.92, "named": 0.88,
      "where": [ { "coordinate": "motor_angle", "share": 0.71, "detail": "order 2.00 of the motor turn", "seconds": [[3.1, 36.0]] } ],
      "effects": [ { "name": "kinematic_error", "verdict": "named", "fidelity": 0.97, "family": "transmission", "closest": null, "equivalents": ["torque_ripple"], "confidence": 0.99, "share": 0.71,
                     "parameters": { "cos_rad": { "value": [5.8e-6], "sd": [2e-7], "unit": "rad" } }, "side": "plant", "why": "seen" } ],
      "undecidable": [ { "name": "inertia", "experiment": "repeat at a second rate" } ],
      "suggestions": [ "torque_side = \"motor\": friction has the other sign" ],
      "next_experiment": "block the output" }"#;

    #[test]
    fn reads_and_writes_the_documented_json() {
        let read: Diagnosis = serde_json::from_str(EXAMPLE).unwrap();
        assert_eq!(read.effects[0].class().collect::<Vec<_>>(), ["kinematic_error", "torque_ripple"]);
        assert_eq!(read.effects[0].parameters["cos_rad"].value.numbers(), [5.8e-6]);
        assert_eq!(read.heldout.rms.extended, 0.085);
        let documented: serde_json::Value = serde_json::from_str(EXAMPLE).unwrap();
        assert_eq!(serde_json::to_value(&read).unwrap(), documented);
    }

    #[test]
    fn nothing_found_names_nothing() {
        let verdict = Diagnosis::nothing(Unit::Ampere, 0.1, Rms::default(), Heldout::default());
        assert!(!verdict.mismatch && verdict.effects.is_empty() && verdict.locations.is_empty());
        assert_eq!(serde_json::to_value(&verdict).unwrap()["unit"], "a");
        assert_eq!(verdict.false_alarm_rate, FALSE_ALARM_RATE);
    }
}
