//! The concealed-physics proof: recordings whose missing physics only a key knows, and the score of a detector on them.
//!
//! [`run`] makes each case from a seed, seals its key ([`key::Key::sha256`] is reported before the detector starts), hands the
//! detector the noisy recordings and a base model without the effect, and only then opens the key and scores. The same
//! seed gives the same cases on any machine, whatever the number of threads.
//!
//! # What the generator assumes
//! - The gear is driven in deflection. A bench gear is c1θ + c2θ³ + c3θ⁵, a waist −eθ√(1 − θ²/A²), and a loop made by a uniform
//!   Preisach density; a Maxwell-slip gear has sliders instead; a joint log has gravity, inertia and friction only.
//! - An effect is scaled until it leaves the rms asked for after the base model (and the encoder's zero) is refitted to the
//!   noise-free recording by linear least squares. What a base model swallows is drawn anew with another motion.
//! - Noise is white, AR(1) up to 0.99, a slow pole with a damped resonance, or the residual of a real recording; torque and
//!   encoders are quantised, rows are outliers, temperatures follow time without meaning anything.
//! - The *theoretical class* of an effect holds every kind of the vocabulary whose own columns explain, in these very
//!   recordings and after the base is refitted, all but [`key::INDISTINGUISHABLE`] squared deviations of the noise (whitened by
//!   an autoregression of the noise that was really added), with at most one free parameter more than the truth has,
//!   friction positive, and no term as large as the base torque.
//!
//! # How it differs from the tool's library
//! It shares no code with the core, the virtual bench, the estimator or the detector. Its hysteresis keeps the profile of a
//! continuum of play operators, not a stack of turning points. Friction comes as tanh, atan, root, clip and Dahl
//! presliding; Stribeck with exponents 0.5 to 2 and a rational law; soft windup as tanh, rational, gaussian, atan and
//! piecewise linear; creep with one to three time constants and as a stretched exponential; wear as step, ramp and
//! sigmoid; time skew as delay and lag; ripple with odd and broken orders. The open world holds physics of no list: ripple
//! that only a loaded gear shows, a dead spot, a one-sided loop, cubic drift, a resonance met at one speed, a burst of
//! interference, a detent in the twist, friction that differs between speeding up and slowing down.

pub mod answers;
pub mod export;
pub mod generator;
pub mod key;
pub mod mix;
pub mod score;
pub mod table;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use crate::diagnosis::Diagnosis;
use crate::model::Model;
use crate::recording::Recording;
use generator::{Case, CaseSpec, Unseen, case, case_seed};
use score::CaseScore;
use table::ProveReport;

/// Cases of a run that takes minutes.
pub const QUICK_CASES: usize = 150;
/// Cases of a run whose nulls number 500.
pub const FULL_CASES: usize = 1500;

/// What a detector says of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The diagnosis.
    pub diagnosis: Diagnosis,
    /// The extended model; the refitted base where nothing was found.
    pub model: Model,
}

/// A detector of missing physics under proof.
pub trait Detector: Sync {
    /// Diagnoses `recordings` of one gear against `base`, without the kinds in `removed`.
    ///
    /// # Errors
    /// Why it refused; scored as a case in which nothing was found.
    fn diagnose(&self, recordings: &[Recording], base: &Model, removed: &[String]) -> Result<Found, String>;

    /// The torque that `model` predicts for a recording it never saw, N·m, up to a constant.
    ///
    /// # Errors
    /// Why it refused; scored as a prediction of nothing.
    fn predict(&self, model: &Model, recording: &Recording) -> Result<Vec<f64>, String>;
}

/// What [`run`] tells on its way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Progress<'a> {
    /// The key of a case is fixed; its detector has not started.
    Sealed {
        /// Number of the case.
        index: usize,
        /// SHA-256 of its key.
        key_sha256: &'a str,
    },
    /// A case is scored.
    Scored {
        /// Cases done.
        done: usize,
        /// Cases in all.
        of: usize,
    },
}

/// What is said of a case, with the recordings that nobody saw predicted.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// The diagnosis.
    pub diagnosis: Diagnosis,
    /// The torque of each recording of [`generator::Case::unseen`], N·m, up to a constant; or why there is none.
    pub unseen: Result<Vec<Vec<f64>>, String>,
}

/// Runs the proof: `cases` cases from `seed` through `detector`, in parallel. `real` holds residuals of real recordings
/// ([`generator::real_residuals`]); without any, the cases that need one are left out, and the report says so.
pub fn run(
    seed: u64,
    cases: usize,
    real: &[Vec<f64>],
    detector: &dyn Detector,
    progress: &(dyn Fn(Progress) + Sync),
) -> ProveReport {
    let answer = |_: usize, case: &Case| {
        let found = detector.diagnose(&case.recordings, &case.base, &case.removed)?;
        let predict = |unseen: &Unseen| detector.predict(&found.model, &unseen.recording);
        Ok(Answer { unseen: case.unseen.iter().map(predict).collect(), diagnosis: found.diagnosis })
    };
    score(seed, cases, real, &answer, progress)
}

/// Scores what `answer` says of each case, given its number. The key is sealed before `answer` is asked.
///
/// An error of `answer` is scored as a case in which nothing was found.
pub fn score(
    seed: u64,
    cases: usize,
    real: &[Vec<f64>],
    answer: &(dyn Fn(usize, &Case) -> Result<Answer, String> + Sync),
    progress: &(dyn Fn(Progress) + Sync),
) -> ProveReport {
    let specs = mix::suite(seed, cases, real);
    let done = AtomicUsize::new(0);
    let scores: Vec<CaseScore> = specs
        .par_iter()
        .map(|(index, spec)| {
            let score = score_one(case_seed(seed, *index as u64), *index, spec, answer, progress);
            progress(Progress::Scored { done: done.fetch_add(1, Ordering::Relaxed) + 1, of: specs.len() });
            score
        })
        .collect();
    ProveReport::new(seed, real.is_empty(), scores)
}

fn score_one(
    seed: u64,
    index: usize,
    spec: &CaseSpec,
    answer: &(dyn Fn(usize, &Case) -> Result<Answer, String> + Sync),
    progress: &(dyn Fn(Progress) + Sync),
) -> CaseScore {
    let case = case(seed, spec);
    let key_sha256 = case.key.sha256();
    progress(Progress::Sealed { index, key_sha256: &key_sha256 });
    let begun = Instant::now();
    let answered = answer(index, &case);
    let seconds = begun.elapsed().as_secs_f64();
    let mut score = CaseScore { index, key_sha256, seconds, ..CaseScore::default() };
    match answered {
        Ok(answer) => {
            score.judge(&case.key, &answer.diagnosis);
            score.judge_prediction(&case, &answer.unseen);
        }
        Err(why) => score.judge_failure(&case.key, why),
    }
    score
}
