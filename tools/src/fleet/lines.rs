//! The file of lines: appended line by line, so that what is done stays done whenever a run is stopped.

use std::collections::HashSet;
use std::fs::{File, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde_json::Value;

use super::error::FleetError;

/// The file, locked against other runs, and the recordings that it held when it was opened.
pub(super) struct Lines {
    path: PathBuf,
    file: Mutex<File>,
    held: HashSet<String>,
}

impl Lines {
    /// Opens the file; without `resume` there must be none with anything in it. A last line that was cut off is taken out.
    pub(super) fn open(path: &Path, resume: bool) -> Result<Self, FleetError> {
        let system = |source| FleetError::System { path: path.to_owned(), source };
        let file = File::options().read(true).write(true).create(true).truncate(false).open(path);
        let mut file = file.map_err(system)?;
        file.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => FleetError::Taken { path: path.to_owned() },
            TryLockError::Error(source) => system(source),
        })?;
        let mut text = Vec::new();
        file.read_to_end(&mut text).map_err(system)?;
        if !resume && !text.is_empty() {
            return Err(FleetError::Exists { path: path.to_owned() });
        }
        let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        let mut held = HashSet::new();
        for (number, line) in
            text[..whole].split(|byte| *byte == b'\n').enumerate().filter(|(_, line)| !line.is_empty())
        {
            let value: Option<Value> = serde_json::from_slice(line).ok();
            let name = value.as_ref().and_then(|value| value["recording"].as_str());
            let foreign = || FleetError::Foreign { path: path.to_owned(), line: number + 1 };
            held.insert(name.ok_or_else(foreign)?.to_owned());
        }
        // Only what a run began and could not end; a text without any line is another file.
        if whole == 0 && text.first().is_some_and(|byte| *byte != b'{') {
            return Err(FleetError::Foreign { path: path.to_owned(), line: 1 });
        }
        file.set_len(whole as u64).map_err(system)?;
        file.seek(SeekFrom::End(0)).map_err(system)?;
        Ok(Self { path: path.to_owned(), file: Mutex::new(file), held })
    }

    /// Whether a recording had a line when the file was opened.
    pub(super) fn holds(&self, recording: &str) -> bool {
        self.held.contains(recording)
    }

    /// Adds a line.
    pub(super) fn add(&self, line: &Value) -> Result<(), FleetError> {
        let text = format!("{line}\n");
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let system = |source| FleetError::System { path: self.path.clone(), source };
        file.write_all(text.as_bytes()).map_err(system)
    }
}
