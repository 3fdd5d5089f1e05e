//! Lines that instruments write above the header of a text: device, date, settings.

use super::dialect::{Separation, is_number};
use super::name::{Named, is_unit, parse_head};
use super::unit_text;

/// How many lines stand above the header. None where the first line names a quantity, or where no later line is a header with rows of numbers below it.
pub(super) fn lines_above(text: &[u8]) -> usize {
    let lines: Vec<(usize, &[u8])> = text
        .split(|&b| b == b'\n')
        .map(<[u8]>::trim_ascii)
        .enumerate()
        .filter(|(_, line)| !line.is_empty() && !line.starts_with(b"#"))
        .collect();
    let Some((_, first)) = lines.first() else { return 0 };
    let second = lines.get(1).map(|(_, line)| *line);
    let first = Separation::of(first, second).names(first);
    if first.iter().all(|name| is_number(name.as_bytes())) || first.iter().any(|name| is_known(name)) {
        return 0;
    }
    let found = (1..lines.len()).find(|at| {
        let below = &lines[at + 1..];
        let names = header(lines[*at].1, below.iter().map(|(_, line)| *line));
        names.is_some_and(|names| names.len() != first.len() || names.iter().any(|name| is_nearly_known(name)))
    });
    found.map_or(0, |at| lines[at].0)
}

/// The names of a line, if it is a header: names, each once, with two rows of as many numbers below it; units may stand between.
fn header<'l>(line: &'l [u8], below: impl Iterator<Item = &'l [u8]>) -> Option<Vec<String>> {
    let mut below = below.peekable();
    let separation = Separation::of(line, below.peek().copied());
    let names = separation.names(line);
    let is_name = |name: &String| name.chars().any(char::is_alphabetic) && !is_number(name.as_bytes());
    let twice = (1..names.len()).any(|at| names[..at].contains(&names[at]));
    if names.len() < 2 || twice || !names.iter().all(is_name) {
        return None;
    }
    let said = |unit: &String| is_unit(unit) || unit_text::is_blank(unit);
    below.next_if(|line| separation.names(line).iter().all(said));
    let is_row = |line: &[u8]| {
        let fields = separation.names(line);
        fields.len() == names.len() && fields.iter().all(|field| is_number(field.as_bytes()))
    };
    let rows = below.take(2).filter(|line| is_row(line)).count();
    (rows == 2).then_some(names)
}

fn is_known(name: &str) -> bool {
    matches!(parse_head(name, None), Named::Known(..))
}

fn is_nearly_known(name: &str) -> bool {
    !matches!(parse_head(name, None), Named::Other)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn above(text: &str) -> usize {
        lines_above(text.as_bytes())
    }

    #[test]
    fn lines_above_the_header_are_counted() {
        let rows = "0,1,2\n0.1,2,3\n";
        assert_eq!(above(&format!("time_s,torque_nm,deflection_rad\n{rows}")), 0);
        assert_eq!(above(&format!("Bench 3\nSerial: 77\n\nTime [s],Torque [Nm],x\n{rows}")), 3);
        assert_eq!(above(&format!("Model,MDO3024\nFirmware,1.26\nStart,Stop\n0,10\nTIME,CH1,CH2\n{rows}")), 4);
        assert_eq!(above("Model,MDO3024\nFirmware,1.26\nTIME,CH1\n0,1\n1,2\n"), 2);
        assert_eq!(above("Device;B;C\nTime;Torque;Angle\n[s];[Nm];[rad]\n0,5;1;2\n0,6;1;2\n"), 1);
        assert_eq!(above("measured today at ten\n\"t\"  \"tau\"\n0 1\n1 2\n"), 1);
    }

    #[test]
    fn the_first_line_stays_the_header_where_it_may_be_one() {
        assert_eq!(above("time_s,state\n0,off\nx,y\n1,2\n2,3\n"), 0);
        assert_eq!(above("t,tau\nfirst,second\n1,2\n2,3\n"), 0);
        assert_eq!(above("0,1\n1,2\na,b\n1,2\n2,3\n"), 0);
        assert_eq!(above("a,b\nnan,nan\n1,2\n2,3\n"), 0);
        assert_eq!(above("Bench 3\n0,1\n1,2\n"), 0);
        assert_eq!(above(""), 0);
    }
}
