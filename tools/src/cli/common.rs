//! Options that several commands share.

use std::path::{Path, PathBuf};

use clap::Args;

use super::Session;
use super::failure::Failure;
use super::progress::Progress;
use crate::recording::{self, ColumnMap, Mapping, Needs, Recording};
use crate::report::page::{Input, Provenance};

/// How recordings are read.
#[derive(Debug, Args)]
pub struct ReadingArgs {
    /// Columns under other names, scaled or flipped: time_s=t,torque_nm=tau*0.001,deflection_rad=-x
    ///
    /// The value is the number of the file, scaled and shifted as written, in the unit that the name on the left ends in. Known names:
    /// time_s, torque_nm, current_a, deflection_rad, theta_in_rad, theta_out_rad, velocity_out_rad_per_s, temperature_c,
    /// torque_sim_nm, each in any unit of its kind (_ms, _nmm, _mrad, _deg, _arcmin, ...).
    #[arg(long, value_name = "NAME=COLUMN,...", value_delimiter = ',', action = clap::ArgAction::Append)]
    map: Vec<Mapping>,

    /// Rated deflection in rad (else the model's, else the largest seen)
    #[arg(long, value_name = "RAD", value_parser = positive)]
    pub rated_deflection: Option<f64>,
}

impl ReadingArgs {
    /// The whole of `--map`; two entries for one quantity are wrong usage.
    pub fn map(&self) -> ColumnMap {
        ColumnMap::new(self.map.clone()).unwrap_or_else(|e| super::wrong_usage(&format!("--map: {e}")))
    }

    /// Reads a recording under a progress bar.
    pub fn read(&self, path: &Path, needs: &Needs, quiet: bool) -> Result<Recording, Failure> {
        let bytes = path.metadata().map_or(0, |m| m.len());
        let progress = Progress::new(&format!("Reading {}", path.display()), bytes, quiet);
        Ok(recording::read(path, &self.map(), needs, &|done| progress.at(done))?)
    }
}

impl ReadingArgs {
    /// Reads several recordings to identify from, one after the other; dropouts of their angles are bridged, and told.
    pub fn read_all(&self, paths: &[PathBuf], session: &Session) -> Result<Vec<Recording>, Failure> {
        let read = |path: &PathBuf| {
            let mut recording = self.read(path, &Needs::FIT, session.quiet)?;
            recording.bridge_dropouts().iter().for_each(|bridged| session.note(&bridged.to_string()));
            Ok(recording)
        };
        paths.iter().map(read).collect()
    }
}

/// The seed of every random choice.
#[derive(Debug, Args)]
pub struct SeedArgs {
    /// Seed of every random choice
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
}

impl Default for SeedArgs {
    fn default() -> Self {
        SeedArgs { seed: 1 }
    }
}

/// Results to standard output. A reader that has had enough of them, as `head`, is no failure: the files are written by then.
///
/// # Errors
/// The system refuses.
pub fn say(results: std::fmt::Arguments<'_>) -> Result<(), Failure> {
    use std::io::{ErrorKind, Write};
    let mut out = std::io::stdout().lock();
    match out.write_fmt(results).and_then(|()| out.flush()) {
        Err(refusal) if refusal.kind() != ErrorKind::BrokenPipe => Err(refusal.into()),
        _ => Ok(()),
    }
}

/// Results as indented JSON with a line break at the end.
pub fn json(results: &impl serde::Serialize) -> Result<String, Failure> {
    Ok(serde_json::to_string_pretty(results).map_err(std::io::Error::other)? + "\n")
}

/// A finite number greater than zero.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err("must be a number greater than zero".to_owned()),
    }
}

/// An address in the memory of a chip.
pub fn address(text: &str) -> Result<u32, String> {
    let number = match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        Some(digits) => u32::from_str_radix(digits, 16),
        None => text.parse(),
    };
    number.map_err(|_| "must be a 32-bit address, such as 0x3F000".to_owned())
}

/// What a report says of where it comes from.
pub fn provenance(inputs: Vec<Input>, seed: Option<u64>) -> Provenance {
    let words = std::env::args().skip(1).map(|word| quoted(&word));
    let command = std::iter::once("gmhm".to_owned()).chain(words).collect::<Vec<_>>().join(" ");
    Provenance { command, inputs, seed }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}
