//! What kind of text a file is: encoding, separator, decimal mark.

use super::error::{CARRIAGE_RETURNS, RecordingProblem};
use super::preamble;

/// How the file separates its columns, and where its header is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Dialect {
    /// What separates its columns.
    pub separation: Separation,
    /// Lines above the header that are none of the table.
    pub lines_above: usize,
    /// The first record is Excel's `sep=;`.
    pub separator_line: bool,
    /// The header behind the `#` of a comment, as NumPy writes it, and its line counted from 1.
    pub commented_header: Option<(Vec<u8>, u64)>,
}

/// What separates columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Separation {
    /// Comma, semicolon, tab or bar. A tab too where spaces separate the columns: runs of them are read as one.
    pub delimiter: u8,
    /// Runs of spaces and tabs separate the columns.
    pub spaces: bool,
}

impl Dialect {
    /// Judges by the first bytes of a file.
    pub fn sniff(head: &[u8]) -> Result<Dialect, RecordingProblem> {
        if head.starts_with(b"\xff\xfe\0\0") {
            return Err(RecordingProblem::NotText("UTF-32"));
        }
        if head.starts_with(b"\xff\xfe") || head.starts_with(b"\xfe\xff") {
            return Err(RecordingProblem::NotText("UTF-16"));
        }
        if head.contains(&0) {
            return Err(RecordingProblem::NotText("binary"));
        }
        let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
        let lines = || text.split(|&b| b == b'\n').map(<[u8]>::trim_ascii);
        let lines_above = preamble::lines_above(text);
        let mut filled = lines().skip(lines_above).filter(|line| !line.is_empty() && !line.starts_with(b"#"));
        let first = filled.next().ok_or(RecordingProblem::Empty)?;
        if first.contains(&b'\r') {
            return Err(RecordingProblem::NotText(CARRIAGE_RETURNS));
        }
        if let Some(&[delimiter]) = first.strip_prefix(b"sep=") {
            let separation = Separation { delimiter, spaces: false };
            return Ok(Dialect { separation, lines_above: 0, separator_line: true, commented_header: None });
        }
        let separation = Separation::of(first, filled.next());
        let mut dialect = Dialect { separation, lines_above, separator_line: false, commented_header: None };
        let count = |line: &[u8]| separation.fields(line).len();
        let numbers = |line: &[u8]| separation.fields(line).iter().all(|field| is_number(field));
        if numbers(first) {
            let at = lines().position(|line| line == first).unwrap_or(0);
            let comment = lines().enumerate().take(at).filter(|(_, line)| line.starts_with(b"#")).last();
            if let Some((line, text)) = comment {
                let names = text[text.iter().take_while(|b| **b == b'#').count()..].trim_ascii();
                if count(names) == count(first) && separation.fields(names).iter().all(|name| !is_number(name)) {
                    dialect.commented_header = Some((names.to_vec(), line as u64 + 1));
                }
            }
        }
        Ok(dialect)
    }
}

impl Separation {
    /// The separation of a header, or of a first row of numbers, and of the row below it.
    pub fn of(first: &[u8], second: Option<&[u8]>) -> Self {
        let mut quoted = false;
        let mut counts = [0_usize; 4];
        for &byte in first {
            quoted ^= byte == b'"';
            if let Some(i) = b",;\t|".iter().position(|&d| d == byte && !quoted) {
                counts[i] += 1;
            }
        }
        let words = |line: &[u8]| line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).count();
        let separates = |line: &[u8]| line.iter().any(|b| b",;\t|".contains(b));
        let (delimiter, spaces) = match counts {
            // Nothing but spaces, in the row below too.
            [0, 0, 0, 0] if words(first) > 1 && second.is_none_or(|row| words(row) > 1 && !separates(row)) => {
                (b'\t', true)
            }
            [commas, semicolons, tabs, _] if tabs > 0 && tabs >= commas.max(semicolons) => (b'\t', false),
            [commas, semicolons, ..] if semicolons > 0 && semicolons >= commas => (b';', false),
            [0, 0, 0, bars] if bars > 0 => (b'|', false),
            _ => (b',', false),
        };
        Separation { delimiter, spaces }
    }

    /// The fields of a line without quotes.
    pub fn fields(self, line: &[u8]) -> Vec<&[u8]> {
        match self.spaces {
            true => line.split(u8::is_ascii_whitespace).filter(|field| !field.is_empty()).collect(),
            false => line.split(|&b| b == self.delimiter).map(<[u8]>::trim_ascii).collect(),
        }
    }

    /// The fields of a line as names: without quotes around them, and without empty ones at the end.
    pub fn names(self, line: &[u8]) -> Vec<String> {
        let bare = |field: &&[u8]| String::from_utf8_lossy(field).trim_matches('"').trim().to_owned();
        let mut names: Vec<String> = self.fields(line).iter().map(bare).collect();
        while names.last().is_some_and(String::is_empty) {
            names.pop();
        }
        names
    }
}

/// Whether a field is a number, with a decimal point or a decimal comma.
pub(super) fn is_number(field: &[u8]) -> bool {
    std::str::from_utf8(field).is_ok_and(|text| text.trim().replace(',', ".").parse::<f64>().is_ok())
}

/// Reads numbers of one file: decimal points, or decimal commas where commas do not separate the columns.
#[derive(Debug, Clone)]
pub(super) struct Numbers {
    comma_separated: bool,
    /// The decimal mark seen first, and its line.
    mark: Option<(u8, u64)>,
    scratch: String,
}

impl Numbers {
    pub fn new(dialect: &Dialect) -> Self {
        Numbers { comma_separated: dialect.separation.delimiter == b',', mark: None, scratch: String::new() }
    }

    /// True once a decimal comma was read.
    pub fn decimal_comma(&self) -> bool {
        matches!(self.mark, Some((b',', _)))
    }

    /// One field as a number, which need not be finite.
    pub fn parse(&mut self, field: &[u8], line: u64) -> Result<f64, RecordingProblem> {
        let field = field.trim_ascii();
        let lossy = || String::from_utf8_lossy(field).into_owned();
        let Ok(text) = std::str::from_utf8(field) else { return Err(RecordingProblem::NotANumber(lossy())) };
        if text.is_empty() {
            return Err(RecordingProblem::EmptyField);
        }
        let mark = field.iter().copied().find(|b| matches!(b, b'.' | b','));
        let number = match mark {
            Some(b',') if self.comma_separated || grouped(text) => None,
            Some(b',') => {
                self.scratch.clear();
                self.scratch.push_str(text);
                self.scratch = self.scratch.replace(',', ".");
                self.scratch.parse::<f64>().ok()
            }
            _ => text.parse::<f64>().ok(),
        };
        let Some(number) = number else {
            return Err(match text {
                _ if grouped(text) => RecordingProblem::Thousands(lossy()),
                _ if mark == Some(b',') && self.comma_separated && text.replace(',', ".").parse::<f64>().is_ok() => {
                    RecordingProblem::CommaInNumber(lossy())
                }
                _ => RecordingProblem::NotANumber(lossy()),
            });
        };
        match (mark, self.mark) {
            (Some(new), None) => self.mark = Some((new, line)),
            (Some(new), Some((old, first_line))) if new != old => {
                return Err(RecordingProblem::MixedDecimalMarks { text: lossy(), first_line });
            }
            _ => {}
        }
        Ok(number)
    }
}

/// `1,234.5`, `1.234.567`, `1 234`, `1'234`: digits in groups.
fn grouped(text: &str) -> bool {
    let marks = text.matches(['.', ',', ' ', '\'', '\u{a0}', '\u{202f}']).count();
    let single = marks == 1 && text.contains(['.', ',']);
    let digits =
        text.trim_start_matches(['-', '+']).chars().all(|c| c.is_ascii_digit() || ".,' \u{a0}\u{202f}".contains(c));
    marks > 0 && !single && digits
}

#[cfg(test)]
mod tests {
    use super::*;

    fn delimiter(head: &str) -> u8 {
        Dialect::sniff(head.as_bytes()).unwrap().separation.delimiter
    }

    #[test]
    fn separators_are_told_from_the_header() {
        assert_eq!(delimiter("# a;b\n\na,b\n1;2"), b',');
        assert_eq!(delimiter("\u{feff}a;b\r\n"), b';');
        assert_eq!(delimiter("a\tb"), b'\t');
        assert_eq!(delimiter("\"x;y;z\",b"), b',');
        assert_eq!(delimiter("sep=;\na;b"), b';');
        assert_eq!(delimiter("a"), b',');
        assert!(Dialect::sniff(b"a  b\n1 2").unwrap().separation.spaces);
        assert!(!Dialect::sniff(b"Time s\n1").unwrap().separation.spaces);
        let numpy = Dialect::sniff(b"# bench 3\n# time_s torque_nm\n0.0e+00 1.0e+00\n").unwrap();
        assert_eq!((numpy.separation.spaces, numpy.commented_header), (true, Some((b"time_s torque_nm".to_vec(), 2))));
        assert_eq!(Dialect::sniff(b"# 3 runs, 2 benches\n0,1,2\n").unwrap().commented_header, None);
    }

    #[test]
    fn numbers_are_read_or_named() {
        let mut numbers = Numbers::new(&Dialect::sniff(b"a;b").unwrap());
        assert_eq!(numbers.parse(b" -1,5e-3\r", 2), Ok(-1.5e-3));
        assert_eq!(numbers.parse(b"7", 3), Ok(7.0));
        assert!(matches!(numbers.parse(b"1.5", 4), Err(RecordingProblem::MixedDecimalMarks { first_line: 2, .. })));
        assert!(matches!(numbers.parse(b"1.234,5", 4), Err(RecordingProblem::Thousands(_))));
        assert!(matches!(numbers.parse(b"1 234", 4), Err(RecordingProblem::Thousands(_))));
        let mut numbers = Numbers::new(&Dialect::sniff(b"a,b").unwrap());
        assert!(matches!(numbers.parse(b"0,5", 4), Err(RecordingProblem::CommaInNumber(_))));
        assert!(matches!(numbers.parse(b"", 4), Err(RecordingProblem::EmptyField)));
        assert!(matches!(numbers.parse(b"1.2.3x", 4), Err(RecordingProblem::NotANumber(_))));
        assert!(matches!(numbers.parse(b"\xb5", 4), Err(RecordingProblem::NotANumber(_))));
    }
}
