//! Answers of detectors written elsewhere to the cases of [`export`](super::export).
//!
//! A folder holds, for each case, `case_0007.json` (what `gmhm diagnose --json` writes) and `case_0007_unseen_1.csv` (what
//! `gmhm predict` writes of the case's `unseen_1.csv`; only its column `torque_model_nm` is read).

use std::path::{Path, PathBuf};

use super::Answer;
use super::generator::Case;

/// The column of a prediction that is read.
const PREDICTED: &str = "torque_model_nm";

/// Where the diagnosis of a case is.
pub fn path(folder: &Path, index: usize) -> PathBuf {
    folder.join(format!("case_{index:04}.json"))
}

/// Reads the answer to a case.
///
/// # Errors
/// A diagnosis that is missing or unreadable. The answer itself says where a prediction is missing.
pub fn read(folder: &Path, index: usize, case: &Case) -> Result<Answer, String> {
    let path = path(folder, index);
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let diagnosis = serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?;
    let predicted = |k: usize| column(&folder.join(format!("case_{index:04}_unseen_{k}.csv")));
    Ok(Answer { diagnosis, unseen: (1..=case.unseen.len()).map(predicted).collect() })
}

fn column(path: &Path) -> Result<Vec<f64>, String> {
    let told = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    let mut reader = csv::Reader::from_path(path).map_err(|e| told(&e))?;
    let names = reader.headers().map_err(|e| told(&e))?;
    let index = names.iter().position(|n| n == PREDICTED).ok_or_else(|| told(&format!("no column {PREDICTED}")))?;
    reader
        .records()
        .map(|row| {
            let row = row.map_err(|e| told(&e))?;
            let field = row.get(index).unwrap_or_default();
            field.parse().map_err(|_| told(&format!("{PREDICTED}: {field:?} is no number")))
        })
        .collect()
}
