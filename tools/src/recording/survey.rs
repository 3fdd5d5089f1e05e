//! What is in a file: its columns, what they are recognised as, and what a recording would lack.

use super::Recording;
use super::error::{RecordingError, RecordingProblem};
use super::format::Format;
use super::needs::{Need, Needs};
use super::open::{Progress, RecordingFile, open};
use super::quantity::Quantity;
use super::read::Reading;
use super::samples::Samples;
use super::table::Location;

use crate::numerics::robust;

/// What is in a file.
#[derive(Debug, Clone)]
pub struct Survey {
    /// Its name for messages.
    pub file: String,
    /// Its format.
    pub format: Format,
    /// The line of a text that names the columns, counted from 1.
    pub header_line: Option<u64>,
    /// Rows that the recognised columns have in common; `None` where none was recognised.
    pub rows: Option<usize>,
    /// The columns, in the order of the file.
    pub columns: Vec<SurveyedColumn>,
    /// How the rows follow each other, where the time was recognised.
    pub timing: Option<Timing>,
    /// Why it is no recording to fit, if it is none.
    pub lacks: Option<RecordingError>,
}

/// A column of a file.
#[derive(Debug, Clone)]
pub struct SurveyedColumn {
    /// Its name.
    pub name: String,
    /// The unit that the file states beside it.
    pub unit: Option<String>,
    /// What it is recognised as, in SI, such as `torque_nm`.
    pub quantity: Option<Quantity>,
    /// Its smallest and largest number in SI, where it is recognised and has any.
    pub range: Option<(f64, f64)>,
    /// Rows without a finite number.
    pub not_finite: usize,
}

/// How rows follow each other in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// First time, s.
    pub first_s: f64,
    /// Last time, s.
    pub last_s: f64,
    /// Rows a second, by the median step.
    pub rate_hz: f64,
    /// Steps of more than five median ones.
    pub gaps: usize,
    /// The longest step, s, and when it begins, s.
    pub longest: (f64, f64),
    /// Steps that do not go forward.
    pub backward: usize,
}

/// A step of so many median ones is a gap.
const GAP: f64 = 5.0;

impl Survey {
    /// Looks into a file. What is wrong with its rows is counted, not refused.
    ///
    /// # Errors
    /// The file cannot be read at all, or a field of it is no number.
    pub fn of(file: &RecordingFile, reading: &Reading, progress: Progress<'_>) -> Result<Survey, RecordingError> {
        let mut opened = open(file, progress)?;
        let any = Needs {
            time: Need::IfPresent,
            torque: Need::IfPresent,
            motion: Need::IfPresent,
            simulation: Need::IfPresent,
        };
        let lenient = Reading { needs: any, from_s: None, to_s: None, ..reading.clone() };
        let found = lenient.sources(&file.name, opened.table());
        let lacks = reading.sources(&file.name, opened.table()).err().or(found.as_ref().err().cloned());
        let heads = opened.table().heads().to_vec();
        let columns = heads.into_iter().map(|head| SurveyedColumn {
            name: head.name,
            unit: head.unit,
            quantity: None,
            range: None,
            not_finite: 0,
        });
        let mut survey = Survey {
            file: file.name.clone(),
            format: opened.format,
            header_line: match opened.table().header_place() {
                Some(Location::Line(line)) => Some(line),
                _ => None,
            },
            rows: None,
            columns: columns.collect(),
            timing: None,
            lacks,
        };
        let sources = found.unwrap_or_default();
        let indices: Vec<usize> = sources.iter().map(|source| source.index).collect();
        if indices.is_empty() {
            return Ok(survey);
        }
        for (source, mut values) in sources.iter().zip(opened.table().read(&indices)?) {
            source.convert(&mut values);
            let column = &mut survey.columns[source.index];
            column.quantity = Some(source.quantity);
            column.not_finite = values.iter().filter(|value| !value.is_finite()).count();
            let finite = values.iter().copied().filter(|value| value.is_finite());
            column.range = finite.fold(None, |range: Option<(f64, f64)>, x| {
                Some(range.map_or((x, x), |(low, high)| (low.min(x), high.max(x))))
            });
            survey.rows = Some(values.len());
            if source.quantity == Quantity::Time {
                survey.timing = Timing::of(&values);
            }
        }
        if survey.lacks.is_none() && survey.rows.is_some_and(|rows| rows < 2) {
            let problem = RecordingProblem::TooShort("fewer than two rows");
            survey.lacks = Some(RecordingError::of_file(&file.name, problem));
        }
        Ok(survey)
    }
}

impl Timing {
    pub(crate) fn of(time: &[f64]) -> Option<Timing> {
        let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let backward = steps.iter().filter(|step| **step <= 0.0).count();
        let longest = steps.iter().copied().zip(time.iter().copied()).max_by(|a, b| a.0.total_cmp(&b.0))?;
        let median = robust::median(&mut steps);
        let gaps = steps.iter().filter(|step| **step > GAP * median).count();
        let (first_s, last_s) = (*time.first()?, *time.last()?);
        Some(Timing { first_s, last_s, rate_hz: 1.0 / median, gaps, longest, backward })
    }
}

impl Recording {
    /// The columns that it has, by their names in SI.
    pub fn channels(&self) -> Vec<(&'static str, &Samples)> {
        let torque = match self.torque_unit {
            super::TorqueUnit::NewtonMetre => "torque_nm",
            super::TorqueUnit::Ampere => "current_a",
        };
        [
            ("deflection_rad", &self.deflection_rad),
            ("theta_in_rad", &self.theta_in_rad),
            ("theta_out_rad", &self.theta_out_rad),
            ("velocity_out_rad_per_s", &self.velocity_out_rad_per_s),
            ("temperature_c", &self.temperature_c),
            (torque, &self.torque),
            ("torque_sim_nm", &self.torque_sim_nm),
        ]
        .into_iter()
        .filter_map(|(name, values)| Some((name, values.as_ref()?)))
        .collect()
    }
}
