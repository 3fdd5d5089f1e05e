//! CSV: text whose columns are separated by commas, semicolons, tabs or spaces.

use std::io::{Cursor, Read};

use csv::ByteRecord;

use super::dialect::{Dialect, Numbers, is_number};
use super::error::{ColumnPlace, RecordingError, RecordingProblem};
use super::header::Source;
use super::name::is_unit;
use super::samples::Samples;
use super::table::{ColumnHead, Location, Table};
use super::unit_text;

/// A CSV file under way: its header, then one row after the other.
pub(super) struct CsvTable<'a> {
    pub(super) file: String,
    pub(super) dialect: Dialect,
    reader: csv::Reader<Box<dyn Read + 'a>>,
    heads: Vec<ColumnHead>,
    /// The row being read; fields beyond the header's are empty.
    pub(super) row: ByteRecord,
    /// The row behind the header, read to see whether it holds units.
    ahead: bool,
    line: u64,
    header_line: u64,
    numbers: Numbers,
    /// Rows from which on lines are so many ahead of rows.
    lines: Vec<(usize, u64)>,
}

/// How much of a file its kind is judged by.
const HEAD: u64 = 64 * 1024;

impl<'a> CsvTable<'a> {
    /// Reads the header.
    pub(super) fn open(file: &str, mut input: impl Read + 'a) -> Result<Self, RecordingError> {
        let refuse = |problem| RecordingError::of_file(file, problem);
        let mut head = Vec::new();
        let taken = input.by_ref().take(HEAD).read_to_end(&mut head);
        taken.map_err(|e| refuse(e.into()))?;
        let dialect = Dialect::sniff(&head).map_err(refuse)?;
        head.drain(..length_of_lines(&head, dialect.lines_above));
        // With a last line break added, a record's line is one less than the reader's.
        let whole = Cursor::new(head).chain(input).chain(&b"\n"[..]);
        let whole: Box<dyn Read + 'a> =
            if dialect.separation.spaces { Box::new(Squeeze::new(whole)) } else { Box::new(whole) };
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(dialect.separation.delimiter)
            // Carriage returns stay at the end of a field, where they are trimmed: so lines are counted rightly.
            .terminator(csv::Terminator::Any(b'\n'))
            .comment(Some(b'#'))
            .buffer_capacity(1 << 17)
            .from_reader(whole);
        let numbers = Numbers::new(&dialect);
        let mut table = CsvTable {
            file: file.to_owned(),
            dialect,
            reader,
            heads: Vec::new(),
            row: ByteRecord::new(),
            ahead: false,
            line: 0,
            header_line: 1,
            numbers,
            lines: Vec::new(),
        };
        table.read_header()?;
        Ok(table)
    }

    fn read_header(&mut self) -> Result<(), RecordingError> {
        if let Some((names, line)) = &self.dialect.commented_header {
            self.header_line = *line;
            let names = self.dialect.separation.fields(names).into_iter().map(text);
            self.heads = names.map(|name| ColumnHead { name, ..ColumnHead::default() }).collect();
            return Ok(());
        }
        if self.dialect.separator_line {
            self.next_record()?;
        }
        if !self.next_record()? {
            return Err(self.at_file(RecordingProblem::Empty));
        }
        let clean = |f: &[u8]| text(f.trim_ascii()).replace(['\r', '\n'], " ");
        let mut names: Vec<String> = self.row.iter().map(clean).collect();
        while names.last().is_some_and(String::is_empty) {
            names.pop();
        }
        if names.iter().all(|name| is_number(name.as_bytes())) {
            return Err(self.at_line(RecordingProblem::HeaderMissing));
        }
        if self.dialect.separation.spaces {
            names = with_their_brackets(names);
        }
        self.heads = names.into_iter().map(|name| ColumnHead { name, ..ColumnHead::default() }).collect();
        self.header_line = self.line;
        self.ahead = self.next_record()?;
        let units: Vec<String> = self.row.iter().map(clean).collect();
        let said = |unit: &String| is_unit(unit) || unit_text::is_blank(unit);
        if self.ahead && units.iter().all(said) && units.iter().any(|unit| is_unit(unit)) {
            self.ahead = false;
            self.heads.iter_mut().zip(units).for_each(|(head, unit)| head.unit = Some(unit));
        }
        Ok(())
    }

    /// Moves to the next row; false at the end. Every row has a field a column.
    pub(super) fn next_row(&mut self) -> Result<bool, RecordingError> {
        if std::mem::take(&mut self.ahead) {
            self.line = self.line_read();
        } else if !self.next_record()? {
            return Ok(false);
        }
        let (found, expected) = (self.row.len(), self.heads.len());
        if found < expected {
            let error = self.at_line(RecordingProblem::TooFewFields { found, expected, last: false });
            let last = !self.next_record()?;
            let problem = Box::new(RecordingProblem::TooFewFields { found, expected, last });
            return Err(RecordingError { problem, ..error });
        }
        if found > expected && self.row.iter().skip(expected).any(|field| !field.trim_ascii().is_empty()) {
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
                Err(e) => return Err(self.at_file(e.into())),
            }
            self.line = self.line_read();
            self.refuse_open_quote()?;
            let comment = self.row.get(0).is_some_and(|f| f.trim_ascii_start().starts_with(b"#"));
            if !comment && self.row.iter().any(|field| !field.trim_ascii().is_empty()) {
                return Ok(true);
            }
        }
    }

    /// The line of the record that was read last.
    fn line_read(&self) -> u64 {
        self.reader.position().line() - 1 + self.dialect.lines_above as u64
    }

    /// Refuses a quoted field that goes on over the ends of lines: it may have taken in rows. A name in the header may have a few lines.
    fn refuse_open_quote(&mut self) -> Result<(), RecordingError> {
        const LINES_OF_A_HEADER: usize = 4;
        let breaks = self.row.as_slice().iter().filter(|byte| **byte == b'\n').count();
        // The line break added to the text is in the field.
        let open = self.row.as_slice().ends_with(b"\n");
        let is_header = self.heads.is_empty();
        if breaks == 0 || is_header && !open && breaks < LINES_OF_A_HEADER {
            return Ok(());
        }
        self.line = self.line + u64::from(open) - breaks as u64;
        Err(self.at_line(RecordingProblem::OpenQuote))
    }

    /// One field of the row as a number.
    pub(super) fn number(&mut self, index: usize) -> Result<f64, RecordingError> {
        let field = self.row.get(index).unwrap_or_default();
        self.numbers.parse(field, self.line).map_err(|problem| self.at_column(index, problem))
    }

    /// One quantity of the row in SI.
    pub(super) fn value(&mut self, source: &Source) -> Result<f64, RecordingError> {
        Ok(source.to_si(self.number(source.index)?))
    }

    /// True once a decimal comma was read.
    pub(super) fn decimal_comma(&self) -> bool {
        self.numbers.decimal_comma()
    }

    fn at_file(&self, problem: RecordingProblem) -> RecordingError {
        RecordingError::of_file(&self.file, problem)
    }

    fn at_line(&self, problem: RecordingProblem) -> RecordingError {
        RecordingError { place: Some(Location::Line(self.line)), ..self.at_file(problem) }
    }

    fn at_column(&self, index: usize, problem: RecordingProblem) -> RecordingError {
        let column = ColumnPlace { name: self.heads[index].name.clone(), number: index + 1 };
        RecordingError { column: Some(column), ..self.at_line(problem) }
    }
}

impl Table for CsvTable<'_> {
    fn heads(&self) -> &[ColumnHead] {
        &self.heads
    }

    fn header_place(&self) -> Option<Location> {
        Some(Location::Line(self.header_line))
    }

    fn read(&mut self, columns: &[usize]) -> Result<Vec<Samples>, RecordingError> {
        let mut values = vec![Vec::new(); columns.len()];
        let mut row = 0;
        while self.next_row()? {
            let ahead = self.line - row as u64;
            if self.lines.last().is_none_or(|(_, last)| *last != ahead) {
                self.lines.push((row, ahead));
            }
            for (index, values) in columns.iter().zip(&mut values) {
                values.push(self.number(*index)?);
            }
            row += 1;
        }
        Ok(values.into_iter().map(Samples::from).collect())
    }

    fn place(&self, row: usize) -> Location {
        let before = self.lines.partition_point(|(first, _)| *first <= row);
        Location::Line(row as u64 + self.lines.get(before.wrapping_sub(1)).map_or(0, |(_, ahead)| *ahead))
    }
}

/// Text in UTF-8, else in Latin-1: `µ` and `°` of older instruments.
fn text(bytes: &[u8]) -> String {
    std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().map(|byte| char::from(*byte)).collect(), str::to_owned)
}

/// How many bytes the first lines of a text take.
fn length_of_lines(text: &[u8], lines: usize) -> usize {
    text.split_inclusive(|byte| *byte == b'\n').take(lines).map(<[u8]>::len).sum()
}

/// Names of a header that spaces separate: `Time [s]` is one name.
fn with_their_brackets(words: Vec<String>) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for word in words {
        let unit = word.starts_with(['[', '(']) && word.ends_with([']', ')']);
        match names.last_mut() {
            Some(name) if unit => *name = format!("{name} {word}"),
            _ => names.push(word),
        }
    }
    names
}

/// Reads runs of spaces and tabs as one tab, those at either end of a line as nothing; quoted ones stay.
struct Squeeze<R> {
    inner: R,
    quoted: bool,
    line_begins: bool,
    spaces: bool,
    raw: Vec<u8>,
    ready: Cursor<Vec<u8>>,
}

impl<R> Squeeze<R> {
    fn new(inner: R) -> Self {
        let raw = vec![0; 1 << 16];
        Squeeze { inner, quoted: false, line_begins: true, spaces: false, raw, ready: Cursor::default() }
    }
}

impl<R: Read> Read for Squeeze<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        loop {
            let handed = self.ready.read(buffer)?;
            if handed > 0 || buffer.is_empty() {
                return Ok(handed);
            }
            let got = self.inner.read(&mut self.raw)?;
            if got == 0 {
                return Ok(0);
            }
            let ready = self.ready.get_mut();
            ready.clear();
            for &byte in &self.raw[..got] {
                if !self.quoted && matches!(byte, b' ' | b'\t' | b'\r') {
                    self.spaces = true;
                    continue;
                }
                if std::mem::take(&mut self.spaces) && !self.line_begins && byte != b'\n' {
                    ready.push(b'\t');
                }
                self.line_begins = byte == b'\n';
                self.quoted = (self.quoted ^ (byte == b'"')) && !self.line_begins;
                ready.push(byte);
            }
            self.ready.set_position(0);
        }
    }
}
