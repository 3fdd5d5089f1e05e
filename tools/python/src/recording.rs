//! Recordings: from files and from columns in memory, and their columns as arrays.

use std::path::PathBuf;
use std::sync::Arc;

use gmhm_tools::fit::EstimateError;
use gmhm_tools::recording::{Columns, RecordingError, RecordingFile, Samples};
use gmhm_tools::{demo as built_in, recording::Recording as Inner};
use numpy::ndarray::ArrayView1;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::lent::{Prints, lent};
use crate::model::Model;
use crate::{errors, job, options};

/// One recording in SI units.
#[pyclass(frozen, module = "gmhm._gmhm")]
pub struct Recording {
    pub inner: Arc<Inner>,
    /// The name of a model made from it.
    pub stem: String,
    prints: Prints,
}

impl Recording {
    pub fn new(inner: Inner, stem: String) -> Self {
        Self { prints: Prints::of(&inner), inner: Arc::new(inner), stem }
    }

    /// Checks that the arrays that it reads were not written to since it was made.
    pub fn unchanged(&self, py: Python<'_>) -> PyResult<()> {
        let changed = py.detach(|| self.prints.changed(&self.inner));
        changed.map_or(Ok(()), |column| Err(errors::changed_array(py, &self.inner.name, column)))
    }
}

#[pymethods]
impl Recording {
    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }

    #[getter]
    fn sha256(&self) -> &str {
        &self.inner.sha256
    }

    #[getter]
    fn torque_unit(&self) -> &'static str {
        self.inner.torque_unit.suffix()
    }

    #[getter]
    fn columns(&self) -> Vec<&'static str> {
        self.inner.columns().into_iter().map(|(name, _)| name).collect()
    }

    fn __len__(&self) -> usize {
        self.inner.len()
    }

    /// A column as it lies in memory, read-only; none where the recording has none.
    fn column<'py>(this: &Bound<'py, Self>, name: &str) -> Option<Bound<'py, PyArray1<f64>>> {
        let columns = this.get().inner.columns();
        let (_, values) = columns.into_iter().find(|(other, _)| *other == name)?;
        // SAFETY: the object that owns the numbers is the array's base, is frozen, and never moves or writes them.
        let array = unsafe { PyArray1::borrow_from_array(&ArrayView1::from(&**values), this.clone().into_any()) };
        array.readwrite().make_nonwriteable();
        Some(array)
    }

    /// Checks that what a command needs is there.
    #[pyo3(signature = (purpose, model=None))]
    fn require(&self, py: Python<'_>, purpose: &str, model: Option<&Model>) -> PyResult<()> {
        self.unchanged(py)?;
        let needs = options::needs(py, purpose, model)?;
        self.inner.require(&needs).map_err(|error| errors::exception(py, &error.into()))
    }
}

/// Reads a file.
#[pyfunction]
#[pyo3(signature = (path, purpose, model=None, map=None, from_s=None, to_s=None))]
pub fn read_file(
    py: Python<'_>,
    path: PathBuf,
    purpose: &str,
    model: Option<&Model>,
    map: Option<&str>,
    from_s: Option<f64>,
    to_s: Option<f64>,
) -> PyResult<Recording> {
    let reading = options::reading(py, (purpose, model), map, from_s, to_s)?;
    job::run(py, move |_| {
        let file = RecordingFile::from(&path);
        Ok(Recording::new(reading.read(&file, &|_| {})?, file.stem()))
    })
}

/// Columns of Python, each asked for by its place.
struct Asked {
    names: Vec<String>,
    column: Py<PyAny>,
}

impl Columns for Asked {
    fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    fn numbers(&mut self, index: usize) -> Result<Samples, String> {
        Python::attach(|py| {
            let said = |error: PyErr| error.value(py).to_string();
            let array = self.column.bind(py).call1((index,)).map_err(said)?;
            let array: PyReadonlyArray1<'_, f64> = array.extract().map_err(said)?;
            lent(&array).map_err(said)
        })
    }
}

/// Reads columns in memory: `column(k)` is the array of the k-th of `names`.
#[pyfunction]
#[pyo3(signature = (name, names, column, purpose, model=None, map=None, from_s=None, to_s=None))]
#[allow(clippy::too_many_arguments, reason = "the wrapper names them")]
pub fn read_columns(
    py: Python<'_>,
    name: String,
    names: Vec<String>,
    column: Py<PyAny>,
    purpose: &str,
    model: Option<&Model>,
    map: Option<&str>,
    from_s: Option<f64>,
    to_s: Option<f64>,
) -> PyResult<Recording> {
    let reading = options::reading(py, (purpose, model), map, from_s, to_s)?;
    let mut columns = Asked { names, column };
    let read = py.detach(|| Ok(Recording::new(reading.read_columns(&name, &mut columns)?, name)));
    read.map_err(|error: RecordingError| errors::exception(py, &error.into()))
}

/// The built-in recording of `gmhm demo`.
#[pyfunction]
pub fn demo(py: Python<'_>, seed: u64) -> PyResult<Recording> {
    job::run(py, move |_| {
        let made = built_in::built_in(seed).map_err(EstimateError::from)?;
        Ok(Recording::new(made.recording, "demo".to_owned()))
    })
}

/// Checks that no array was written to while work went on.
pub fn unchanged(py: Python<'_>, recordings: &[Py<Recording>]) -> PyResult<()> {
    recordings.iter().try_for_each(|recording| recording.get().unchanged(py))
}

/// The recordings themselves.
pub fn owned(recordings: &[Py<Recording>]) -> Vec<Arc<Inner>> {
    recordings.iter().map(|recording| Arc::clone(&recording.get().inner)).collect()
}
