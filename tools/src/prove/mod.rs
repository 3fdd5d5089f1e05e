//! The concealed-physics proof: recordings whose missing physics only a key knows, and the score of a detector on them.
//!
//! Every case is made from a seed. [`Sealed`] fixes the keys of all cases by their hashes before a detector starts, hands the
//! detector the noisy recordings and a base model without the effect, and only then opens the key and scores. The same
//! seed gives the same cases on any machine, whatever the number of threads. `docs/proof.md` says how to read the table.
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
pub mod diagnostician;
pub mod export;
pub mod generator;
pub mod key;
pub mod mix;
pub mod real;
pub mod score;
mod sealed;
pub mod table;

pub use diagnostician::Diagnostician;
pub use sealed::{Answer, Sealed};

use crate::diagnose::diagnosis::Diagnosis;
use crate::model::Model;
use crate::recording::Recording;

/// Cases of a run that takes minutes.
pub const QUICK_CASES: usize = 60;
/// Cases of a run whose nulls number 500, those of the loud blocks not counted.
pub const FULL_CASES: usize = 1875;

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
