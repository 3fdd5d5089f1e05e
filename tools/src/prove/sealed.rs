//! Cases whose keys are fixed by hashes, and their score.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use super::Detector;
use super::generator::{Case, CaseSpec, Unseen, case, case_seed};
use super::key::sha256;
use super::score::CaseScore;
use super::table::ProveReport;
use crate::diagnose::diagnosis::Diagnosis;

/// What is said of a case, with the recordings that nobody saw predicted.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// The diagnosis.
    pub diagnosis: Diagnosis,
    /// The torque of each recording of [`Case::unseen`], N·m, up to a constant; or why there is none.
    pub unseen: Result<Vec<Vec<f64>>, String>,
}

/// Cases whose keys are fixed. Only they can be put to a detector, so that every hash is known before the first answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Sealed {
    seed: u64,
    cases: Vec<(usize, CaseSpec)>,
    hashes: Vec<String>,
}

impl Sealed {
    /// Fixes the keys of `cases`, numbered as in [`mix::suite`](super::mix::suite).
    pub fn new(seed: u64, cases: Vec<(usize, CaseSpec)>) -> Self {
        let hash = |(index, spec): &(usize, CaseSpec)| made(seed, *index, spec).key.sha256();
        Self { seed, hashes: cases.par_iter().map(hash).collect(), cases }
    }

    /// How many cases there are.
    pub fn len(&self) -> usize {
        self.cases.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.cases.is_empty()
    }

    /// The hash of every key, in the format of `sha256sum` for the keys of [`export`](super::export).
    pub fn hashes(&self) -> String {
        let line = |((index, _), hash): (&(usize, CaseSpec), &String)| format!("{hash}  keys/case_{index:04}.toml\n");
        self.cases.iter().zip(&self.hashes).map(line).collect()
    }

    /// SHA-256 of [`hashes`](Self::hashes), hexadecimal: one number that fixes every key.
    pub fn sha256(&self) -> String {
        sha256(self.hashes().as_bytes())
    }

    /// Puts every case to `detector`, in parallel, and scores. `progress` gets the number done.
    pub fn run(&self, detector: &dyn Detector, progress: &(dyn Fn(usize) + Sync)) -> ProveReport {
        let answer = |_: usize, case: &Case| {
            let found = detector.diagnose(&case.recordings, &case.base, &case.removed)?;
            let predict = |unseen: &Unseen| detector.predict(&found.model, &unseen.recording);
            Ok(Answer { unseen: case.unseen.iter().map(predict).collect(), diagnosis: found.diagnosis })
        };
        self.score(&answer, progress)
    }

    /// Scores what `answer` says of each case, given its number. An error is scored as a case in which nothing was found.
    pub fn score(
        &self,
        answer: &(dyn Fn(usize, &Case) -> Result<Answer, String> + Sync),
        progress: &(dyn Fn(usize) + Sync),
    ) -> ProveReport {
        let done = AtomicUsize::new(0);
        let one = |((index, spec), hash): (&(usize, CaseSpec), &String)| {
            let case = made(self.seed, *index, spec);
            let score = judged(*index, hash, &case, answer);
            progress(done.fetch_add(1, Ordering::Relaxed) + 1);
            score
        };
        let scores = self.cases.par_iter().zip(&self.hashes).map(one).collect();
        ProveReport::new(self.seed, self.sha256(), scores)
    }
}

fn made(seed: u64, index: usize, spec: &CaseSpec) -> Case {
    case(case_seed(seed, index as u64), spec)
}

fn judged(
    index: usize,
    hash: &str,
    case: &Case,
    answer: &(dyn Fn(usize, &Case) -> Result<Answer, String> + Sync),
) -> CaseScore {
    let begun = Instant::now();
    // One case in which a detector panics must not cost the hours of all others.
    let answered = catch_unwind(AssertUnwindSafe(|| answer(index, case)))
        .unwrap_or_else(|_| Err("the detector panicked; its message is on standard error".to_owned()));
    let seconds = begun.elapsed().as_secs_f64();
    let mut score = CaseScore { index, key_sha256: hash.to_owned(), seconds, ..CaseScore::default() };
    match answered {
        _ if case.key.sha256() != hash => score.judge_failure(&case.key, "its key is not the sealed one".to_owned()),
        Ok(answer) => {
            score.count(&case.key, &answer.diagnosis);
            score.judge_prediction(case, &answer.unseen);
        }
        Err(why) => score.judge_failure(&case.key, why),
    }
    score
}

#[cfg(test)]
mod tests {
    use super::super::mix;
    use super::*;

    fn said(sealed: &Sealed, answer: &(dyn Fn(usize, &Case) -> Result<Answer, String> + Sync)) -> String {
        sealed.score(answer, &|_| ()).cases.remove(0).failed.unwrap_or_default()
    }

    #[test]
    fn a_key_that_is_not_the_sealed_one_is_not_scored() {
        let mut sealed = Sealed::new(3, mix::suite(3, 1, &[]));
        assert_eq!(said(&sealed, &|_, _| Err("refused".to_owned())), "refused");
        sealed.hashes[0].replace_range(..1, "x");
        assert_eq!(said(&sealed, &|_, _| Err("refused".to_owned())), "its key is not the sealed one");
    }

    #[test]
    fn a_detector_that_panics_has_refused() {
        let sealed = Sealed::new(3, mix::suite(3, 1, &[]));
        assert!(said(&sealed, &|_, _| panic!("a bug")).contains("panicked"));
    }
}
