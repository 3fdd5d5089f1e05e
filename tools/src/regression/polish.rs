//! Levenberg–Marquardt with the linear parameters projected out: a [`Problem`] goes down by [`descent`](crate::numerics::levenberg_marquardt).
//!
//! The step is that of [variable projection](crate::regression::variable_projection) of models with terms; the two evaluate apart. Here a pass over the rows keeps triangular factors only, the
//! noise is given, and the linear parameters are at their bounded optimum. There the columns of all terms are in memory, and the noise is estimated anew before each step.
//!
//! Variable projection in Kaufman's form (Golub, Pereyra 1973; Kaufman 1975; O'Leary, Rust, *Variable projection for nonlinear least squares problems*, Comput.
//! Optim. Appl. 54, 2013): the step in the nonlinear parameters comes from the QR of \[columns, derivative columns, torque\], after the columns are eliminated. One
//! pass over the data an evaluation, one a derivative; linear parameters at their bound take no part in the projection.

use std::convert::Infallible;

use crate::numerics::bounded::Solution;
use crate::numerics::levenberg_marquardt::{Descend, Linearisation, Schedule, descend};
use crate::numerics::particle_swarm::Stop;
use crate::numerics::qr::Triangle;
use crate::progress::Progress;
use crate::regression::problem::{Linear, Problem, Sweep, Tangent};

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

/// A step that moves no parameter by more than this share of its range is none.
const STANDSTILL: f64 = 1e-13;

/// A step that gains less than this share of the squares is the last.
const SETTLED: f64 = 1e-12;

/// Polishes the smooth nonlinear parameters from a starting point.
pub fn polish(problem: &Problem<'_>, start: &[f64], sweep: Sweep<'_>, progress: &dyn Progress) -> Polished {
    let ranges: Vec<(f64, f64)> = problem.nonlinear().iter().map(|n| (n.low, n.high)).collect();
    let smooth: Vec<usize> = (0..ranges.len()).filter(|&k| problem.nonlinear()[k].smooth).collect();
    let mut projected = Projected { problem, sweep, ranges, smooth, evaluations: 0 };
    let from = projected.at(start.to_vec());
    if projected.smooth.is_empty() {
        return Polished { stop: Stop::Exact, evaluations: projected.evaluations, ..from };
    }
    let Ok((ended, stop)) = descend(&mut projected, from, Schedule::TO_THE_END, progress);
    Polished { stop, evaluations: projected.evaluations, ..ended }
}

/// A problem whose linear parameters are eliminated.
struct Projected<'p> {
    problem: &'p Problem<'p>,
    sweep: Sweep<'p>,
    ranges: Vec<(f64, f64)>,
    smooth: Vec<usize>,
    evaluations: usize,
}

impl Projected<'_> {
    fn at(&mut self, nonlinear: Vec<f64>) -> Polished {
        self.evaluations += 1;
        let (linear, Solution { at_bound, rss, .. }) = self.problem.solve(&nonlinear, self.sweep);
        Polished { nonlinear, linear, at_bound, rss, evaluations: 0, stop: Stop::Converged }
    }
}

impl Descend for Projected<'_> {
    type Point = Polished;
    type Error = Infallible;

    fn linearise(&mut self, at: &mut Polished) -> Result<Linearisation, Infallible> {
        self.evaluations += 2;
        let tangent = Tangent { parameters: &self.smooth, linear: &at.linear };
        let system = self.problem.factor(&at.nonlinear, Some(tangent), self.sweep).combine(|_, _| true);
        let gear = at.at_bound.len();
        Ok(Linearisation {
            reduced: project(&system.shared, &at.at_bound, self.smooth.len()),
            norms: system.norms[gear..].to_vec(),
            room: self
                .smooth
                .iter()
                .map(|&k| (self.ranges[k].0 - at.nonlinear[k], self.ranges[k].1 - at.nonlinear[k]))
                .collect(),
            cost: at.rss,
        })
    }

    fn moved(&mut self, at: &Polished, step: &[f64]) -> Option<(Polished, f64)> {
        let mut nonlinear = at.nonlinear.clone();
        for (&k, step) in self.smooth.iter().zip(step) {
            nonlinear[k] = (nonlinear[k] + step).clamp(self.ranges[k].0, self.ranges[k].1);
        }
        let share = |&k: &usize| (nonlinear[k] - at.nonlinear[k]).abs() / (self.ranges[k].1 - self.ranges[k].0);
        if self.smooth.iter().map(share).fold(0.0, f64::max) < STANDSTILL {
            return None;
        }
        let next = self.at(nonlinear);
        let rss = next.rss;
        Some((next, rss))
    }

    fn is_converged(&self, gain: f64, cost: f64) -> bool {
        gain <= SETTLED * cost
    }
}

/// The derivative columns and the torque with the free linear columns eliminated.
pub fn project(shared: &Triangle, at_bound: &[bool], derivatives: usize) -> Triangle {
    let gear = at_bound.len();
    let mut columns: Vec<usize> = (0..gear).filter(|&j| !at_bound[j] && shared.norm(j) > 0.0).collect();
    let eliminated = columns.len();
    columns.extend(gear..=gear + derivatives);
    shared.select(&columns).tail(eliminated)
}
