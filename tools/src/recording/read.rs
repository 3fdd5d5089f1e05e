//! Reading recordings from CSV, row by row.

use std::fs::File;
use std::io::{Cursor, Read};
use std::path::Path;

use csv::ByteRecord;
use sha2::{Digest, Sha256};

use super::dialect::{Dialect, Numbers};
use super::error::{ColumnPlace, RecordingError, RecordingProblem};
use super::header::{self, Source};
use super::map::ColumnMap;
use super::quantity::Quantity;
use super::{Recording, TorqueUnit};

/// What a command needs of a group of columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// It must be there.
    Required,
    /// It is read and checked where it is there.
    IfPresent,
    /// It is not even looked at.
    Ignored,
}

/// What a command needs of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Needs {
    /// `time_s`. Where it is not read, [`Recording::time_s`] counts the rows.
    pub time: Need,
    /// `torque_nm`, or `current_a` in its stead.
    pub torque: Need,
    /// The deflection, both angles, or the output-side angle alone; velocity and temperature where present.
    pub motion: Need,
    /// `torque_sim_nm`.
    pub simulation: Need,
}

impl Needs {
    /// To identify a model.
    pub const FIT: Needs =
        Needs { time: Need::Required, torque: Need::Required, motion: Need::Required, simulation: Need::IfPresent };
    /// To predict the torque from the motion.
    pub const PREDICT: Needs =
        Needs { time: Need::Required, torque: Need::Ignored, motion: Need::Required, simulation: Need::Ignored };
    /// To find the deflection that a torque needs; law `time` requires the time too.
    pub const INVERT: Needs =
        Needs { time: Need::Ignored, torque: Need::Required, motion: Need::Ignored, simulation: Need::Ignored };

    pub(super) fn of(&self, quantity: Quantity) -> Need {
        match quantity {
            Quantity::Time => self.time,
            Quantity::Torque | Quantity::Current => self.torque,
            Quantity::TorqueSim => self.simulation,
            _ => self.motion,
        }
    }
}

/// Called with the number of bytes read so far.
pub type Progress<'a> = &'a dyn Fn(u64);

/// Reads a recording as the contract of the file format says.
///
/// Commas, semicolons or tabs separate the columns (as the header does); with semicolons and tabs numbers may have decimal commas.
/// A byte-order mark, CRLF, quotes, comment lines (`#`), blank rows and trailing separators are accepted, other columns ignored.
///
/// # Errors
/// Anything that cannot be read rightly: [`RecordingProblem`], with file, line and column.
pub fn read(path: &Path, map: &ColumnMap, needs: &Needs, progress: Progress<'_>) -> Result<Recording, RecordingError> {
    let mut table = Table::open(path, progress)?;
    let sources = table.sources(map, needs)?;
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); sources.len()];
    let mut rows = 0_usize;
    let mut last_time = f64::NEG_INFINITY;
    while table.next_row()? {
        for (source, column) in sources.iter().zip(&mut columns) {
            let value = table.number(source)?;
            if source.quantity == Quantity::Time {
                if value <= last_time {
                    let problem = match value == last_time {
                        true => RecordingProblem::TimeRepeats(value),
                        false => RecordingProblem::TimeRunsBack { before: last_time, after: value },
                    };
                    return Err(table.at_column(source.index, problem));
                }
                last_time = value;
            }
            column.push(value);
        }
        rows += 1;
    }
    if rows < 2 {
        let problem = RecordingProblem::TooShort(if rows == 0 { "no row" } else { "a single row" });
        return Err(table.at_file(problem));
    }
    let mut recording = Recording { name: table.file.clone(), sha256: table.sha256(), ..Recording::default() };
    for (source, column) in sources.iter().zip(columns) {
        match source.quantity {
            Quantity::Time => recording.time_s = column,
            Quantity::Torque => recording.torque = Some(column),
            Quantity::Current => {
                recording.torque = Some(column);
                recording.torque_unit = TorqueUnit::Ampere;
            }
            Quantity::Deflection => recording.deflection_rad = Some(column),
            Quantity::ThetaIn => recording.theta_in_rad = Some(column),
            Quantity::ThetaOut => recording.theta_out_rad = Some(column),
            Quantity::VelocityOut => recording.velocity_out_rad_per_s = Some(column),
            Quantity::Temperature => recording.temperature_c = Some(column),
            Quantity::TorqueSim => recording.torque_sim_nm = Some(column),
        }
    }
    if recording.time_s.is_empty() {
        recording.time_s = (0..rows).map(|row| row as f64).collect();
    }
    Ok(recording)
}

/// A CSV file under way: its header, then one row after the other.
pub(super) struct Table<'a> {
    pub(super) file: String,
    pub(super) dialect: Dialect,
    reader: csv::Reader<Box<dyn Read + 'a>>,
    digest: std::rc::Rc<std::cell::RefCell<Sha256>>,
    header: Vec<String>,
    /// The row being read; fields beyond the header's are empty.
    pub(super) row: ByteRecord,
    line: u64,
    numbers: Numbers,
}

/// How much of a file its kind is judged by.
const HEAD: u64 = 64 * 1024;

impl<'a> Table<'a> {
    pub(super) fn open(path: &Path, progress: Progress<'a>) -> Result<Self, RecordingError> {
        let file = path.display().to_string();
        let refuse =
            |problem| RecordingError { file: file.clone(), line: None, column: None, problem: Box::new(problem) };
        let unreadable = |e: std::io::Error| refuse(RecordingProblem::Unreadable(e.to_string()));
        if path.is_dir() {
            return Err(refuse(RecordingProblem::Unreadable("it is a folder".to_owned())));
        }
        let mut input = File::open(path).map_err(unreadable)?;
        let mut head = Vec::new();
        input.by_ref().take(HEAD).read_to_end(&mut head).map_err(unreadable)?;
        let dialect = Dialect::sniff(&head).map_err(refuse)?;

        let digest = std::rc::Rc::default();
        let tap =
            Tap { inner: Cursor::new(head).chain(input), digest: std::rc::Rc::clone(&digest), bytes: 0, progress };
        // With a last line break added, a record's line is one less than the reader's.
        let whole: Box<dyn Read + 'a> = Box::new(tap.chain(&b"\n"[..]));
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(dialect.delimiter)
            // Carriage returns stay at the end of a field, where they are trimmed: so lines are counted rightly.
            .terminator(csv::Terminator::Any(b'\n'))
            .comment(Some(b'#'))
            .buffer_capacity(1 << 17)
            .from_reader(whole);
        let numbers = Numbers::new(dialect);
        let mut table =
            Table { file, dialect, reader, digest, header: Vec::new(), row: ByteRecord::new(), line: 0, numbers };
        table.read_header()?;
        Ok(table)
    }

    fn read_header(&mut self) -> Result<(), RecordingError> {
        if self.dialect.separator_line {
            self.next_record()?;
        }
        if !self.next_record()? {
            return Err(self.at_file(RecordingProblem::Empty));
        }
        self.header =
            self.row.iter().map(|f| String::from_utf8_lossy(f.trim_ascii()).replace(['\r', '\n'], " ")).collect();
        while self.header.last().is_some_and(String::is_empty) {
            self.header.pop();
        }
        let number = |name: &String| name.replace(',', ".").parse::<f64>().is_ok();
        if self.header.iter().all(number) {
            return Err(self.at_line(RecordingProblem::HeaderMissing));
        }
        Ok(())
    }

    /// The names of the columns, trailing nameless ones left out.
    pub(super) fn columns(&self) -> &[String] {
        &self.header
    }

    /// Moves to the next row; false at the end. Every row has a field a column.
    pub(super) fn next_row(&mut self) -> Result<bool, RecordingError> {
        if !self.next_record()? {
            return Ok(false);
        }
        let (found, expected) = (self.row.len(), self.header.len());
        if found < expected {
            let error = self.at_line(RecordingProblem::TooFewFields { found, expected, last: false });
            let last = !self.next_record()?;
            let problem = Box::new(RecordingProblem::TooFewFields { found, expected, last });
            return Err(RecordingError { problem, ..error });
        }
        if self.row.iter().skip(expected).any(|field| !field.trim_ascii().is_empty()) {
            return Err(self.at_line(RecordingProblem::TooManyFields { found, expected }));
        }
        Ok(true)
    }

    /// The next record with anything in it.
    fn next_record(&mut self) -> Result<bool, RecordingError> {
        loop {
            match self.reader.read_byte_record(&mut self.row) {
                Ok(true) => {}
                Ok(false) => return Ok(false),
                Err(e) => return Err(self.at_file(RecordingProblem::Unreadable(e.to_string()))),
            }
            self.line = self.reader.position().line() - 1;
            let comment = self.row.get(0).is_some_and(|f| f.trim_ascii_start().starts_with(b"#"));
            if !comment && self.row.iter().any(|field| !field.trim_ascii().is_empty()) {
                return Ok(true);
            }
        }
    }

    /// Where the quantities that a command needs stand.
    pub(super) fn sources(&self, map: &ColumnMap, needs: &Needs) -> Result<Vec<Source>, RecordingError> {
        header::resolve(&self.header, map, needs).map_err(|fault| match fault.index {
            Some(index) => self.at_column(index, fault.problem),
            None => self.at_line(fault.problem),
        })
    }

    /// One quantity of the row, in SI.
    pub(super) fn number(&mut self, source: &Source) -> Result<f64, RecordingError> {
        let field = self.row.get(source.index).unwrap_or_default();
        let problem = match self.numbers.parse(field, self.line) {
            Ok(number) => {
                let value = source.unit.to_si(source.linear.apply(number));
                if value.is_finite() {
                    return Ok(value);
                }
                RecordingProblem::NotFinite(format!("{number}"))
            }
            Err(problem) => problem,
        };
        Err(self.at_column(source.index, problem))
    }

    /// True once a decimal comma was read.
    pub(super) fn decimal_comma(&self) -> bool {
        self.numbers.decimal_comma()
    }

    fn sha256(&self) -> String {
        let digest = self.digest.borrow().clone().finalize();
        digest.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    fn at_file(&self, problem: RecordingProblem) -> RecordingError {
        RecordingError { file: self.file.clone(), line: None, column: None, problem: Box::new(problem) }
    }

    fn at_line(&self, problem: RecordingProblem) -> RecordingError {
        RecordingError { line: Some(self.line), ..self.at_file(problem) }
    }

    fn at_column(&self, index: usize, problem: RecordingProblem) -> RecordingError {
        let column = ColumnPlace { name: self.header[index].clone(), number: index + 1 };
        RecordingError { column: Some(column), ..self.at_line(problem) }
    }
}

/// Hashes and counts what is read through it.
struct Tap<'a, R> {
    inner: R,
    digest: std::rc::Rc<std::cell::RefCell<Sha256>>,
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
