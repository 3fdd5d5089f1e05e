//! Evidence, suggestions and the next experiment of a diagnosis in words. In JSON they are these words, too.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::diagnose::diagnosis::EmpiricalCurve;
use crate::diagnose::evidence::{Evidence, NextExperiment, Sight};
use crate::diagnose::suggestion::Suggestion;
use crate::number::percent;
use crate::report::diagnosis::words;

impl fmt::Display for Sight {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::MotorOrders(orders) => {
                let words: Vec<String> = orders.iter().map(|o| format!("{o:.2}")).collect();
                write!(f, "order {} of the motor turn", words.join(", "))
            }
            Self::OutputTurn => f.write_str("at orders of the output turn"),
            Self::Along(coordinate) => write!(f, "as a function of {}", words(coordinate)),
            Self::FreeCurve(part) => {
                write!(f, "a free curve over it explains {} of the effect", percent(*part))
            }
            Self::Written(text) => f.write_str(text),
        }
    }
}

impl fmt::Display for EmpiricalCurve<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "over {}, {} knots, in the model file", words(self.coordinate), self.knots)
    }
}

impl fmt::Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Explains { share, gain, runner_up } => {
                let share = percent(*share);
                write!(f, "explains {share} of the structure and lowers −2 ln L by {gain:.0}")?;
                match runner_up {
                    Some((kind, gain)) => write!(f, ", the next best kind, {kind}, by {gain:.0}"),
                    None => Ok(()),
                }
            }
            Self::Closest { kind, coordinate } => write!(
                f,
                "a free curve over {coordinate} explains more than any kind; the closest kind, {kind}, is kept in the model as an approximation"
            ),
            Self::Curve { coordinate, along } => {
                write!(f, "no kind explains the structure over {coordinate}; a curve over {along} describes it")
            }
            Self::NoCurve { coordinate } => write!(
                f,
                "no kind explains the structure over {coordinate}, and no curve improves the prediction of held-out blocks: the model contains no curve"
            ),
            Self::Written(text) => f.write_str(text),
        }
    }
}

impl fmt::Display for Suggestion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TorqueSide(side) => {
                write!(f, "torque_side = \"{}\": friction has the other sign", side.name())
            }
            Self::Ratio { ratio, order } => {
                write!(f, "ratio = {ratio:.0}: a line at {order:.1} a turn of the output")
            }
            Self::Law(law) => write!(
                f,
                "law = \"{}\": beside it the terms found predict better than beside the law given; the model written has it",
                law.name()
            ),
            Self::Gain(factor) => {
                write!(f, "torque_sim_nm * {factor:.3}: the recorded torque is that multiple of the simulated one")
            }
            Self::Written(text) => f.write_str(text),
        }
    }
}

impl fmt::Display for NextExperiment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => Ok(()),
            Self::Bench { experiment, distinguishes } => {
                let aim = match distinguishes.as_slice() {
                    [] => "shows what these recordings cannot".to_owned(),
                    kinds => format!("distinguishes {}", kinds.join(", ")),
                };
                write!(
                    f,
                    "{}; this {aim} (on the virtual bench: gmhm simulate M.toml --experiment {} -o next.csv)",
                    experiment.instruction(),
                    experiment.name()
                )
            }
            Self::Written(text) => f.write_str(text),
        }
    }
}

/// Types that are text in JSON: what is read is another program's.
macro_rules! text_in_json {
    ($($type:ty),*) => { $(
        impl Serialize for $type {
            fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                to.collect_str(self)
            }
        }

        impl<'de> Deserialize<'de> for $type {
            fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                String::deserialize(from).map(Self::Written)
            }
        }
    )* };
}

text_in_json!(Sight, Evidence, Suggestion, NextExperiment);
