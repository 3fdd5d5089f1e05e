//! The base model of a joint log, which knows an angle and a torque (or current) and no deflection: gravity, inertia, Coulomb and viscous friction.
//!
//! All terms are the core's own, evaluated by [`crate::physics`]; they are linear but for the velocity over which Coulomb friction is smoothed.

use std::collections::BTreeMap;

use gmhm::terms::{KINDS, KeyInfo, KindInfo, Role};

use crate::fit::options::{FitOptions, Method};
use crate::fit::refine::Weighted;
use crate::fit::{Fit, left, refine, select};
use crate::kinds::JOINT_BASE as BASE;
use crate::model::{GearSection, Model, Term, TermValue};
use crate::numerics::autoregression;
use crate::numerics::bounded::Bound;
use crate::numerics::particle_swarm::Stop;
use crate::physics::{Evaluation, PredictError};
use crate::progress::Progress;
use crate::recording::Recording;
use crate::regression::columns::{Column, Columns, Contribution, Evaluate, Nonlinear, Offset, Stretch};
use crate::regression::error::EstimateError;
use crate::regression::heldout::heldout;
use crate::regression::note::Remedy;
use crate::regression::polish::polish;
use crate::regression::problem::{Problem, Sweep};
use crate::regression::rows;
use crate::regression::rows::Rows;
use crate::regression::uncertainty;
use crate::signal::recorded;

const COULOMB: &str = BASE[2];
const SMOOTHING: &str = "smoothing_rad_per_s";

/// Fits the base terms to joint logs.
///
/// # Errors
/// When a recording lacks what is needed, or `progress` cancels.
pub fn fit(recordings: &[Recording], options: &FitOptions, progress: &dyn Progress) -> Result<Fit, EstimateError> {
    let first = &recordings[0];
    let given = options.start.as_ref();
    let gear = options.gear(first.torque_unit);
    if let Some(other) = given.and_then(|m| m.terms.iter().find(|t| !BASE.contains(&t.kind.as_str()))) {
        return Err(EstimateError::HasTerms { kind: other.kind.clone() });
    }
    let mut rows = rows::of_joint_logs(recordings)?;
    let size = rows::torque_size(&rows);
    if size <= 0.0 {
        return Err(EstimateError::NoTorqueChange { recording: first.name.clone() });
    }
    let base = Base::new(recordings, &gear)?;
    let contributions = || -> Vec<&dyn Contribution> { vec![&Offset, &base] };
    let (mut from, evaluations) = select::search(
        &Problem { rows: &rows, corrections: Vec::new(), contributions: contributions() },
        options.seed,
        progress,
    );
    for _ in 0..2 {
        let problem = Problem { rows: &rows, corrections: Vec::new(), contributions: contributions() };
        let plain = polish(&problem, &from, Sweep::PLAIN, progress);
        let residuals = problem.residuals(&plain.nonlinear, &plain.linear);
        from = plain.nonlinear;
        let found: usize =
            rows.iter_mut().zip(&residuals).map(|(r, left)| autoregression::mark_outliers(left, &mut r.marks)).sum();
        if found == 0 {
            break;
        }
    }
    let problem = Problem { rows: &rows, corrections: Vec::new(), contributions: contributions() };
    let plain = polish(&problem, &from, Sweep::PLAIN, progress);
    let heldout_rms = heldout(&problem, &plain.nonlinear, None).rms;
    let Weighted { polished: result, noise, prewhitened, heldout_rms } =
        refine::against_noise(&problem, plain, heldout_rms, progress)?;
    if progress.cancelled() || result.stop == Stop::Cancelled {
        return Err(EstimateError::Cancelled);
    }
    let weights = prewhitened.then_some(&noise[..]);
    let mut uncertainty =
        uncertainty::of_columns(&problem, &result.nonlinear, &result.linear, weights, Remedy::JointMotion);
    uncertainty.per(first.torque_unit);
    let (residuals, rss, counted) = left(&problem, &result);
    let name = given.map(|m| m.name.clone()).filter(|n| !n.is_empty()).unwrap_or_else(|| first.name.clone());
    let terms = base.terms(&result.linear.gear, &result.nonlinear);
    Ok(Fit {
        model: Model { name, gear, torque_unit: first.torque_unit, elastic: None, memory: None, terms },
        method: Method::Auto,
        seed: options.seed,
        unit: first.torque_unit.suffix(),
        uncertainty,
        rated_is_largest_seen: false,
        started_from_model: options.start.is_some(),
        selection: Vec::new(),
        selection_rows: 0,
        rms: (rss / counted.max(1) as f64).sqrt(),
        rss,
        residuals,
        heldout_rms,
        rows: counted,
        offsets: result.linear.recordings.iter().map(|l| l[0]).collect(),
        deflection_zeros: Vec::new(),
        known_start: vec![true; recordings.len()],
        unsettled_rows: vec![0; recordings.len()],
        noise,
        prewhitened,
        held_invertible: false,
        stop: result.stop,
        evaluations: evaluations + result.evaluations,
    })
}

/// The base terms as one contribution.
struct Base<'a> {
    columns: Vec<Column>,
    nonlinear: Vec<Nonlinear>,
    /// Each recording without terms, and the columns that no nonlinear parameter changes.
    recordings: Vec<(Evaluation<'a>, Vec<Vec<f64>>)>,
}

/// A term of a kind with all its linear numbers 0.
fn empty(kind: &str, smoothing: f64) -> Term {
    let mut values: BTreeMap<String, TermValue> =
        linear(kind).map(|key| (key.name.to_owned(), TermValue::Number(0.0))).collect();
    if kind == COULOMB {
        values.insert(SMOOTHING.to_owned(), TermValue::Number(smoothing));
    }
    Term { kind: kind.to_owned(), values }
}

fn info(kind: &str) -> Option<&'static KindInfo> {
    KINDS.iter().find(|info| info.name == kind)
}

/// The linear keys of a kind.
fn linear(kind: &str) -> impl Iterator<Item = &'static KeyInfo> {
    info(kind).map_or(&[][..], |info| info.keys).iter().filter(|key| key.role == Role::Linear)
}

/// The column of a key. Friction opposes and inertia resists.
fn column(kind: &str, key: &KeyInfo) -> Column {
    let bound = if key.plausible.0 >= 0.0 { Bound::NonNegative } else { Bound::Free };
    Column { name: format!("{kind}.{}", key.name).into(), ..Column::of_gear("", key.unit, bound) }
}

impl<'a> Base<'a> {
    fn new(recordings: &'a [Recording], gear: &GearSection) -> Result<Self, EstimateError> {
        let told = |error: PredictError| EstimateError::Joint { why: error.to_string() };
        let columns = BASE.iter().flat_map(|kind| linear(kind).map(|key| column(kind, key)));
        // A model has to hold something: a load of nothing.
        let bare = Model { gear: gear.clone(), terms: vec![empty(BASE[0], 0.0)], ..Model::default() };
        let mut fastest = 0.0_f64;
        let mut ready = Vec::new();
        for recording in recordings {
            let evaluation =
                Evaluation::along(&bare, None, recording, recorded::signals(recording, gear)).map_err(told)?;
            let mut fixed = Vec::new();
            for kind in BASE {
                let units = evaluation.columns(&empty(kind, 0.0)).map_err(told)?;
                fixed.extend(units.into_iter().map(|unit| unit.values));
            }
            let velocity = evaluation.context().signals.velocity_rad_per_s.as_deref().unwrap_or_default();
            fastest = velocity.iter().fold(fastest, |most, v| most.max(v.abs()));
            ready.push((evaluation, fixed));
        }
        if fastest == 0.0 {
            return Err(EstimateError::NoMovement { recording: recordings[0].name.clone() });
        }
        // Beyond the fastest movement, smoothed Coulomb friction is viscous.
        let smoothing = Nonlinear {
            name: format!("{COULOMB}.{SMOOTHING}").into(),
            unit: "rad/s".into(),
            low: 1e-3 * fastest,
            high: fastest,
            smooth: true,
        };
        Ok(Self { columns: columns.collect(), nonlinear: vec![smoothing], recordings: ready })
    }

    /// The terms of a model file.
    fn terms(&self, coefficients: &[f64], nonlinear: &[f64]) -> Vec<Term> {
        let mut values = coefficients.iter();
        BASE.iter()
            .map(|kind| {
                let mut term = empty(kind, nonlinear[0]);
                for (key, value) in linear(kind).zip(&mut values) {
                    term.values.insert(key.name.to_owned(), TermValue::Number(*value));
                }
                term
            })
            .collect()
    }
}

impl Contribution for Base<'_> {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn nonlinear(&self) -> &[Nonlinear] {
        &self.nonlinear
    }

    fn start<'s>(&'s self, nonlinear: &[f64], _: &'s Rows<'s>, index: usize) -> Box<dyn Evaluate + 's> {
        let (evaluation, fixed) = &self.recordings[index];
        // The same columns were evaluated before: only the smoothing differs.
        let coulomb = evaluation.columns(&empty(COULOMB, nonlinear[0])).unwrap_or_default();
        let at = BASE.iter().take_while(|kind| **kind != COULOMB).map(|kind| linear(kind).count()).sum();
        Box::new(Filled { fixed, at, coulomb: coulomb.into_iter().next().map(|unit| unit.values).unwrap_or_default() })
    }
}

/// Columns that stand ready.
struct Filled<'s> {
    fixed: &'s [Vec<f64>],
    at: usize,
    coulomb: Vec<f64>,
}

impl Evaluate for Filled<'_> {
    fn fill(&mut self, stretch: &Stretch<'_>, columns: &mut Columns<'_>) {
        for (j, fixed) in self.fixed.iter().enumerate() {
            let from = if j == self.at && !self.coulomb.is_empty() { &self.coulomb } else { fixed };
            columns.column(j)[..stretch.range.len()].copy_from_slice(&from[stretch.range.clone()]);
        }
    }
}
