//! Which law, kernel, gate and play: chosen by prediction of rows that took no part in the fit.
//!
//! How the prediction is done stands in [`heldout`](crate::regression::heldout).

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use gmhm::{Gate, Kernel, Law};
use rayon::prelude::*;

use crate::fit::thresholds::THRESHOLDS;
use crate::numerics::particle_swarm::{SwarmOptions, minimise};
use crate::progress::Progress;
use crate::regression::assembly::Assembly;
use crate::regression::base::{Play, Structure};
use crate::regression::error::EstimateError;
use crate::regression::heldout::{Heldout, heldout};
use crate::regression::polish::polish;
use crate::regression::problem::{Problem, Sweep};
use crate::regression::rows::Rows;

/// One line of the selection table.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Candidate {
    /// `law/kernel/gate`, with `+play` where a play was fitted.
    pub name: String,
    /// Number of parameters of the gear.
    pub parameters: usize,
    /// Root mean square of the residual of the rows fitted, N·m.
    pub rms: f64,
    /// Root mean square of the error on rows held out, N·m.
    pub heldout_rms: f64,
    /// Whether it was chosen.
    pub chosen: bool,
    /// Whether these recordings do not tell it from the best: it predicts as well.
    pub tied: bool,
    #[serde(skip)]
    pub(crate) structure: Structure,
    #[serde(skip)]
    pub(crate) nonlinear: Vec<f64>,
    #[serde(skip)]
    fold_errors: Vec<f64>,
}

/// All structures that the core has.
pub fn structures(rated_deflection_rad: f64) -> Vec<Structure> {
    let mut all = vec![
        Structure::MASING,
        Structure { play: Play::UpTo(THRESHOLDS.widest_play_share * rated_deflection_rad), ..Structure::MASING },
    ];
    for law in [Law::Phase, Law::Time] {
        for kernel in [Kernel::Deflection, Kernel::Rate] {
            for gate in [Gate::Cycle, Gate::None] {
                all.push(Structure { law, kernel, gate, play: Play::Fixed(0.0) });
            }
        }
    }
    all
}

/// A structure's name in the table.
pub fn name(structure: &Structure) -> String {
    let gate = if structure.gate == Gate::Cycle { "cycle" } else { "none" };
    match (structure.law, structure.play) {
        (Law::Masing, Play::UpTo(_)) => "masing+play".to_owned(),
        (Law::Masing, _) => "masing".to_owned(),
        (law, _) => format!("{}/{}/{gate}", law.name(), structure.kernel.name()),
    }
}

/// Rows of the search beyond which every few are left out.
const SEARCH_ROWS: usize = 1024;

/// Searches and polishes the nonlinear parameters of a problem; returns them with the evaluations used.
pub fn search(problem: &Problem<'_>, seed: u64, progress: &dyn Progress) -> (Vec<f64>, usize) {
    let bounds: Vec<(f64, f64)> = problem.nonlinear().iter().map(|n| (n.low, n.high)).collect();
    if bounds.is_empty() {
        return (Vec::new(), 0);
    }
    let total: usize = problem.rows.iter().map(Rows::len).sum();
    let sweep = Sweep { stride: total.div_ceil(SEARCH_ROWS).max(1), ..Sweep::PLAIN };
    let options = SwarmOptions::for_unknowns(bounds.len(), seed, 1e-9);
    let objective = |x: &[f64]| if progress.cancelled() { f64::INFINITY } else { problem.solve(x, sweep).1.rss };
    let best = minimise(&bounds, &options, objective);
    let polished = polish(problem, &best.position, sweep, progress);
    (polished.nonlinear, best.evaluations + polished.evaluations)
}

/// Fits every structure and marks the one that predicts best; the simplest of those that the recordings cannot distinguish from the best.
pub fn table(
    structures: &[Structure],
    rated_deflection_rad: f64,
    rows: &[Rows<'_>],
    known_start: &[bool],
    seed: u64,
    progress: &dyn Progress,
) -> Result<(Vec<Candidate>, usize), EstimateError> {
    let done = AtomicUsize::new(0);
    let tried = structures.par_iter().map(|structure| {
        let assembly = Assembly::new(*structure, rated_deflection_rad, rows, known_start)?;
        let problem = assembly.problem(rows);
        let (nonlinear, used) = search(&problem, seed, progress);
        if progress.cancelled() {
            return Err(EstimateError::Cancelled);
        }
        let Heldout { rms: heldout_rms, blocks: fold_errors, in_sample_rms: rms } = heldout(&problem, &nonlinear, None);
        progress.report("choosing the law", (1 + done.fetch_add(1, Relaxed)) as f64 / structures.len() as f64);
        let candidate = Candidate {
            name: name(structure),
            parameters: problem.gear_columns().len() + nonlinear.len(),
            rms,
            heldout_rms,
            chosen: false,
            tied: false,
            structure: *structure,
            nonlinear,
            fold_errors,
        };
        Ok((candidate, used + 2))
    });
    let tried: Vec<(Candidate, usize)> = tried.collect::<Result<_, EstimateError>>()?;
    let evaluations = tried.iter().map(|(_, used)| used).sum();
    let mut candidates: Vec<Candidate> = tried.into_iter().map(|(candidate, _)| candidate).collect();
    let best = (0..candidates.len()).min_by(|&a, &b| candidates[a].heldout_rms.total_cmp(&candidates[b].heldout_rms));
    let Some(best) = best else { return Ok((candidates, evaluations)) };
    let tied: Vec<bool> = candidates.iter().map(|c| !clearly_worse(c, &candidates[best])).collect();
    candidates.iter_mut().zip(&tied).for_each(|(c, tied)| c.tied = *tied);
    let equal = (0..candidates.len()).filter(|&i| tied[i]);
    let chosen = equal.min_by_key(|&i| (candidates[i].parameters, i)).unwrap_or(best);
    candidates[chosen].chosen = true;
    Ok((candidates, evaluations))
}

/// Whether the blocks agree, by one standard error of their difference, that the candidate predicts worse than the best.
fn clearly_worse(candidate: &Candidate, best: &Candidate) -> bool {
    let differences: Vec<f64> = candidate.fold_errors.iter().zip(&best.fold_errors).map(|(c, b)| c - b).collect();
    let count = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / count;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    // A percent of the error is no difference, however consistent.
    mean > (variance / count).sqrt().max(THRESHOLDS.same_heldout_share * best.heldout_rms.powi(2))
        && candidate.heldout_rms > best.heldout_rms
}
