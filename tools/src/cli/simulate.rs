//! `gmhm simulate`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::Session;
use super::common::{SeedArgs, drawing, json, rows_file};
use super::failure::Failure;
use super::files::Files;
use super::progress::{Progress, Working};
use crate::bench::joint::{self, Plant};
use crate::bench::{self, BenchError, Experiment, Options};
use crate::device::{Lockstep, Target, line};
use crate::model;
use crate::number::{number, trimmed};
use crate::output::Outputs;

/// Run the virtual test bench on the gear of a model file: a synthetic recording
///
/// The bench has a motor, the gear, a torque sensor, two encoders and a machine that loads and brakes. The torque is computed as in
/// gmhm predict; the sensors add noise and quantisation. The true values are written into the key. Experiment joint also reports the position error with each
/// compensation, on the gear of --plant, or on all of them.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gmhm simulate gear.toml --experiment cycle -o cycle.csv
  gmhm simulate gear.toml --experiment running --noise torque=0.1,ar=0.95,encoder_bits=20 --seed 7 -o running.csv --key key.toml
  gmhm simulate gear.toml --experiment running --hide kinematic_error=0.15 --hide wear:step=0.1 -o worn.csv --key key.toml
  gmhm simulate gear.toml --experiment joint --plant maxwell-slip --compensation reference -o joint.csv
  gmhm simulate gear.toml --experiment joint -o joint.csv --plot joint.svg --json joint.json")]
pub struct SimulateArgs {
    /// Model file of the gear
    #[arg(value_name = "M.toml")]
    model: PathBuf,
    /// Experiment of the bench
    #[arg(long, value_enum)]
    experiment: Experiment,
    /// Where to write the recording
    #[arg(short, long, value_name = "REC.csv", value_parser = rows_file)]
    output: PathBuf,
    /// Where to write the true values
    #[arg(long, value_name = "K.toml")]
    key: Option<PathBuf>,
    /// Where to draw the link's error by compensation, on the gear of --plant or else maxwell-slip (joint) [default: beside the recording]
    #[arg(long, value_name = "F.svg", value_parser = drawing)]
    plot: Option<PathBuf>,
    /// Where to write the error of each compensation (joint)
    #[arg(long, value_name = "F.json")]
    json: Option<PathBuf>,
    /// Drive that runs in lock-step with the bench, serial:PORT or tcp:HOST:PORT; compared with the same servo on this host (joint)
    #[arg(long, value_name = "TARGET", conflicts_with_all = ["plot", "json"])]
    drive: Option<Target>,
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    seed: SeedArgs,
}

/// A list of keys and numbers, the numbers to three digits.
fn rounded(noise: &str) -> String {
    let short = |part: &str| match part.split_once('=').map(|(key, value)| (key, value.parse::<f64>())) {
        Some((key, Ok(value))) => format!("{key}={}", trimmed(value, 3)),
        _ => part.to_owned(),
    };
    noise.split(',').map(short).collect::<Vec<_>>().join(", ")
}

/// Bits a second of a serial port.
const BAUD: u32 = 921_600;

impl SimulateArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let joint = self.experiment == Experiment::Joint;
        let given =
            [("--plot", self.plot.is_some()), ("--json", self.json.is_some()), ("--drive", self.drive.is_some())];
        for (option, given) in given {
            if given && !joint {
                return Err(BenchError::NotInExperiment { option, experiment: self.experiment }.into());
            }
        }
        for output in
            [Some(&self.output), self.key.as_ref(), self.plot.as_ref(), self.json.as_ref()].into_iter().flatten()
        {
            Outputs::check(output)?;
        }
        let (model, seed) = (model::load(&self.model)?, self.seed.seed);
        let working = Working::new("Simulating", session.quiet);
        let (recording, mut key) = bench::simulate_under(&model, self.experiment, &self.options, seed, &working)?;
        key.command = std::env::args().collect::<Vec<_>>().join(" ");
        let mut files = Files::new(session);
        files.stream("Recording", &self.output, |out| Ok(recording.write_under(out, &working)?))?;
        files.add("Key", self.key.as_ref(), || Ok(key.to_toml()))?;
        drop(working);
        let mut text = format!(
            "Synthetic recording of experiment {}: {} rows, {} s, seed {}, noise {}\n",
            self.experiment,
            key.rows,
            number(key.duration_s, 5),
            key.seed,
            rounded(&key.noise.to_string())
        );
        if let Some(target) = &self.drive {
            let mut drive = Lockstep::new(line::open(target, BAUD)?);
            let run = joint::in_lockstep(&model, &self.options, seed, &mut drive)?;
            let equal = if run.equal { "every bit agrees" } else { "the runs differ" };
            text += &format!(
                "Link's position error, µrad rms: {:.4} with the drive at {target}, {:.4} with the same servo on this host; {equal}\n",
                1e6 * run.drive_rad,
                1e6 * run.host_rad
            );
        } else if joint {
            let given = self.options.plant;
            let plants = given.as_ref().map_or(Plant::value_variants(), std::slice::from_ref);
            let progress = Progress::new("Driving the joint", Progress::WHOLE, session.quiet);
            let report = joint::run(&model, plants, seed, &progress)?;
            drop(progress);
            text += &format!("\n{report}\n");
            let beside = || session.side_file(&self.output.with_extension("svg"), "--plot");
            files.add("Picture", self.plot.clone().or_else(beside).as_ref(), || {
                Ok(joint::figure(&model, given.unwrap_or(Plant::MaxwellSlip), seed)?.to_file())
            })?;
            files.add("JSON", self.json.as_ref(), || json(&report))?;
        }
        files.finish(text)
    }
}
