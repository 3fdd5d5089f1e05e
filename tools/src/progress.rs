//! Progress of long work, and its cancellation.

/// Receives the progress of long work.
pub trait Progress: Sync {
    /// A stage and how much of it is done, 0 to 1.
    fn report(&self, _stage: &str, _done: f64) {}

    /// Asked now and then: true ends the work with an error that says so.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Rows between two reports of work that goes row by row.
const ROWS_A_REPORT: usize = 1 << 14;

/// Reports a row of so many, now and then.
pub fn at_row(progress: &dyn Progress, stage: &str, row: usize, rows: usize) {
    if row.is_multiple_of(ROWS_A_REPORT) && row > 0 {
        progress.report(stage, row as f64 / rows as f64);
    }
}

/// Reports nothing and never cancels.
impl Progress for () {}
