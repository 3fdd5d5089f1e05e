//! Numbers as people write them: digits in groups of three, powers of ten where a number is very large or small.

/// A number in the notation that suits its size, to four significant digits or as many as asked.
pub fn number(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return "–".to_owned();
    }
    let exponent = value.abs().log10().floor() as i32;
    let digits = digits.max(1) as i32;
    let text = if (-3..5).contains(&exponent) {
        format!("{value:.*}", (digits - 1 - exponent).max(0) as usize)
    } else {
        format!("{value:.*e}", (digits - 1) as usize)
    };
    let shown = match text.split_once('e') {
        Some((mantissa, exponent)) => {
            let raised: String = exponent.chars().map(superscript).collect();
            format!("{mantissa}·10{raised}")
        }
        None => grouped(&text),
    };
    shown.replace('-', "−")
}

/// The same without zeros at the end: for numbers that were given, not estimated.
pub fn trimmed(value: f64, digits: usize) -> String {
    let shown = number(value, digits);
    let (mantissa, power) = shown.split_once('·').map_or((&shown[..], ""), |(mantissa, power)| (mantissa, power));
    let mantissa = if mantissa.contains('.') { mantissa.trim_end_matches('0').trim_end_matches('.') } else { mantissa };
    if power.is_empty() { mantissa.to_owned() } else { format!("{mantissa}·{power}") }
}

/// A share, 0 to 1, in whole percent.
pub fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// A number without decimals.
pub fn whole(value: f64) -> String {
    grouped(&format!("{value:.0}")).replace('-', "−")
}

/// Between groups of three digits: narrow, and no place to break a line.
const GAP: char = '\u{202f}';

/// The whole part in groups of three digits, from five digits on.
fn grouped(text: &str) -> String {
    let (whole, part) = text.split_once('.').map_or((text, None), |(whole, part)| (whole, Some(part)));
    let count = whole.chars().filter(char::is_ascii_digit).count();
    let mut shown = String::with_capacity(text.len() + 8);
    let mut left = count;
    for letter in whole.chars() {
        if letter.is_ascii_digit() {
            if count > 4 && left != count && left.is_multiple_of(3) {
                shown.push(GAP);
            }
            left -= 1;
        }
        shown.push(letter);
    }
    part.map_or(shown.clone(), |part| format!("{shown}.{part}"))
}

/// An estimate as people write it: its value and the ends of ± two standard deviations, all to the place of the second digit of the standard deviation.
pub fn estimate(value: f64, sd: f64) -> (String, String) {
    let ends = [value - 2.0 * sd, value + 2.0 * sd];
    let Some(place) = LastDigit::of(sd, ends[0].abs().max(ends[1].abs())) else {
        return (number(value, 6), "–".to_owned());
    };
    let [value, low, high] = [value, ends[0], ends[1]].map(|x| place.digits(x));
    (value + &place.power, place.raised(format!("{low} … {high}")))
}

/// An error of more than so many times a value tells that the value is not known; to the place of the error it would be 0.
const HIDES: f64 = 100.0;

/// A value and its error after ±, both to the place of the second digit of the error. Of a value that is far less than its error two digits.
pub fn plus_minus(value: f64, error: f64) -> String {
    if value != 0.0 && error > HIDES * value.abs() {
        return format!("{} ± {}", number(value, 2), number(error, 2));
    }
    match LastDigit::of(error, value.abs().max(error)) {
        Some(place) => place.raised(format!("{} ± {}", place.digits(value), place.digits(error))),
        None => number(value, 6),
    }
}

/// How numbers that belong together are written: by one power of ten, to one place.
struct LastDigit {
    scale: i32,
    decimals: usize,
    /// The power of ten; empty for 1.
    power: String,
}

impl LastDigit {
    /// The place of the second digit of an error, where there is one, beside the largest number.
    fn of(error: f64, largest: f64) -> Option<Self> {
        if !(error > 0.0 && largest.is_finite()) {
            return None;
        }
        let (exponent, place) = (largest.log10().floor() as i32, error.log10().floor() as i32 - 1);
        let scale = if (-3..5).contains(&exponent) { 0 } else { exponent };
        let raised = || format!("·10{}", scale.to_string().chars().map(superscript).collect::<String>());
        let power = if scale == 0 { String::new() } else { raised() };
        Some(Self { scale, decimals: (scale - place).clamp(0, 12) as usize, power })
    }

    fn digits(&self, x: f64) -> String {
        grouped(&format!("{:.*}", self.decimals, x / 10_f64.powi(self.scale))).replace('-', "−")
    }

    fn raised(&self, numbers: String) -> String {
        if self.power.is_empty() { numbers } else { format!("({numbers}){}", self.power) }
    }
}

fn superscript(digit: char) -> char {
    match digit {
        '-' => '⁻',
        '0' => '⁰',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        d => char::from_u32('⁰' as u32 + d.to_digit(10).unwrap_or(0)).unwrap_or(d),
    }
}

/// A number along an axis whose numbers span so much: as many digits as tell neighbours apart.
pub fn tick(value: f64, span: f64) -> String {
    let step = span / 10.0;
    if value.abs() < 1e-6 * span {
        return "0".to_owned();
    }
    let largest = value.abs().max(step);
    if !(1e-4..1e6).contains(&largest) {
        return number(value, ((largest / step).log10().ceil().max(0.0) as usize + 1).min(5));
    }
    let decimals = (0.01 - step.log10()).ceil().clamp(0.0, 8.0) as usize;
    grouped(&format!("{value:.decimals$}")).replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_as_people_write_them() {
        assert_eq!(number(24737.4, 5), "24\u{202f}737");
        assert_eq!(number(1234.0, 4), "1234");
        assert_eq!(trimmed(-1.177e14, 9), "−1.177·10¹⁴");
        assert_eq!((trimmed(2.0, 9), trimmed(0.25, 4), trimmed(120.0, 3)), ("2".into(), "0.25".into(), "120".into()));
        assert_eq!(number(-1.1774e14, 4), "−1.177·10¹⁴");
        assert_eq!(number(1.168e-3, 3), "0.00117");
        assert_eq!(number(5.8e-6, 2), "5.8·10⁻⁶");
        assert_eq!(number(0.0, 3), "0");
    }

    #[test]
    fn an_estimate_is_written_to_the_place_that_is_known() {
        let written = |value, sd| {
            let (value, interval) = estimate(value, sd);
            format!("{value} | {interval}")
        };
        assert_eq!(written(0.194, 0.0904), "0.194 | 0.013 … 0.375");
        assert_eq!(written(2.1e5, 1.4e5), "2.1·10⁵ | (−0.7 … 4.9)·10⁵");
        assert_eq!(written(9.989e8, 2.87e7), "0.999·10⁹ | (0.942 … 1.056)·10⁹");
        assert_eq!(written(-1.41e14, 3.8e13), "−1.41·10¹⁴ | (−2.17 … −0.65)·10¹⁴");
        assert_eq!(written(24797.0, 87.0), "24\u{202f}797 | 24\u{202f}623 … 24\u{202f}971");
        assert_eq!(written(5.0, 0.0), "5.00000 | –");
        assert_eq!(plus_minus(1.028e9, 8.4e7), "(1.028 ± 0.084)·10⁹");
        assert_eq!(plus_minus(20908.3, 24.2), "20\u{202f}908 ± 24");
        assert_eq!(plus_minus(59.3, 2.1e7), "59 ± 2.1·10⁷");
        assert_eq!(plus_minus(0.0, 0.3), "0.00 ± 0.30");
    }

    #[test]
    fn ticks_tell_neighbours_apart() {
        assert_eq!(tick(-30.0, 66.0), "−30");
        assert_eq!(tick(24_800.0, 1500.0), "24\u{202f}800");
        assert_eq!(tick(-0.25, 0.5), "−0.25");
        assert_eq!(tick(1e-17, 2.0), "0");
        assert_eq!(tick(2e-6, 1e-5), "2.0·10⁻⁶");
    }
}
