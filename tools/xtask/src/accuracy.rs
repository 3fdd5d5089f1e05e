//! How well each model that is counted predicts the same recording: the error that `gmhm compare` finds on blocks held out.

use anyhow::{Context, Result};
use serde_json::Value;
use xshell::{Shell, cmd};

use crate::program::{self, Profile};

/// What the table calls the model of the crate itself.
const OWN: (&str, &str) = ("GMHM masing", "law `masing`, away from a reversal");

/// Calls whose error is that of a model: its inverse, or other arithmetic for the same curve.
const SAME: [(&str, &str); 3] = [
    ("Prandtl–Ishlinskii inverse, 10 elements", "Maxwell slip, 10 elements"),
    ("closed form of the paper, `libm`", "closed form of the paper"),
    ("closed form of the paper, tuned sine, exponential and arcsine", "closed form of the paper"),
];

/// Errors of the models on a recording, N·m.
pub struct Accuracy(Vec<(String, f64)>);

impl Accuracy {
    /// Compares the models on the recording of the demo: synthetic, of the published gear, with noise.
    pub fn measure(shell: &Shell) -> Result<Self> {
        let folder = shell.create_temp_dir()?;
        let path = |name: &str| folder.path().join(name);
        let (recording, table, plot) = (path("recording.csv"), path("table.json"), path("plot.svg"));
        let folder = folder.path();
        let gmhm = program::gmhm(shell, Profile::Dev)?;
        cmd!(shell, "{gmhm} demo --out {folder}").quiet().ignore_stdout().run().context("`gmhm demo` failed")?;
        cmd!(shell, "{gmhm} compare {recording} --json {table} --plot {plot} --quiet")
            .quiet()
            .ignore_stdout()
            .run()
            .context("`gmhm compare` failed")?;
        let text = shell.read_file(&table)?;
        let compared: Value = serde_json::from_str(&text).context("`gmhm compare` wrote no JSON")?;
        let models = compared["models"].as_array().context("`gmhm compare` lists no models")?;
        let error = |model: &Value| Some((model["model"].as_str()?.to_owned(), model["heldout_rms"].as_f64()?));
        Ok(Self(models.iter().filter_map(error).collect()))
    }

    /// The error of a call of the table, where `gmhm compare` knows its model.
    pub fn of(&self, call: &str) -> Option<f64> {
        let other = SAME.iter().find(|(name, _)| *name == call).map(|(_, model)| *model);
        let model = if call == OWN.1 { OWN.0 } else { other.unwrap_or(call) };
        self.0.iter().find(|(name, _)| name == model).map(|(_, error)| *error)
    }
}
