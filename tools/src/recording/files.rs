//! Which files are meant: folders stand for the recordings in them, `-` for standard input, a list for the paths in it.

use std::path::{Path, PathBuf};

use super::error::{RecordingError, RecordingProblem};
use super::format::Format;
use super::open::RecordingFile;

/// What a line of a list that is no path starts with.
const COMMENT: char = '#';
/// The path that stands for standard input.
const STANDARD: &str = "-";

/// A single file, or standard input.
///
/// # Errors
/// Standard input cannot be read.
pub fn file(path: &Path) -> Result<RecordingFile, RecordingError> {
    if path == Path::new(STANDARD) { RecordingFile::standard_input() } else { Ok(path.into()) }
}

/// All files that are meant by paths and by a list of paths, one a line, in their order. Those of a folder come in the order of their names; folders in it are not searched.
///
/// # Errors
/// What cannot be read, and folders without recordings.
pub fn files_and_listed(paths: &[PathBuf], list: Option<&Path>) -> Result<Vec<RecordingFile>, RecordingError> {
    paths_and_listed(paths, list)?.iter().map(|path| file(path)).collect()
}

/// The paths of [`files_and_listed`], whether or not there is a file at each.
///
/// # Errors
/// A list that cannot be read, and folders without recordings.
pub fn paths_and_listed(paths: &[PathBuf], list: Option<&Path>) -> Result<Vec<PathBuf>, RecordingError> {
    let listed = list.map(listed).transpose()?.unwrap_or_default();
    let mut all = Vec::new();
    for path in paths.iter().chain(&listed) {
        if path.is_dir() {
            all.extend(in_folder(path)?);
        } else {
            all.push(path.clone());
        }
    }
    Ok(all)
}

fn listed(list: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let file = file(list)?;
    let refuse = |problem| RecordingError::of_file(&file.name, problem);
    let text = std::fs::read_to_string(&file.path);
    let text = text.map_err(|e| refuse(e.into()))?;
    let is_path = |line: &&str| !line.is_empty() && !line.starts_with(COMMENT);
    let paths: Vec<PathBuf> = text.lines().map(str::trim).filter(is_path).map(PathBuf::from).collect();
    match paths.first() {
        None => Err(refuse(RecordingProblem::EmptyList)),
        Some(first) if !paths.iter().any(|path| path.exists() || path == Path::new(STANDARD)) => {
            Err(refuse(RecordingProblem::NotAList(first.display().to_string())))
        }
        Some(_) => Ok(paths),
    }
}

fn in_folder(folder: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let refuse = |problem| RecordingError::of_file(&folder.display().to_string(), problem);
    let entries = std::fs::read_dir(folder).map_err(|e| refuse(e.into()))?;
    let is_recording = |path: &PathBuf| {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        path.is_file() && Format::ENDINGS.contains(&ending.as_str())
    };
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_recording).collect();
    paths.sort();
    if paths.is_empty() { Err(refuse(RecordingProblem::NoRecordings)) } else { Ok(paths) }
}
