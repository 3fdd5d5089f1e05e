//! The gear's model beside the baselines, fitted and held out alike.

use std::borrow::Cow;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use rayon::prelude::*;

use crate::baselines::{Baseline, all, cost};
use crate::fit::options::FitOptions;
use crate::fit::prepare::Prepared;
use crate::fit::select::{self, search};
use crate::model::GearSection;
use crate::numerics::bounded;
use crate::numerics::mark::Mark;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::regression::assembly::Assembly;
use crate::regression::base;
use crate::regression::columns::Offset;
use crate::regression::error::EstimateError;
use crate::regression::heldout::heldout;
use crate::regression::polish::polish;
use crate::regression::problem::{Problem, Sweep};
use crate::regression::rows::{self, Rows};

/// One model beside the recordings.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// Its name.
    pub model: String,
    /// Number of its parameters, without the offset of each recording.
    pub parameters: usize,
    /// Instructions a sample on a Cortex-M4F in `f32`, from `docs/cost.md`: of GMHM away from a reversal, of the others the mean over a cycle.
    pub instructions: Option<u32>,
    /// Residual sum of squares of the counted rows, N²·m² (A² where current stands in).
    pub rss: f64,
    /// Root mean square of the residual, N·m.
    pub rms: f64,
    /// Root mean square of the error on blocks held out, N·m.
    pub heldout_rms: f64,
    /// Root mean square of the error on each recording when it is held out whole and only its offset is free; with two recordings or more.
    pub unseen_recording_rms: Option<f64>,
}

/// The torque of a baseline fitted to a recording, row by row, the offset included.
///
/// # Errors
/// As [`fit`](crate::fit::fit).
pub fn fitted(baseline: &Baseline, recording: &Recording, seed: u64) -> Result<Vec<f64>, EstimateError> {
    let rows = rows::of_recordings(std::slice::from_ref(recording), &GearSection::default())?;
    let problem = Problem { rows: &rows, corrections: Vec::new(), contributions: vec![&Offset, baseline] };
    let found = polish(&problem, &search(&problem, seed, &()).0, Sweep::PLAIN, &());
    let residual = problem.residuals(&found.nonlinear, &found.linear).swap_remove(0);
    Ok(rows[0].torque.iter().zip(residual).map(|(torque, left)| torque - left).collect())
}

/// Compares the gear's model, its structure chosen as [`fit`](crate::fit::fit) does, with the baselines. The first line is the gear's.
///
/// # Errors
/// As [`fit`](crate::fit::fit).
pub fn compare(
    recordings: &[Recording],
    options: &FitOptions,
    progress: &dyn Progress,
) -> Result<Vec<Comparison>, EstimateError> {
    let prepared = Prepared::new(recordings, options, None)?;
    let Prepared { rows, rated_deflection_rad, start, .. } = &prepared;
    let structures = prepared.structures(options);
    let (table, _) = select::table(&structures, *rated_deflection_rad, rows, &start.known, options.seed, progress)?;
    let (chosen, parameters) =
        table.iter().find(|c| c.chosen).map_or((base::Structure::MASING, 5), |c| (c.structure, c.parameters));
    let assembly = Assembly::new(chosen, *rated_deflection_rad, rows, &start.known)?;
    let baselines = all(*rated_deflection_rad);
    let gear = assembly.problem(rows);
    let (found, _) = search(&gear, options.seed, progress);
    let mut lines = vec![line(format!("GMHM {}", select::name(&chosen)), parameters, &gear, &found, progress)];
    let searched = searched(rows);
    let done = AtomicUsize::new(0);
    let baselines = baselines.par_iter().map(|baseline| {
        let problem = |rows| Problem { rows, corrections: Vec::new(), contributions: vec![&Offset, baseline] };
        let (found, _) = search(&problem(&searched), options.seed, progress);
        let line = line(baseline.name.clone(), baseline.parameters(), &problem(rows), &found, progress);
        progress.report("comparing", (1 + done.fetch_add(1, Relaxed)) as f64 / baselines.len() as f64);
        line
    });
    lines.par_extend(baselines);
    if progress.cancelled() {
        return Err(EstimateError::Cancelled);
    }
    Ok(lines)
}

/// Rows beyond which the search of a baseline looks at every few recordings only, and the recordings that it looks at at least. The polish looks at all.
const SEARCHED: (usize, usize) = (4000, 8);

/// The recordings that a search looks at.
fn searched<'r, 'a>(rows: &'r [Rows<'a>]) -> Cow<'r, [Rows<'a>]> {
    let (most_rows, least_recordings) = SEARCHED;
    let total: usize = rows.iter().map(Rows::len).sum();
    let every = total.div_ceil(most_rows).min(rows.len() / least_recordings).max(1);
    if every == 1 { rows.into() } else { rows.iter().step_by(every).cloned().collect() }
}

/// A model beside the recordings, polished from where a search found it.
fn line(model: String, parameters: usize, problem: &Problem<'_>, found: &[f64], progress: &dyn Progress) -> Comparison {
    let nonlinear = polish(problem, found, Sweep::PLAIN, progress).nonlinear;
    let system = problem.factor(&nonlinear, None, Sweep::PLAIN).combine(|_, _| true);
    let rss = bounded::solve(&system.shared, &problem.bounds()).rss;
    let rms = (rss / system.rows.max(1) as f64).sqrt();
    let heldout_rms = heldout(problem, &nonlinear, None).rms;
    let unseen_recording_rms = (problem.rows.len() > 1).then(|| unseen(problem, &nonlinear));
    let instructions = cost::instructions(&model);
    Comparison { model, parameters, instructions, rss, rms, heldout_rms, unseen_recording_rms }
}

/// Recordings are held out whole in so many groups at most.
const MOST_GROUPS: usize = 8;

/// Each recording held out whole in turn, many of them in groups; the nonlinear parameters are polished without them.
fn unseen(problem: &Problem<'_>, nonlinear: &[f64]) -> f64 {
    let (mut sum, mut rows) = (0.0, 0);
    let groups = problem.rows.len().min(MOST_GROUPS);
    for group in 0..groups {
        let held = |recording: usize| recording % groups == group;
        let mut others = problem.rows.to_vec();
        (others.iter_mut().enumerate().filter(|(index, _)| held(*index)))
            .for_each(|(_, rows)| rows.marks.fill(Mark::Skipped));
        let without = Problem {
            rows: &others,
            corrections: problem.corrections.clone(),
            contributions: problem.contributions.clone(),
        };
        let nonlinear = polish(&without, nonlinear, Sweep::PLAIN, &()).nonlinear;
        let factors = problem.factor(&nonlinear, None, Sweep::PLAIN);
        let gear = bounded::solve(&factors.combine(|r, _| !held(r)).shared, &problem.bounds()).coefficients;
        let alone = factors.combine(|r, _| held(r));
        let x: Vec<f64> = gear.iter().copied().chain([-1.0]).collect();
        sum += alone.shared.squared_norm_of_product(&x);
        rows += alone.rows;
    }
    (sum / rows.max(1) as f64).sqrt()
}
