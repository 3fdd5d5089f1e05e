//! Words of options as the types of the library.

use clap::ValueEnum;
use gmhm_tools::jobs;
use gmhm_tools::model::TorqueSide;
use gmhm_tools::physics;
use gmhm_tools::recording::{ColumnMap, Needs, Reading};
use pyo3::prelude::*;

use crate::errors::wrong_option;
use crate::model::Model;

/// One of the words that an option takes.
pub fn word<T: ValueEnum>(py: Python<'_>, option: &str, given: &str) -> PyResult<T> {
    T::from_str(given, true).map_err(|_| {
        let names: Vec<_> = T::value_variants().iter().filter_map(T::to_possible_value).collect();
        let names: Vec<&str> = names.iter().map(|name| name.get_name()).collect();
        wrong_option(py, option, &format!("\"{given}\" is none of {}", names.join(", ")))
    })
}

/// The side on which the torque is taken.
pub fn torque_side(py: Python<'_>, given: Option<&str>) -> PyResult<Option<TorqueSide>> {
    given.map(|given| word(py, "torque_side", given)).transpose()
}

/// A number greater than zero.
pub fn positive(py: Python<'_>, option: &str, given: Option<f64>) -> PyResult<Option<f64>> {
    match given {
        Some(number) if !(number > 0.0 && number.is_finite()) => {
            Err(wrong_option(py, option, "must be a number greater than zero"))
        }
        given => Ok(given),
    }
}

/// A ratio: no less than one to one.
pub fn ratio(py: Python<'_>, given: Option<f64>) -> PyResult<Option<f64>> {
    match given {
        Some(number) if !(number.is_finite() && number.abs() >= 1.0) => {
            Err(wrong_option(py, "ratio", "must be a number of 1 or more, or -1 or less"))
        }
        given => Ok(given),
    }
}

/// What a recording is read for.
pub fn needs(py: Python<'_>, purpose: &str, model: Option<&Model>) -> PyResult<Needs> {
    match (purpose, model.map(|model| &*model.inner)) {
        ("any", _) => Ok(Needs::ANY),
        ("fit", _) => Ok(Needs::FIT),
        ("diagnose", _) => Ok(jobs::diagnose::NEEDS),
        ("predict", Some(model)) => Ok(physics::predict::needs(model)),
        ("invert", Some(model)) => Ok(physics::invert::needs(model)),
        _ => Err(wrong_option(py, "purpose", "any, fit, diagnose; predict and invert with a model")),
    }
}

/// How a recording is read for a purpose.
pub fn reading(
    py: Python<'_>,
    (purpose, model): (&str, Option<&Model>),
    map: Option<&str>,
    from_s: Option<f64>,
    to_s: Option<f64>,
) -> PyResult<Reading> {
    let needs = needs(py, purpose, model)?;
    let map: ColumnMap = match map {
        Some(map) => map.parse().map_err(|error| wrong_option(py, "map", &format!("{error}")))?,
        None => ColumnMap::default(),
    };
    if let (Some(from), Some(to)) = (from_s, to_s)
        && from >= to
    {
        return Err(wrong_option(py, "from_s", "must be before to_s"));
    }
    Ok(Reading { from_s, to_s, ..Reading::new(map, needs) })
}
