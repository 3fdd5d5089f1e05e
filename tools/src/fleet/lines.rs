//! The file of lines: appended line by line, so that what is done stays done whenever a run is stopped.

use std::collections::HashMap;
use std::fs::{File, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde_json::Value;

use super::Resume;
use super::error::FleetError;

/// The file, locked against other runs, and the recordings that it held when it was opened, each with whether it has a result.
pub(super) struct Lines {
    path: PathBuf,
    file: Mutex<File>,
    held: HashMap<String, bool>,
}

impl Lines {
    /// Opens the file; where a run does not resume there must be none with anything in it. A last line that was cut off is taken out, and so are failures that are tried again.
    pub(super) fn open(path: &Path, resume: Resume) -> Result<Self, FleetError> {
        let system = |source| FleetError::System { path: path.to_owned(), source };
        let file = File::options().read(true).write(true).create(true).truncate(false).open(path);
        let mut file = file.map_err(system)?;
        file.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => FleetError::Taken(path.to_owned()),
            TryLockError::Error(source) => system(source),
        })?;
        let mut text = Vec::new();
        file.read_to_end(&mut text).map_err(system)?;
        if resume == Resume::No && !text.is_empty() {
            return Err(FleetError::Exists(path.to_owned()));
        }
        let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        let (mut held, mut results) = (HashMap::new(), Vec::new());
        for (number, line) in
            text[..whole].split(|byte| *byte == b'\n').enumerate().filter(|(_, line)| !line.is_empty())
        {
            let value: Option<Value> = serde_json::from_slice(line).ok();
            let named = value.as_ref().and_then(|value| Some((value["recording"].as_str()?, value["ok"].as_bool()?)));
            let foreign = || FleetError::Foreign { path: path.to_owned(), line: number + 1 };
            let (name, ok) = named.ok_or_else(foreign)?;
            held.insert(name.to_owned(), ok);
            if ok {
                results.extend_from_slice(line);
                results.push(b'\n');
            }
        }
        // Only what a run began and could not end; a text without any line is another file.
        if whole == 0 && text.first().is_some_and(|byte| *byte != b'{') {
            return Err(FleetError::Foreign { path: path.to_owned(), line: 1 });
        }
        if resume == Resume::RetryFailed && held.values().any(|ok| !ok) {
            held.retain(|_, ok| *ok);
            file = replaced(path, &file, &results).map_err(system)?;
        } else {
            file.set_len(whole as u64).map_err(system)?;
        }
        file.seek(SeekFrom::End(0)).map_err(system)?;
        Ok(Self { path: path.to_owned(), file: Mutex::new(file), held })
    }

    /// Whether a recording had a line when the file was opened, and if so whether with a result.
    pub(super) fn held(&self, recording: &str) -> Option<bool> {
        self.held.get(recording).copied()
    }

    /// Adds a line.
    pub(super) fn add(&self, line: &Value) -> Result<(), FleetError> {
        let text = format!("{line}\n");
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let system = |source| FleetError::System { path: self.path.clone(), source };
        file.write_all(text.as_bytes()).map_err(system)
    }
}

/// Replaces a file by one of these bytes, at once, so that a run that is stopped loses nothing. The new file is locked before it has the name.
fn replaced(path: &Path, old: &File, bytes: &[u8]) -> std::io::Result<File> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut draft = tempfile::NamedTempFile::new_in(folder)?;
    draft.as_file().set_permissions(old.metadata()?.permissions())?;
    draft.write_all(bytes)?;
    draft.as_file().try_lock()?;
    Ok(draft.persist(path)?)
}
