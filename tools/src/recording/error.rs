//! Why a recording was refused: where, what is wrong, and the fix.

use super::quantity::Quantity;
use super::table::Location;
use crate::number::trimmed;

/// A recording was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{file}{}: {problem}", self.located())]
pub struct RecordingError {
    /// The file.
    pub file: String,
    /// Its line or row, where one is to blame.
    pub place: Option<Location>,
    /// Its column, where one is to blame.
    pub column: Option<ColumnPlace>,
    /// What is wrong.
    pub problem: Box<RecordingProblem>,
}

/// What the oldest programs end their lines by.
pub(super) const CARRIAGE_RETURNS: &str = "text whose lines end in a carriage return alone";

/// A column of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnPlace {
    /// Its name in the header.
    pub name: String,
    /// Its number, counted from 1.
    pub number: usize,
}

/// What is wrong with a recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordingProblem {
    /// The system could not read the file.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// A folder that holds nothing to read.
    #[error("holds no recording: none of its files ends in .{}", super::format::Format::ENDINGS.join(", ."))]
    NoRecordings,
    /// A list of recordings without one.
    #[error("names no recording")]
    EmptyList,
    /// A file that was given as a list of recordings, and names none that is there.
    #[error("names no file that exists; its first line is `{0}`")]
    NotAList(String),
    /// Nothing but white space and comments.
    #[error("is empty")]
    Empty,
    /// Text, but not as it is read.
    #[error("is {0}, not CSV text in UTF-8")]
    NotText(&'static str),
    /// A format that is not read.
    #[error("is {format}, which is not read")]
    Foreign {
        /// What it is.
        format: &'static str,
        /// How to export it.
        export: &'static str,
    },
    /// A format that this program was built without.
    #[error("is {format}, which this gmhm was built without")]
    NotBuilt {
        /// What it is.
        format: &'static str,
        /// The feature that reads it.
        feature: &'static str,
    },
    /// A file of a known format that is damaged, or uses what is not read of it.
    #[error("cannot be read as {format}: {why}")]
    Damaged {
        /// What it is.
        format: &'static str,
        /// What is wrong with it.
        why: String,
    },
    /// The first row is numbers.
    #[error("starts with numbers where the header should name the columns")]
    HeaderMissing,
    /// No row, or a single one.
    #[error("has {0} of numbers under its header; a recording needs at least two")]
    TooShort(&'static str),
    /// Columns that the command needs are not there.
    #[error("has no column {wanted}; its columns are {found}")]
    MissingColumns {
        /// What is needed, in words.
        wanted: String,
        /// What the header names.
        found: String,
        /// Columns that may be it, as one `--map`.
        guess: Option<String>,
    },
    /// The unit in a column's name is not that beside it.
    #[error("the name says {named}, the unit beside it {beside}")]
    TwoUnits {
        /// The unit of the name.
        named: String,
        /// The unit beside it.
        beside: String,
    },
    /// A column in memory that holds something else.
    #[error("holds {0}, not numbers")]
    NoNumbers(String),
    /// Columns in memory of different lengths.
    #[error("has {rows} rows, `{other}` has {expected}")]
    OtherLength {
        /// Its rows.
        rows: usize,
        /// Another column.
        other: String,
        /// The rows of that.
        expected: usize,
    },
    /// Columns without rows in common.
    #[error("has rows of its own, other than those of `{other}`")]
    OtherRows {
        /// The other column.
        other: String,
    },
    /// What is needed is there, with rows of its own.
    #[error("is the column {wanted}, but has rows of its own, other than those of `{other}`")]
    RowsApart {
        /// What is needed, in words.
        wanted: &'static str,
        /// The other column.
        other: String,
    },
    /// Nothing is left between `--from` and `--to`.
    #[error("has {found} between --from and --to; its time runs from {first} to {last} s")]
    NothingBetween {
        /// What is left, in words.
        found: &'static str,
        /// First time, s.
        first: f64,
        /// Last time, s.
        last: f64,
    },
    /// Two columns of one name.
    #[error("is twice in the header, also as column {0}")]
    DuplicateColumn(usize),
    /// Two columns give one quantity in different units.
    #[error("and `{other}` both give the {}", quantity.stem())]
    TwoColumnsForOne {
        /// The other column.
        other: String,
        /// What both give.
        quantity: Quantity,
    },
    /// The name ends in no unit that is known.
    #[error("{} for the {}; accepted: {}", suffix_words(suffix), quantity.stem(), quantity.accepted_suffixes())]
    UnknownUnit {
        /// What the name's stem says.
        quantity: Quantity,
        /// What follows the stem; may be empty.
        suffix: String,
    },
    /// `--map` names a column that is not there.
    #[error("has no column for `--map {mapping}`; its columns are {found}")]
    MapColumnMissing {
        /// The entry as written.
        mapping: String,
        /// What the header names.
        found: String,
    },
    /// A field without content.
    #[error("the field is empty")]
    EmptyField,
    /// Text where a number should be.
    #[error("`{0}` is not a number")]
    NotANumber(String),
    /// NaN, infinite, or too large for a double.
    #[error("`{0}` is not a finite number")]
    NotFinite(String),
    /// Digits grouped, as in `1,234.5`.
    #[error("`{0}` looks like a number with thousands separators")]
    Thousands(String),
    /// A comma in a quoted number of a comma-separated file.
    #[error("`{0}` holds a comma, which separates the columns of this file")]
    CommaInNumber(String),
    /// Decimal commas and decimal points in one file.
    #[error("`{text}` has another decimal mark than line {first_line}")]
    MixedDecimalMarks {
        /// The offending field.
        text: String,
        /// Where the other mark was first seen.
        first_line: u64,
    },
    /// Time stands still.
    #[error("time does not increase: {0} s, as in the row before")]
    TimeRepeats(f64),
    /// Time runs back.
    #[error("time decreases: {after} s after {before} s")]
    TimeRunsBack {
        /// The row before, s.
        before: f64,
        /// This row, s.
        after: f64,
    },
    /// A quoted field that does not end on its line.
    #[error("a quote is opened and not closed on the line")]
    OpenQuote,
    /// Fewer fields than columns.
    #[error("{} has {found} of {expected} fields", if *last { "the last row is cut off: it" } else { "the row" })]
    TooFewFields {
        /// Fields in the row.
        found: usize,
        /// Columns of the header.
        expected: usize,
        /// It is the file's last row.
        last: bool,
    },
    /// More fields than columns.
    #[error("the row has {found} fields, the header {expected}")]
    TooManyFields {
        /// Fields in the row.
        found: usize,
        /// Columns of the header.
        expected: usize,
    },
    /// Angles without a ratio.
    #[error("has motor-side and output-side angles but no deflection, and no ratio is known")]
    NoRatio {
        /// The ratio that the angles show.
        shown: Option<f64>,
    },
    /// Angles that show another ratio than the one given.
    #[error("its angles turn {shown} to 1, the ratio given is {given}")]
    OtherRatio {
        /// The ratio given.
        given: f64,
        /// The ratio that the angles show.
        shown: f64,
        /// What the difference suggests.
        mistake: Mistake,
    },
    /// An angle that starts again after each turn.
    #[error("`{column}` starts again after each turn ({jumps} times, first at {} s)", trimmed(*first_s, 6))]
    StartsAgain {
        /// The column.
        column: &'static str,
        /// How often.
        jumps: usize,
        /// When first, s.
        first_s: f64,
    },
    /// The motor-side or output-side angle alone where the deflection is needed.
    #[error("holds no deflection: that takes `deflection_rad`, or `theta_in_rad` and `theta_out_rad` with the ratio")]
    NoDeflection,
}

/// What the angles' own ratio is beside the one given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mistake {
    /// The other sign.
    Sign,
    /// One angle in degrees or revolutions, the other in radians.
    Unit,
    /// One tooth difference: circular spline or flex spline held.
    OneOff,
    /// Another whole number.
    Other,
}

impl RecordingError {
    /// What is wrong with a file as a whole.
    pub fn of_file(file: &str, problem: RecordingProblem) -> Self {
        RecordingError { file: file.to_owned(), place: None, column: None, problem: Box::new(problem) }
    }

    fn located(&self) -> String {
        let line = self.place.map(|place| format!(", {place}")).unwrap_or_default();
        let column = self.column.as_ref().map(|c| format!(", column {} `{}`", c.number, c.name)).unwrap_or_default();
        line + &column
    }

    /// How to fix it, where there is more to say than the message does.
    pub fn fix(&self) -> Option<String> {
        if let (RecordingProblem::UnknownUnit { quantity, suffix }, Some(column)) = (&*self.problem, &self.column) {
            let map = format!("{}={}", quantity.si_name(), column.name);
            if suffix.contains(':') {
                return RecordingProblem::NotANumber(suffix.clone()).fix();
            }
            return Some(match suffix.is_empty() {
                true => format!("if it is in {}, add --map {}", quantity.units()[0].spellings[0], shell_word(&map)),
                false => format!("convert it, such as --map {}", shell_word(&format!("{map}*0.001"))),
            });
        }
        if let (RecordingProblem::MissingColumns { guess: None, .. }, None) = (&*self.problem, self.place) {
            return Some(
                "name the column so, or add --map NAME=COLUMN; `gmhm columns FILE` lists them all. Columns that hold no numbers (texts, lists, complex numbers) are not among them"
                    .to_owned(),
            );
        }
        self.problem.fix()
    }
}

/// A stream of compressed bytes that is damaged; travels in an [`std::io::Error`].
#[derive(Debug, thiserror::Error)]
#[error("{why}")]
pub(super) struct DamagedStream {
    /// The format.
    pub format: &'static str,
    /// What its decoder says.
    pub why: String,
}

impl From<csv::Error> for RecordingProblem {
    fn from(error: csv::Error) -> Self {
        let text = error.to_string();
        match error.into_kind() {
            csv::ErrorKind::Io(error) => error.into(),
            _ => RecordingProblem::Unreadable(text),
        }
    }
}

impl From<std::io::Error> for RecordingProblem {
    fn from(error: std::io::Error) -> Self {
        match error.get_ref().and_then(|inner| inner.downcast_ref::<DamagedStream>()) {
            Some(DamagedStream { format, why }) => RecordingProblem::Damaged { format, why: why.clone() },
            None => RecordingProblem::Unreadable(error.to_string()),
        }
    }
}

impl RecordingProblem {
    fn fix(&self) -> Option<String> {
        let text = match self {
            RecordingProblem::Unreadable(_) => "check the path, and that the file may be read",
            RecordingProblem::EmptyList | RecordingProblem::NotAList(_) => {
                "write one path a line; a recording itself is given without --files-from"
            }
            RecordingProblem::NoRecordings => "name the files, or another folder",
            RecordingProblem::Empty => "record again, or check that the export finished",
            RecordingProblem::StartsAgain { .. } => {
                "let the angle count on over the turns before export, such as by numpy.unwrap(angle) or MATLAB's unwrap(angle), the angle in rad"
            }
            RecordingProblem::NotText(CARRIAGE_RETURNS) => {
                "convert its line ends, such as by tr '\\r' '\\n' < FILE > NEW, or export it again"
            }
            RecordingProblem::NotText(_) => "export it as CSV, encoded in UTF-8",
            RecordingProblem::HeaderMissing => {
                "put the column names first, such as time_s,deflection_rad,torque_nm, without a # before them"
            }
            RecordingProblem::TooShort(_) => "check that the recording finished and that the export holds its rows",
            RecordingProblem::MissingColumns { guess: Some(guess), .. } => {
                let many = if guess.contains(',') { "those are the columns" } else { "that is the column" };
                let open = if guess.ends_with("=COLUMN") { ", COLUMN being the name in the file" } else { "" };
                return Some(format!(
                    "if {many}, add --map {} (with *SCALE where units differ){open}",
                    shell_word(guess)
                ));
            }
            RecordingProblem::MissingColumns { guess: None, .. } => {
                "name the column so in the header (the first line that does not begin with #), or add --map NAME=COLUMN; `gmhm columns FILE` lists them all"
            }
            RecordingProblem::DuplicateColumn(_) | RecordingProblem::TwoColumnsForOne { .. } => {
                "keep one of the two, or say which by --map"
            }
            RecordingProblem::UnknownUnit { quantity, .. } => {
                return Some(format!("convert it, such as --map {}=COLUMN*0.001", quantity.si_name()));
            }
            RecordingProblem::TwoUnits { .. } => "correct the header, or say which by --map",
            RecordingProblem::NoNumbers(_) => "convert it to floats, or map another column",
            RecordingProblem::OtherLength { .. } => "give all columns the same length",
            RecordingProblem::OtherRows { .. } | RecordingProblem::RowsApart { .. } => {
                "take all columns from one group or topic, or resample them to one time when exporting"
            }
            RecordingProblem::NothingBetween { .. } => "give --from and --to in seconds of the time column",
            RecordingProblem::Foreign { export, .. } => export,
            RecordingProblem::NotBuilt { feature, .. } => {
                return Some(format!(
                    "build it with --features {feature}; or save again in MATLAB by save -v7, which is read by every build"
                ));
            }
            RecordingProblem::Damaged { .. } => "export it again, or export it as CSV",
            RecordingProblem::MapColumnMissing { .. } => {
                "write the column as in the header; COLUMN*2, COLUMN/2, -COLUMN and COLUMN*2+0.5 are understood"
            }
            RecordingProblem::EmptyField => "fill it, or remove the row",
            RecordingProblem::NotANumber(text) if text.contains(':') => {
                "write times as seconds, such as 12.345, counted from any origin; of time stamps by pandas: (t - t.iloc[0]).dt.total_seconds()"
            }
            RecordingProblem::NotANumber(_) => "write a number such as -1.5e-3, or remove the row",
            RecordingProblem::NotFinite(_) => "remove the row, or fill it by a measured value",
            RecordingProblem::Thousands(_) => "export without thousands separators",
            RecordingProblem::CommaInNumber(_) => {
                "for decimal commas separate the columns by semicolons or tabs; else export without thousands separators"
            }
            RecordingProblem::MixedDecimalMarks { .. } => "use decimal points throughout, or decimal commas throughout",
            RecordingProblem::TimeRepeats(_) => {
                "remove the repeated row, or write the time with more digits, so that it increases from row to row"
            }
            RecordingProblem::TimeRunsBack { .. } => {
                "sort the rows, or split the file where the clock was set back; time must increase from row to row"
            }
            RecordingProblem::OpenQuote => "close the quote, or remove it and any line break in the field",
            RecordingProblem::TooFewFields { last: true, .. } => "remove the last row, or export again",
            RecordingProblem::TooFewFields { .. } => "complete the row, or remove it",
            RecordingProblem::TooManyFields { .. } => {
                "remove the extra fields; for decimal commas separate the columns by semicolons or tabs"
            }
            RecordingProblem::NoRatio { shown: Some(shown) } => {
                return Some(format!("add --ratio N; the angles turn {} to 1", (1e4 * shown).round() / 1e4));
            }
            RecordingProblem::NoRatio { shown: None } => {
                "add --ratio N, or give a model file with `ratio` in its [gear] section"
            }
            RecordingProblem::OtherRatio { given, shown, mistake } => {
                return Some(match mistake {
                    Mistake::Sign => format!(
                        "one angle has the wrong sign: add --map theta_out_rad=-COLUMN, or --ratio {shown} where the gear reverses"
                    ),
                    Mistake::Unit => format!(
                        "the angles are in different units: name each in its own, such as --map theta_in_deg=COLUMN; the factor is {:.5}",
                        shown / given
                    ),
                    Mistake::OneOff => {
                        format!("add --ratio {shown}: the ratio is one more or less with the other spline held")
                    }
                    Mistake::Other => format!("add --ratio {shown}, or check the units of the angles"),
                });
            }
            RecordingProblem::NoDeflection => "add the column, or name it by --map",
        };
        Some(text.to_owned())
    }
}

/// A word as a shell takes it.
pub fn shell_word(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

fn suffix_words(suffix: &str) -> String {
    if suffix.is_empty() { "the name says no unit".to_owned() } else { format!("`_{suffix}` is no unit") }
}
