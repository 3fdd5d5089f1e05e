//! The torque that a model predicts for a recording's motion, and what each of its parts adds.

use std::collections::BTreeMap;

use gmhm::terms::{Domain, Need, TermError};

use super::error::PredictError;
use super::evaluate::RecordingContext;
use super::signals::Signals;
use super::term::{Terms, no_terms};
use crate::model::{Model, Term};
use crate::progress::Progress;
use crate::recording::{Need as ColumnNeed, Needs, Recording};

/// Torques of every row of a recording, in the model's unit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Prediction {
    /// Elastic + hysteresis + terms.
    pub torque: Vec<f64>,
    /// f(θ) at the uncorrected deflection; 0 for a joint log.
    pub elastic: Vec<f64>,
    /// z there.
    pub hysteresis: Vec<f64>,
    /// What each term changes when it is added to those before it in the file: `kind`, or `kind_2` for the second of its kind.
    pub terms: Vec<(String, Vec<f64>)>,
    /// Rows outside the rated deflection, where the model is not calibrated.
    pub rows_out_of_range: usize,
    /// Pairs of turning points given up because more were open than are remembered.
    pub merged_pairs: u32,
}

/// Predicts the torque of every row. The first row is the start: y = 0, m = 0 there (MODEL.md sections 3 and 4). `deflection_zero_rad` is
/// subtracted first; the deflection is computed from the angles where none is recorded. The rated deflection is the one asked for, else the model's, else
/// the largest of the recording.
///
/// # Errors
/// [`PredictError`].
pub fn predict(model: &Model, asked_rad: Option<f64>, recording: &Recording) -> Result<Prediction, PredictError> {
    predict_along(model, asked_rad, recording, Signals::new(recording, model), &())
}

/// [`predict`] for signals that are at hand.
///
/// # Errors
/// [`PredictError`].
pub fn predict_along(
    model: &Model,
    asked_rad: Option<f64>,
    recording: &Recording,
    signals: Signals<'_>,
    progress: &dyn Progress,
) -> Result<Prediction, PredictError> {
    let context = context(model, asked_rad, recording, signals)?;
    let mut terms = no_terms(model, context.rated_deflection_rad);
    let uncorrected = context.follow(&terms)?;
    let rows = recording.len();
    let mut prediction = Prediction {
        rows_out_of_range: uncorrected.rows_out_of_range,
        merged_pairs: uncorrected.merged_pairs,
        ..Prediction::default()
    };
    let mut total = context.total(&uncorrected, &terms);
    prediction.torque = total.clone();
    let mut followed = uncorrected.clone();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let passes = (1 + model.terms.len()) as f64;
    for (at, term) in model.terms.iter().enumerate() {
        progress.report("Predicting", (1 + at) as f64 / passes);
        add(&mut terms, term)?;
        let newest = terms.terms().last();
        if newest.is_some_and(|term| term.info().domain == Domain::Deflection) {
            context.check(&terms)?;
            followed = context.follow(&terms)?;
        }
        context.check(&terms)?;
        let with = context.total(&followed, &terms);
        if let Some(row) = with.iter().position(|torque| !torque.is_finite()) {
            return Err(PredictError::NotFinite {
                file: recording.name.clone(),
                row: row + 1,
                kind: term.kind.clone(),
            });
        }
        let change: Vec<f64> = with.iter().zip(&total).map(|(with, without)| with - without).collect();
        prediction.torque.iter_mut().zip(&change).for_each(|(sum, change)| *sum += change);
        total = with;
        let count = counts.entry(&term.kind).and_modify(|n| *n += 1).or_insert(1);
        let name = if *count == 1 { term.kind.clone() } else { format!("{}_{count}", term.kind) };
        prediction.terms.push((name, change));
    }
    let or_zeros = |values: Vec<f64>| if values.is_empty() { vec![0.0; rows] } else { values };
    prediction.elastic = or_zeros(uncorrected.elastic);
    prediction.hysteresis = or_zeros(uncorrected.hysteresis);
    Ok(prediction)
}

/// A recording as a model sees it.
///
/// # Errors
/// A model that predicts nothing, parameters that are refused, a gear without a deflection.
pub fn context<'a>(
    model: &Model,
    asked_rad: Option<f64>,
    recording: &'a Recording,
    signals: Signals<'a>,
) -> Result<RecordingContext<'a>, PredictError> {
    let seen = || signals.deflection_rad.as_ref().map(|theta| theta.iter().fold(0.0, |a: f64, x| a.max(x.abs())));
    let rated = asked_rad.or(model.gear.rated_deflection_rad).or_else(seen).unwrap_or(f64::NAN);
    if model.is_simulation() && signals.torque_sim_nm.is_none() {
        return Err(PredictError::NoSimulation(recording.name.clone()));
    }
    let params = model.params(rated);
    if params.is_none() && model.terms.is_empty() && !model.is_simulation() {
        return Err(PredictError::EmptyModel);
    }
    if params.is_some() && signals.deflection_rad.is_none() {
        // Says what is missing before it says that the rated deflection is unknown.
        return RecordingContext::new(recording, signals, model.params(1.0).and_then(Result::ok));
    }
    let refused = |error| PredictError::Params { rated_deflection_rad: rated, error };
    let context = RecordingContext::new(recording, signals, params.transpose().map_err(refused)?)?;
    Ok(RecordingContext { rated_deflection_rad: Some(rated).filter(|rated| rated.is_finite()), ..context })
}

/// What `gmhm predict` reads of a recording for a model.
pub fn needs(model: &Model) -> Needs {
    let of_terms = |term: &Term| term.info().is_some_and(|info| info.needs.contains(&Need::SimulatedTorque));
    if model.is_simulation() {
        // Whether the terms have what they need is known once they are read.
        Needs { motion: ColumnNeed::IfPresent, simulation: ColumnNeed::IfPresent, ..Needs::PREDICT }
    } else if model.terms.iter().any(of_terms) {
        Needs { simulation: ColumnNeed::IfPresent, ..Needs::PREDICT }
    } else {
        Needs::PREDICT
    }
}

/// Adds a term of a model file.
///
/// # Errors
/// Why the core refuses it.
pub fn add(terms: &mut Terms, term: &Term) -> Result<(), PredictError> {
    let refused = |error: TermError| PredictError::Term { kind: term.kind.clone(), error };
    terms.add(&term.kind, term).map_err(refused)
}
