//! `gmhm simulate`.

use std::path::PathBuf;

use clap::Args;

use super::common::SeedArgs;
use super::failure::Failure;
use crate::bench::{self, Experiment, Options};
use crate::model;
use crate::output::Outputs;

/// Run the virtual test bench on the gear of a model file: a synthetic recording
///
/// The bench has a motor, the gear, a torque sensor, two encoders and a machine that loads and brakes. The torque is that of the core, as in
/// gmhm predict; sensors add noise and quantisation. What was true goes into the key.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gmhm simulate gear.toml --experiment cycle -o cycle.csv
  gmhm simulate gear.toml --experiment running --noise torque=0.1,ar=0.95,encoder_bits=20 --seed 7 -o running.csv --key key.toml
  gmhm simulate gear.toml --experiment running --hide kinematic_error=0.15 --hide wear:step=0.1 -o worn.csv --key key.toml
  gmhm simulate gear.toml --experiment joint --plant maxwell-slip --compensation reference -o joint.csv")]
pub struct SimulateArgs {
    /// Model file of the gear
    #[arg(value_name = "M.toml")]
    model: PathBuf,
    /// What the bench does with it
    #[arg(long, value_enum)]
    experiment: Experiment,
    /// Where to write the recording
    #[arg(short, long, value_name = "REC.csv")]
    output: PathBuf,
    /// Where to write what was true
    #[arg(long, value_name = "K.toml")]
    key: Option<PathBuf>,
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    seed: SeedArgs,
}

impl SimulateArgs {
    pub(super) fn run(&self) -> Result<(), Failure> {
        for output in [Some(&self.output), self.key.as_ref()].into_iter().flatten() {
            Outputs::check(output)?;
        }
        let model = model::load(&self.model)?;
        let (recording, mut key) = bench::simulate(&model, self.experiment, &self.options, self.seed.seed)?;
        key.command = std::env::args().collect::<Vec<_>>().join(" ");
        let mut outputs = Outputs::new();
        outputs.add(&self.output, |out| Ok::<(), Failure>(recording.write(out)?))?;
        if let Some(path) = &self.key {
            outputs.add_text(path, &key.to_toml())?;
        }
        outputs.commit()?;
        println!(
            "Synthetic recording of experiment {}: {} rows, {:.6} s, seed {}, noise {}",
            self.experiment, key.rows, key.duration_s, key.seed, key.noise
        );
        if self.experiment == Experiment::Joint {
            println!("\n{}", bench::joint::run(&model, self.seed.seed)?);
        }
        println!("Recording written to {}", self.output.display());
        Ok(())
    }
}
