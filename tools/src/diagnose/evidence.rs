//! What a diagnosis rests on, as types; `report::diagnosis_words` says it in words.

use crate::kinds::experiment::Experiment;

/// What is seen over a coordinate.
#[derive(Debug, Clone, PartialEq)]
pub enum Sight {
    /// Waves of these orders of the motor turn.
    MotorOrders(Vec<f64>),
    /// Waves of the output turn.
    OutputTurn,
    /// A function of this coordinate.
    Along(String),
    /// A free curve over the coordinate explains this part of what the effect does, 0 to 1.
    FreeCurve(f64),
    /// In another program's words.
    Written(String),
}

/// Why an effect is reported as it is.
#[derive(Debug, Clone, PartialEq)]
pub enum Evidence {
    /// A kind explains a share of the structure.
    Explains {
        /// Share of the structured power, 0 to 1.
        share: f64,
        /// By how much −2 ln L would be higher without it.
        gain: f64,
        /// The next best kind, and its gain.
        runner_up: Option<(String, f64)>,
    },
    /// No kind does what a free curve over a coordinate does; one that comes closest is kept in the model.
    Closest {
        /// That kind.
        kind: String,
        /// The coordinate.
        coordinate: String,
    },
    /// No kind explains the structure; a curve describes it.
    Curve {
        /// Where the structure is seen.
        coordinate: String,
        /// What the curve is over.
        along: String,
    },
    /// No kind explains the structure, and no curve predicts blocks held out better.
    NoCurve {
        /// Where the structure is seen.
        coordinate: String,
    },
    /// In another program's words.
    Written(String),
}

/// The experiment that best splits what is still open.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum NextExperiment {
    /// Nothing is open.
    #[default]
    None,
    /// An experiment.
    Bench {
        /// Which.
        experiment: Experiment,
        /// The kinds that it distinguishes; where there are none, it shows what these recordings cannot.
        distinguishes: Vec<String>,
    },
    /// In another program's words.
    Written(String),
}
