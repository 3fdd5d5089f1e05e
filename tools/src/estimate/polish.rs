//! Levenberg–Marquardt with the linear parameters projected out.
//!
//! Variable projection in Kaufman's form (Golub, Pereyra 1973; Kaufman 1975; O'Leary, Rust, *Variable projection for nonlinear least squares problems*, Comput.
//! Optim. Appl. 54, 2013): the step in the nonlinear parameters comes from the QR of \[columns, derivative columns, torque\], after the columns are eliminated. One
//! pass over the data an evaluation, one a derivative; linear parameters at their bound take no part in the projection.

use super::problem::{Linear, Problem, Sweep, Tangent};
use super::swarm::Stop;
use super::triangle::Triangle;
use super::{Progress, bounded};

/// Where the polish ended.
#[derive(Debug, Clone)]
pub struct Polished {
    /// Nonlinear parameters.
    pub nonlinear: Vec<f64>,
    /// Linear parameters.
    pub linear: Linear,
    /// Linear parameters of the gear held at their bound.
    pub at_bound: Vec<bool>,
    /// Residual sum of squares, filtered.
    pub rss: f64,
    /// Passes over the data.
    pub evaluations: usize,
    /// Why it ended.
    pub stop: Stop,
}

const MOST_STEPS: usize = 30;

/// Polishes the smooth nonlinear parameters from a starting point.
pub fn polish(problem: &Problem<'_>, start: &[f64], sweep: Sweep<'_>, progress: &dyn Progress) -> Polished {
    let (linear, solution) = problem.solve(start, sweep);
    let mut at = Polished {
        nonlinear: start.to_vec(),
        linear,
        at_bound: solution.at_bound,
        rss: solution.rss,
        evaluations: 1,
        stop: Stop::Converged,
    };
    let ranges: Vec<(f64, f64, bool)> = problem.nonlinear().iter().map(|n| (n.low, n.high, n.smooth)).collect();
    let smooth: Vec<usize> = (0..ranges.len()).filter(|&k| ranges[k].2).collect();
    if smooth.is_empty() {
        at.stop = Stop::Exact;
        return at;
    }
    let mut damping = 1e-4;
    for _ in 0..MOST_STEPS {
        if progress.cancelled() {
            at.stop = Stop::Cancelled;
            return at;
        }
        let tangent = Tangent { parameters: &smooth, linear: &at.linear };
        let system = problem.factor(&at.nonlinear, Some(tangent), sweep).combine(|_, _| true);
        at.evaluations += 2;
        let reduced = project(&system.shared, &at.at_bound, smooth.len());
        loop {
            let step = damped_step(&reduced, damping);
            let mut trial = at.nonlinear.clone();
            for (&k, step) in smooth.iter().zip(&step) {
                trial[k] = (trial[k] + step).clamp(ranges[k].0, ranges[k].1);
            }
            let moved = smooth.iter().map(|&k| (trial[k] - at.nonlinear[k]).abs() / (ranges[k].1 - ranges[k].0));
            let moved = moved.fold(0.0, f64::max);
            if moved < 1e-13 {
                return at;
            }
            let (linear, solution) = problem.solve(&trial, sweep);
            at.evaluations += 1;
            if solution.rss < at.rss {
                let gain = at.rss - solution.rss;
                let done = gain <= 1e-12 * at.rss;
                at = Polished { nonlinear: trial, linear, at_bound: solution.at_bound, rss: solution.rss, ..at };
                damping = (damping * 0.1).max(1e-12);
                if done {
                    return at;
                }
                break;
            }
            damping *= 10.0;
            if damping > 1e8 {
                return at;
            }
        }
    }
    at.stop = Stop::Evaluations;
    at
}

/// The derivative columns and the torque with the free linear columns eliminated.
pub fn project(shared: &Triangle, at_bound: &[bool], derivatives: usize) -> Triangle {
    let gear = at_bound.len();
    let mut columns: Vec<usize> = (0..gear).filter(|&j| !at_bound[j] && shared.norm(j) > 0.0).collect();
    let eliminated = columns.len();
    columns.extend(gear..=gear + derivatives);
    shared.select(&columns).tail(eliminated)
}

fn damped_step(reduced: &Triangle, damping: f64) -> Vec<f64> {
    let count = reduced.columns() - 1;
    let mut rows: Vec<Vec<f64>> =
        (0..=count).map(|i| (0..=count).map(|j| if j >= i { reduced.get(i, j) } else { 0.0 }).collect()).collect();
    for j in 0..count {
        let mut row = vec![0.0; count + 1];
        row[j] = damping.sqrt() * reduced.norm(j);
        rows.push(row);
    }
    let all: Vec<usize> = (0..count).collect();
    bounded::solve_subset(&bounded::factor_of_rows(&rows), &all).coefficients
}
