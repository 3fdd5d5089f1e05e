//! Models with terms, and joint logs, whose base model is made of terms: gear and terms refitted together.
//!
//! Kinds, shapes and the law stay as given; every number is refitted. The zero of the deflection is refitted where that clearly explains more. A joint log knows an angle and a
//! torque (or current) and no deflection: its base model is gravity, inertia, Coulomb and viscous friction. It is fitted along the motion freed of its noise, without the rows near standstill that show only this noise; the
//! errors stated are those along the motion as recorded.

use std::borrow::Cow;

use gmhm::terms::{Role, kind};

use crate::fit::options::FitOptions;
use crate::fit::thresholds::THRESHOLDS;
use crate::fit::{DeflectionZero, Fit, finished, refine, select};
use crate::kinds::{JOINT_BASE, SMOOTHING, UNKNOWN};
use crate::model::{Model, Term, TermValue};
use crate::numerics::autoregression;
use crate::numerics::extremes::largest;
use crate::physics::{PredictError, Signals};
use crate::progress::Progress;
use crate::recording::Recording;
use crate::regression::columns::{Column, Contribution, Offset};
use crate::regression::dataset;
use crate::regression::deflection_zeros::DEFLECTION_ZERO;
use crate::regression::disturbed_rows::{self, MotionNoise};
use crate::regression::error::EstimateError;
use crate::regression::heldout::heldout;
use crate::regression::model_part::ModelPart;
use crate::regression::note::Remedy;
use crate::regression::parameters::{self, FreeParameter};
use crate::regression::polish::polish;
use crate::regression::problem::{Problem, Sweep};
use crate::regression::ready::Ready;
use crate::regression::rows::{self, Rows};
use crate::regression::uncertainty;
use crate::signal::denoise::denoised;
use crate::signal::recorded;

/// Rows of a gear that are fitted at most. Of longer recordings means of rows are taken, of the motion as of the torque.
const MOST_ROWS: usize = 250_000;

/// Fits and searches for outliers in turn, at most so often.
const ROUNDS: usize = 2;

/// Where the search for the smoothing of a joint's Coulomb friction begins, over the largest velocity.
const FIRST_SMOOTHING: f64 = 0.03;

/// Refits the model to start from; of joint logs whose model has no other terms, the base model.
///
/// # Errors
/// Recordings that cannot be taken together, a model that cannot be evaluated on them, or `progress` cancelling.
pub fn fit(recordings: &[Recording], options: &FitOptions, progress: &dyn Progress) -> Result<Fit, EstimateError> {
    let given = options.start.as_ref().filter(|model| !is_joint_base(model));
    let total: usize = recordings.iter().map(Recording::len).sum();
    let means = if given.is_some_and(Model::has_gear) { total.div_ceil(MOST_ROWS) } else { 1 };
    let of_simulation = given.is_some_and(Model::is_simulation);
    let own = |recording: &Recording| {
        let mut recording = if means > 1 { recording.in_means(means) } else { recording.clone() };
        // Only a model of the difference needs what another simulator predicted.
        recording.torque_sim_nm.take_if(|_| !of_simulation);
        recording
    };
    let own: Vec<Recording> = recordings.iter().map(own).collect();
    let mut rows = rows::without_deflection(&own)?;
    if rows::torque_size(&rows) <= 0.0 {
        return Err(EstimateError::NoTorqueChange { recording: own[0].name.clone() });
    }
    let (model, rated_is_largest_seen) = match given {
        Some(model) => prepared(model, recordings, options)?,
        None => (joint_base(recordings, options)?, false),
    };
    let past = own.iter().map(|recording| dataset::past(recording, &model)).collect::<Result<Vec<_>, _>>()?;
    let past: Option<Vec<_>> = past.into_iter().collect();
    let past = past.as_deref().map(of_past);
    // A friction that changes its sign with the noise of the velocity is not the friction of the joint.
    let clean: Vec<Cow<'_, Recording>> = own.iter().map(|r| without_noise(r, &model)).collect();
    let beside = |model: &Model, zero: bool| {
        let signals = own.iter().zip(&clean).map(|(recorded, clean)| signals(recorded, clean, model));
        ModelPart::along(model, signals.collect(), &free(model, zero))
    };
    progress.report("refitting gear and terms", 0.0);
    let mut part = beside(&model, false)?;
    let (mut from, searched) = match given {
        Some(_) => (part.start_values(), 0),
        None => select::search(&problem(&rows, past.as_ref(), &part), options.seed, progress),
    };
    for _ in 0..ROUNDS {
        let beside_rows = problem(&rows, past.as_ref(), &part);
        let plain = polish(&beside_rows, &from, Sweep::PLAIN, progress);
        let residuals = beside_rows.residuals(&plain.nonlinear, &plain.linear);
        // The bounds of a shape go with it.
        part = beside(&part.model(&plain.nonlinear, &plain.linear), false)?;
        from = part.start_values();
        let found: usize =
            rows.iter_mut().zip(&residuals).map(|(r, left)| autoregression::mark_outliers(left, &mut r.marks)).sum();
        if found == 0 {
            break;
        }
    }
    let mut plain = polish(&problem(&rows, past.as_ref(), &part), &from, Sweep::PLAIN, progress);
    let refitted = part.model(&plain.nonlinear, &plain.linear);
    let rows_near_standstill = match MotionNoise::new(&own, &clean, &refitted).filter(|_| !refitted.has_gear()) {
        Some(noise) => {
            let residuals = problem(&rows, past.as_ref(), &part).residuals(&plain.nonlinear, &plain.linear);
            skip_disturbed(&mut rows, &noise, &refitted, &residuals, options.seed)?
        }
        None => vec![0; rows.len()],
    };
    if rows_near_standstill.iter().any(|rows| *rows > 0) {
        plain = polish(&problem(&rows, past.as_ref(), &part), &plain.nonlinear, Sweep::PLAIN, progress);
    }
    if progress.cancelled() {
        return Err(EstimateError::Cancelled);
    }
    if model.has_gear() {
        let with_zero = beside(&part.model(&plain.nonlinear, &plain.linear), true)?;
        let (without, with) = (problem(&rows, past.as_ref(), &part), problem(&rows, past.as_ref(), &with_zero));
        let found = polish(&with, &with_zero.start_values(), Sweep::PLAIN, progress);
        let noise = refine::noise_of(&with, &found);
        let sweep = Sweep { noise: Some(&noise), ..Sweep::PLAIN };
        let left = polish(&with, &found.nonlinear, sweep, progress).rss;
        let gain = polish(&without, &plain.nonlinear, sweep, progress).rss - left;
        let count = rows.iter().map(Rows::len).sum::<usize>() as f64;
        if gain > (THRESHOLDS.zero_likelihood_gain + count.ln()) * left / count {
            (part, plain) = (with_zero, found);
        }
    }
    let beside_rows = problem(&rows, past.as_ref(), &part);
    let heldout_rms = heldout(&beside_rows, &plain.nonlinear, None).rms;
    let mut weighted = refine::against_noise(&beside_rows, plain, heldout_rms, progress)?;
    if progress.cancelled() {
        return Err(EstimateError::Cancelled);
    }
    let found = &weighted.polished;
    let weights = weighted.prewhitened.then_some(&weighted.noise[..]);
    let remedy = given.is_none().then_some(Remedy::JointMotion);
    let mut known = uncertainty::of_columns(&beside_rows, &found.nonlinear, &found.linear, weights, remedy);
    let mut refitted = part.model(&found.nonlinear, &found.linear);
    if given.is_some() {
        // In the order of the file.
        let order = free(&refitted, true).into_iter().map(|place| parameters::named(&refitted, place).0);
        let order: Vec<_> = order.collect();
        known.parameters.sort_by_key(|p| order.iter().position(|name| *name == p.name));
    }
    if refitted.name.is_empty() {
        refitted.name.clone_from(&recordings[0].name);
    }
    let zero_sd = known.parameters.iter().find(|p| p.name == DEFLECTION_ZERO).and_then(|p| p.sd);
    let zero = refitted.gear.deflection_zero_rad;
    let zeros = recordings.iter().filter(|_| refitted.has_gear());
    let zeros = zeros.map(|r| DeflectionZero { recording: r.name.clone(), rad: zero, sd_rad: zero_sd }).collect();
    let fit = if clean.iter().any(|clean| matches!(clean, Cow::Owned(_))) {
        // Errors are those of a prediction from the motion as recorded.
        let as_recorded = ModelPart::new(&refitted, &own, &free(&refitted, false))?;
        let as_recorded = problem(&rows, past.as_ref(), &as_recorded);
        weighted.heldout_rms = heldout(&as_recorded, &weighted.polished.nonlinear, weights).rms;
        finished(recordings, options, &as_recorded, weighted, refitted, known)
    } else {
        finished(recordings, options, &beside_rows, weighted, refitted, known)
    };
    let evaluations = fit.evaluations + searched;
    Ok(Fit { rated_is_largest_seen, deflection_zeros: zeros, rows_near_standstill, evaluations, ..fit })
}

/// The free numbers of a model. The last value of each curve stays: a constant added to a curve is the offset of each recording.
fn free(model: &Model, zero: bool) -> Vec<FreeParameter> {
    let is_last = |parameter: &FreeParameter| match *parameter {
        FreeParameter::Term { term, key, index: Some(index) } if model.terms[term].kind == UNKNOWN => {
            matches!(model.terms[term].values.get(key.name), Some(TermValue::List(list)) if list.len() == index + 1)
        }
        _ => false,
    };
    let mut free = parameters::free(model, zero);
    free.retain(|parameter| !is_last(parameter));
    free
}

/// The motion of a joint freed of its noise. That of a gear stays as recorded: where its deflection turns is what its memory starts from.
fn without_noise<'r>(recording: &'r Recording, model: &Model) -> Cow<'r, Recording> {
    if model.has_gear() { Cow::Borrowed(recording) } else { denoised(recording, model.gear.ratio) }
}

/// What a model sees of a recording.
fn signals<'r>(recorded: &'r Recording, clean: &'r Cow<'r, Recording>, model: &Model) -> (&'r Recording, Signals<'r>) {
    match clean {
        Cow::Borrowed(_) => (recorded, recorded::signals(recorded, model)),
        Cow::Owned(clean) => (clean, recorded::clean_signals(recorded, clean, model)),
    }
}

/// Skips rows of a joint near standstill that show only the noise of the velocity; returns how many of each recording. What is left there would look like physics.
fn skip_disturbed(
    rows: &mut [Rows<'_>],
    noise: &MotionNoise<'_>,
    model: &Model,
    residuals: &[Vec<f64>],
    seed: u64,
) -> Result<Vec<usize>, EstimateError> {
    let variances = noise.variances(seed, |copies| {
        let totals = copies.iter().map(|copy| Ok(recorded::evaluate(model, copy)?.total().to_vec()));
        Ok::<_, PredictError>(totals.collect::<Result<Vec<_>, PredictError>>()?.concat())
    })?;
    let mut from = 0;
    let skip = |(rows, residual): (&mut Rows<'_>, &Vec<f64>)| {
        let own = from..from + residual.len();
        from = own.end;
        disturbed_rows::skip(residual, &variances[own], &mut rows.marks)
    };
    Ok(rows.iter_mut().zip(residuals).map(skip).collect())
}

/// Recordings beside a model, their offsets and what the gear may remember.
fn problem<'p>(rows: &'p [Rows<'p>], past: Option<&'p Ready<'p>>, part: &'p ModelPart<'p>) -> Problem<'p> {
    let mut contributions: Vec<&dyn Contribution> = vec![&Offset];
    contributions.extend(past.map(|past| past as &dyn Contribution));
    contributions.push(part);
    Problem { rows, corrections: Vec::new(), contributions }
}

/// What a gear may remember from before the first row of each recording.
fn of_past(recordings: &[Vec<Vec<f64>>]) -> Ready<'_> {
    let columns = recordings[0].iter().map(|_| Column::of_recording("past", "1")).collect();
    Ready::new(columns, recordings.iter().map(|own| own.iter().map(Vec::as_slice).collect()).collect())
}

/// Whether a model, of no difference to a simulation, has the terms of a joint's base model and no others.
fn is_joint_base(model: &Model) -> bool {
    model.has_terms_alone() && model.terms.iter().all(|term| JOINT_BASE.contains(&term.kind.as_str()))
}

/// The base model of joint logs before it is fitted.
fn joint_base(recordings: &[Recording], options: &FitOptions) -> Result<Model, EstimateError> {
    let first = &recordings[0];
    let name = options.start.as_ref().map(|model| model.name.clone()).unwrap_or_default();
    let gear = options.gear(first.torque_unit);
    let model = Model { name, gear, torque_unit: first.torque_unit, ..Model::default() };
    let velocities = recordings.iter().filter_map(|r| Signals::new(r, &model).velocity_rad_per_s);
    let fastest = velocities.map(|v| largest(&v)).fold(0.0, f64::max);
    if fastest == 0.0 {
        return Err(EstimateError::NoMovement { recording: first.name.clone() });
    }
    let term = |name: &&str| {
        let keys = kind(name).map_or(&[][..], |info| info.keys).iter();
        let linear = keys.clone().filter(|key| key.role == Role::Linear).map(|key| (key.name, 0.0));
        let smoothing = keys.filter(|key| key.name == SMOOTHING).map(|key| (key.name, FIRST_SMOOTHING * fastest));
        let values = linear.chain(smoothing).map(|(key, value)| (key.to_owned(), TermValue::Number(value)));
        Term { kind: (*name).to_owned(), values: values.collect() }
    };
    Ok(Model { terms: JOINT_BASE.iter().map(term).collect(), ..model })
}

/// The model with the canonical signs of its memory and a rated deflection, and whether that is the largest seen.
fn prepared(start: &Model, recordings: &[Recording], options: &FitOptions) -> Result<(Model, bool), EstimateError> {
    let torque_unit = recordings[0].torque_unit;
    let mut model = Model { gear: options.gear(torque_unit), torque_unit, ..start.clone() };
    if !model.has_gear() {
        return Ok((model, false));
    }
    let given = options.rated_deflection_rad.or(model.gear.rated_deflection_rad);
    let seen = |recording: &Recording| {
        let mut recording = recording.clone();
        recording.derive_deflection(model.gear.ratio).ok()?;
        recording.largest_deflection_rad(model.gear.deflection_zero_rad)
    };
    let rated = given.or_else(|| recordings.iter().filter_map(seen).reduce(f64::max));
    let rated = rated.ok_or_else(|| EstimateError::NoMovement { recording: recordings[0].name.clone() })?;
    model.gear.rated_deflection_rad = Some(rated);
    if let Some(params) = model.params(rated) {
        model.memory = Some(params?.memory());
    }
    Ok((model, given.is_none()))
}
