//! Outputs that appear whole or not at all.
//!
//! Each output is written to a temporary file beside its target; [`Outputs::commit`] renames them all once every one is complete.
//! The path `-` is standard output. Dropping the value, a failure or Ctrl-C before that removes the temporary files and leaves the targets as they were.

use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

use crate::recording::RecordingFile;

/// An output could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The folder is not there.
    #[error("{}: the folder {} does not exist", path.display(), folder.display())]
    NoFolder {
        /// The output.
        path: PathBuf,
        /// The folder that it should appear in.
        folder: PathBuf,
    },
    /// A file where a folder is to be made.
    #[error("{}: is a file, and a folder is needed", .0.display())]
    NotAFolder(PathBuf),
    /// Two outputs of one name.
    #[error("{}: named for two outputs", .0.display())]
    Twice(PathBuf),
    /// A recording that would be written over.
    #[error("{}: is the recording that was to be read; what was measured is not written over", .0.display())]
    OverRecording(PathBuf),
    /// The system refused.
    #[error("{}: cannot be written: {source}", path.display())]
    System {
        /// The output.
        path: PathBuf,
        /// Why.
        #[source]
        source: io::Error,
    },
}

impl OutputError {
    /// How to fix it, where there is more to say than the message does.
    pub fn fix(&self) -> Option<&'static str> {
        match self {
            OutputError::NoFolder { .. } => Some("create the folder first, or write elsewhere"),
            OutputError::Twice(_) => Some("give each output a name of its own"),
            OutputError::OverRecording(_) => Some("write to another file"),
            OutputError::NotAFolder(_) => Some("name another folder"),
            OutputError::System { .. } => Some("write elsewhere, or check the permissions and the space on the disk"),
        }
    }
}

/// Temporary files that Ctrl-C removes. Held while targets are renamed, so that an interrupt comes before all of them or after.
static PENDING: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn pending() -> MutexGuard<'static, Vec<PathBuf>> {
    PENDING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes Ctrl-C remove unfinished outputs and end the program with status 130. Call once, from `main`.
pub fn clean_up_on_interrupt() {
    // Fails only where a handler is already set: then that one stays.
    let _ = ctrlc::set_handler(|| {
        let files = pending();
        for file in files.iter() {
            let _ = std::fs::remove_file(file);
        }
        // Does nothing where the terminal is as the program found it.
        let _ = ratatui::crossterm::terminal::disable_raw_mode();
        std::process::exit(130);
    });
}

/// The path that stands for standard output.
const STANDARD: &str = "-";

/// Whether an output goes to standard output, so that nothing else may.
pub fn takes_standard_output() -> bool {
    STANDARD_TAKEN.load(Ordering::Relaxed)
}

static STANDARD_TAKEN: AtomicBool = AtomicBool::new(false);

/// Outputs of one command, complete together.
#[derive(Debug, Default)]
pub struct Outputs {
    files: Vec<(PathBuf, NamedTempFile)>,
}

impl Outputs {
    /// No output yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Checks that an output could appear at `path`, before long work is begun for it.
    pub fn check(path: &Path) -> Result<(), OutputError> {
        if path == Path::new(STANDARD) {
            STANDARD_TAKEN.store(true, Ordering::Relaxed);
            return Ok(());
        }
        let folder = folder_of(path);
        if !folder.is_dir() {
            return Err(OutputError::NoFolder { path: path.to_owned(), folder });
        }
        if path.is_dir() {
            let source = io::Error::new(io::ErrorKind::IsADirectory, "it is a folder");
            return Err(OutputError::System { path: path.to_owned(), source });
        }
        Ok(())
    }

    /// [`check`](Self::check), and that a path is none of the recordings that are read.
    pub fn check_beside(path: &Path, recordings: &[RecordingFile]) -> Result<(), OutputError> {
        let target = resolved(path);
        if !is_device(&target) && recordings.iter().any(|recording| resolved(&recording.path) == target) {
            return Err(OutputError::OverRecording(path.to_owned()));
        }
        Self::check(path)
    }

    /// Makes the folder that outputs are to appear in, with those above it.
    pub fn make_folder(path: &Path) -> Result<(), OutputError> {
        if path.exists() && !path.is_dir() {
            return Err(OutputError::NotAFolder(path.to_owned()));
        }
        std::fs::create_dir_all(path).map_err(|source| OutputError::System { path: path.to_owned(), source })
    }

    /// Writes one output, to appear at `path` on [`commit`](Self::commit). An error of `write` is handed on as it is.
    pub fn add<E, F>(&mut self, path: &Path, write: F) -> Result<(), E>
    where
        E: From<OutputError> + From<io::Error>,
        F: FnOnce(&mut dyn Write) -> Result<(), E>,
    {
        Self::check(path)?;
        let target = resolved(path);
        if self.files.iter().any(|(other, _)| *other == target) {
            return Err(OutputError::Twice(path.to_owned()).into());
        }
        let system = |source| OutputError::System { path: path.to_owned(), source };
        let folder = if is_device(&target) { std::env::temp_dir() } else { folder_of(&target) };
        let file = {
            let mut pending = pending();
            let file = temporary().tempfile_in(folder).map_err(system)?;
            pending.push(file.path().to_owned());
            file
        };
        let mut writer = BufWriter::with_capacity(1 << 17, file);
        let done = write(&mut writer);
        let file = writer.into_inner().map_err(|e| system(e.into_error()));
        done?;
        self.files.push((target, file?));
        Ok(())
    }

    /// Writes a text or bytes; see [`add`](Self::add).
    pub fn add_contents(&mut self, path: &Path, contents: impl AsRef<[u8]>) -> Result<(), OutputError> {
        let written: Result<(), ContentsError> = self.add(path, |out| Ok(out.write_all(contents.as_ref())?));
        written.map_err(|e| match e {
            ContentsError::Output(e) => e,
            ContentsError::Io(source) => OutputError::System { path: path.to_owned(), source },
        })
    }

    /// Lets every output appear.
    pub fn commit(mut self) -> Result<(), OutputError> {
        let mut pending = pending();
        for (target, file) in self.files.drain(..) {
            let system = |source| OutputError::System { path: target.clone(), source };
            pending.retain(|path| path != file.path());
            if target == Path::new(STANDARD) {
                let mut from = file.into_file();
                from.rewind().map_err(system)?;
                // A reader that has had enough, as `head`, is no failure.
                match io::copy(&mut from, &mut io::stdout().lock()) {
                    Err(e) if e.kind() != io::ErrorKind::BrokenPipe => return Err(system(e)),
                    _ => {}
                }
            } else if is_device(&target) {
                let mut from = file.into_file();
                from.rewind().map_err(system)?;
                let mut to = File::options().write(true).open(&target).map_err(system)?;
                io::copy(&mut from, &mut to).map_err(system)?;
            } else {
                file.persist(&target).map_err(|e| system(e.error))?;
            }
        }
        Ok(())
    }
}

#[derive(Debug, thiserror::Error)]
#[error(transparent)]
enum ContentsError {
    Output(#[from] OutputError),
    Io(#[from] io::Error),
}

/// The file itself: a link stays a link, and what it points to is replaced.
fn resolved(path: &Path) -> PathBuf {
    if path == Path::new(STANDARD) {
        return path.to_owned();
    }
    let beside = || Some(folder_of(path).canonicalize().ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(beside).unwrap_or_else(|| path.to_owned())
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// A terminal, pipe or the like, which is written through and never replaced.
fn is_device(path: &Path) -> bool {
    path == Path::new(STANDARD) || path.exists() && !path.is_file()
}

fn temporary() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".gmhm-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any program's output: what the umask leaves of it.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_appear_together_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (folder.path().join("a"), folder.path().join("b"));
        std::fs::write(&a, "before").unwrap();

        let mut outputs = Outputs::new();
        outputs.add_contents(&a, "after").unwrap();
        let failed: Result<(), ContentsError> = outputs.add(&b, |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("power cut").into())
        });
        assert!(matches!(failed, Err(ContentsError::Io(_))));
        drop(outputs);
        assert_eq!(std::fs::read_to_string(&a).unwrap(), "before");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);

        let mut outputs = Outputs::new();
        outputs.add_contents(&a, "after").unwrap();
        outputs.add_contents(&b, "too").unwrap();
        assert!(matches!(outputs.add_contents(&a, "twice"), Err(OutputError::Twice(_))));
        outputs.commit().unwrap();
        assert_eq!(std::fs::read_to_string(&a).unwrap(), "after");
        assert_eq!(std::fs::read_to_string(&b).unwrap(), "too");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let error = Outputs::new().add_contents(Path::new("no/such/folder/x"), "").unwrap_err();
        assert!(error.to_string().contains("no/such/folder does not exist"), "{error}");
    }
}
