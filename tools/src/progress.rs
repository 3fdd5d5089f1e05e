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

/// Reports nothing and never cancels.
impl Progress for () {}
