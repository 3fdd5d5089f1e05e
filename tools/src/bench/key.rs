//! The key of a simulated recording: what was true.

use std::str::FromStr;

use clap::ValueEnum;

use super::hide::Hidden;
use super::joint::Plant;
use super::noise::{Noise, NoiseError};
use super::options::Experiment;
use crate::model::{self, Model, ModelError};

/// What a recording was made from. The file holds a table `[simulation]`, a `[[hidden]]` for every hidden effect, and
/// under `[truth]` the model file of the gear with the effects as its last terms.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// Seed of every random choice.
    pub seed: u64,
    /// The experiment.
    pub experiment: Experiment,
    /// The command line that made it; empty where there was none.
    pub command: String,
    /// Rows.
    pub rows: usize,
    /// Length, s.
    pub duration_s: f64,
    /// Noise of the sensors.
    pub noise: Noise,
    /// The gear that was simulated: `model`, or, in experiment `joint`, one that the model does not describe.
    pub plant: Plant,
    /// What was hidden, in the order of the last terms of the truth.
    pub hidden: Vec<Hidden>,
    /// The model; in experiment `drift`, what it has become at the end. But in these two and in experiment `joint`, its prediction is the torque of perfect sensors.
    pub truth: Model,
}

/// Why a text is no key.
#[derive(Debug, thiserror::Error)]
pub enum KeyError {
    /// Not TOML.
    #[error("the key is no TOML: {0}")]
    Toml(#[from] toml::de::Error),
    /// A field is missing, or of another type.
    #[error("the key's field {0} is missing or of the wrong type")]
    Field(&'static str),
    /// The noise cannot be read.
    #[error(transparent)]
    Noise(#[from] NoiseError),
    /// The gear cannot be read.
    #[error(transparent)]
    Model(#[from] ModelError),
}

impl Key {
    /// The key's text.
    ///
    /// # Panics
    /// Never: a model file is TOML.
    pub fn to_toml(&self) -> String {
        let mut simulation = toml::Table::new();
        // TOML's integers are signed; a seed beyond them keeps its bits as text.
        simulation.insert("seed".to_owned(), self.seed.to_string().into());
        simulation.insert("experiment".to_owned(), self.experiment.name().into());
        simulation.insert("command".to_owned(), self.command.clone().into());
        simulation.insert("rows".to_owned(), (self.rows as i64).into());
        simulation.insert("duration_s".to_owned(), self.duration_s.into());
        simulation.insert("noise".to_owned(), self.noise.to_string().into());
        simulation.insert("plant".to_owned(), self.plant.name().into());
        let truth: toml::Table = self.truth.to_toml().parse().expect("a model file is TOML");
        let mut key = toml::Table::new();
        key.insert("simulation".to_owned(), simulation.into());
        if !self.hidden.is_empty() {
            let hidden = toml::Value::try_from(&self.hidden).expect("names and numbers are TOML");
            key.insert("hidden".to_owned(), hidden);
        }
        key.insert("truth".to_owned(), truth.into());
        key.to_string()
    }

    /// Reads what [`to_toml`](Self::to_toml) wrote.
    ///
    /// # Errors
    /// [`KeyError`] names the field.
    pub fn from_toml(text: &str) -> Result<Self, KeyError> {
        let key: toml::Table = text.parse()?;
        let simulation = key.get("simulation").and_then(toml::Value::as_table).ok_or(KeyError::Field("simulation"))?;
        let field = |name| simulation.get(name).ok_or(KeyError::Field(name));
        let text = |name| field(name)?.as_str().ok_or(KeyError::Field(name));
        let truth = key.get("truth").and_then(toml::Value::as_table).ok_or(KeyError::Field("truth"))?;
        Ok(Self {
            seed: text("seed")?.parse().map_err(|_| KeyError::Field("seed"))?,
            experiment: <Experiment as ValueEnum>::from_str(text("experiment")?, false)
                .map_err(|_| KeyError::Field("experiment"))?,
            command: text("command")?.to_owned(),
            rows: field("rows")?.as_integer().and_then(|n| usize::try_from(n).ok()).ok_or(KeyError::Field("rows"))?,
            duration_s: field("duration_s")?.as_float().ok_or(KeyError::Field("duration_s"))?,
            noise: <Noise as FromStr>::from_str(text("noise")?)?,
            plant: <Plant as ValueEnum>::from_str(text("plant")?, false).map_err(|_| KeyError::Field("plant"))?,
            hidden: match key.get("hidden") {
                Some(hidden) => hidden.clone().try_into()?,
                None => Vec::new(),
            },
            truth: model::parse("[truth]", &truth.to_string())?,
        })
    }
}
