//! Prediction of blocks that took no part in the fit.
//!
//! Each recording is cut into contiguous blocks. One pass gives a factor a block; leaving blocks out, refitting and predicting them costs no further
//! pass, because factors add up. Nonlinear parameters are refitted along their derivatives at the optimum of all rows. The memory always runs through all
//! rows: deflection is an input, only torque is held out. A block is one of one recording, and of a [`Problem`]'s factors, in bounded memory; of a model
//! with terms `heldout_rows` leaves out the same block of all recordings together, row by row, against coloured noise. The nuisances of a recording, which no prediction claims to know, are those that suit the whole of it.

use crate::numerics::autoregression::Noise;
use crate::numerics::bounded;
use crate::numerics::qr::Triangle;
use crate::regression::factors::{Factors, Shared};
use crate::regression::polish::project;
use crate::regression::problem::{Problem, Sweep, Tangent};

/// Blocks that a recording is cut into.
pub const FOLDS: usize = 8;

/// Errors of a problem on blocks that took no part in its fit.
#[derive(Debug, Clone)]
pub struct Heldout {
    /// Root mean square of all blocks.
    pub rms: f64,
    /// Root mean square of the same rows where they take part.
    pub in_sample_rms: f64,
    /// Mean square of each block.
    pub(crate) blocks: Vec<f64>,
}

/// Left-out rows still count with this weight, so that what only they tell is taken from them, not from rounding.
const LEFT_OUT: f64 = 1e-2;

/// Factors of blocks, some of which may be left out.
pub struct Blocks<'f> {
    factors: &'f Factors,
    held: Triangle,
    /// For each recording, what all others say.
    others: Vec<Shared>,
}

impl<'f> Blocks<'f> {
    /// The blocks of a pass.
    pub fn of(factors: &'f Factors) -> Self {
        let parts: Vec<Shared> = (0..factors.recordings()).map(|index| factors.shared(index, |_| true)).collect();
        let held = factors.combine(|_, _| true).shared.scaled(LEFT_OUT);
        let mut others = Vec::with_capacity(parts.len());
        Shared::each_beside_others(&parts, |index, beside| {
            others.push(beside.clone());
            parts[index].clone()
        });
        Self { factors, held, others }
    }

    /// The factor of the gear's columns without one block of one recording. Costs no more with many recordings than with few.
    pub fn without_one(&self, recording: usize, block: usize) -> Triangle {
        let own = self.factors.shared(recording, |fold| fold != block);
        let mut remaining = self.others[recording].with(&own).factor().0;
        remaining.merge(&self.held);
        remaining
    }

    /// The factor of the gear's columns without some of the blocks (recording, block).
    pub fn without(&self, left_out: impl Fn(usize, usize) -> bool) -> Triangle {
        let mut remaining = self.factors.combine(|recording, fold| !left_out(recording, fold)).shared;
        remaining.merge(&self.held);
        remaining
    }
}

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
    let rest = Blocks::of(&trained);
    // The nuisances suit the unfiltered rows, in sample as held out.
    let linear = whole.linear(&linear.gear);
    let (mut sum, mut rows, mut in_sample) = (0.0, 0, 0.0);
    let mut blocks = Vec::new();
    let none = vec![0.0; smooth.len()];
    for recording in 0..factors.recordings() {
        for fold in 0..factors.folds() {
            let remaining = rest.without_one(recording, fold);
            let (gear, step) = without_block(&remaining, &bounds, &at_bound, &room);
            let shared: Vec<f64> = gear.iter().chain(&step).copied().collect();
            let nuisances = whole.nuisances_of(recording, &shared);
            let (error, count) = factors.squared_error(recording, fold, &nuisances, &gear, &step);
            if count > 0 {
                sum += error;
                rows += count;
                in_sample +=
                    factors.squared_error(recording, fold, &linear.recordings[recording], &linear.gear, &none).0;
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
