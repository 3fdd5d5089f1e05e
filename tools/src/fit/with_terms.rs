//! Models with terms: gear and terms refitted together, by the data set and the variable projection that the diagnosis uses.
//!
//! Kinds, shapes and the law stay as given; every number is refitted. The zero of the deflection is refitted where that clearly explains more.

use std::borrow::Cow;

use gmhm::Law;

use crate::fit::options::{FitOptions, Method};
use crate::fit::thresholds::THRESHOLDS;
use crate::fit::{DeflectionZero, Fit};
use crate::model::Model;
use crate::numerics::autoregression::mark_outliers;
use crate::numerics::mark::Mark;
use crate::numerics::particle_swarm::Stop;
use crate::numerics::vector::dot;
use crate::physics::PredictError;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::regression::dataset::Dataset;
use crate::regression::deflection_zeros::DEFLECTION_ZERO;
use crate::regression::error::{DatasetError, EstimateError};
use crate::regression::fit::Fitted;
use crate::regression::note::Note;
use crate::regression::parameters::{self, FreeParameter};
use crate::regression::uncertainty::{Estimated, Uncertainty, correlated};

/// Rows that are fitted at most. Of longer recordings means of rows are taken, of the motion as of the torque.
const MOST_ROWS: usize = 250_000;

/// Steps of the descent, at most.
const MOST_STEPS: usize = 30;

/// Refits a model with terms to recordings of its gear or joint.
///
/// # Errors
/// Recordings that cannot be taken together, a model that cannot be evaluated on them, or `progress` cancelling.
pub fn fit(
    recordings: &[Recording],
    start: &Model,
    options: &FitOptions,
    progress: &dyn Progress,
) -> Result<Fit, EstimateError> {
    let (model, rated_is_largest_seen) = prepared(start, recordings, options)?;
    let rows: usize = recordings.iter().map(Recording::len).sum();
    let means = rows.div_ceil(MOST_ROWS);
    // What another simulator predicted is no part of a refit.
    let own = |recording: &Recording| {
        let recording = if means > 1 { recording.in_means(means) } else { recording.clone() };
        Recording { torque_sim_nm: None, ..recording }
    };
    let own: Vec<Recording> = recordings.iter().map(own).collect();
    let mut dataset = Dataset::new(&own, &model).map_err(refused)?;
    let check = || if progress.cancelled() { Err(EstimateError::Cancelled) } else { Ok(()) };
    let descend = |dataset: &Dataset<'_>, model: &Model, zero: bool| {
        let free = dataset.free_parameters(model, zero);
        dataset.fit(model, &free, None, MOST_STEPS).map_err(refused)
    };
    progress.report("refitting gear and terms", 0.1);
    let first = descend(&dataset, &model, false)?;
    check()?;
    let found: usize = (dataset.spans.iter().zip(&mut dataset.marks))
        .map(|(span, marks)| mark_outliers(&first.residual[span.clone()], marks))
        .sum();
    progress.report("refitting gear and terms", 0.4);
    let mut fitted = if found > 0 { descend(&dataset, &first.model, false)? } else { first };
    check()?;
    if model.elastic.is_some() {
        let with_zero = descend(&dataset, &fitted.model, true)?;
        let gain = fitted.minus_two_log_likelihood - with_zero.minus_two_log_likelihood;
        if gain > THRESHOLDS.zero_likelihood_gain + (dataset.counted() as f64).ln() {
            fitted = with_zero;
        }
    }
    progress.report("refitting gear and terms", 0.8);
    let fitted = dataset.settled(fitted).map_err(refused)?;
    check()?;
    report(&dataset, fitted, recordings, options, rated_is_largest_seen)
}

/// The model with the canonical signs of its memory and a rated deflection, and whether that is the largest seen.
fn prepared(start: &Model, recordings: &[Recording], options: &FitOptions) -> Result<(Model, bool), EstimateError> {
    let mut model = start.clone();
    if model.elastic.is_none() {
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

fn refused(error: DatasetError) -> EstimateError {
    match error {
        DatasetError::NoRecording => EstimateError::NoRecording,
        DatasetError::NoTorque(recording) => EstimateError::NoTorque { recording },
        DatasetError::MixedUnits { first, other } => EstimateError::MixedUnits { first, other },
        error => EstimateError::Joint { why: error.to_string() },
    }
}

fn report(
    dataset: &Dataset<'_>,
    fitted: Fitted,
    recordings: &[Recording],
    options: &FitOptions,
    rated_is_largest_seen: bool,
) -> Result<Fit, EstimateError> {
    let unit = recordings[0].torque_unit;
    let residual = dataset.layout().masked(&fitted.residual);
    let (rss, rows) = (dot(&residual, &residual), dataset.counted());
    let total = dataset.total(&fitted.model).map_err(|error: PredictError| refused(error.into()))?;
    let offset = |(span, marks): (&std::ops::Range<usize>, &Vec<Mark>)| {
        let counted: Vec<f64> = (span.clone().zip(marks))
            .filter(|(_, mark)| matches!(mark, Mark::Used | Mark::First))
            .map(|(row, _)| dataset.target[row] - total[row] - fitted.residual[row])
            .collect();
        counted.iter().sum::<f64>() / counted.len().max(1) as f64
    };
    let mut uncertainty = uncertainty(dataset, &fitted);
    uncertainty.per(unit);
    let zero = fitted.model.gear.deflection_zero_rad;
    let zero_sd = uncertainty.parameters.iter().find(|p| p.name == DEFLECTION_ZERO).and_then(|p| p.sd);
    let zeros = recordings.iter().filter(|_| fitted.model.elastic.is_some());
    Ok(Fit {
        method: Method::Auto,
        seed: options.seed,
        unit: unit.suffix(),
        uncertainty,
        rated_is_largest_seen,
        started_from_model: true,
        selection: Vec::new(),
        selection_rows: 0,
        rms: (rss / rows.max(1) as f64).sqrt(),
        rss,
        residuals: dataset.spans.iter().map(|span| fitted.residual[span.clone()].to_vec()).collect(),
        heldout_rms: dataset.rms_of_blocks(&fitted),
        rows,
        offsets: dataset.spans.iter().zip(&dataset.marks).map(offset).collect(),
        deflection_zeros: zeros
            .map(|recording| DeflectionZero { recording: recording.name.clone(), rad: zero, sd_rad: zero_sd })
            .collect(),
        known_start: vec![true; recordings.len()],
        unsettled_rows: vec![0; recordings.len()],
        prewhitened: !fitted.plain,
        held_invertible: false,
        stop: Stop::Converged,
        evaluations: 0,
        noise: fitted.noise,
        model: Model { torque_unit: unit, ..fitted.model },
    })
}

/// Every free number with its standard deviation: that of the noise, or that by which blocks of the recordings scatter where that is larger.
fn uncertainty(dataset: &Dataset<'_>, fitted: &Fitted) -> Uncertainty {
    let model = &fitted.model;
    let directions = dataset.layout().directions(&fitted.of_places(), &fitted.residual);
    let sds = dataset.standard_deviations(fitted);
    let line = |((&free, direction), sd): ((&FreeParameter, _), Option<f64>)| {
        let value = parameters::value(model, free);
        let at_bound = parameters::room(model, free) == 0.0;
        (Estimated::new(name_of(model, free), value, sd, at_bound, Note::Open(None), None), direction)
    };
    correlated(fitted.places.iter().zip(directions).zip(sds).map(line).collect())
}

/// The name of a free number, as in the model file, and its unit. A term's follows its kind, a second of its kind is numbered, and so are the numbers of lists.
fn name_of(model: &Model, free: FreeParameter) -> (Cow<'static, str>, Cow<'static, str>) {
    let time = model.memory.is_some_and(|memory| memory.law == Law::Time);
    let (name, unit) = match free {
        FreeParameter::Elastic(0) => ("c1_nm_per_rad", "N·m/rad"),
        FreeParameter::Elastic(1) => ("c2_nm_per_rad3", "N·m/rad³"),
        FreeParameter::Elastic(_) => ("c3_nm_per_rad5", "N·m/rad⁵"),
        FreeParameter::Memory(0) if time => ("alpha", ""),
        FreeParameter::Memory(_) if time => ("beta_per_s", "1/s"),
        FreeParameter::Memory(0) => ("e", "N·m/rad"),
        FreeParameter::Memory(_) => ("h", "N·m/rad"),
        FreeParameter::Zero => (DEFLECTION_ZERO, "rad"),
        FreeParameter::Term { term, key, index } => {
            let kind = &model.terms[term].kind;
            let before = model.terms[..term].iter().filter(|other| other.kind == *kind).count();
            let number = if before > 0 { format!("_{}", before + 1) } else { String::new() };
            let index = index.map_or_else(String::new, |index| format!("[{index}]"));
            return (format!("{kind}{number}.{}{index}", key.name).into(), key.unit.into());
        }
    };
    (name.into(), unit.into())
}
