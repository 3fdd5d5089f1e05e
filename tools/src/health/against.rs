//! Quantities beside a property of the recordings: temperature, hours of service, size.

use std::path::Path;

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use super::HealthError;
use super::change::holm;
use super::condition::Condition;
use crate::number::number;
use crate::numerics::extremes::range;
use crate::recording::Recording;

/// A property and its value for each condition.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Property {
    /// Its name.
    pub property: String,
    /// Its values.
    pub values: Vec<f64>,
}

impl Property {
    /// Name and unit, for an axis. A column of a table is what its name says.
    pub fn label(&self) -> String {
        match self.property.as_str() {
            "temperature_c" => "temperature in °C".to_owned(),
            "velocity_out_rad_per_s" => "output velocity in rad/s".to_owned(),
            name => name.to_owned(),
        }
    }

    /// What a slope is per.
    pub fn unit(&self) -> String {
        match self.property.as_str() {
            "temperature_c" => "K".to_owned(),
            "velocity_out_rad_per_s" => "rad/s".to_owned(),
            name => format!("unit of {name}"),
        }
    }
}

/// A line through a quantity over a property.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Regression {
    /// The quantity.
    pub name: &'static str,
    /// Unit of the quantity.
    pub unit: String,
    /// Value at the mean of the property.
    pub at_mean: f64,
    /// Mean of the property, weighted as the fit.
    pub mean: f64,
    /// Change for a unit of the property.
    pub slope: f64,
    /// Its standard deviation.
    pub sd: Option<f64>,
    /// Slope beside the value at the mean.
    pub relative_slope: f64,
    /// How much more the values scatter about the line than their standard deviations say; at least 1.
    pub scatter: f64,
    /// Probability of such a slope where there is none.
    pub p_value: Option<f64>,
    /// Whether the quantity goes with the property, Holm's correction applied.
    pub significant: bool,
}

/// The property named `temperature_c`, the mean of that column, or `TABLE.csv:COLUMN`.
///
/// # Errors
/// [`HealthError::Against`].
pub fn property(asked: &str, recordings: &[Recording]) -> Result<Property, HealthError> {
    let fault = |problem: String| HealthError::Against { asked: asked.to_owned(), problem };
    if asked.contains(':') {
        return tabled(asked, &recordings.iter().map(|r| r.name.clone()).collect::<Vec<_>>());
    }
    let column = |r: &'_ Recording| match asked {
        "temperature_c" => Ok(r.temperature_c.clone()),
        "velocity_out_rad_per_s" => Ok(r.velocity_out_rad_per_s.clone()),
        _ => Err(fault("is neither a column of recordings that gmhm reads nor a table".to_owned())),
    };
    let (mut values, mut within) = (Vec::new(), 0.0_f64);
    for recording in recordings {
        let column = column(recording)?.ok_or_else(|| fault(format!("{} has no such column", recording.name)))?;
        let (low, high) = range(column.iter());
        values.push(column.iter().sum::<f64>() / column.len() as f64);
        within = within.max(high - low);
    }
    let (low, high) = range(&values);
    if high - low < 0.1 * within {
        let problem = format!(
            "its means differ by {}, and within a recording it changes by {}: no regression is possible",
            number(high - low, 3),
            number(within, 3)
        );
        return Err(fault(problem));
    }
    spread(asked, Property { property: asked.to_owned(), values })
}

/// The property of a table: its first column names recordings or models, by path, file name or stem.
///
/// # Errors
/// [`HealthError::Against`].
pub fn tabled(asked: &str, names: &[String]) -> Result<Property, HealthError> {
    let fault = |problem: String| HealthError::Against { asked: asked.to_owned(), problem };
    let (file, wanted) =
        asked.rsplit_once(':').ok_or_else(|| fault("a model file has no columns: give a table".to_owned()))?;
    let mut table = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(file)
        .map_err(|e| fault(format!("{file} cannot be read: {e}")))?;
    let header = table.headers().map_err(|e| fault(format!("{file}: {e}")))?.clone();
    let column = header
        .iter()
        .position(|name| name == wanted)
        .filter(|column| *column > 0)
        .ok_or_else(|| fault(format!("{file} has no column {wanted} after its first one")))?;
    let mut rows: Vec<(String, f64)> = Vec::new();
    for record in table.records() {
        let record = record.map_err(|e| fault(format!("{file}: {e}")))?;
        let line = record.position().map_or(0, csv::Position::line);
        let value: f64 = record
            .get(column)
            .and_then(|text| text.parse().ok())
            .filter(|v: &f64| v.is_finite())
            .ok_or_else(|| fault(format!("{file}, line {line}: {wanted} is not a number")))?;
        rows.push((record.get(0).unwrap_or_default().to_owned(), value));
    }
    let values = names
        .iter()
        .map(|name| {
            let path = Path::new(name);
            let ends = [path.file_name(), path.file_stem()].map(|end| end.map(|e| e.to_string_lossy().into_owned()));
            let own = |known: &String| known == name || ends.iter().flatten().any(|end| end == known);
            let mut found = rows.iter().filter(|row| own(&row.0));
            match (found.next(), found.next()) {
                (Some(row), None) => Ok(row.1),
                (None, _) => Err(fault(format!("{file} has no row for {name}"))),
                _ => Err(fault(format!("{file} has several rows for {name}"))),
            }
        })
        .collect::<Result<Vec<f64>, HealthError>>()?;
    spread(asked, Property { property: wanted.to_owned(), values })
}

fn spread(asked: &str, property: Property) -> Result<Property, HealthError> {
    let first = property.values[0];
    if property.values.iter().all(|v| *v == first) {
        let problem = format!("it is {first} everywhere: nothing can go with it");
        return Err(HealthError::Against { asked: asked.to_owned(), problem });
    }
    Ok(property)
}

/// Weighted least squares of each quantity on the property, q = a + b·(x − x̄) with weights 1/s². Where the values scatter about the line by more than their
/// standard deviations, these are widened by that much (Birge, Phys. Rev. 40, 1932), and the slope is held against Student's t.
pub fn regressions(conditions: &[Condition], property: &Property, false_alarm_rate: f64) -> Vec<Regression> {
    let count = conditions[0].quantities.len();
    let mut all: Vec<Regression> = (0..count).map(|index| regression(conditions, index, &property.values)).collect();
    let p_values: Vec<Option<f64>> = all.iter().map(|r| r.p_value).collect();
    for (line, significant) in all.iter_mut().zip(holm(&p_values, false_alarm_rate)) {
        line.significant = significant;
    }
    all
}

fn regression(conditions: &[Condition], index: usize, x: &[f64]) -> Regression {
    let quantity = |k: usize| &conditions[k].quantities[index];
    let known = (0..x.len()).all(|k| quantity(k).sd.is_some_and(|sd| sd > 0.0));
    let weight = |k: usize| quantity(k).sd.filter(|_| known).map_or(1.0, |sd| 1.0 / (sd * sd));
    let sum = |f: &dyn Fn(usize) -> f64| (0..x.len()).map(|k| weight(k) * f(k)).sum::<f64>();
    let total = sum(&|_| 1.0);
    let mean = sum(&|k| x[k]) / total;
    let at_mean = sum(&|k| quantity(k).value) / total;
    let squares = sum(&|k| (x[k] - mean).powi(2));
    let slope = sum(&|k| (x[k] - mean) * quantity(k).value) / squares;
    let misfit = sum(&|k| (quantity(k).value - at_mean - slope * (x[k] - mean)).powi(2));
    let freedom = x.len().saturating_sub(2) as f64;
    let birge = if freedom > 0.0 { (misfit / freedom).sqrt() } else { 0.0 };
    let (scatter, sd) = match (known, freedom > 0.0) {
        (true, _) => (birge.max(1.0), Some(birge.max(1.0) / squares.sqrt())),
        // Without standard deviations the scatter about the line is all there is.
        (false, true) => (1.0, Some(birge / squares.sqrt())),
        (false, false) => (1.0, None),
    };
    let p_value = sd.filter(|sd| *sd > 0.0).map(|sd| {
        let z = (slope / sd).abs();
        let student = StudentsT::new(0.0, 1.0, freedom);
        // A scatter that was only just measured has Student's tails; standard deviations that hold are known beforehand.
        let measured = !known || scatter > 1.0;
        2.0 * student.ok().filter(|_| measured).map_or_else(|| Normal::standard().sf(z), |t| t.sf(z))
    });
    let first = quantity(0);
    Regression {
        name: first.name,
        unit: first.unit.clone(),
        at_mean,
        mean,
        slope,
        sd,
        relative_slope: slope / at_mean.abs(),
        scatter,
        p_value,
        significant: false,
    }
}
