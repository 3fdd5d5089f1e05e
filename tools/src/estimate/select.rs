//! Which law, kernel, gate and play: chosen by prediction of rows that took no part in the fit.
//!
//! Each recording is cut into contiguous blocks. One pass gives a factor a block; leaving a block out, refitting and predicting it costs no further
//! pass, because factors add up. Nonlinear parameters are refitted along their derivatives at the optimum of all rows. The memory always runs through all
//! rows: deflection is an input, only torque is held out. The nuisances of a recording, which no prediction claims to know, are those that suit the whole of it.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use gmhm::{Gate, Kernel, Law};
use rayon::prelude::*;

use super::assembly::Assembly;
use super::base::{Play, Structure};
use super::columns::Rows;
use super::noise::Noise;
use super::polish::{polish, project};
use super::problem::{Problem, Sweep, Tangent};
use super::swarm::{SwarmOptions, minimise};
use super::triangle::Triangle;
use super::{EstimateError, Progress, bounded};

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
    pub(super) structure: Structure,
    #[serde(skip)]
    pub(super) nonlinear: Vec<f64>,
    #[serde(skip)]
    fold_errors: Vec<f64>,
}

/// Blocks that a recording is cut into.
pub const FOLDS: usize = 8;

/// Widest reversal play that is tried, in rated deflections.
const WIDEST_PLAY: f64 = 0.1;

/// All structures that the core has.
pub fn structures(rated_deflection_rad: f64) -> Vec<Structure> {
    let mut all = vec![
        Structure::MASING,
        Structure { play: Play::UpTo(WIDEST_PLAY * rated_deflection_rad), ..Structure::MASING },
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
    let particles = 8 + 4 * bounds.len();
    let options = SwarmOptions {
        particles,
        evaluations: (1 + 2 * bounds.len() * bounds.len()) * particles,
        seed,
        tolerance: 1e-9,
    };
    let objective = |x: &[f64]| if progress.cancelled() { f64::INFINITY } else { problem.solve(x, sweep).1.rss };
    let best = minimise(&bounds, &options, objective);
    let polished = polish(problem, &best.position, sweep, progress);
    (polished.nonlinear, best.evaluations + polished.evaluations)
}

/// Errors of a problem on blocks that took no part in its fit.
#[derive(Debug, Clone)]
pub struct Heldout {
    /// Root mean square of all blocks.
    pub rms: f64,
    /// Root mean square of the same rows where they take part.
    pub in_sample_rms: f64,
    /// Mean square of each block.
    blocks: Vec<f64>,
}

/// Left-out rows still count with this weight, so that what only they tell is taken from them, not from rounding.
const LEFT_OUT: f64 = 1e-2;

/// Held-out errors of a problem at the optimum of its nonlinear parameters, fitted against `noise` where given. The errors themselves are never filtered.
pub fn heldout(problem: &Problem<'_>, nonlinear: &[f64], noise: Option<&[Noise]>) -> Heldout {
    let sweep = Sweep { folds: FOLDS, ..Sweep::PLAIN };
    let infos = problem.nonlinear();
    // A parameter at the edge of its range stays there.
    let inside = |k: usize| {
        let margin = 1e-6 * (infos[k].high - infos[k].low);
        nonlinear[k] > infos[k].low + margin && nonlinear[k] < infos[k].high - margin
    };
    let smooth: Vec<usize> = (0..infos.len()).filter(|&k| infos[k].smooth && inside(k)).collect();
    let room: Vec<(f64, f64)> =
        smooth.iter().map(|&k| (infos[k].low - nonlinear[k], infos[k].high - nonlinear[k])).collect();
    let bounds = problem.bounds();
    let training = Sweep { noise, ..sweep };
    let (linear, at_bound, trained) = if smooth.is_empty() {
        let factors = problem.factor(nonlinear, None, training);
        let system = factors.combine(|_, _| true);
        let solution = bounded::solve(&system.shared, &bounds);
        (system.linear(&solution.coefficients), solution.at_bound, factors)
    } else {
        let (linear, solution) = problem.solve(nonlinear, Sweep { noise, ..Sweep::PLAIN });
        let tangent = Tangent { parameters: &smooth, linear: &linear };
        let factors = problem.factor(nonlinear, Some(tangent), training);
        (linear, solution.at_bound, factors)
    };
    let unfiltered = noise.map(|_| {
        let tangent = (!smooth.is_empty()).then_some(Tangent { parameters: &smooth, linear: &linear });
        problem.factor(nonlinear, tangent, sweep)
    });
    let factors = unfiltered.as_ref().unwrap_or(&trained);
    let whole = factors.combine(|_, _| true);
    let everything = trained.combine(|_, _| true).shared.scaled(LEFT_OUT);
    // The nuisances suit the unfiltered rows, in sample as held out.
    let linear = whole.linear(&linear.gear);
    let (mut sum, mut rows, mut in_sample) = (0.0, 0, 0.0);
    let mut blocks = Vec::new();
    let none = vec![0.0; smooth.len()];
    for recording in 0..factors.recordings() {
        for fold in 0..factors.folds() {
            let mut remaining = trained.combine(|r, f| (r, f) != (recording, fold)).shared;
            remaining.merge(&everything);
            let (gear, step) = without_block(&remaining, &bounds, &at_bound, &room);
            let shared: Vec<f64> = gear.iter().chain(&step).copied().collect();
            let (error, count) = factors.squared_error(recording, fold, &whole.linear(&shared), &step);
            if count > 0 {
                sum += error;
                rows += count;
                in_sample += factors.squared_error(recording, fold, &linear, &none).0;
                blocks.push(error / count as f64);
            }
        }
    }
    let count = rows.max(1) as f64;
    Heldout { rms: (sum / count).sqrt(), in_sample_rms: (in_sample / count).sqrt(), blocks }
}

/// The gear's linear parameters without a block, and how far the nonlinear ones move along their derivatives.
fn without_block(
    remaining: &Triangle,
    bounds: &[bounded::Bound],
    at_bound: &[bool],
    room: &[(f64, f64)],
) -> (Vec<f64>, Vec<f64>) {
    let derivatives = room.len();
    if derivatives == 0 {
        return (bounded::solve(remaining, bounds).coefficients, Vec::new());
    }
    let reduced = project(remaining, at_bound, derivatives);
    let all: Vec<usize> = (0..derivatives).collect();
    let mut step = bounded::solve_subset(&reduced, &all).coefficients;
    step.iter_mut().zip(room).for_each(|(step, (low, high))| *step = step.clamp(*low, *high));
    // The torque less what the step explains, on the gear's columns.
    let gear = bounds.len();
    let rest: Vec<Vec<f64>> = (0..remaining.columns())
        .map(|i| {
            let at = |j: usize| if j >= i { remaining.get(i, j) } else { 0.0 };
            let explained: f64 = (0..derivatives).map(|k| at(gear + k) * step[k]).sum();
            (0..gear).map(at).chain([at(gear + derivatives) - explained]).collect()
        })
        .collect();
    (bounded::solve(&bounded::factor_of_rows(&rest), bounds).coefficients, step)
}

/// Fits every structure and marks the one that predicts best; the simplest of those that cannot be told from the best.
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
    let rivals = (0..candidates.len()).filter(|&i| tied[i]);
    let chosen = rivals.min_by_key(|&i| (candidates[i].parameters, i)).unwrap_or(best);
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
    mean > (variance / count).sqrt().max(0.01 * best.heldout_rms.powi(2)) && candidate.heldout_rms > best.heldout_rms
}
