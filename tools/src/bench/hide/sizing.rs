//! How large an effect must be to leave a given rms after the base model is refitted.

use std::borrow::Cow;

use super::{Hidden, Hide, HideError};
use crate::bench::error::BenchError;
use crate::bench::stage::Stage;
use crate::fit::select;
use crate::kinds::draft::Draft;
use crate::model::{Model, Term, TermValue};
use crate::numerics::mark::Mark;
use crate::recording::Recording;
use crate::regression::assembly::Assembly;
use crate::regression::base::Structure;
use crate::regression::columns::Column;
use crate::regression::polish::polish;
use crate::regression::problem::Sweep;
use crate::regression::ready::Ready;
use crate::regression::rows::{Past, Rows};

/// The size is met within this share.
const TOLERANCE: f64 = 1e-3;
/// Trials before the size counts as out of reach.
const MOST_TRIALS: usize = 40;
/// An effect of which less than this share is left is invisible: made visible, it would be a hundred times as large as what is seen of it.
const INVISIBLE: f64 = 0.01;
/// Gauss–Newton steps of the encoders' zero.
const ZERO_STEPS: usize = 4;

/// Scales the effect of a draft in a gear.
///
/// Before each trial, `tried` is called with the number of trials done.
pub(super) fn size(
    model: &Model,
    draft: &Draft,
    hide: &Hide,
    stage: &Stage,
    tried: &dyn Fn(usize),
) -> Result<(Term, Hidden), BenchError> {
    let invisible = || HideError::Invisible(hide.kind.clone());
    let refit = Refit::new(model, stage)?;
    let mut factor = hide.size_nm;
    let mut largest_nm = 0.0_f64;
    for trial in 1..=MOST_TRIALS {
        tried(trial - 1);
        let term = draft.term(factor);
        if !is_finite(term.values.values()) {
            return Err(invisible().into());
        }
        let mut with = model.clone();
        with.terms.push(term.clone());
        let (before_nm, left_nm) = match stage.record(&with).and_then(|recording| refit.sizes(&recording)) {
            Ok(sizes) => sizes,
            // A factor that the gear does not bear.
            Err(_) if largest_nm > 0.0 => break,
            Err(_) if trial < MOST_TRIALS => {
                factor *= 0.1;
                continue;
            }
            Err(error) => return Err(error),
        };
        if left_nm <= INVISIBLE * before_nm || before_nm <= 1e-9 * hide.size_nm {
            return Err(invisible().into());
        }
        if (left_nm / hide.size_nm - 1.0).abs() <= TOLERANCE {
            return Ok((term, Hidden { kind: hide.kind.clone(), size_nm: left_nm, before_nm }));
        }
        largest_nm = largest_nm.max(left_nm);
        factor *= (hide.size_nm / left_nm).clamp(0.05, 20.0);
    }
    Err(HideError::TooLarge { kind: hide.kind.clone(), size_nm: hide.size_nm, largest_nm }.into())
}

fn is_finite<'a>(mut values: impl Iterator<Item = &'a TermValue>) -> bool {
    values.all(|value| match value {
        TermValue::Number(x) => x.is_finite(),
        TermValue::List(list) => list.iter().all(|x| x.is_finite()),
        TermValue::Text(_) => true,
    })
}

/// The base model, to be refitted to one recording after the other.
struct Refit {
    base: Model,
    structure: Structure,
    rated_deflection_rad: f64,
    /// Nonlinear parameters of the true gear.
    nonlinear: Vec<f64>,
    /// Torque of the effects that are not counted, N·m.
    others_nm: Vec<f64>,
}

impl Refit {
    fn new(model: &Model, stage: &Stage) -> Result<Self, BenchError> {
        let base = Model { terms: Vec::new(), ..model.clone() };
        let memory = model.memory.ok_or(BenchError::NoGear)?;
        let without = stage.record(model)?;
        let base_nm = base_torque(&base, &without)?;
        let others_nm = difference(torque(&without), &base_nm);
        let mut refit = Self {
            base,
            structure: Structure::of(&memory),
            rated_deflection_rad: stage.params.rated_deflection_rad(),
            nonlinear: Vec::new(),
            others_nm,
        };
        let rows = refit.rows(&without, base_nm, 0.0);
        let assembly = refit.assembly(&rows)?;
        let problem = assembly.problem(&rows);
        if !problem.nonlinear().is_empty() {
            let (start, _) = select::search(&problem, 1, &());
            refit.nonlinear = polish(&problem, &start, Sweep::PLAIN, &()).nonlinear;
        }
        Ok(refit)
    }

    /// Rms of the effect in a recording, and of what the refitted base model leaves of it, N·m.
    fn sizes(&self, recording: &Recording) -> Result<(f64, f64), BenchError> {
        let target = difference(torque(recording), &self.others_nm);
        let before_nm = rms(&difference(&target, &base_torque(&self.base, recording)?));
        let mut zero_rad = 0.0;
        let mut rss = 0.0;
        for _ in 0..ZERO_STEPS {
            let rows = self.rows(recording, target.clone(), zero_rad);
            let column = self.zero_column(recording, zero_rad)?;
            let shift = Ready::new(vec![Column::of_recording("deflection_zero_rad", "rad")], vec![vec![&column]]);
            let assembly = self.assembly(&rows)?;
            let mut problem = assembly.problem(&rows);
            problem.contributions.push(&shift);
            let refitted = polish(&problem, &self.nonlinear, Sweep::PLAIN, &());
            rss = refitted.rss;
            // The shift was put last.
            zero_rad += refitted.linear.recordings[0].last().copied().unwrap_or(0.0);
        }
        Ok((before_nm, (rss / recording.len() as f64).sqrt()))
    }

    /// What the torque changes by a radian of the encoders' zero, N·m/rad: a difference over a thousandth of A, for the gate is steep at the tips.
    fn zero_column(&self, recording: &Recording, zero_rad: f64) -> Result<Vec<f64>, BenchError> {
        let step = 1e-3 * self.rated_deflection_rad;
        let shifted = |by: f64| {
            let mut base = self.base.clone();
            base.gear.deflection_zero_rad += zero_rad + by;
            base_torque(&base, recording)
        };
        let change = difference(&shifted(step)?, &shifted(-step)?);
        Ok(change.iter().map(|x| x / (2.0 * step)).collect())
    }

    fn assembly(&self, rows: &[Rows<'_>]) -> Result<Assembly, BenchError> {
        Ok(Assembly::new(self.structure, self.rated_deflection_rad, rows, &[true])?)
    }

    fn rows<'a>(&self, recording: &'a Recording, torque: Vec<f64>, zero_rad: f64) -> [Rows<'a>; 1] {
        let zero_rad = self.base.gear.deflection_zero_rad + zero_rad;
        let deflection = recording.deflection_rad.as_deref().unwrap_or_default();
        [Rows {
            recording,
            deflection_rad: Cow::Owned(deflection.iter().map(|theta| theta - zero_rad).collect()),
            torque: Cow::Owned(torque),
            marks: vec![Mark::Used; recording.len()],
            past: Past::default(),
            counts: None,
        }]
    }
}

/// What the base model predicts for the recorded deflection, N·m.
fn base_torque(base: &Model, recording: &Recording) -> Result<Vec<f64>, BenchError> {
    Ok(crate::physics::predict(base, None, recording)?.torque)
}

fn torque(recording: &Recording) -> &[f64] {
    recording.torque.as_deref().unwrap_or_default()
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}
