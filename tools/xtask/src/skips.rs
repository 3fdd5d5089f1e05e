//! Checks that this machine cannot do: said aloud and counted, so that nobody takes them for passed.

use std::collections::BTreeSet;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Names the file that other processes note theirs in: the test programs of the workspace (`tools/tests/common/skips.rs`) and the part of the tests that runs beside.
pub const LIST: &str = "GMHM_SKIPPED";

static SKIPPED: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// Prints and counts a check that is skipped, and why.
pub fn skipped(what: &str, why: &str) {
    let line = format!("skipped: {what} ({why})");
    println!("{line}");
    if let Some(list) = std::env::var_os(LIST) {
        // A list that cannot be written is noticed in the output.
        let file = OpenOptions::new().create(true).append(true).open(&list);
        let noted = file.and_then(|mut file| file.write_all(format!("{line}\n").as_bytes()));
        if let Err(error) = noted {
            println!("{}: {error}", list.display());
        }
    }
    SKIPPED.lock().unwrap_or_else(PoisonError::into_inner).insert(line);
}

/// All that were skipped, in this process and in those that note theirs in the list, each once.
pub fn all(list: &Path) -> BTreeSet<String> {
    let mut all = SKIPPED.lock().unwrap_or_else(PoisonError::into_inner).clone();
    // There is no list where none of them skipped anything.
    let noted = std::fs::read_to_string(list).unwrap_or_default();
    all.extend(noted.lines().map(str::to_owned));
    all
}
