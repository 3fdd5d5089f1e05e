//! Identification: one estimator for everything that is fitted to recordings.
//!
//! | file | what |
//! |---|---|
//! | `prepare`, [`zeros`], `start` | rows of recordings: zeros and scale of the deflection, the memory at the first row |
//! | [`select`] | law, kernel, gate and play by held-out prediction |
//! | `optimum`, `refine` | structure, outliers, zeros, colour in turn |
//! | `invertible` | the parameters held where feed-forward has an inverse |
//! | [`with_terms`] | models with terms, and joint logs: gravity, inertia, friction |
//! | [`coverage`], [`rated`], [`torque_side`], [`verdict`] | what the recordings exercise, whether rated deflection and side of the torque are theirs, and whether the fit is good enough for the drive |
//! | [`thresholds`] | what decides, in one place |
//! | [`units`] | quantities that no gear reaches |
//! | [`pso`] | the paper's own identification |
//!
//! **Start of a recording.** What the gear went through before the first row is unknown, but `predict` starts every recording with an empty memory. Both
//! are tried. In law `masing` the rows before the loop has settled are first left out; if a start from rest, or from a branch of
//! the rated cycle, explains them as well as the rest (Chow's test), they take part. In the other laws the memory at the start is a nuisance, which is dropped where it is not significant.
//!
//! **Gauge.** Of (α, β, ω) a rate-independent loop fixes only e, h and β/ω. The result is written with the ω of the model handed in, else ω = 1 1/s
//! (law `time` does not use ω and has 0).

pub mod comparison;
pub mod coverage;
pub(crate) mod invertible;
pub(crate) mod optimum;
pub mod options;
pub mod paper;
pub(crate) mod prepare;
pub mod pso;
pub mod rated;
pub(crate) mod refine;
pub mod select;
pub(crate) mod start;
pub mod thresholds;
pub mod torque_side;
pub mod units;
pub mod verdict;
pub mod with_terms;
pub mod zeros;

use gmhm::Elastic;

pub use crate::fit::options::{FitOptions, Method};
use crate::fit::thresholds::THRESHOLDS;
use crate::progress::Progress;
use crate::regression::uncertainty;
use crate::signal::encoder_zeros;
use crate::signal::plausible;

pub use crate::regression::error::EstimateError;

use crate::fit::optimum::Optimum;
use crate::fit::prepare::Prepared;
use crate::fit::refine::Weighted;
use crate::fit::select::Candidate;
use crate::model::{GearSection, Model};
use crate::numerics::autoregression::Noise;
use crate::numerics::particle_swarm::Stop;
use crate::recording::{Recording, RecordingError};
use crate::regression::polish::Polished;
use crate::regression::problem::Problem;
use crate::regression::uncertainty::{Estimated, Fitted, Uncertainty};

/// A fit and what is known about it.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Fit {
    /// The model, ready for a file.
    #[serde(skip)]
    pub model: Model,
    /// The method.
    pub method: Method,
    /// The seed used.
    pub seed: u64,
    /// Unit of the torque: `nm`, or `a` where current stands in.
    pub unit: &'static str,
    /// Parameters with standard deviations, and the correlations.
    #[serde(flatten)]
    pub uncertainty: Uncertainty,
    /// Whether the rated deflection was not given, and is the largest deflection seen. A hundredth of a per cent of it moves e of the published gear by 4 %, c1 by 0.6 %: what may lie between its samples is in the
    /// standard deviations.
    pub rated_is_largest_seen: bool,
    /// Whether a model said what the gear is, so that the units were compared with it.
    #[serde(skip)]
    pub started_from_model: bool,
    /// Structures tried, the chosen one marked. One line where the model gave the structure.
    pub selection: Vec<Candidate>,
    /// Rows that the selection looked at, spread over the whole of each recording.
    pub selection_rows: usize,
    /// Root mean square of the residual of all counted rows, N·m.
    pub rms: f64,
    /// Residual sum of squares of the counted rows, N²·m².
    pub rss: f64,
    /// Recording minus fit of each recording, row by row, N·m. A gear that had been through its rated cycle is followed from there; a prediction starts from rest.
    #[serde(skip)]
    pub residuals: Vec<Vec<f64>>,
    /// Root mean square of the error on blocks held out, N·m.
    pub heldout_rms: f64,
    /// Rows that counted.
    pub rows: usize,
    /// Constant torque offset of each recording, N·m. Not part of the model.
    pub offsets: Vec<f64>,
    /// Where the deflection of each recording is zero. Where they differ, the model has that of the first. None of joint logs.
    pub deflection_zeros: Vec<DeflectionZero>,
    /// For each recording, whether it starts with an empty memory.
    pub known_start: Vec<bool>,
    /// For each recording, rows left out before its loop had settled.
    pub unsettled_rows: Vec<usize>,
    /// For each recording, rows near standstill left out: the noise of the motion alone changes the friction there by about as much as the residual.
    pub rows_near_standstill: Vec<usize>,
    /// Noise of each recording.
    pub noise: Vec<Noise>,
    /// Whether the rows were weighted against that noise; if not, the fit is plain least squares.
    pub prewhitened: bool,
    /// Whether the optimum had no inverse over the range that its law can have one in, and the parameters were held at the nearest that has, which the recordings do not
    /// contradict.
    pub held_invertible: bool,
    /// Why the search stopped.
    pub stop: Stop,
    /// Evaluations of the whole problem.
    pub evaluations: usize,
}

/// Where the deflection as recorded is none.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct DeflectionZero {
    /// The recording.
    pub recording: String,
    /// In terms of the recording, rad.
    pub rad: f64,
    /// Its standard deviation, rad; absent where it was not fitted.
    pub sd_rad: Option<f64>,
}

impl Fit {
    /// How far the zero of each recording is from that of the first, rad, where the encoders count from different ones.
    pub fn zeros_apart_rad(&self) -> Option<Vec<f64>> {
        encoder_zeros::apart(&self.deflection_zeros.iter().map(|zero| zero.rad).collect::<Vec<_>>())
    }

    /// Shifts the deflections of the recordings that were fitted to the zero that the model has, that of the first.
    ///
    /// # Errors
    /// Angles without a ratio.
    pub fn align(&self, recordings: &mut [Recording]) -> Result<(), RecordingError> {
        let apart = self.zeros_apart_rad().unwrap_or_default();
        let ratio = self.model.gear.ratio;
        recordings
            .iter_mut()
            .zip(apart)
            .try_for_each(|(recording, zero)| encoder_zeros::take_off(recording, zero, ratio))
    }

    /// Whether what is left is physics more than noise: a fit against it as noise predicts worse.
    pub fn leaves_physics(&self) -> bool {
        !self.prewhitened && self.method == Method::Auto
    }

    /// Where the parameters are held at the nearest that have an inverse: whether up to the rated deflection, or else up to half of it.
    pub fn held_invertible_up_to_rated(&self) -> Option<bool> {
        let whole = self.model.memory.is_none_or(|memory| invertible::reach(&memory) == 1.0);
        self.held_invertible.then_some(whole)
    }

    /// A parameter by name.
    pub fn parameter(&self, name: &str) -> Option<&Estimated> {
        self.uncertainty.parameters.iter().find(|p| p.name == name)
    }
}

/// Whether what a fit leaves of a recording is more than that share.
fn is_missed(recording: &Recording, left: &[f64]) -> bool {
    let squares = left.iter().map(|left| left.powi(2)).sum::<f64>();
    let sd = plausible::sd(recording.torque.as_deref().unwrap_or_default());
    squares > left.len() as f64 * (THRESHOLDS.missed_share * sd).powi(2)
}

/// Whether the largest deflections of recordings, rad, differ so much that their units may.
pub fn differ_in_size(largest_rad: &[f64]) -> bool {
    let largest = largest_rad.iter().copied().fold(0.0, f64::max);
    largest_rad.iter().any(|own| THRESHOLDS.other_size_ratio * own < largest)
}

/// Fits the base model to recordings of one gear. Joint logs, which know no deflection, have a base model [of terms](with_terms).
///
/// # Errors
/// When a recording lacks what is needed, or `progress` cancels.
pub fn fit(recordings: &[Recording], options: &FitOptions, progress: &dyn Progress) -> Result<Fit, EstimateError> {
    let fit = fit_together(recordings, options, progress)?;
    // Recordings that do not go together: perhaps one is in another unit or of another sign than the first.
    let (first, others) = recordings.split_at(1);
    let missed = || recordings.iter().zip(&fit.residuals).any(|(recording, left)| is_missed(recording, left));
    let sizes = || recordings.iter().flat_map(largest_deflection_rad).collect::<Vec<f64>>();
    if !others.is_empty() && fit.model.has_gear() && (missed() || differ_in_size(&sizes())) {
        let alone = fit_together(first, options, progress)?;
        others.iter().try_for_each(|other| plausible::units(other, &alone.model))?;
    }
    Ok(fit)
}

/// The held-out error of a fit with other options, N·m or A; infinite where there is none.
fn heldout_rms_of(
    recordings: &[Recording],
    options: &FitOptions,
    progress: &dyn Progress,
) -> Result<f64, EstimateError> {
    match fit(recordings, options, progress) {
        Ok(other) => Ok(other.heldout_rms),
        Err(EstimateError::Cancelled) => Err(EstimateError::Cancelled),
        Err(_) => Ok(f64::INFINITY),
    }
}

fn fit_together(recordings: &[Recording], options: &FitOptions, progress: &dyn Progress) -> Result<Fit, EstimateError> {
    if let Some(model) = &options.start {
        let mut model = model.clone();
        model.gear.rated_deflection_rad = options.rated_deflection_rad.or(model.gear.rated_deflection_rad);
        recordings.iter().try_for_each(|recording| plausible::units(recording, &model))?;
    }
    let joint = !recordings.is_empty() && recordings.iter().all(Recording::is_joint_log);
    let has_terms = options.start.as_ref().is_some_and(|model| !model.terms.is_empty());
    if options.method == Method::Auto && (joint || has_terms) {
        return with_terms::fit(recordings, options, progress);
    }
    let Optimum {
        prepared: Prepared { rows, mut gear, rated_deflection_rad, start, zeros, .. },
        selection,
        selection_rows,
        assembly,
        weighted: Weighted { polished: mut result, noise, prewhitened, heldout_rms },
        gauge_omega_per_s,
        mut evaluations,
    } = Optimum::of(recordings, options, progress)?;
    let rated_is_largest_seen = options.rated_deflection_rad.or(gear.rated_deflection_rad).is_none();
    let weights = prewhitened.then_some(&noise[..]);
    let held_invertible = options.method == Method::Auto && invertible::hold(&assembly, &rows, &mut result, weights);
    evaluations += result.evaluations;
    let (elastic, memory) = assembly.coefficients(&result.nonlinear, &result.linear, gauge_omega_per_s);
    let mut deflection_zeros: Vec<DeflectionZero> = (recordings.iter().enumerate())
        .map(|(index, recording)| DeflectionZero {
            recording: recording.name.clone(),
            rad: gear.deflection_zero_rad + zeros.rad[index] + assembly.zero_rad(&result.nonlinear, index),
            sd_rad: None,
        })
        .collect();
    gear.deflection_zero_rad = deflection_zeros[0].rad;
    gear.rated_deflection_rad = Some(rated_deflection_rad);
    let fitted = Fitted {
        assembly: &assembly,
        nonlinear: &result.nonlinear,
        linear: &result.linear,
        memory,
        known_start: &start.known,
        stored_zero_rad: gear.deflection_zero_rad,
        rated_sd_rad: if rated_is_largest_seen { start::tip_sd_rad(&rows) } else { 0.0 },
    };
    let (uncertainty, zeros_sd_rad) = uncertainty::assess(&fitted, &rows, weights)?;
    if let Some(zeros) = assembly.free_zeros() {
        deflection_zeros.iter_mut().enumerate().for_each(|(k, zero)| zero.sd_rad = zeros_sd_rad[zeros.place(k)]);
    }
    let model = named_model(options.start.as_ref(), recordings, gear, elastic, memory);
    let weighted = Weighted { polished: result, noise, prewhitened, heldout_rms };
    let fit = finished(recordings, options, &assembly.problem(&rows), weighted, model, uncertainty);
    Ok(Fit {
        rated_is_largest_seen,
        selection,
        selection_rows,
        deflection_zeros,
        known_start: start.known,
        unsettled_rows: start.unsettled,
        held_invertible,
        evaluations,
        ..fit
    })
}

/// What there is to say of any fitted problem.
fn finished(
    recordings: &[Recording],
    options: &FitOptions,
    problem: &Problem<'_>,
    weighted: Weighted,
    model: Model,
    mut uncertainty: Uncertainty,
) -> Fit {
    let Weighted { polished, noise, prewhitened, heldout_rms } = weighted;
    let unit = recordings[0].torque_unit;
    uncertainty.per(unit);
    let (residuals, rss, rows) = left(problem, &polished);
    Fit {
        model,
        method: options.method,
        seed: options.seed,
        unit: unit.suffix(),
        uncertainty,
        rated_is_largest_seen: false,
        started_from_model: options.start.is_some(),
        selection: Vec::new(),
        selection_rows: 0,
        rms: (rss / rows.max(1) as f64).sqrt(),
        rss,
        residuals,
        heldout_rms,
        rows,
        offsets: polished.linear.recordings.iter().map(|l| l[0]).collect(),
        deflection_zeros: Vec::new(),
        known_start: vec![true; recordings.len()],
        unsettled_rows: vec![0; recordings.len()],
        rows_near_standstill: vec![0; recordings.len()],
        noise,
        prewhitened,
        held_invertible: false,
        stop: polished.stop,
        evaluations: polished.evaluations,
    }
}

/// The rated deflection of a recording by itself: the largest deflection about its zero, rad.
///
/// # Errors
/// As [`fit`].
pub fn largest_deflection_rad(recording: &Recording) -> Result<f64, EstimateError> {
    Prepared::new(std::slice::from_ref(recording), &FitOptions::default(), None).map(|p| p.rated_deflection_rad)
}

fn named_model(
    start: Option<&Model>,
    recordings: &[Recording],
    gear: GearSection,
    elastic: Elastic,
    memory: gmhm::Memory,
) -> Model {
    let name = start.map(|m| m.name.clone()).filter(|n| !n.is_empty()).unwrap_or_else(|| recordings[0].name.clone());
    let torque_unit = recordings[0].torque_unit;
    Model { name, gear, torque_unit, elastic: Some(elastic), memory: Some(memory), terms: Vec::new() }
}

fn left(problem: &Problem<'_>, result: &Polished) -> (Vec<Vec<f64>>, f64, usize) {
    let rows = problem.rows;
    let residuals = problem.residuals(&result.nonlinear, &result.linear);
    let mut sum = 0.0;
    let mut count = 0;
    for (rows, residual) in rows.iter().zip(&residuals) {
        for (r, _) in residual.iter().zip(&rows.marks).filter(|(_, mark)| mark.counts()) {
            sum += r * r;
            count += 1;
        }
    }
    (residuals, sum, count)
}
