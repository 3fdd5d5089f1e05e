//! What is known of the real recordings, against the recordings where they are at hand.

use crate::common::skips;
use std::path::Path;

use gmhm_tools::prove::Diagnostician;
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

#[test]
fn names_that_predict_stand_against_a_likelihood_that_predicts_nothing() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/recordings"));
    let (questions, _) = real::questions(folder, Some(Split::Development), &[Part::Added]).unwrap();
    let Some(question) = questions.into_iter().find(|q| q.file == "schunk_lwa4p_j4.csv") else {
        return skips::skipped("the recordings of real machines", "not beside the checkout");
    };
    // The fit against coloured noise leaves more of the blocks held out than the base does.
    let scores = real::run(&[question], &Diagnostician, &|_| ());
    assert!(scores[0].missed.is_empty() && scores[0].taken > Some(1.0), "{:?}", scores[0]);
}

#[test]
fn a_name_that_predicts_most_stands_against_curves_that_predict_more() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/recordings"));
    let (questions, _) = real::questions(folder, Some(Split::Development), &[Part::Dropped]).unwrap();
    let is_asked = |q: &real::Question| q.file == "kuka_kr300_a1_A.csv" && q.detail == "without inertia";
    let Some(question) = questions.into_iter().find(is_asked) else {
        return skips::skipped("the recordings of real machines", "not beside the checkout");
    };
    // Inertia leaves 0.53 of the base's rms error, two curves over angle and velocity 0.36.
    let scores = real::run(&[question], &Diagnostician, &|_| ());
    assert!(scores[0].missed.is_empty() && scores[0].taken > Some(1.0), "{:?}", scores[0]);
}
