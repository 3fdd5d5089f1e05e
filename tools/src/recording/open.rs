//! Opens a file of any format that is read.

use std::cell::RefCell;
use std::fs::File;
use std::io::{Cursor, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use sha2::{Digest, Sha256};

use super::csv_table::CsvTable;
use super::error::{DamagedStream, RecordingError, RecordingProblem};
use super::format::Format;
use super::mat5::Mat5Table;
use super::mcap_table::McapTable;
use super::mdf4::Mdf4Table;
use super::parquet_table::ParquetTable;
use super::table::Table;

/// Called with the number of bytes read so far.
pub type Progress<'a> = &'a dyn Fn(u64);

/// A file to be read, and what messages call it.
#[derive(Debug, Clone)]
pub struct RecordingFile {
    /// Where it is.
    pub path: PathBuf,
    /// Its name for messages and reports.
    pub name: String,
    /// The copy of a stream, which goes with the last of its users.
    copy: Option<Rc<tempfile::TempPath>>,
}

impl RecordingFile {
    /// Standard input, whole: a recording may be read more than once.
    ///
    /// # Errors
    /// The system refuses.
    pub fn standard_input() -> Result<Self, RecordingError> {
        const NAME: &str = "standard input";
        let refuse = |e: std::io::Error| RecordingError::of_file(NAME, RecordingProblem::Unreadable(e.to_string()));
        let mut copy = tempfile::Builder::new().prefix("gmhm-").tempfile().map_err(refuse)?;
        std::io::copy(&mut std::io::stdin().lock(), &mut copy).map_err(refuse)?;
        let copy = copy.into_temp_path();
        Ok(RecordingFile { path: copy.to_path_buf(), name: NAME.to_owned(), copy: Some(Rc::new(copy)) })
    }

    /// Its name without folders and ending, for a model made from it.
    pub fn stem(&self) -> String {
        match self.copy {
            Some(_) => "recording".to_owned(),
            None => self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        }
    }
}

impl From<&Path> for RecordingFile {
    fn from(path: &Path) -> Self {
        RecordingFile { path: path.to_owned(), name: path.display().to_string(), copy: None }
    }
}

impl From<&PathBuf> for RecordingFile {
    fn from(path: &PathBuf) -> Self {
        path.as_path().into()
    }
}

/// A file whose columns are known.
pub(super) struct Opened<'a> {
    pub format: Format,
    pub columns: Columns<'a>,
    digest: Rc<RefCell<Sha256>>,
}

/// CSV is read row by row, other formats column by column.
pub(super) enum Columns<'a> {
    Csv(Box<CsvTable<'a>>),
    Binary(Box<dyn Table>),
}

impl<'a> Opened<'a> {
    pub(super) fn table(&mut self) -> &mut (dyn Table + 'a) {
        match &mut self.columns {
            Columns::Csv(table) => table.as_mut(),
            Columns::Binary(table) => table.as_mut(),
        }
    }

    /// SHA-256 of what was read of the file: all of it, once the columns were.
    pub(super) fn sha256(&self) -> String {
        hex::encode(self.digest.borrow().clone().finalize())
    }
}

/// Opens a file and reads its columns' names.
pub(super) fn open<'a>(file: &RecordingFile, progress: Progress<'a>) -> Result<Opened<'a>, RecordingError> {
    let refuse = |problem| RecordingError::of_file(&file.name, problem);
    let unreadable = |e: std::io::Error| refuse(e.into());
    if file.path.is_dir() {
        return Err(refuse(RecordingProblem::Unreadable("it is a folder".to_owned())));
    }
    let mut input = File::open(&file.path).map_err(unreadable)?;
    let mut head = Vec::new();
    input.by_ref().take(4096).read_to_end(&mut head).map_err(unreadable)?;
    let format = Format::of(&head, &file.path).map_err(refuse)?;
    let digest = Rc::<RefCell<Sha256>>::default();
    let tap = Tap { inner: Cursor::new(head).chain(input), digest: Rc::clone(&digest), bytes: 0, progress };
    let whole = |mut tap: Tap<'_, _>| {
        let mut bytes = Vec::new();
        tap.read_to_end(&mut bytes).map_err(unreadable).map(|_| bytes)
    };
    let name = file.name.as_str();
    let columns = match format {
        Format::Csv => Columns::Csv(Box::new(CsvTable::open(name, tap)?)),
        Format::CsvGz => {
            let plain = flate2::read::MultiGzDecoder::new(tap);
            Columns::Csv(Box::new(CsvTable::open(name, Decoded { plain, format: "gzip" })?))
        }
        Format::CsvZst => {
            let plain = zstd::stream::read::Decoder::new(tap).map_err(unreadable)?;
            Columns::Csv(Box::new(CsvTable::open(name, Decoded { plain, format: "Zstandard" })?))
        }
        Format::Parquet => Columns::Binary(Box::new(ParquetTable::open(name, whole(tap)?)?)),
        Format::Mat5 => Columns::Binary(Box::new(Mat5Table::open(name, &whole(tap)?)?)),
        Format::Mat73 => Columns::Binary(mat73(name, whole(tap)?)?),
        Format::Mdf4 => Columns::Binary(Box::new(Mdf4Table::open(name, whole(tap)?)?)),
        Format::Mcap => Columns::Binary(Box::new(McapTable::open(name, whole(tap)?)?)),
    };
    if let Columns::Binary(table) = &columns
        && table.heads().is_empty()
    {
        let why = "it holds no column of numbers".to_owned();
        return Err(refuse(RecordingProblem::Damaged { format: format.name(), why }));
    }
    Ok(Opened { format, columns, digest })
}

/// What a decoder makes of compressed bytes; its errors say what was decoded.
struct Decoded<R> {
    plain: R,
    format: &'static str,
}

impl<R: Read> Read for Decoded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.plain.read(buffer).map_err(|e| {
            let why = format!("it is damaged or cut off ({e})");
            std::io::Error::new(e.kind(), DamagedStream { format: self.format, why })
        })
    }
}

#[cfg(feature = "mat73")]
fn mat73(name: &str, bytes: Vec<u8>) -> Result<Box<dyn Table>, RecordingError> {
    Ok(Box::new(super::mat73::Mat73Table::open(name, bytes)?))
}

#[cfg(not(feature = "mat73"))]
fn mat73(name: &str, _: Vec<u8>) -> Result<Box<dyn Table>, RecordingError> {
    Err(RecordingError::of_file(name, RecordingProblem::NotBuilt { format: Format::Mat73.name(), feature: "mat73" }))
}

/// Hashes and counts what is read through it.
struct Tap<'a, R> {
    inner: R,
    digest: Rc<RefCell<Sha256>>,
    bytes: u64,
    progress: Progress<'a>,
}

impl<R: Read> Read for Tap<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let n = self.inner.read(buffer)?;
        self.digest.borrow_mut().update(&buffer[..n]);
        self.bytes += n as u64;
        (self.progress)(self.bytes);
        Ok(n)
    }
}
