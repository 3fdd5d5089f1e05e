//! Options that several commands share.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::Value;

use super::Session;
use super::failure::Failure;
use super::progress::Progress;
use crate::jobs::ready::ready;
use crate::model::{Model, TorqueSide};
use crate::recording::{self, ColumnMap, Format, Mapping, Needs, Reading, Recording, RecordingFile};
use crate::report::page::{Input, Provenance};

/// Which recordings.
#[derive(Debug, Args)]
pub struct RecordingArgs {
    /// Recordings of one gear or joint: CSV (.gz, .zst), Parquet, MAT, MDF4 or MCAP; a folder means the recordings in it, - is standard input
    #[arg(required_unless_present = "files_from", value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// File with more recordings, one path per line; - is standard input
    #[arg(long, value_name = "FILE")]
    files_from: Option<PathBuf>,
}

impl RecordingArgs {
    /// The paths as they were given.
    pub fn paths(&self) -> &[PathBuf] {
        &self.recordings
    }

    /// The list of more.
    pub fn list(&self) -> Option<&Path> {
        self.files_from.as_deref()
    }

    /// The files, folders opened.
    pub fn files(&self) -> Result<Vec<RecordingFile>, Failure> {
        Ok(recording::files_and_listed(&self.recordings, self.files_from.as_deref())?)
    }
}

/// How recordings are read.
#[derive(Debug, Args)]
pub struct ReadingArgs {
    /// Columns under other names, scaled or flipped: time_s=t,torque_nm=tau*0.001,deflection_rad=-x
    ///
    /// The number in the file is scaled and shifted as written. The ending of the name on the left is its unit. Known names:
    /// time_s, torque_nm, current_a, deflection_rad, theta_in_rad, theta_out_rad, velocity_out_rad_per_s, temperature_c,
    /// torque_sim_nm, each in any unit of its kind (_ms, _nmm, _mrad, _deg, _arcmin, ...). gmhm columns lists the columns of a file.
    #[arg(long, value_name = "NAME=COLUMN,...", value_delimiter = ',', action = clap::ArgAction::Append)]
    map: Vec<Mapping>,

    /// Rated deflection in rad [default: the model's, otherwise the largest recorded]
    #[arg(long, value_name = "RAD", allow_negative_numbers = true, value_parser = positive)]
    pub rated_deflection: Option<f64>,

    /// Reduction ratio, negative if the gear reverses; required for recordings of two angles [default: the model's]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = ratio)]
    pub ratio: Option<f64>,

    /// Side on which the torque is measured [default: the model's, otherwise output; motor for a current]
    #[arg(long, value_enum, value_name = "SIDE")]
    pub torque_side: Option<TorqueSide>,

    /// Ignore rows before this time, in seconds of the time column
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = finite)]
    from: Option<f64>,

    /// Ignore rows after this time, in seconds of the time column
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = finite)]
    to: Option<f64>,
}

impl ReadingArgs {
    /// How they are read for what is needed of them; two entries of `--map` for one quantity are wrong usage.
    pub fn reading(&self, needs: &Needs) -> Reading {
        let map = ColumnMap::new(self.map.clone()).unwrap_or_else(|e| super::wrong_usage(&format!("--map: {e}")));
        if let (Some(from), Some(to)) = (self.from, self.to)
            && from >= to
        {
            super::wrong_usage("--from must be before --to");
        }
        Reading { from_s: self.from, to_s: self.to, ..Reading::new(map, *needs) }
    }

    /// Reads a recording under a progress bar.
    pub fn read(&self, file: &RecordingFile, needs: &Needs, session: &Session) -> Result<Recording, Failure> {
        let bytes = file.path.metadata().map_or(0, |m| m.len());
        let progress = Progress::new(&format!("Reading {}", file.name), bytes, session.quiet);
        Ok(self.reading(needs).read(file, &|done| progress.at(done))?)
    }

    /// A model's gear section, with what the options say of it instead.
    pub fn of_gear(&self, model: Model) -> Model {
        model.of_gear(self.ratio, self.torque_side)
    }

    /// Reads several recordings to identify from, one after the other; dropouts of their angles are interpolated and reported. The ratio is that of the options, else the model's.
    pub fn read_all(
        &self,
        files: &[RecordingFile],
        model: Option<&Model>,
        session: &Session,
    ) -> Result<Vec<Recording>, Failure> {
        self.read_needed(files, &Needs::FIT, model, session)
    }

    /// [`read_all`](Self::read_all) of recordings that need other columns.
    pub fn read_needed(
        &self,
        files: &[RecordingFile],
        needs: &Needs,
        model: Option<&Model>,
        session: &Session,
    ) -> Result<Vec<Recording>, Failure> {
        let read = |file: &RecordingFile| {
            let mut recording = self.read(file, needs, session)?;
            ready(&mut recording, self.ratio, model, &mut |note| session.note(note))?;
            Ok(recording)
        };
        files.iter().map(read).collect()
    }
}

/// The seed of every random choice.
#[derive(Debug, Args)]
pub struct SeedArgs {
    /// Seed of every random choice
    #[arg(long, value_name = "S", default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
}

impl Default for SeedArgs {
    fn default() -> Self {
        SeedArgs { seed: 1 }
    }
}

/// A file for a page: .html, or standard output.
pub fn page(text: &str) -> Result<PathBuf, String> {
    let ending = Path::new(text).extension().map(|ending| ending.to_ascii_lowercase());
    match ending.as_ref().and_then(|ending| ending.to_str()) {
        Some("html" | "htm") => Ok(text.into()),
        _ if text == "-" || Path::new(text).starts_with("/dev") => Ok(text.into()),
        _ => Err("must end in .html: the report is an HTML page".to_owned()),
    }
}

/// The ending of a file's name in lower case; empty where there is none.
pub fn ending(path: &Path) -> String {
    path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// A file for a model, not named as a recording.
pub fn model_file(text: &str) -> Result<PathBuf, String> {
    let ending = ending(Path::new(text));
    // A text file may hold anything.
    match ending != "txt" && Format::ENDINGS.contains(&&*ending) {
        true => Err("must end in .toml: a model file is written, and that is the name of a recording".to_owned()),
        false => Ok(text.into()),
    }
}

/// A file for rows, not named as a model.
pub fn rows_file(text: &str) -> Result<PathBuf, String> {
    match ending(Path::new(text)) == "toml" {
        true => Err("must end in .csv: rows are written, and that is the name of a model file".to_owned()),
        false => Ok(text.into()),
    }
}

/// A file for a drawing, not named as a picture of another format or a page.
pub fn drawing(text: &str) -> Result<PathBuf, String> {
    const OTHERS: [&str; 8] = ["png", "jpg", "jpeg", "gif", "pdf", "eps", "html", "htm"];
    match OTHERS.contains(&&*ending(Path::new(text))) {
        true => Err("must end in .svg: the picture is an SVG drawing".to_owned()),
        false => Ok(text.into()),
    }
}

/// Results as indented JSON with a line break at the end.
pub fn json(results: &impl serde::Serialize) -> Result<String, Failure> {
    Ok(serde_json::to_string_pretty(results).map_err(std::io::Error::other)? + "\n")
}

/// Results of a recording with the text of its model file as `model_toml`.
pub fn with_model(results: &impl serde::Serialize, model: &Model) -> Result<Value, Failure> {
    let mut value = serde_json::to_value(results).map_err(std::io::Error::other)?;
    value["model_toml"] = Value::String(model.to_toml());
    Ok(value)
}

/// A finite number greater than zero.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err("must be a number greater than zero".to_owned()),
    }
}

/// A ratio: no less than one to one.
fn ratio(text: &str) -> Result<f64, String> {
    finite(text)
        .ok()
        .filter(|n| n.abs() >= 1.0)
        .ok_or_else(|| "must be a number of 1 or more, or -1 or less".to_owned())
}

/// A number of turning points.
pub fn depth(text: &str) -> Result<u16, String> {
    let depth = text.parse().ok().filter(|depth: &u16| *depth >= 4 && depth.is_multiple_of(2));
    depth.ok_or_else(|| "must be an even number of 4 or more".to_owned())
}

/// A finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    text.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| "must be a finite number".to_owned())
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
    let words = std::env::args().skip(1).map(|word| recording::shell_word(&word));
    let command = std::iter::once("gmhm".to_owned()).chain(words).collect::<Vec<_>>().join(" ");
    Provenance { command, inputs, seed }
}
