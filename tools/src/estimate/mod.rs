//! Identification: one estimator for everything that is fitted to recordings.
//!
//! | file | what |
//! |---|---|
//! | [`columns`] | what a contribution is to the estimator, and how to plug one in |
//! | [`base`], [`assembly`] | the base model as contributions, and back |
//! | [`problem`], [`factors`], [`triangle`], [`bounded`] | one pass over the recordings, its triangular factor, the exact bounded optimum |
//! | [`swarm`], [`polish`] | search and polish of the nonlinear parameters |
//! | `invertible` | law `masing` held where feed-forward has an inverse |
//! | [`joint`] | joint logs: gravity, inertia, friction |
//! | [`noise`] | colour, outliers, quantisation |
//! | [`select`] | law, kernel, gate and play by held-out prediction |
//! | [`uncertainty`] | standard deviations, and what the recordings cannot tell |
//! | [`coverage`], [`judge`] | what the recordings exercise, and whether the fit is good enough for the drive |
//! | [`pso`] | the paper's own identification |
//! | [`rivals`] | foreign models, as yardsticks |
//!
//! **Start of a recording.** What the gear went through before the first row is unknown, but `predict` starts every recording with an empty memory. Both
//! are tried. In law `masing` the rows before the loop has settled are first left out; if a start from rest, or from a branch of
//! the rated cycle, explains them as well as the rest (Chow's test), they take part. In the other laws the memory at the start is a nuisance, which is dropped where it is not significant.
//!
//! **Gauge.** Of (α, β, ω) a rate-independent loop fixes only e, h and β/ω. The result is written with the ω of the model handed in, else ω = 1 1/s
//! (law `time` does not use ω and has 0).

pub mod assembly;
pub mod base;
pub mod bounded;
pub mod columns;
pub mod coverage;
pub mod factors;
mod invertible;
pub mod joint;
pub mod judge;
pub mod noise;
pub mod polish;
pub(crate) mod prepare;
pub mod problem;
pub mod pso;
mod refine;
pub mod rivals;
pub mod select;
pub mod swarm;
pub mod triangle;
pub mod uncertainty;

use gmhm::{Elastic, Law, ParamError};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::model::{GearSection, Model, TorqueSide};
use crate::recording::{Recording, TorqueUnit};
use assembly::Assembly;
use base::{Play, Structure};
use columns::{Mark, Past, Rows};
use noise::Noise;
use polish::Polished;
use problem::{Problem, Sweep};
use refine::Weighted;
use select::Candidate;
use swarm::Stop;
use uncertainty::{Estimated, Fitted, Uncertainty};

/// How the parameters are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Linear parameters eliminated, the others searched and polished; noise, selection.
    #[default]
    Auto,
    /// The paper's swarm over all six parameters.
    Pso,
}

/// What to fit and how.
#[derive(Debug, Clone, Default)]
pub struct FitOptions {
    /// The method.
    pub method: Method,
    /// Seed of every random choice.
    pub seed: u64,
    /// A model whose gear section, law, kernel, gate, play and ω are kept.
    pub start: Option<Model>,
    /// A; else the model's, else the largest deflection seen. rad.
    pub rated_deflection_rad: Option<f64>,
    /// Evaluations of `pso`; by default 20,000.
    pub evaluations: Option<usize>,
}

/// Who watches a long fit.
pub trait Progress: Sync {
    /// A stage and how much of it is done, 0 to 1.
    fn report(&self, _stage: &str, _done: f64) {}

    /// Asked now and then: true ends the work with [`EstimateError::Cancelled`].
    fn cancelled(&self) -> bool {
        false
    }
}

/// Nobody watches.
impl Progress for () {}

/// Why nothing was fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EstimateError {
    /// No recording.
    #[error("no recording was given")]
    NoRecording,
    /// Too little to fit.
    #[error("{recording}: {rows} rows are too few to fit a gear, at least {needed} are needed")]
    TooFewRows {
        /// The recording.
        recording: String,
        /// Its rows.
        rows: usize,
        /// Rows needed.
        needed: usize,
    },
    /// No torque to explain.
    #[error(
        "{recording}: column torque_nm (or current_a) is missing; name it, or map another column to it with --map torque_nm=…"
    )]
    NoTorque {
        /// The recording.
        recording: String,
    },
    /// No deflection.
    #[error(
        "{recording}: column deflection_rad is missing, and so is theta_in_rad or theta_out_rad; map a column with --map deflection_rad=…"
    )]
    NoDeflection {
        /// The recording.
        recording: String,
    },
    /// Angles without a ratio.
    #[error(
        "{recording}: the deflection follows from theta_in_rad and theta_out_rad only with the ratio: give [gear] ratio in --model"
    )]
    NoRatio {
        /// The recording.
        recording: String,
    },
    /// The gear does not move.
    #[error("the deflection is the same in every row, or the joint of a joint log stands still: nothing can be fitted")]
    NoMovement,
    /// The torque does not change.
    #[error("the torque is the same in every row: nothing can be fitted")]
    NoTorqueChange,
    /// Newton-metres and amperes.
    #[error("{first} and {other} hold torque in different units: fit them apart")]
    MixedUnits {
        /// The first recording.
        first: String,
        /// The one that differs.
        other: String,
    },
    /// A term that cannot be fitted.
    #[error("the model has a term {kind}, which fit does not refit: use diagnose")]
    HasTerms {
        /// Its kind.
        kind: String,
    },
    /// A joint log that the base terms cannot be evaluated on.
    #[error("{why}")]
    Joint {
        /// Why.
        why: String,
    },
    /// The core refused the gear.
    #[error("the fitted gear is none: {0}")]
    Refused(#[from] ParamError),
    /// The caller asked for it.
    #[error("stopped before the fit was done; nothing was written")]
    Cancelled,
}

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
    /// Structures tried, the chosen one marked. One line where the model gave the structure.
    pub selection: Vec<Candidate>,
    /// Rows that the selection looked at.
    pub selection_rows: usize,
    /// Root mean square of the residual of all counted rows, N·m.
    pub rms: f64,
    /// Residual sum of squares of the counted rows, N²·m².
    pub rss: f64,
    /// Root mean square of the error on blocks held out, N·m.
    pub heldout_rms: f64,
    /// Rows that counted.
    pub rows: usize,
    /// Constant torque offset of each recording, N·m. Not part of the model.
    pub offsets: Vec<f64>,
    /// For each recording, whether it starts with an empty memory.
    pub known_start: Vec<bool>,
    /// For each recording, rows left out before its loop had settled.
    pub unsettled_rows: Vec<usize>,
    /// Noise of each recording.
    pub noise: Vec<Noise>,
    /// Whether the rows were weighted against that noise; if not, the fit is plain least squares.
    pub prewhitened: bool,
    /// Whether the optimum had no inverse over the whole rated range and the parameters were held at the nearest that has, which the recordings do not contradict.
    pub held_invertible: bool,
    /// Why the search stopped.
    pub stop: Stop,
    /// Evaluations of the whole problem.
    pub evaluations: usize,
}

impl Fit {
    /// Whether what is left is physics more than noise: a fit against it as noise predicts worse.
    pub fn leaves_physics(&self) -> bool {
        !self.prewhitened && self.method == Method::Auto
    }

    /// A parameter by name.
    pub fn parameter(&self, name: &str) -> Option<&Estimated> {
        self.uncertainty.parameters.iter().find(|p| p.name == name)
    }
}

/// Rows that the choice of the structure looks at; the chosen one is then fitted to all.
const SELECTION_ROWS: usize = 20_000;

/// Fits the base model to recordings of one gear. Joint logs, which know no deflection, have the base model of [`joint`].
///
/// # Errors
/// When a recording lacks what is needed, or `progress` cancels.
pub fn fit(recordings: &[Recording], options: &FitOptions, progress: &dyn Progress) -> Result<Fit, EstimateError> {
    if options.method == Method::Auto && !recordings.is_empty() && recordings.iter().all(Recording::is_joint_log) {
        return joint::fit(recordings, options, progress);
    }
    let prepared = Prepared::new(recordings, options)?;
    let structures = prepared.structures(options);
    let Prepared { mut rows, mut gear, rated_deflection_rad, torque_nm, mut start } = prepared;
    let mut beginning = prepare::beginning(&rows, SELECTION_ROWS);
    let selection_rows = beginning.iter().map(Rows::len).sum();
    let (mut selection, mut evaluations) =
        select::table(&structures, rated_deflection_rad, &beginning, &start.known, options.seed, progress)?;
    let chosen = selection.iter().position(|c| c.chosen).unwrap_or(0);
    let structure = selection[chosen].structure;
    let from = selection[chosen].nonlinear.clone();
    beginning.clear();
    drop(beginning);

    if structure.law != Law::Masing {
        refine::free_start(&mut rows, &mut start, structure, rated_deflection_rad, &from)?;
    }
    let gauge = options.start.as_ref().and_then(|m| m.memory).map_or(1.0, |m| m.omega_per_s.abs());
    let mut gauge_omega_per_s = if gauge > 0.0 { gauge } else { 1.0 };
    let mut assembly = Assembly::new(structure, rated_deflection_rad, &rows, &start.known)?;
    let Weighted { polished: mut result, noise, prewhitened, heldout_rms } = match options.method {
        Method::Auto => {
            let refined = refine::refine(assembly, &mut rows, &start.known, from, progress)?;
            assembly = refined.assembly;
            refined.weighted
        }
        Method::Pso => {
            let allowed = options.evaluations.unwrap_or(pso::EVALUATIONS);
            let found = pso::search(&assembly, &rows, torque_nm, allowed, options.seed, progress)?;
            gauge_omega_per_s = found.omega_per_s.max(f64::MIN_POSITIVE);
            let noise = refine::noise_of(&assembly.problem(&rows), &found.polished);
            let heldout_rms = select::heldout(&assembly.problem(&rows), &found.polished.nonlinear, None).rms;
            let prewhitened = noise.iter().all(Noise::is_white);
            Weighted { polished: found.polished, noise, prewhitened, heldout_rms }
        }
    };
    let weights = prewhitened.then_some(&noise[..]);
    let held_invertible = structure.law == Law::Masing
        && options.method == Method::Auto
        && invertible::hold(&assembly.problem(&rows), &mut result, weights, rated_deflection_rad);
    evaluations += result.evaluations;
    let (elastic, memory) = assembly.coefficients(&result.nonlinear, &result.linear, gauge_omega_per_s);
    let zero_rad = assembly.has_free_zero().then(|| assembly.zero_rad(&result.nonlinear));
    gear.deflection_zero_rad += zero_rad.unwrap_or(0.0);
    gear.rated_deflection_rad = Some(rated_deflection_rad);
    if options.start.is_none() && recordings[0].torque_unit == TorqueUnit::Ampere {
        gear.torque_side = TorqueSide::Motor;
    }
    let fitted = Fitted {
        rated_deflection_rad,
        elastic,
        memory,
        known_start: &start.known,
        zero_rad,
        stored_zero_rad: gear.deflection_zero_rad,
        searched_play: matches!(structure.play, Play::UpTo(_)),
        torque_nm,
    };
    let mut uncertainty = uncertainty::assess(&fitted, &rows, weights)?;
    uncertainty.per(recordings[0].torque_unit);
    let (rss, counted) = plain_rss(&assembly.problem(&rows), &result);
    for candidate in &mut selection {
        candidate.chosen = candidate.structure == structure;
    }
    Ok(Fit {
        model: named_model(options.start.as_ref(), recordings, gear, elastic, memory),
        method: options.method,
        seed: options.seed,
        unit: prepare::unit_word(recordings[0].torque_unit),
        uncertainty,
        selection,
        selection_rows,
        rms: (rss / counted.max(1) as f64).sqrt(),
        rss,
        heldout_rms,
        rows: counted,
        offsets: result.linear.recordings.iter().map(|l| l[0]).collect(),
        known_start: start.known,
        unsettled_rows: start.unsettled,
        noise,
        prewhitened,
        held_invertible,
        stop: result.stop,
        evaluations,
    })
}

/// Recordings ready to be fitted.
struct Prepared<'a> {
    rows: Vec<Rows<'a>>,
    gear: GearSection,
    rated_deflection_rad: f64,
    torque_nm: f64,
    start: Start,
}

impl<'a> Prepared<'a> {
    fn new(recordings: &'a [Recording], options: &FitOptions) -> Result<Self, EstimateError> {
        let mut gear = options.start.as_ref().map_or_else(GearSection::default, |m| m.gear.clone());
        if let Some(term) = options.start.as_ref().and_then(|m| m.terms.first()) {
            return Err(EstimateError::HasTerms { kind: term.kind.clone() });
        }
        let mut rows = prepare::rows(recordings, &gear)?;
        let torque_nm = prepare::torque_size(&rows);
        if torque_nm <= 0.0 {
            return Err(EstimateError::NoTorqueChange);
        }
        let given = options.rated_deflection_rad.or(gear.rated_deflection_rad);
        let rated_deflection_rad = settle_scale(&mut rows, &mut gear, given)?;
        let start = decide_start(&mut rows, rated_deflection_rad)?;
        Ok(Self { rows, gear, rated_deflection_rad, torque_nm, start })
    }

    /// What to choose from: the model's structure if there is one, else all.
    fn structures(&self, options: &FitOptions) -> Vec<Structure> {
        match options.start.as_ref().and_then(|m| m.memory.as_ref()) {
            Some(memory) => vec![Structure::of(memory)],
            None if options.method == Method::Pso => vec![Structure::MASING],
            None => select::structures(self.rated_deflection_rad),
        }
    }
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

fn plain_rss(problem: &Problem<'_>, result: &Polished) -> (f64, usize) {
    let rows = problem.rows;
    let residuals = problem.residuals(&result.nonlinear, &result.linear);
    let counted = |mark: &Mark| matches!(mark, Mark::Used | Mark::First);
    let mut sum = 0.0;
    let mut count = 0;
    for (rows, residual) in rows.iter().zip(&residuals) {
        for (r, _) in residual.iter().zip(&rows.marks).filter(|(_, m)| counted(m)) {
            sum += r * r;
            count += 1;
        }
    }
    (sum, count)
}

/// A, and the zero of the deflection where it is far off: the middle of the range, if that explains the torque better.
fn settle_scale(rows: &mut [Rows<'_>], gear: &mut GearSection, given: Option<f64>) -> Result<f64, EstimateError> {
    let (low, high) = prepare::deflection_range(rows);
    let half = 0.5 * (high - low);
    if half.is_nan() || half <= 0.0 {
        return Err(EstimateError::NoMovement);
    }
    let middle = 0.5 * (low + high);
    let rated = |zero: f64| given.unwrap_or_else(|| (high - zero).max(zero - low));
    if middle.abs() <= 0.05 * half {
        return Ok(rated(0.0));
    }
    let shift = |rows: &mut [Rows<'_>], by: f64| {
        rows.iter_mut().for_each(|r| r.deflection_rad.to_mut().iter_mut().for_each(|theta| *theta -= by));
    };
    let misfit = |rows: &[Rows<'_>], rated: f64| -> Result<f64, EstimateError> {
        let beginning = prepare::beginning(rows, SELECTION_ROWS);
        let assembly = Assembly::new(Structure::MASING, rated, &beginning, &[])?;
        Ok(assembly.problem(&beginning).solve(&[], Sweep::PLAIN).1.rss)
    };
    let as_given = misfit(rows, rated(0.0))?;
    shift(rows, middle);
    if misfit(rows, rated(middle))? < 0.8 * as_given {
        gear.deflection_zero_rad += middle;
        return Ok(rated(middle));
    }
    shift(rows, -middle);
    Ok(rated(0.0))
}

/// How each recording starts.
pub(crate) struct Start {
    pub(crate) known: Vec<bool>,
    pub(crate) unsettled: Vec<usize>,
}

/// Leaves out the rows before the loop has settled, unless a start from rest, or from a branch of the rated cycle, explains them.
fn decide_start(rows: &mut [Rows<'_>], rated_deflection_rad: f64) -> Result<Start, EstimateError> {
    let settled: Vec<usize> = rows
        .iter()
        .map(|r| {
            let row = prepare::settled_row(&r.deflection_rad, rated_deflection_rad).unwrap_or(0);
            // Where too little would be left, the recording is taken as it is.
            if (r.len() - row) * 5 >= r.len() * 2 && r.len() - row >= 24 { row } else { 0 }
        })
        .collect();
    for (rows, &row) in rows.iter_mut().zip(&settled) {
        rows.marks[..row].fill(Mark::Skipped);
        // From the tip on, every past on the rated cycle is the same.
        rows.past = Past::Rising;
    }
    let misfit = |rows: &[Rows<'_>]| -> Result<(f64, f64), EstimateError> {
        let assembly = Assembly::new(Structure::MASING, rated_deflection_rad, rows, &[])?;
        let problem = assembly.problem(rows);
        let system = problem.factor(&[], None, Sweep::PLAIN).combine(|_, _| true);
        let columns = problem.bounds();
        let freedom = system.rows as f64 - (columns.len() + system.nuisances) as f64;
        Ok((bounded::solve(&system.shared, &columns).rss, freedom))
    };
    let floor = (1e-8 * prepare::torque_size(rows)).powi(2);
    let mut start = Start { known: vec![true; rows.len()], unsettled: vec![0; rows.len()] };
    for (index, &row) in settled.iter().enumerate() {
        let (without, freedom) = misfit(rows)?;
        let kept: Vec<Mark> = rows[index].marks[..row].to_vec();
        rows[index].marks[..row].fill(Mark::Used);
        let mut under = |past: Past| -> Result<(Past, f64), EstimateError> {
            rows[index].past = past;
            Ok((past, misfit(rows)?.0))
        };
        let (rest, rising, falling) = (under(Past::Rest)?, under(Past::Rising)?, under(Past::Falling)?);
        let other = if rising.1 <= falling.1 { rising } else { falling };
        // Predictions start from rest: another past has to be clearly better.
        let clearly = 1.0 + STRANGE_PAST / freedom.max(1.0);
        let (past, with) = if other.1 * clearly + floor < rest.1 { other } else { rest };
        rows[index].past = past;
        start.known[index] = past == Past::Rest;
        // Chow's test of further observations (Econometrica 28, 1960): F with (early rows, freedom) degrees.
        let ratio = (with - without) / row as f64 / (without / freedom.max(1.0) + floor);
        let usual = FisherSnedecor::new(row as f64, freedom.max(1.0)).map_or(2.0, |f| f.inverse_cdf(1.0 - STRANGE));
        if row > 0 && ratio > usual.max(2.0) {
            rows[index].marks[..row].copy_from_slice(&kept);
            rows[index].past = Past::Rising;
            start.known[index] = false;
            start.unsettled[index] = row;
        }
    }
    Ok(start)
}

/// By how much, in variances of the residual, another past has to explain a recording better than a start from rest.
const STRANGE_PAST: f64 = 25.0;

/// Probability at which a start from rest is given up where it is true.
const STRANGE: f64 = 1e-4;
