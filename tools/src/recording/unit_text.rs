//! Units as people write them: in brackets, with dots, degrees and slashes.

/// The words of a name, joined by `_`.
pub(super) fn words(name: &str) -> String {
    let words = name.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("_")
}

/// Whether a field says that there is no unit.
pub(super) fn is_blank(unit: &str) -> bool {
    matches!(bare(unit), "" | "-" | "1" | "--" | "none")
}

/// The unit as the suffix of a name would say it: `N·m` as `Nm`, `°/s` as `deg_per_s`.
pub(super) fn suffix(unit: &str) -> Option<String> {
    let text = bare(unit);
    let joined: String = text.chars().filter(|c| !matches!(c, ' ' | '·' | '⋅' | '*' | '.' | '-' | '\u{a0}')).collect();
    let plain = joined.replace(['µ', 'μ'], "u").replace(['°', 'º'], "deg");
    let known = match plain.to_lowercase().as_str() {
        "" => return None,
        "sec" | "secs" | "second" | "seconds" => "s",
        "msec" | "millisecond" | "milliseconds" => "ms",
        "usec" | "microseconds" => "us",
        "nsec" | "nanoseconds" => "ns",
        "minutes" => "min",
        "hours" => "h",
        "amp" | "amps" | "ampere" | "arms" => "a",
        "radian" | "radians" => "rad",
        "degree" | "degrees" => "deg",
        "arcminutes" | "\'" | "′" => "arcmin",
        "arcseconds" | "\"" | "″" => "arcsec",
        "revs" | "turns" | "revolutions" => "rev",
        "degc" | "celsius" | "℃" => "c",
        "degf" | "fahrenheit" => "f",
        "kelvin" => "k",
        "1/min" | "min^1" | "u/min" | "r/min" | "rev/min" => "rpm",
        "rev/s" | "rps" | "1/s" => "rev_per_s",
        "inlbf" | "lbfin" => "lbin",
        "ftlbf" | "lbfft" => "lbft",
        "ozfin" | "inozf" => "ozin",
        "newtonmeter" | "newtonmetre" | "newtonmeters" => "nm",
        _ => return Some(plain.replace('/', "_per_").replace("_per_sec", "_per_s")),
    };
    Some(known.to_owned())
}

/// Without the brackets of a units row.
pub(super) fn bare(unit: &str) -> &str {
    unit.trim().trim_start_matches(['[', '(', '{', '<']).trim_end_matches([']', ')', '}', '>']).trim()
}
