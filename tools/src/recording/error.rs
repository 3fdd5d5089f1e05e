//! Why a recording was refused: where, what is wrong, and the mend.

use super::quantity::Quantity;

/// A recording was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{file}{}: {problem}", self.place())]
pub struct RecordingError {
    /// The file.
    pub file: String,
    /// Its line, counted from 1, where one is to blame.
    pub line: Option<u64>,
    /// Its column, where one is to blame.
    pub column: Option<ColumnPlace>,
    /// What is wrong.
    pub problem: Box<RecordingProblem>,
}

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
    /// Nothing but white space and comments.
    #[error("is empty")]
    Empty,
    /// No CSV in UTF-8.
    #[error("is {0}, not CSV text in UTF-8")]
    NotText(&'static str),
    /// The first row is numbers.
    #[error("starts with numbers where the header should name the columns")]
    HeaderMissing,
    /// No row, or a single one.
    #[error("has {0} of numbers under its header; a recording needs at least two")]
    TooShort(&'static str),
    /// A column that the command needs is not there.
    #[error("has no column {wanted}; its columns are {found}")]
    MissingColumn {
        /// What is needed, in words.
        wanted: String,
        /// What the header names.
        found: String,
        /// A column that may be it, with the `--map` entry to say so.
        guess: Option<String>,
    },
    /// Two columns of one name.
    #[error("stands twice in the header, as column {0} too")]
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
    #[error("`{0}` is no number")]
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
    #[error("time stands still: {0} s, as on the row before")]
    TimeRepeats(f64),
    /// Time runs back.
    #[error("time runs back: {after} s after {before} s")]
    TimeRunsBack {
        /// The row before, s.
        before: f64,
        /// This row, s.
        after: f64,
    },
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
    NoRatio,
    /// The motor-side or output-side angle alone where the deflection is needed.
    #[error("holds no deflection: that takes `deflection_rad`, or `theta_in_rad` and `theta_out_rad` with the ratio")]
    NoDeflection,
}

impl RecordingError {
    fn place(&self) -> String {
        let line = self.line.map(|n| format!(", line {n}")).unwrap_or_default();
        let column = self.column.as_ref().map(|c| format!(", column {} `{}`", c.number, c.name)).unwrap_or_default();
        line + &column
    }

    /// How to mend it, where there is more to say than the message does.
    pub fn mend(&self) -> Option<String> {
        self.problem.mend()
    }
}

impl RecordingProblem {
    fn mend(&self) -> Option<String> {
        let text = match self {
            RecordingProblem::Unreadable(_) => return None,
            RecordingProblem::Empty => "record again, or check that the export finished",
            RecordingProblem::NotText(_) => "export it as CSV, encoded in UTF-8",
            RecordingProblem::HeaderMissing => {
                "put the column names first, such as time_s,deflection_rad,torque_nm, without a # before them"
            }
            RecordingProblem::TooShort(_) => "check that the recording finished and that the export holds its rows",
            RecordingProblem::MissingColumn { guess: Some(guess), .. } => {
                return Some(format!("if that is the column, add --map {guess} (with *SCALE where units differ)"));
            }
            RecordingProblem::MissingColumn { guess: None, .. } => {
                "name the column so in the header, or add --map NAME=COLUMN"
            }
            RecordingProblem::DuplicateColumn(_) | RecordingProblem::TwoColumnsForOne { .. } => {
                "keep one of the two, or say which by --map"
            }
            RecordingProblem::UnknownUnit { quantity, .. } => {
                return Some(format!(
                    "rename the column, or convert it by --map, such as --map {}=COLUMN*0.001",
                    quantity.si_name()
                ));
            }
            RecordingProblem::MapColumnMissing { .. } => {
                "write the column as in the header; COLUMN*2, COLUMN/2, -COLUMN and COLUMN*2+0.5 are understood"
            }
            RecordingProblem::EmptyField => "fill it, or remove the row",
            RecordingProblem::NotANumber(text) if text.contains(':') => {
                "write times as seconds, such as 12.345, counted from any origin"
            }
            RecordingProblem::NotANumber(text) if is_unit(text) => {
                "this looks like a row of units: remove it, and say the units in the names, such as time_s, torque_nm, deflection_mrad"
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
            RecordingProblem::TooFewFields { last: true, .. } => "remove the last row, or export again",
            RecordingProblem::TooFewFields { .. } => "complete the row, or remove it",
            RecordingProblem::TooManyFields { .. } => {
                "remove the extra fields; for decimal commas separate the columns by semicolons or tabs"
            }
            RecordingProblem::NoRatio => "give a model file with `ratio` in its [gear] section",
            RecordingProblem::NoDeflection => "add the column, or name it by --map",
        };
        Some(text.to_owned())
    }
}

/// Whether a field is what exports write in a row of units.
fn is_unit(text: &str) -> bool {
    const UNITS: [&str; 28] = [
        "s", "sec", "ms", "us", "µs", "rad", "mrad", "urad", "µrad", "deg", "°", "arcmin", "nm", "n·m", "n*m", "n.m",
        "n m", "mnm", "nmm", "knm", "a", "ma", "°c", "degc", "rad/s", "deg/s", "°/s", "rpm",
    ];
    let bare = text.trim().trim_start_matches(['[', '(']).trim_end_matches([']', ')']).to_lowercase();
    UNITS.contains(&bare.as_str())
}

fn suffix_words(suffix: &str) -> String {
    if suffix.is_empty() { "the name says no unit".to_owned() } else { format!("`_{suffix}` is no unit") }
}
