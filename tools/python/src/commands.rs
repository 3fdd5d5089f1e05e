//! `fit`, `diagnose` and `health`: what the commands of these names do, with their results as `--json` writes them.

use std::path::PathBuf;
use std::sync::Arc;

use gmhm_tools::diagnose::Options;
use gmhm_tools::failure::Failure;
use gmhm_tools::fit::{self as fits, FitOptions};
use gmhm_tools::health::{self, HealthOptions, catalogue::Asked};
use gmhm_tools::jobs::{self, Notes};
use gmhm_tools::model::Model as Gear;
use gmhm_tools::recording::Recording as Inner;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use serde::Serialize;

use crate::errors::wrong_option;
use crate::model::{Model, of_gear};
use crate::recording::{Recording, owned, unchanged};
use crate::{job, options};

type Arrays<'py> = Vec<Bound<'py, PyArray1<f64>>>;

/// The recordings, made ready to be identified from. A column is copied where it is changed.
fn ready(
    recordings: &[Arc<Inner>],
    ratio: Option<f64>,
    model: Option<&Gear>,
    notes: Notes<'_>,
) -> Result<Vec<Inner>, Failure> {
    let one = |recording: &Arc<Inner>| {
        let mut recording = Inner::clone(recording);
        jobs::ready::ready(&mut recording, ratio, model, notes)?;
        Ok(recording)
    };
    recordings.iter().map(one).collect()
}

fn json(results: &impl Serialize) -> Result<String, Failure> {
    Ok(serde_json::to_string(results).map_err(std::io::Error::other)?)
}

/// As `--json` of `gmhm fit`, the model, the recordings as they were fitted, the residual and the predicted torque of each.
#[pyfunction]
#[pyo3(signature = (recordings, model, method, own_zeros, rated_deflection_rad, ratio, torque_side, name, seed, compare))]
#[allow(clippy::too_many_arguments, clippy::type_complexity, reason = "the wrapper names them")]
pub fn fit<'py>(
    py: Python<'py>,
    recordings: Vec<Py<Recording>>,
    model: Option<&Model>,
    method: &str,
    own_zeros: bool,
    rated_deflection_rad: Option<f64>,
    ratio: Option<f64>,
    torque_side: Option<&str>,
    name: Option<String>,
    seed: u64,
    compare: bool,
) -> PyResult<(String, Model, Vec<Recording>, Arrays<'py>, Arrays<'py>)> {
    let start = of_gear(py, model, ratio, torque_side)?;
    let stem = recordings.first().map(|first| first.get().stem.clone());
    let name = name.or_else(|| stem.filter(|_| start.is_none()));
    let options = FitOptions {
        method: match method {
            "auto" => fits::Method::Auto,
            "pso" => fits::Method::Pso,
            _ => return Err(wrong_option(py, "method", "must be auto or pso")),
        },
        seed,
        start,
        rated_deflection_rad: options::positive(py, "rated_deflection_rad", rated_deflection_rad)?,
        evaluations: None,
        ratio,
        torque_side: options::torque_side(py, torque_side)?,
        own_zeros,
    };
    let stems: Vec<String> = recordings.iter().map(|recording| recording.get().stem.clone()).collect();
    let given = owned(&recordings);
    let (json, found) = job::run(py, move |caller| {
        let notes = &mut caller.notes();
        let ready = ready(&given, ratio, options.start.as_ref(), notes)?;
        let found = jobs::fit::identify(ready, &options, name, compare, caller, notes)?;
        Ok((json(&found.results())?, found))
    })?;
    unchanged(py, &recordings)?;
    let recordings = found.recordings.into_iter().zip(stems).map(|(inner, stem)| Recording::new(inner, stem));
    let residuals = found.assessment.residuals.into_iter().map(|residual| residual.into_pyarray(py));
    let predictions = found.assessment.predictions.into_iter().map(|prediction| prediction.torque.into_pyarray(py));
    Ok((json, found.fit.model.into(), recordings.collect(), residuals.collect(), predictions.collect()))
}

/// As `--json` of `gmhm diagnose`, and the extended model.
#[pyfunction]
#[pyo3(signature = (recordings, model, holdout, own_zeros, rated_deflection_rad, ratio, torque_side, name, seed))]
#[allow(clippy::too_many_arguments, reason = "the wrapper names them")]
pub fn diagnose(
    py: Python<'_>,
    recordings: Vec<Py<Recording>>,
    model: Option<&Model>,
    holdout: Vec<Py<Recording>>,
    own_zeros: bool,
    rated_deflection_rad: Option<f64>,
    ratio: Option<f64>,
    torque_side: Option<&str>,
    name: Option<String>,
    seed: u64,
) -> PyResult<(String, Model)> {
    let side = options::torque_side(py, torque_side)?;
    let mut base = match of_gear(py, model, ratio, torque_side)? {
        Some(model) => model,
        None => jobs::diagnose::simulation().of_gear(ratio, side),
    };
    if let Some(name) = name {
        base.name = name;
    }
    let rated_deflection_rad = options::positive(py, "rated_deflection_rad", rated_deflection_rad)?;
    let options = Options { rated_deflection_rad, seed, ..Options::default() };
    let (given, withheld) = (owned(&recordings), owned(&holdout));
    let found = job::run(py, move |caller| {
        let notes = &mut caller.notes();
        let given = ready(&given, ratio, Some(&base), notes)?;
        let withheld = ready(&withheld, ratio, Some(&base), notes)?;
        let found = jobs::diagnose::find(base, given, withheld, &options, own_zeros, caller, notes)?.finding;
        found.remarks.iter().for_each(|remark| notes(&remark.to_string()));
        Ok((json(&found.diagnosis)?, found.model.into()))
    })?;
    unchanged(py, &recordings)?;
    unchanged(py, &holdout)?;
    Ok(found)
}

/// As `--json` of `gmhm health`.
#[pyfunction]
#[pyo3(signature = (recordings, model, own_zeros, rated_deflection_rad, ratio, torque_side, rating, against, seed))]
#[allow(clippy::too_many_arguments, reason = "the wrapper names them")]
pub fn health_of_recordings(
    py: Python<'_>,
    recordings: Vec<Py<Recording>>,
    model: Option<&Model>,
    own_zeros: bool,
    rated_deflection_rad: Option<f64>,
    ratio: Option<f64>,
    torque_side: Option<&str>,
    rating: [Option<f64>; 3],
    against: Option<String>,
    seed: u64,
) -> PyResult<String> {
    let options = HealthOptions {
        seed,
        start: of_gear(py, model, ratio, torque_side)?,
        rated_deflection_rad: options::positive(py, "rated_deflection_rad", rated_deflection_rad)?,
        ratio,
        torque_side: options::torque_side(py, torque_side)?,
        own_zeros,
        rating: asked(py, rating)?,
        against,
    };
    let given = owned(&recordings);
    let found = job::run(py, move |caller| {
        let given = ready(&given, ratio, options.start.as_ref(), &mut caller.notes())?;
        json(&health::of_recordings(&given, &options, caller)?)
    })?;
    unchanged(py, &recordings)?;
    Ok(found)
}

/// The same of model files; with what `fit --json` wrote beside each they have uncertainty too.
#[pyfunction]
#[pyo3(signature = (models, rating, against, seed))]
pub fn health_of_models(
    py: Python<'_>,
    models: Vec<PathBuf>,
    rating: [Option<f64>; 3],
    against: Option<String>,
    seed: u64,
) -> PyResult<String> {
    let options = HealthOptions { seed, rating: asked(py, rating)?, against, ..HealthOptions::default() };
    job::run(py, move |_| {
        let models = models.into_iter().map(|path| {
            let model = gmhm_tools::model::load(&path)?;
            Ok((path, model))
        });
        let models = models.collect::<Result<Vec<_>, Failure>>()?;
        json(&health::of_models(&models, &options)?)
    })
}

fn asked(py: Python<'_>, [rated_torque, t1, t2]: [Option<f64>; 3]) -> PyResult<Asked> {
    Ok(Asked {
        rated_torque: options::positive(py, "rated_torque", rated_torque)?,
        t1: options::positive(py, "t1", t1)?,
        t2: options::positive(py, "t2", t2)?,
    })
}
