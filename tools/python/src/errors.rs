//! Failures of the library as exceptions of Python, in the words of the command line.

use std::ffi::CString;

use gmhm_tools::failure::Failure;
use gmhm_tools::fit::EstimateError;
use gmhm_tools::fit::verdict::AssessError;
use gmhm_tools::model::ModelError;
use gmhm_tools::physics::PredictError;
use gmhm_tools::physics::invert::InvertError;
use gmhm_tools::recording::{self, CopyError, RecordingError};
use pyo3::prelude::*;

/// Where the exceptions are.
const MODULE: &str = "gmhm._errors";

/// Where in an input.
#[derive(Default)]
struct Location {
    file: Option<String>,
    line: Option<u64>,
    row: Option<u64>,
    field: Option<String>,
}

impl Location {
    fn of_recording(error: &RecordingError) -> Self {
        let (line, row) = match error.place {
            Some(recording::Location::Line(line)) => (Some(line), None),
            Some(recording::Location::Row(row)) => (None, Some(row)),
            None => (None, None),
        };
        let field = error.column.as_ref().map(|column| column.name.clone());
        Location { file: Some(error.file.clone()), line, row, field }
    }

    fn of_model(error: &ModelError) -> Self {
        let field = Some(error.key.clone()).filter(|key| !key.is_empty());
        Location { file: Some(error.file.clone()), line: error.line().map(|line| line as u64), row: None, field }
    }

    fn of(failure: &Failure) -> Self {
        match failure {
            Failure::Recording(error) | Failure::Copy(CopyError::Recording(error)) => Self::of_recording(error),
            Failure::Predict(PredictError::Recording(error))
            | Failure::Assess(AssessError::Predict(PredictError::Recording(error)))
            | Failure::Invert(InvertError::Model(PredictError::Recording(error))) => Self::of_recording(error),
            Failure::Model(error) => Self::of_model(error),
            _ => Self::default(),
        }
    }
}

/// The class of a failure.
fn class(failure: &Failure) -> &'static str {
    match failure {
        Failure::Recording(_)
        | Failure::Copy(_)
        | Failure::Predict(PredictError::Recording(_))
        | Failure::Invert(InvertError::Model(PredictError::Recording(_))) => "RecordingError",
        Failure::Model(_) => "ModelError",
        Failure::Predict(_) => "PredictError",
        Failure::Invert(_) => "InvertError",
        Failure::Estimate(EstimateError::Implausible(_)) => "RecordingError",
        Failure::Estimate(_) | Failure::Assess(_) => "FitError",
        Failure::Discover(_) => "DiagnoseError",
        Failure::Health(_) => "HealthError",
        Failure::Bench(_) => "SimulateError",
        Failure::Pack(_) | Failure::BlockFile(_) => "BlockError",
        Failure::Output(_) => "OutputError",
        _ => "GmhmError",
    }
}

/// The exception of a failure.
pub fn exception(py: Python<'_>, failure: &Failure) -> PyErr {
    let Location { file, line, row, field } = Location::of(failure);
    let arguments = (failure.to_string(), failure.fix(), file, line, row, field);
    raised(py, class(failure), arguments)
}

/// The exception of an option that is none.
pub fn wrong_option(py: Python<'_>, option: &str, problem: &str) -> PyErr {
    raised(py, "OptionError", (format!("{option}: {problem}"),))
}

/// The exception of a recording whose array was written to.
pub fn changed_array(py: Python<'_>, recording: &str, column: &str) -> PyErr {
    let message = format!("{recording}: the array of `{column}` was written to after the recording was read");
    let help = "read the recording again, or give read copy=True: it then has rows of its own";
    raised(py, "RecordingError", (message, help, recording, None::<u64>, None::<u64>, column))
}

fn raised<'py>(py: Python<'py>, class: &str, arguments: impl pyo3::call::PyCallArgs<'py>) -> PyErr {
    let made = py.import(MODULE).and_then(|module| module.getattr(class)).and_then(|class| class.call1(arguments));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// Says something worth knowing that is no failure.
pub fn warn(py: Python<'_>, note: &str) -> PyResult<()> {
    let category = py.import(MODULE)?.getattr("Note")?;
    let text = CString::new(note.replace('\0', " "))?;
    // From the native function over its wrapper to the caller.
    PyErr::warn(py, &category, &text, 2)
}
