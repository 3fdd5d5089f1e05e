//! Checks that this machine cannot do: said aloud and counted, so that nobody takes them for passed.

use std::io::Write;
use std::path::{Path, PathBuf};

/// The file that `cargo xtask test` counts the skipped checks of all test programs in.
const LIST: &str = "GMHM_SKIPPED";

/// Prints `skipped: WHAT (WHY)`, past the test harness, which shows no words of a test that passes.
pub fn skipped(what: &str, why: &str) {
    let line = format!("skipped: {what} ({why})\n");
    let _ = std::io::stderr().write_all(line.as_bytes());
    if let Some(list) = std::env::var_os(LIST) {
        let list = std::fs::File::options().append(true).create(true).open(list);
        list.and_then(|mut list| list.write_all(line.as_bytes())).expect("the list of skipped checks");
    }
}

/// A recording of a real machine; none, said aloud, where the folder of them does not lie beside the checkout.
pub fn real_recording(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings").join(name);
    let found = path.canonicalize().ok();
    if found.is_none() {
        skipped(&format!("the recording {name}"), "not beside the checkout");
    }
    found
}
