//! What is known of the real recordings, against the recordings where they are at hand.

use crate::common::skips;
use std::path::Path;

use gmhm_tools::prove::real::{self, Part, Split};

#[test]
fn every_known_recording_that_is_here_can_be_asked_about() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/recordings"));
    let (questions, missing) = real::questions(folder, Some(Split::Development), &[Part::Answers]).unwrap();
    if questions.is_empty() {
        return skips::skipped("the recordings of real machines", "not beside the checkout");
    }
    println!("{} questions, {} recordings missing", questions.len(), missing.len());
    for question in &questions {
        // What is known is there: plain least squares with the true terms predicts better than the base.
        assert!(question.textbook_share() > 0.02, "{}: {}", question.file, question.textbook_share());
        assert!(!question.asked.is_empty() && question.base_error.is_finite());
    }
}
