//! Models: files, prediction, inversion, simulation, blocks.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use gmhm::block::{Identity, verify};
use gmhm_tools::bench::{self, Experiment, Options};
use gmhm_tools::block::{self, Arithmetic, Contents, FileError, Form, PackOptions};
use gmhm_tools::failure::Failure;
use gmhm_tools::jobs;
use gmhm_tools::model::{self, Model as Inner};
use gmhm_tools::output::Outputs;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::recording::Recording;
use crate::{errors, job, options};

type Array<'py> = Bound<'py, PyArray1<f64>>;

/// A model file.
#[pyclass(frozen, module = "gmhm._gmhm")]
pub struct Model {
    pub inner: Arc<Inner>,
}

impl From<Inner> for Model {
    fn from(inner: Inner) -> Self {
        Self { inner: Arc::new(inner) }
    }
}

/// The model that is given, with what options say of its gear.
pub fn of_gear(
    py: Python<'_>,
    model: Option<&Model>,
    ratio: Option<f64>,
    torque_side: Option<&str>,
) -> PyResult<Option<Inner>> {
    let (ratio, side) = (options::ratio(py, ratio)?, options::torque_side(py, torque_side)?);
    Ok(model.map(|model| Inner::clone(&model.inner).of_gear(ratio, side)))
}

/// What a bench may be asked, as words of the command line.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Bench {
    experiment: String,
    seed: u64,
    duration_s: Option<f64>,
    sample_rate_hz: Option<f64>,
    amplitudes: Vec<f64>,
    rates_hz: Vec<f64>,
    cycles: Option<u32>,
    waveform: Option<String>,
    speed_rad_per_s: Option<f64>,
    plant: Option<String>,
    compensation: Option<String>,
    warm_up_k: Option<f64>,
    hide: Vec<String>,
    noise: Option<String>,
}

impl Bench {
    fn options(&self, py: Python<'_>) -> PyResult<(Experiment, Options)> {
        let hide = |text: &String| text.parse().map_err(|error| errors::wrong_option(py, "hide", &format!("{error}")));
        let noise =
            |text: &String| text.parse().map_err(|error| errors::wrong_option(py, "noise", &format!("{error}")));
        let options = Options {
            duration_s: self.duration_s,
            sample_rate_hz: self.sample_rate_hz,
            amplitudes: self.amplitudes.clone(),
            rates_hz: self.rates_hz.clone(),
            cycles: self.cycles,
            waveform: self.waveform.as_deref().map(|text| options::word(py, "waveform", text)).transpose()?,
            speed_rad_per_s: self.speed_rad_per_s,
            plant: self.plant.as_deref().map(|text| options::word(py, "plant", text)).transpose()?,
            compensation: self
                .compensation
                .as_deref()
                .map(|text| options::word(py, "compensation", text))
                .transpose()?,
            warm_up_k: self.warm_up_k.unwrap_or(Options::WARM_UP_K),
            hide: self.hide.iter().map(hide).collect::<PyResult<_>>()?,
            noise: self.noise.as_ref().map(noise).transpose()?,
        };
        Ok((options::word(py, "experiment", &self.experiment)?, options))
    }
}

#[pymethods]
impl Model {
    /// Reads the text of a model file.
    #[staticmethod]
    fn parse(py: Python<'_>, text: &str, file: &str) -> PyResult<Self> {
        model::parse(file, text).map(Self::from).map_err(|error| errors::exception(py, &error.into()))
    }

    /// Reads a model file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        model::load(&path).map(Self::from).map_err(|error| errors::exception(py, &error.into()))
    }

    #[getter]
    fn torque_unit(&self) -> &'static str {
        self.inner.torque_unit.suffix()
    }

    fn to_toml(&self) -> String {
        self.inner.to_toml()
    }

    /// Writes the model file, whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        written(&path, self.inner.to_toml().as_bytes()).map_err(|failure| errors::exception(py, &failure))
    }

    /// Torque, elastic and hysteresis torque, and the terms by name.
    #[pyo3(signature = (recording, rated_deflection_rad=None, ratio=None, torque_side=None))]
    #[allow(clippy::type_complexity, reason = "the tuple is what the wrapper names")]
    fn predict<'py>(
        &self,
        py: Python<'py>,
        recording: &Recording,
        rated_deflection_rad: Option<f64>,
        ratio: Option<f64>,
        torque_side: Option<&str>,
    ) -> PyResult<(Array<'py>, Array<'py>, Array<'py>, Vec<(String, Array<'py>)>, usize, u32)> {
        let rated = options::positive(py, "rated_deflection_rad", rated_deflection_rad)?;
        let model = of_gear(py, Some(self), ratio, torque_side)?.unwrap_or_default();
        let inner = Arc::clone(&recording.inner);
        let found =
            job::run(py, move |caller| jobs::predict::predict(&model, rated, &inner, &mut caller.notes(), caller))?;
        recording.unchanged(py)?;
        let terms = found.terms.into_iter().map(|(name, values)| (name, values.into_pyarray(py))).collect();
        Ok((
            found.torque.into_pyarray(py),
            found.elastic.into_pyarray(py),
            found.hysteresis.into_pyarray(py),
            terms,
            found.rows_out_of_range,
            found.merged_pairs,
        ))
    }

    /// Deflection, whether it is held at the edge, and the edge.
    #[pyo3(signature = (recording, rated_deflection_rad=None))]
    fn invert<'py>(
        &self,
        py: Python<'py>,
        recording: &Recording,
        rated_deflection_rad: Option<f64>,
    ) -> PyResult<(Array<'py>, Bound<'py, PyArray1<bool>>, f64, u32)> {
        let rated = options::positive(py, "rated_deflection_rad", rated_deflection_rad)?;
        let (model, inner) = (Arc::clone(&self.inner), Arc::clone(&recording.inner));
        let found =
            job::run(py, move |caller| jobs::predict::invert(&model, rated, &inner, &mut caller.notes(), caller))?;
        recording.unchanged(py)?;
        let saturated = found.saturated.into_pyarray(py);
        Ok((found.deflection_rad.into_pyarray(py), saturated, found.range_rad, found.merged_pairs))
    }

    /// A synthetic recording, its key as TOML, and the gear that was simulated.
    fn simulate(&self, py: Python<'_>, asked: &Bound<'_, PyAny>) -> PyResult<(Recording, String, Self)> {
        let asked: Bench = asked.extract()?;
        let (experiment, options) = asked.options(py)?;
        let model = Arc::clone(&self.inner);
        job::run(py, move |_| {
            let (recording, key) = bench::simulate(&model, experiment, &options, asked.seed)?;
            Ok((Recording::new(recording, experiment.to_string()), key.to_toml(), key.truth.into()))
        })
    }

    /// The bytes of the parameter block, and why it has no inverse where it has none.
    #[pyo3(signature = (scalar, period_s=None, gear=None, stack_depth=16, rated_deflection_rad=None))]
    fn pack<'py>(
        &self,
        py: Python<'py>,
        scalar: &str,
        period_s: Option<f64>,
        gear: Option<&str>,
        stack_depth: u16,
        rated_deflection_rad: Option<f64>,
    ) -> PyResult<(Bound<'py, PyBytes>, Option<String>)> {
        let refuse = |option, problem| Err(errors::wrong_option(py, option, problem));
        let arithmetic = match scalar {
            "f32" => Arithmetic::F32,
            "fixed" => Arithmetic::Fixed,
            _ => return refuse("scalar", "must be f32 or fixed"),
        };
        let identity = match gear.map(Identity::new) {
            Some(None) => return refuse("gear", "must have at most 16 bytes"),
            given => given.flatten(),
        };
        if stack_depth < 4 || !stack_depth.is_multiple_of(2) {
            return refuse("stack_depth", "must be an even number of 4 or more");
        }
        let options = PackOptions {
            arithmetic,
            period_s: options::positive(py, "period_s", period_s)?,
            rated_deflection_rad: options::positive(py, "rated_deflection_rad", rated_deflection_rad)?,
            identity,
            stack_depth: Some(stack_depth),
            ..PackOptions::default()
        };
        let packed = block::pack(&self.inner, &options).map_err(|error| errors::exception(py, &error.into()))?;
        Ok((PyBytes::new(py, &packed.bytes), packed.without_inverse))
    }
}

/// What a block holds, as `gmhm inspect --json` writes it.
#[pyfunction]
pub fn inspect(py: Python<'_>, bytes: &[u8], name: &str) -> PyResult<String> {
    let contents = verify(bytes).and_then(|block| Contents::of(&block));
    let refused = |error| FileError::Block { path: name.into(), error };
    let contents = contents.map_err(|error| errors::exception(py, &refused(error).into()))?;
    Ok(contents.json().to_string())
}

/// The bytes of a block from a `.bin` or `.hex`.
#[pyfunction]
pub fn read_block(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyBytes>> {
    let file = block::read(&path).map_err(|error| errors::exception(py, &error.into()))?;
    Ok(PyBytes::new(py, &file.bytes))
}

/// Writes a block as the ending of the path says: `.bin`, `.hex` or `.h`.
#[pyfunction]
pub fn write_block(py: Python<'_>, bytes: &[u8], path: PathBuf, address: u32) -> PyResult<()> {
    let write = || -> Result<(), Failure> {
        let form = Form::of(&path)?;
        let block = verify(bytes).map_err(|error| FileError::Block { path: path.clone(), error })?;
        written(&path, &block::write(form, &path, &block, address)?)
    };
    write().map_err(|failure| errors::exception(py, &failure))
}

fn written(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let mut outputs = Outputs::new();
    outputs.add(path, |out| Ok::<(), Failure>(out.write_all(bytes)?))?;
    Ok(outputs.commit()?)
}
