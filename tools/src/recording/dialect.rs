//! What kind of text a file is: encoding, separator, decimal mark.

use super::error::RecordingProblem;

/// How the file separates its columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dialect {
    /// Comma, semicolon or tab.
    pub delimiter: u8,
    /// The first record is Excel's `sep=;`.
    pub separator_line: bool,
}

impl Dialect {
    /// Judges by the first bytes of a file.
    pub fn sniff(head: &[u8]) -> Result<Dialect, RecordingProblem> {
        if let Some(what) = foreign(head) {
            return Err(RecordingProblem::NotText(what));
        }
        let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
        let header = text
            .split(|&b| b == b'\n')
            .map(<[u8]>::trim_ascii)
            .find(|line| !line.is_empty() && !line.starts_with(b"#"))
            .ok_or(RecordingProblem::Empty)?;
        if header.contains(&b'\r') {
            return Err(RecordingProblem::NotText("text whose lines end in a carriage return alone"));
        }
        if let Some(&[delimiter]) = header.strip_prefix(b"sep=") {
            return Ok(Dialect { delimiter, separator_line: true });
        }
        let mut quoted = false;
        let mut counts = [0_usize; 3];
        for &byte in header {
            quoted ^= byte == b'"';
            if let Some(i) = b",;\t".iter().position(|&d| d == byte && !quoted) {
                counts[i] += 1;
            }
        }
        let most = counts.into_iter().max().unwrap_or(0);
        let delimiter = match counts {
            [_, _, tabs] if tabs == most && most > 0 => b'\t',
            [_, semicolons, _] if semicolons == most && most > 0 => b';',
            _ => b',',
        };
        Ok(Dialect { delimiter, separator_line: false })
    }
}

fn foreign(head: &[u8]) -> Option<&'static str> {
    match head {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some("UTF-16"),
        [b'P', b'K', 3, 4, ..] => Some("a ZIP archive or an Excel workbook"),
        [0x1f, 0x8b, ..] => Some("gzip-compressed"),
        _ if head.contains(&0) => Some("binary"),
        _ => None,
    }
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
    pub fn new(dialect: Dialect) -> Self {
        Numbers { comma_separated: dialect.delimiter == b',', mark: None, scratch: String::new() }
    }

    /// True once a decimal comma was read.
    pub fn decimal_comma(&self) -> bool {
        matches!(self.mark, Some((b',', _)))
    }

    /// One field as a finite number.
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
        if !number.is_finite() {
            return Err(RecordingProblem::NotFinite(lossy()));
        }
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
        Dialect::sniff(head.as_bytes()).unwrap().delimiter
    }

    #[test]
    fn separators_are_told_from_the_header() {
        assert_eq!(delimiter("# a;b\n\na,b\n1;2"), b',');
        assert_eq!(delimiter("\u{feff}a;b\r\n"), b';');
        assert_eq!(delimiter("a\tb"), b'\t');
        assert_eq!(delimiter("\"x;y;z\",b"), b',');
        assert_eq!(delimiter("sep=;\na;b"), b';');
        assert_eq!(delimiter("a"), b',');
    }

    #[test]
    fn numbers_are_read_or_named() {
        let semicolon = Dialect { delimiter: b';', separator_line: false };
        let mut numbers = Numbers::new(semicolon);
        assert_eq!(numbers.parse(b" -1,5e-3\r", 2), Ok(-1.5e-3));
        assert_eq!(numbers.parse(b"7", 3), Ok(7.0));
        assert!(matches!(numbers.parse(b"1.5", 4), Err(RecordingProblem::MixedDecimalMarks { first_line: 2, .. })));
        assert!(matches!(numbers.parse(b"1.234,5", 4), Err(RecordingProblem::Thousands(_))));
        assert!(matches!(numbers.parse(b"1 234", 4), Err(RecordingProblem::Thousands(_))));
        let mut numbers = Numbers::new(Dialect { delimiter: b',', separator_line: false });
        assert!(matches!(numbers.parse(b"0,5", 4), Err(RecordingProblem::CommaInNumber(_))));
        assert!(matches!(numbers.parse(b"NaN", 4), Err(RecordingProblem::NotFinite(_))));
        assert!(matches!(numbers.parse(b"1e999", 4), Err(RecordingProblem::NotFinite(_))));
        assert!(matches!(numbers.parse(b"", 4), Err(RecordingProblem::EmptyField)));
        assert!(matches!(numbers.parse(b"1.2.3x", 4), Err(RecordingProblem::NotANumber(_))));
        assert!(matches!(numbers.parse(b"\xb5", 4), Err(RecordingProblem::NotANumber(_))));
    }
}
