//! Identification: one estimator for everything that is fitted to recordings.
//!
//! | file | what |
//! |---|---|
//! | [`columns`] | what a contribution is to the estimator, and how to plug one in |
//! | [`base`], [`assembly`] | the base model as contributions, and back |
//! | [`problem`], [`factors`], [`triangle`], [`bounded`] | one pass over the recordings, its triangular factor, the exact bounded optimum |
//! | [`swarm`], [`polish`], [`descent`] | search and polish of the nonlinear parameters |
//! | [`ready`], [`profile`], [`basis`] | models of any terms, linearised: their columns stand ready in memory |
//! | `start` | scale and zero of the deflection, the memory at the first row |
//! | `invertible` | the parameters held where feed-forward has an inverse |
//! | [`joint`] | joint logs: gravity, inertia, friction |
//! | [`plausible`] | units, signs, zeros and dead channels, before anything is concluded |
//! | [`noise`], `whitening`, `denoise`, `graduation` | colour, outliers; angles freed of noise |
//! | [`counts`] | the motion behind a deflection in counts, and how far it may be from it |
//! | [`recorded`], [`acceleration`] | a motion recorded with noise, as a model sees it |
//! | [`select`] | law, kernel, gate and play by held-out prediction |
//! | [`heldout`] | blocks predicted by a fit to the others |
//! | [`uncertainty`], `spread`, [`singular`], `changes` | standard deviations, and what the recordings cannot tell |
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

pub mod acceleration;
pub mod assembly;
pub mod base;
pub mod basis;
pub mod bounded;
mod changes;
pub mod columns;
pub mod conversion;
pub mod counts;
pub mod coverage;
pub(crate) mod denoise;
pub mod descent;
mod error;
pub mod factors;
mod graduation;
pub mod heldout;
mod invertible;
pub mod joint;
pub mod judge;
pub mod noise;
pub mod plausible;
pub mod polish;
pub(crate) mod prepare;
pub mod problem;
pub mod profile;
pub mod pso;
pub mod ready;
pub mod recorded;
mod refine;
pub mod rivals;
pub mod select;
pub mod singular;
mod spread;
mod start;
pub mod swarm;
pub mod triangle;
pub mod uncertainty;
mod whitening;

use gmhm::{Elastic, Law};

pub use error::EstimateError;

use crate::model::{GearSection, Model, TorqueSide};
use crate::recording::{Recording, TorqueUnit};
use assembly::Assembly;
use base::{Play, Structure};
use columns::{Mark, Rows};
use noise::Noise;
use polish::Polished;
use problem::Problem;
use refine::Weighted;
use select::Candidate;
use start::{Start, decide_start, settle_scale};
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
    /// Structures tried, the chosen one marked. One line where the model gave the structure.
    pub selection: Vec<Candidate>,
    /// Rows that the selection looked at.
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
    /// For each recording, whether it starts with an empty memory.
    pub known_start: Vec<bool>,
    /// For each recording, rows left out before its loop had settled.
    pub unsettled_rows: Vec<usize>,
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

impl Fit {
    /// Whether what is left is physics more than noise: a fit against it as noise predicts worse.
    pub fn leaves_physics(&self) -> bool {
        !self.prewhitened && self.method == Method::Auto
    }

    /// What there is to say where the parameters are held at the bound of an inverse.
    pub fn said_of_the_inverse(&self) -> Option<&'static str> {
        let whole = self.model.memory.is_none_or(|memory| invertible::reach(&memory) == 1.0);
        self.held_invertible.then_some(if whole {
            "held at the bound where feed-forward has an inverse up to the rated deflection"
        } else {
            "held at the bound where feed-forward has an inverse up to half the rated deflection"
        })
    }

    /// A parameter by name.
    pub fn parameter(&self, name: &str) -> Option<&Estimated> {
        self.uncertainty.parameters.iter().find(|p| p.name == name)
    }
}

/// Recordings of which a fit predicts no more than this are looked at one by one: error held out beside the torque's deviation.
const APART: f64 = 0.3;

/// The deviation of the torque from its mean in each recording, rms over all.
fn torque_sd(recordings: &[Recording]) -> f64 {
    let (mut sum, mut rows) = (0.0, 0);
    for torque in recordings.iter().filter_map(|recording| recording.torque.as_deref()) {
        let mean = torque.iter().sum::<f64>() / torque.len().max(1) as f64;
        sum += torque.iter().map(|t| (t - mean).powi(2)).sum::<f64>();
        rows += torque.len();
    }
    (sum / rows.max(1) as f64).sqrt()
}

/// Rows that the choice of the structure looks at; the chosen one is then fitted to all.
const SELECTION_ROWS: usize = 20_000;

/// Fits the base model to recordings of one gear. Joint logs, which know no deflection, have the base model of [`joint`].
///
/// # Errors
/// When a recording lacks what is needed, or `progress` cancels.
pub fn fit(recordings: &[Recording], options: &FitOptions, progress: &dyn Progress) -> Result<Fit, EstimateError> {
    let fit = fit_together(recordings, options, progress)?;
    // Recordings that do not go together: perhaps one is in another unit or of another sign than the first.
    let (first, others) = recordings.split_at(1);
    if !others.is_empty() && fit.model.elastic.is_some() && fit.heldout_rms > APART * torque_sd(recordings) {
        let alone = fit_together(first, options, progress)?;
        others.iter().try_for_each(|other| plausible::units(other, &alone.model))?;
    }
    Ok(fit)
}

fn fit_together(recordings: &[Recording], options: &FitOptions, progress: &dyn Progress) -> Result<Fit, EstimateError> {
    if let Some(model) = &options.start {
        let mut model = model.clone();
        model.gear.rated_deflection_rad = options.rated_deflection_rad.or(model.gear.rated_deflection_rad);
        recordings.iter().try_for_each(|recording| plausible::units(recording, &model))?;
    }
    if options.method == Method::Auto && !recordings.is_empty() && recordings.iter().all(Recording::is_joint_log) {
        return joint::fit(recordings, options, progress);
    }
    let prepared = Prepared::new(recordings, options)?;
    let structures = prepared.structures(options);
    let Prepared { mut rows, mut gear, rated_deflection_rad, torque_nm, mut start } = prepared;
    let rated_is_largest_seen = options.rated_deflection_rad.or(gear.rated_deflection_rad).is_none();
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
            let heldout_rms = heldout::heldout(&assembly.problem(&rows), &found.polished.nonlinear, None).rms;
            let prewhitened = noise.iter().all(Noise::is_white);
            Weighted { polished: found.polished, noise, prewhitened, heldout_rms }
        }
    };
    let weights = prewhitened.then_some(&noise[..]);
    let held_invertible = options.method == Method::Auto && invertible::hold(&assembly, &rows, &mut result, weights);
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
        rated_sd_rad: if rated_is_largest_seen { start::tip_sd_rad(&rows) } else { 0.0 },
    };
    let mut uncertainty = uncertainty::assess(&fitted, &rows, weights)?;
    uncertainty.per(recordings[0].torque_unit);
    let (residuals, rss, counted) = left(&assembly.problem(&rows), &result);
    for candidate in &mut selection {
        candidate.chosen = candidate.structure == structure;
    }
    Ok(Fit {
        model: named_model(options.start.as_ref(), recordings, gear, elastic, memory),
        method: options.method,
        seed: options.seed,
        unit: prepare::unit_word(recordings[0].torque_unit),
        uncertainty,
        rated_is_largest_seen,
        selection,
        selection_rows,
        rms: (rss / counted.max(1) as f64).sqrt(),
        rss,
        residuals,
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
        rows.iter().try_for_each(prepare::believable)?;
        prepare::together(&rows)?;
        let given = options.rated_deflection_rad.or(gear.rated_deflection_rad);
        let rated_deflection_rad = settle_scale(&mut rows, &mut gear, given)?;
        let model = Model {
            gear: GearSection { rated_deflection_rad: Some(rated_deflection_rad), ..gear.clone() },
            ..options.start.clone().unwrap_or_default()
        };
        recordings.iter().try_for_each(|recording| plausible::within(recording, &model))?;
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

/// The rated deflection of a recording by itself: the largest deflection about its zero, rad.
///
/// # Errors
/// As [`fit`].
pub fn largest_deflection_rad(recording: &Recording) -> Result<f64, EstimateError> {
    Prepared::new(std::slice::from_ref(recording), &FitOptions::default()).map(|p| p.rated_deflection_rad)
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
    let counted = |mark: &Mark| matches!(mark, Mark::Used | Mark::First);
    let mut sum = 0.0;
    let mut count = 0;
    for (rows, residual) in rows.iter().zip(&residuals) {
        for (r, _) in residual.iter().zip(&rows.marks).filter(|(_, m)| counted(m)) {
            sum += r * r;
            count += 1;
        }
    }
    (residuals, sum, count)
}
