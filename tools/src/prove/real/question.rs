//! A question about one real recording, and how an answer is scored.

use serde::{Deserialize, Serialize};

use super::entry::Split;
use super::report::RealScore;
use crate::diagnose::diagnosis::{Diagnosis, UNKNOWN};
use crate::model::Model;
use crate::recording::Recording;

/// What kind of question.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// The base lacks what is known of the recording.
    #[default]
    Answers,
    /// One term of the full textbook base is dropped.
    Dropped,
    /// An effect is added to the torque.
    Added,
    /// The simulation is a model of the machine before a change that is known.
    Pairs,
}

impl Part {
    /// Every part, in the order of the report.
    pub const ALL: [Self; 4] = [Self::Answers, Self::Dropped, Self::Added, Self::Pairs];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Answers => "answers",
            Self::Dropped => "dropped",
            Self::Added => "added",
            Self::Pairs => "pairs",
        }
    }
}

/// One recording, a base, and what has to be named.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// What kind of question.
    pub part: Part,
    /// The recording's file.
    pub file: String,
    /// The machine.
    pub machine: String,
    /// The half that the machine is in.
    pub split: Split,
    /// What was dropped, added or changed, in words; empty for answers.
    pub detail: String,
    /// What the detector sees.
    pub recording: Recording,
    /// The base handed over.
    pub base: Model,
    /// What has to be named: one of each.
    pub asked: Vec<Vec<String>>,
    /// Kinds that are no wrong names.
    pub may_also: Vec<String>,
    /// Error of the base by plain least squares, held out, in the unit of the recording.
    pub base_error: f64,
    /// The same with the true textbook terms.
    pub textbook_error: f64,
}

impl Question {
    /// The share of the base's squared error, held out, that the true textbook terms take.
    pub fn textbook_share(&self) -> f64 {
        1.0 - (self.textbook_error / self.base_error).powi(2)
    }

    /// Scores an answer.
    pub fn score(&self, answer: Result<Diagnosis, String>) -> RealScore {
        let mut score = RealScore {
            part: self.part,
            file: self.file.clone(),
            machine: self.machine.clone(),
            split: self.split,
            detail: self.detail.clone(),
            asked: self.asked.iter().map(|kinds| kinds.join(" or ")).collect(),
            base_error: self.base_error,
            textbook_error: self.textbook_error,
            ..RealScore::default()
        };
        let diagnosis = match answer {
            Ok(diagnosis) => diagnosis,
            Err(why) => {
                score.missed = score.asked.clone();
                score.failed = Some(why);
                return score;
            }
        };
        let found = &diagnosis.effects;
        let stands_for = |kinds: &[String]| found.iter().any(|e| e.class().any(|k| kinds.iter().any(|a| a == k)));
        score.missed = self.asked.iter().filter(|kinds| !stands_for(kinds)).map(|kinds| kinds.join(" or ")).collect();
        score.named = found.iter().map(|e| e.name.clone()).collect();
        let right = |name: &String| self.asked.iter().flatten().chain(&self.may_also).any(|k| k == name);
        score.wrong_names = score.named.iter().filter(|n| *n != UNKNOWN && !right(n)).cloned().collect();
        score.mismatch = diagnosis.mismatch;
        let rms = &diagnosis.heldout.rms;
        score.refitted = Some(rms.refitted);
        score.extended = Some(rms.extended);
        if self.textbook_share() > 0.02 && rms.refitted > 0.0 {
            score.taken = Some((1.0 - (rms.extended / rms.refitted).powi(2)) / self.textbook_share());
        }
        // Keys that a later diagnosis states and an earlier one does not.
        let stated = serde_json::to_value(&diagnosis).unwrap_or_default();
        score.predictable = stated.get("predictable").and_then(serde_json::Value::as_f64);
        let effects = stated.get("effects").and_then(|e| e.as_array().cloned()).unwrap_or_default();
        score.verdicts = effects.iter().filter_map(|e| Some(e.get("verdict")?.as_str()?.to_owned())).collect();
        score
    }
}
