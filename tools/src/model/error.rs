//! Why a model file was refused: where, what is wrong, and the fix.

use std::ops::Range;
use std::sync::Arc;

/// A model file was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{file}{}{}: {problem}", self.line().map(|n| format!(", line {n}")).unwrap_or_default(), self.key_words())]
pub struct ModelError {
    /// The file.
    pub file: String,
    /// Its text, for a snippet.
    pub text: Arc<str>,
    /// The bytes to blame.
    pub span: Option<Range<usize>>,
    /// The key to blame with its section, such as `[gear] ratio`; may be empty.
    pub key: String,
    /// What is wrong.
    pub problem: Box<ModelProblem>,
}

/// What is wrong with a model file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelProblem {
    /// The system could not read the file.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// The file holds something else than text.
    #[error("is not text in UTF-8")]
    NotText,
    /// No TOML.
    #[error("is not TOML: {0}")]
    Syntax(String),
    /// A key or section that model files do not have.
    #[error("unknown {what}{}", near.as_ref().map(|n| format!("; did you mean `{n}`?")).unwrap_or_default())]
    Unknown {
        /// Key, section or kind of term.
        what: &'static str,
        /// The nearest name.
        near: Option<String>,
        /// What is accepted.
        accepted: String,
    },
    /// A key or section is missing.
    #[error("`{0}` is missing")]
    Missing(String),
    /// Another type than expected.
    #[error("must be {expected}, not {found}")]
    WrongType {
        /// What it should be.
        expected: &'static str,
        /// What it is.
        found: &'static str,
    },
    /// NaN, infinite, or too large for a double.
    #[error("`{0}` is not a finite number")]
    NotFinite(String),
    /// A number outside its range.
    #[error("`{value}` must be {range}")]
    OutOfRange {
        /// The number.
        value: f64,
        /// Where it should lie.
        range: &'static str,
    },
    /// None of the choices.
    #[error("\"{found}\" is none of {accepted}")]
    NoChoice {
        /// What it is.
        found: String,
        /// What it may be.
        accepted: String,
    },
    /// Another format than this program reads.
    #[error("format {0} is not known; this program reads format 1")]
    Format(String),
    /// The core refuses the parameters.
    #[error("{}", super::refusal::of_parameters(.0))]
    Refused(gmhm::ParamError),
    /// The core refuses the values of a term.
    #[error("{0}")]
    Term(gmhm::terms::TermError),
    /// A gear of the model's own beside a simulation's torque.
    #[error("cannot be combined with base = \"simulation\" in [gear]: the terms are added to one torque")]
    GearBesideSimulation,
    /// Parameters per newton-metre and per ampere in one file.
    #[error("is {} while `{first}` is {}", per(!*ampere), per(*ampere))]
    MixedUnits {
        /// The key that came first.
        first: String,
        /// Whether that one is per ampere.
        ampere: bool,
    },
}

fn per(ampere: bool) -> &'static str {
    if ampere { "in amperes" } else { "in newton-metres" }
}

impl ModelError {
    /// The line of the bytes to blame, counted from 1.
    pub fn line(&self) -> Option<usize> {
        let start = self.span.as_ref()?.start.min(self.text.len());
        Some(1 + self.text.as_bytes()[..start].iter().filter(|b| **b == b'\n').count())
    }

    fn key_words(&self) -> String {
        if self.key.is_empty() { String::new() } else { format!(", {}", self.key) }
    }

    /// How to fix it, where there is more to say than the message does.
    pub fn fix(&self) -> Option<String> {
        let text = match &*self.problem {
            ModelProblem::NoChoice { .. } => return None,
            ModelProblem::Unreadable(_) => "check the path, and that the file may be read",
            ModelProblem::NotText if self.file.to_lowercase().ends_with(".toml") => "save it again, encoded in UTF-8",
            ModelProblem::NotText => "a model file (.toml) is needed here, as gmhm fit writes it",
            ModelProblem::Syntax(_) if !self.file.to_lowercase().ends_with(".toml") => {
                "a model file (.toml) is needed here, as gmhm fit writes it; name it before the recordings"
            }
            ModelProblem::Syntax(_) => "write it as KEY = VALUE lines under [section] headings; texts in quotes",
            ModelProblem::Unknown { accepted, .. } => return Some(format!("known: {accepted}")),
            ModelProblem::Missing(key) => return Some(format!("add `{key}`")),
            ModelProblem::WrongType { .. } => "write numbers bare, texts in \"quotes\", lists in [brackets]",
            ModelProblem::NotFinite(_) => "write a finite number",
            ModelProblem::OutOfRange { .. } => "correct the number; the key's name says its unit",
            ModelProblem::Format(_) => "set `format = 1`, or use the program that wrote the file",
            ModelProblem::Term(gmhm::terms::TermError::Missing { key }) => return Some(format!("add `{key}`")),
            ModelProblem::Term(_) => "correct the value; the key's name says its unit",
            ModelProblem::Refused(gmhm::ParamError::NotInLaw { .. }) => "remove the key, or choose another law",
            ModelProblem::Refused(_) => "correct the parameters; `gmhm fit` writes files that are accepted",
            ModelProblem::GearBesideSimulation => {
                "remove [elastic] and [memory] to add the terms to column torque_sim_nm, or remove `base`"
            }
            ModelProblem::MixedUnits { .. } => "use _nm throughout, or _a throughout (a recording with current_a)",
        };
        Some(text.to_owned())
    }
}
