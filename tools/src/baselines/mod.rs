//! Foreign models of hysteresis, as baselines: the same recordings, estimator and held-out blocks as the gear's own model.
//!
//! One file a model. Each is its textbook equation with the linear parameters eliminated and the others searched, so that no model loses by a
//! bad search; models of hysteresis stand beside the gear's own elastic polynomial, so that none loses by its spring. All start with an empty
//! memory, as the gear's model does.

mod bouc_wen;
mod closed_form;
mod cost;
mod dahl;
mod lines;
mod maxwell_slip;
mod polynomial;

pub use lines::{spring, two as two_lines};

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use gmhm::Law;
use rayon::prelude::*;

use crate::fit::FitOptions;
use crate::fit::prepare;
use crate::fit::prepare::Prepared;
use crate::fit::select;
use crate::fit::select::search;
use crate::model::GearSection;
use crate::numerics::bounded;
use crate::numerics::bounded::Bound;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::regression::assembly::Assembly;
use crate::regression::base;
use crate::regression::columns::{Column, Columns, Contribution, Evaluate, Mark, Nonlinear, Offset, Rows, Stretch};
use crate::regression::error::EstimateError;
use crate::regression::heldout::heldout;
use crate::regression::polish::polish;
use crate::regression::problem::{Problem, Sweep};

/// A model whose columns follow from the deflection path alone.
pub struct Baseline {
    /// Its name for people.
    pub name: String,
    columns: Vec<Column>,
    nonlinear: Vec<Nonlinear>,
    start: Start,
}

/// One sample: the deflection in, the columns out.
type Step = Box<dyn FnMut(f64, &mut [f64])>;
/// From nonlinear parameters to a model at rest.
type Start = Box<dyn Fn(&[f64]) -> Step + Sync>;

impl Baseline {
    fn new(
        name: impl Into<String>,
        columns: &[(&'static str, Bound)],
        start: impl Fn(&[f64]) -> Step + Sync + 'static,
    ) -> Self {
        let columns = columns.iter().map(|(name, bound)| Column::of_gear(name, "", *bound)).collect();
        Self { name: name.into(), columns, nonlinear: Vec::new(), start: Box::new(start) }
    }

    fn searching(mut self, name: &'static str, low: f64, high: f64) -> Self {
        self.nonlinear.push(Nonlinear { name: name.into(), unit: "".into(), low, high, smooth: true });
        self
    }

    /// Parameters of the model, the offset of each recording not among them.
    pub fn parameters(&self) -> usize {
        self.columns.len() + self.nonlinear.len()
    }
}

struct Running(Step);

impl Contribution for Baseline {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn nonlinear(&self) -> &[Nonlinear] {
        &self.nonlinear
    }

    fn start<'a>(&'a self, nonlinear: &[f64], _: &'a Rows<'a>, _: usize) -> Box<dyn Evaluate + 'a> {
        Box::new(Running((self.start)(nonlinear)))
    }
}

impl Evaluate for Running {
    fn fill(&mut self, stretch: &Stretch<'_>, columns: &mut Columns<'_>) {
        let mut values = vec![0.0; columns.count()];
        for (row, &theta) in stretch.deflection_rad.iter().enumerate() {
            (self.0)(theta, &mut values);
            columns.set(row, &values);
        }
    }
}

/// The direction of a path: the sign of its last change.
#[derive(Default)]
struct Direction {
    last: Option<f64>,
    sign: f64,
}

impl Direction {
    /// The change since the last sample.
    fn step(&mut self, theta: f64) -> f64 {
        let change = theta - self.last.unwrap_or(theta);
        self.last = Some(theta);
        if change != 0.0 {
            self.sign = change.signum();
        }
        change
    }
}

/// Columns of the elastic torque f(θ).
const ELASTIC: [(&str, Bound); 3] = [("c1", Bound::Free), ("c2", Bound::Free), ("c3", Bound::Free)];

/// Fills them.
fn elastic(theta: f64, out: &mut [f64]) {
    out[..3].copy_from_slice(&gmhm::elastic::basis(theta));
}

/// The torque of a baseline fitted to a recording, row by row, the offset included.
///
/// # Errors
/// As [`fit`](crate::fit::fit).
pub fn fitted(baseline: &Baseline, recording: &Recording, seed: u64) -> Result<Vec<f64>, EstimateError> {
    let rows = prepare::rows(std::slice::from_ref(recording), &GearSection::default())?;
    let problem = Problem { rows: &rows, corrections: Vec::new(), contributions: vec![&Offset, baseline] };
    let found = polish(&problem, &search(&problem, seed, &()).0, Sweep::PLAIN, &());
    let residual = problem.residuals(&found.nonlinear, &found.linear).swap_remove(0);
    Ok(rows[0].torque.iter().zip(residual).map(|(torque, left)| torque - left).collect())
}

/// All baselines for a rated deflection.
pub fn all(rated_deflection_rad: f64) -> Vec<Baseline> {
    let a = rated_deflection_rad;
    let mut baselines =
        vec![spring(), lines::two(), lines::four(), polynomial::with_coulomb(), closed_form::closed_form(a)];
    baselines.extend([dahl::dahl(a), bouc_wen::one_step(a), bouc_wen::bouc_wen(a)]);
    baselines.extend([2, 4, 8, 10, 16].map(|count| maxwell_slip::maxwell_slip(a, count)));
    baselines
}

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

/// The name of two lines fitted by least squares, the paper's baseline.
pub const TWO_LINES: &str = "two lines";

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
    let chosen = table.iter().find(|c| c.chosen).map_or(base::Structure::MASING, |c| c.structure);
    let assembly = Assembly::new(chosen, *rated_deflection_rad, rows, &start.known)?;
    let baselines = all(*rated_deflection_rad);
    let of_gear = |parameters: usize| if chosen.law == Law::Masing { parameters } else { parameters + 1 };
    let gear = assembly.problem(rows);
    let mut lines = vec![line(format!("GMHM {}", select::name(&chosen)), of_gear(5), &gear, options.seed, progress)];
    let done = AtomicUsize::new(0);
    let baselines = baselines.par_iter().map(|baseline| {
        let problem = Problem { rows, corrections: Vec::new(), contributions: vec![&Offset, baseline] };
        let line = line(baseline.name.clone(), baseline.parameters(), &problem, options.seed, progress);
        progress.report("comparing", (1 + done.fetch_add(1, Relaxed)) as f64 / baselines.len() as f64);
        line
    });
    lines.par_extend(baselines);
    if progress.cancelled() {
        return Err(EstimateError::Cancelled);
    }
    Ok(lines)
}

fn line(model: String, parameters: usize, problem: &Problem<'_>, seed: u64, progress: &dyn Progress) -> Comparison {
    let (found, _) = search(problem, seed, progress);
    let nonlinear = polish(problem, &found, Sweep::PLAIN, progress).nonlinear;
    let system = problem.factor(&nonlinear, None, Sweep::PLAIN).combine(|_, _| true);
    let rss = bounded::solve(&system.shared, &problem.bounds()).rss;
    let rms = (rss / system.rows.max(1) as f64).sqrt();
    let heldout_rms = heldout(problem, &nonlinear, None).rms;
    let unseen_recording_rms = (problem.rows.len() > 1).then(|| unseen(problem, &nonlinear));
    let instructions = cost::instructions(&model);
    Comparison { model, parameters, instructions, rss, rms, heldout_rms, unseen_recording_rms }
}

/// Each recording held out whole in turn; the nonlinear parameters are polished without it.
fn unseen(problem: &Problem<'_>, nonlinear: &[f64]) -> f64 {
    let (mut sum, mut rows) = (0.0, 0);
    for held in 0..problem.rows.len() {
        let mut others = problem.rows.to_vec();
        others[held].marks.fill(Mark::Skipped);
        let without = Problem {
            rows: &others,
            corrections: problem.corrections.clone(),
            contributions: problem.contributions.clone(),
        };
        let nonlinear = polish(&without, nonlinear, Sweep::PLAIN, &()).nonlinear;
        let factors = problem.factor(&nonlinear, None, Sweep::PLAIN);
        let gear = bounded::solve(&factors.combine(|r, _| r != held).shared, &problem.bounds()).coefficients;
        let alone = factors.combine(|r, _| r == held);
        let x: Vec<f64> = gear.iter().copied().chain([-1.0]).collect();
        sum += alone.shared.squared_norm_of_product(&x);
        rows += alone.rows;
    }
    (sum / rows.max(1) as f64).sqrt()
}
