//! The key of a simulated recording: what was true.

use super::hide::Hidden;
use super::joint::Plant;
use super::noise::Noise;
use super::options::Experiment;
use crate::model::Model;

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

impl Key {
    /// The key's text.
    ///
    /// # Panics
    /// Never: a model file is TOML.
    pub fn to_toml(&self) -> String {
        let mut simulation = toml::Table::new();
        // TOML's integers are signed; a seed beyond them keeps its bits as text.
        simulation.insert("seed".to_owned(), self.seed.to_string().into());
        simulation.insert("experiment".to_owned(), self.experiment.to_string().into());
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
}
