//! Checks that this machine cannot do: said aloud and counted, so that nobody takes them for passed.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Names, to the test programs of the workspace, the file that they note theirs in (`tools/tests/common/skips.rs`).
pub const LIST: &str = "GMHM_SKIPPED";

static SKIPPED: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// Prints and counts a check that is skipped, and why.
pub fn skipped(what: &str, why: &str) {
    let line = format!("skipped: {what} ({why})");
    println!("{line}");
    SKIPPED.lock().unwrap_or_else(PoisonError::into_inner).insert(line);
}

/// All that were skipped, in this process and in the test programs, each once.
pub fn all(list: &Path) -> BTreeSet<String> {
    let mut all = SKIPPED.lock().unwrap_or_else(PoisonError::into_inner).clone();
    // There is no list where no test program skipped anything.
    let noted = std::fs::read_to_string(list).unwrap_or_default();
    all.extend(noted.lines().map(str::to_owned));
    all
}
