//! The table of questions about real recordings.

use std::fmt::{self, Display, Formatter};

use serde::{Deserialize, Serialize};

use super::entry::Split;
use super::question::Part;
use crate::prove::table::{Rate, judged, median};
use crate::text_table::{Head, text_table};

/// "No structure" is wrong while textbook terms take this share of the squared error.
const SILENT_SHARE: f64 = 0.2;

/// How a detector did on one question.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RealScore {
    /// What kind of question.
    pub part: Part,
    /// The recording's file.
    pub file: String,
    /// The machine.
    pub machine: String,
    /// The half that the machine is in.
    pub split: Split,
    /// What was dropped, added or changed.
    pub detail: String,
    /// What had to be named.
    pub asked: Vec<String>,
    /// What of it was not.
    pub missed: Vec<String>,
    /// Names given.
    pub named: Vec<String>,
    /// Verdicts on them, where the diagnosis states any.
    pub verdicts: Vec<String>,
    /// Names that stand for nothing asked for nor known to be possible.
    pub wrong_names: Vec<String>,
    /// The detector saw a mismatch.
    pub mismatch: bool,
    /// Error of the base by plain least squares, held out, in the unit of the recording.
    pub base_error: f64,
    /// The same with the true textbook terms.
    pub textbook_error: f64,
    /// Error of the refitted base, held out, as the diagnosis states it.
    pub refitted: Option<f64>,
    /// Error of the extended model, held out, as the diagnosis states it.
    pub extended: Option<f64>,
    /// Share of the base's squared error that the diagnosis takes, over the share that the textbook takes.
    pub taken: Option<f64>,
    /// What the diagnosis says can be predicted at all.
    pub predictable: Option<f64>,
    /// Time of the detector by the clock, s.
    pub seconds: f64,
    /// Why it refused.
    pub failed: Option<String>,
}

/// One half of one part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RealRow {
    /// What kind of question.
    pub part: Part,
    /// Which half.
    pub split: Split,
    /// Its questions.
    pub questions: usize,
    /// Answers named.
    pub named: Rate,
    /// Wrong names.
    pub wrong_names: usize,
    /// Error taken over the textbook's: the median question, and the worst. A refusal takes nothing.
    pub taken_median: Option<f64>,
    /// The worst.
    pub taken_worst: Option<f64>,
    /// Questions in which no mismatch was seen although textbook terms take a fifth of the squared error.
    pub silent: Rate,
    /// Questions that the detector refused.
    pub refused: usize,
}

/// Every question about real recordings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RealReport {
    /// The table.
    pub rows: Vec<RealRow>,
    /// Recordings that were not there.
    pub missing: Vec<String>,
    /// Every question.
    pub questions: Vec<RealScore>,
}

impl RealReport {
    /// Sums up `questions`.
    pub fn new(questions: Vec<RealScore>, missing: Vec<String>) -> Self {
        let rows = Part::ALL.iter().flat_map(|part| {
            [Split::Development, Split::Heldout].map(|split| {
                let own: Vec<&RealScore> = questions.iter().filter(|q| q.part == *part && q.split == split).collect();
                RealRow::new(*part, split, &own)
            })
        });
        Self { rows: rows.filter(|r| r.questions > 0).collect(), missing, questions }
    }
}

impl RealRow {
    fn new(part: Part, split: Split, scores: &[&RealScore]) -> Self {
        let asked: usize = scores.iter().map(|s| s.asked.len()).sum();
        let missed: usize = scores.iter().map(|s| s.missed.len()).sum();
        let share = |s: &RealScore| 1.0 - (s.textbook_error / s.base_error).powi(2);
        let loud: Vec<_> = scores.iter().filter(|s| !s.asked.is_empty() && share(s) >= SILENT_SHARE).collect();
        let taken: Vec<f64> = loud.iter().map(|s| s.taken.unwrap_or(0.0)).collect();
        Self {
            part,
            split,
            questions: scores.len(),
            named: Rate::new(asked - missed, asked),
            wrong_names: scores.iter().map(|s| s.wrong_names.len()).sum(),
            taken_worst: taken.iter().copied().min_by(f64::total_cmp),
            taken_median: median(taken),
            silent: Rate::new(loud.iter().filter(|s| !s.mismatch).count(), loud.len()),
            refused: scores.iter().filter(|s| s.failed.is_some()).count(),
        }
    }
}

impl Display for RealReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for row in &self.rows {
            let half = if row.split == Split::Development { "development" } else { "held out" };
            writeln!(f, "{}, {half} ({} questions)", row.part.name(), row.questions)?;
            let number = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.2}"));
            let wrong = row.wrong_names as f64 / row.questions as f64;
            let line = |name: &str, value: String, verdict: String| [name.to_owned(), value, verdict];
            let lines = [
                line("named", row.named.to_string(), judged("answers", row.named, 0.92, true)),
                line("wrong names", format!("{} ({wrong:.2} a question)", row.wrong_names), String::new()),
                line("error explained, over textbook, median", number(row.taken_median), String::new()),
                line("error explained, over textbook, worst", number(row.taken_worst), String::new()),
                line(
                    "nothing reported of a fifth or more",
                    row.silent.to_string(),
                    judged("questions", row.silent, 0.0, false),
                ),
            ];
            let refused = (row.refused > 0).then(|| line("refused", row.refused.to_string(), String::new()));
            f.write_str(&text_table([""; 3].map(Head::Words), lines.into_iter().chain(refused)))?;
        }
        writeln!(f, "\nevery question: base, textbook | refitted, extended (rms, held out); taken; names")?;
        let digits = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.4}"));
        for q in &self.questions {
            let what = if q.detail.is_empty() { q.file.clone() } else { format!("{}, {}", q.file, q.detail) };
            let taken = q.taken.map_or("-".to_owned(), |x| format!("{x:.2}"));
            writeln!(
                f,
                "  {what}: {:.4}, {:.4} | {}, {}; {taken}; {}",
                q.base_error,
                q.textbook_error,
                digits(q.refitted),
                digits(q.extended),
                if q.named.is_empty() { "nothing".to_owned() } else { q.named.join(", ") },
            )?;
            if !q.missed.is_empty() {
                writeln!(f, "      missed: {}", q.missed.join(", "))?;
            }
            if !q.wrong_names.is_empty() {
                writeln!(f, "      wrong: {}", q.wrong_names.join(", "))?;
            }
            if let Some(why) = &q.failed {
                writeln!(f, "      refused: {why}")?;
            }
        }
        self.missing.iter().try_for_each(|file| writeln!(f, "skipped: {file} is not in the folder"))
    }
}
