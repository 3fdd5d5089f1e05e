//! Concealment in real data: recordings whose answers are known, terms dropped from a textbook base, effects added to
//! a recording, and pairs of recordings of one machine.
//!
//! The recordings stay outside the repository; what is known of each stands in `recordings/*.toml`. A diagnosis is
//! measured by textbook least squares with the true terms: the share of the base's squared error, held out in eight
//! blocks, that it takes, over the share that those terms take.

mod asked;
mod entry;
mod question;
mod report;
mod textbook;

pub use entry::{Entry, KnownAnswer, KnownChange, RealError, Split};
pub use question::{Part, Question};
pub use report::{RealReport, RealScore};

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use super::Detector;

/// Puts `questions` to `detector`, in parallel. `progress` gets the number done.
pub fn run(questions: &[Question], detector: &dyn Detector, progress: &(dyn Fn(usize) + Sync)) -> Vec<RealScore> {
    let done = AtomicUsize::new(0);
    questions
        .par_iter()
        .map(|question| {
            let began = Instant::now();
            let asked = || detector.diagnose(std::slice::from_ref(&question.recording), &question.base, &[]);
            let answered = catch_unwind(AssertUnwindSafe(asked))
                .unwrap_or_else(|_| Err("the detector panicked; its message is on standard error".to_owned()));
            let mut score = question.score(answered.map(|found| found.diagnosis));
            score.seconds = began.elapsed().as_secs_f64();
            progress(done.fetch_add(1, Ordering::Relaxed) + 1);
            score
        })
        .collect()
}

/// Every question of `parts` about the recordings in `folder` of the half `split`, or of both, and the files that are not there.
///
/// # Errors
/// A file that is there and cannot be read.
pub fn questions(
    folder: &Path,
    split: Option<Split>,
    parts: &[Part],
) -> Result<(Vec<Question>, Vec<String>), RealError> {
    let (mut questions, mut missing) = (Vec::new(), Vec::new());
    for entry in Entry::all().into_iter().filter(|e| split.is_none_or(|s| e.split == s)) {
        if folder.join(&entry.file).exists() {
            questions.extend(asked::of(&entry, folder, parts)?);
        } else {
            missing.push(entry.file);
        }
    }
    Ok((questions, missing))
}
