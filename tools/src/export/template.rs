//! Slots, helpers, names and precision of the templates.
//!
//! A template is C with `@slots@`. `real` is the type of numbers, `1.0_r` a number of it and `sqrt_r(x)` a function of `<math.h>` for it; names begin with `gear_` or
//! `GEAR_`. Helpers are functions that are taken in where they are called.

use super::plan::Precision;

const HELPERS: &str = include_str!("../../templates/export/helpers.c");

/// Fills slots; one whose text ends a line takes the rest of that line as it is.
pub(super) fn fill(template: &str, slots: &[(&str, &str)]) -> String {
    slots.iter().fold(template.to_owned(), |text, (slot, value)| text.replace(&format!("@{slot}@"), value))
}

/// The helpers that a source calls, those first that others call.
pub(super) fn helpers(source: &str) -> String {
    let all: Vec<(&str, &str)> =
        HELPERS.split("@helper ").skip(1).filter_map(|helper| helper.split_once('\n')).collect();
    let mut used = String::new();
    let mut taken = vec![false; all.len()];
    // A helper stands behind those that it calls: from the end one pass takes all.
    for (number, (name, text)) in all.iter().enumerate().rev() {
        let is_used = |text: &str| if name.starts_with("GEAR_") { mentions(text, name) } else { calls(text, name) };
        if is_used(source) || is_used(&used) {
            taken[number] = true;
            used.push_str(text);
        }
    }
    let chosen = all.iter().zip(&taken).filter(|(_, taken)| **taken);
    chosen.map(|((_, text), _)| format!("{text}\n")).collect()
}

/// Whether a text holds a name as a word of its own.
pub(super) fn mentions(text: &str, name: &str) -> bool {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.match_indices(name)
        .any(|(at, _)| !text[..at].ends_with(is_part) && !text[at + name.len()..].starts_with(is_part))
}

/// Whether a text calls a function.
fn calls(text: &str, name: &str) -> bool {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.match_indices(name).any(|(at, _)| !text[..at].ends_with(is_part) && text[at + name.len()..].starts_with('('))
}

/// A finished text: the names with their prefix, the numbers in their precision.
pub(super) fn finish(text: &str, prefix: &str, precision: Precision) -> String {
    let mut done = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(|c: char| c.is_ascii_alphanumeric() || c == '_') {
        let (before, from) = rest.split_at(at);
        done.push_str(before);
        let end = word_end(from);
        let (word, after) = from.split_at(end);
        done.push_str(&spelled(word, prefix, precision));
        rest = after;
    }
    done.push_str(rest);
    done
}

/// Where a word ends: a name, or a number with its point.
fn word_end(text: &str) -> usize {
    let number = text.starts_with(|c: char| c.is_ascii_digit());
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_' || (number && c == '.');
    text.find(|c| !is_part(c)).unwrap_or(text.len())
}

fn spelled(word: &str, prefix: &str, precision: Precision) -> String {
    let single = precision == Precision::F32;
    if word == "real" {
        return if single { "float".to_owned() } else { "double".to_owned() };
    }
    if let Some(rest) = word.strip_prefix("gear_") {
        return format!("{prefix}_{rest}");
    }
    if let Some(rest) = word.strip_prefix("GEAR_") {
        return format!("{}_{rest}", prefix.to_ascii_uppercase());
    }
    match word.strip_suffix("_r") {
        Some(plain) if single => format!("{plain}f"),
        Some(plain) => plain.to_owned(),
        None => word.to_owned(),
    }
}

/// A text as plain ASCII that cannot end a comment.
pub(super) fn comment(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            // It would look like a slot.
            '@' => plain.push_str("(at)"),
            ' '..='~' => plain.push(c),
            'α' => plain.push_str("alpha"),
            'β' => plain.push_str("beta"),
            'γ' => plain.push_str("gamma"),
            'δ' => plain.push_str("delta"),
            'Δ' => plain.push('d'),
            'ε' => plain.push_str("epsilon"),
            'ζ' => plain.push_str("zeta"),
            'θ' => plain.push_str("theta"),
            'Θ' => plain.push_str("Theta"),
            'κ' => plain.push_str("kappa"),
            'λ' => plain.push_str("lambda"),
            'μ' => plain.push_str("mu"),
            'ρ' => plain.push_str("rho"),
            'σ' => plain.push_str("sigma"),
            'Σ' => plain.push_str("sum of"),
            'τ' => plain.push_str("tau"),
            'φ' => plain.push_str("phi"),
            'ω' => plain.push_str("omega"),
            '·' => plain.push('*'),
            '−' => plain.push('-'),
            '±' => plain.push_str("+-"),
            '²' => plain.push_str("^2"),
            '³' => plain.push_str("^3"),
            '°' => plain.push_str("deg "),
            // A dot above, a rate.
            '\u{307}' => plain.push('\''),
            _ => plain.push('?'),
        }
    }
    plain.replace("*/", "* /").replace("/*", "/ *").replace('\\', "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_numbers_are_spelled_for_their_scalar() {
        let text = "real x = sqrt_r(0.5_r) * gear_step(GEAR_PI, 1e-7_r); /* a 0.5 of unreal */";
        let single = "float x = sqrtf(0.5f) * j3_step(J3_PI, 1e-7f); /* a 0.5 of unreal */";
        let double = "double x = sqrt(0.5) * j3_step(J3_PI, 1e-7); /* a 0.5 of unreal */";
        assert_eq!(finish(text, "j3", Precision::F32), single);
        assert_eq!(finish(text, "j3", Precision::F64), double);
    }

    #[test]
    fn helpers_come_with_those_that_they_call() {
        let taken = helpers("x = gate(p, theta);");
        let at = |name: &str| taken.find(&format!("{name}(")).unwrap();
        assert!(at("root") < at("fraction") && at("fraction") < at("gate") && !taken.contains("polynomial"));
        assert!(!mentions("x = my_root(y) + roots", "root") && mentions("x = (root)", "root"));
        assert!(!helpers("real cosine = 1.0_r;").contains("cosine"));
    }

    #[test]
    fn comments_cannot_be_left() {
        assert_eq!(comment("α*/ θ² \\\n"), "alpha* / theta^2 /?");
    }
}
