//! What the script of a page needs to draw a figure anew: its curves with fewer points, their numbers in binary. `templates/page.js` reads it.

use std::collections::BTreeSet;

use serde::Serialize;

use super::Role;
use super::decimate::{self, Window};
use super::figure::{Curve, Figure, Phase, Style};
use super::heat::Side;

/// Points of a curve that a page holds, at most.
const MOST: usize = 3000;

/// A figure of curves, for the script.
#[derive(Serialize)]
pub(super) struct Interactive<'f> {
    title: &'f str,
    x: Axis<'f>,
    y: Axis<'f>,
    curves: Vec<Trace<'f>>,
    /// Row numbers of the points, where the curves are columns of the same rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    rows: Option<String>,
    /// How many rows there are: figures of as many rows share a cursor.
    #[serde(skip_serializing_if = "Option::is_none")]
    count: Option<usize>,
    shaded: Vec<[f64; 2]>,
    levels: Vec<(&'f str, f64)>,
}

#[derive(Serialize)]
struct Axis<'f> {
    label: &'f str,
    range: [f64; 2],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    names: &'f [String],
}

#[derive(Serialize)]
struct Trace<'f> {
    label: &'f str,
    role: Role,
    style: Style,
    #[serde(skip_serializing_if = "Option::is_none")]
    phase: Option<Phase>,
    /// Absent where it is that of the first curve.
    #[serde(skip_serializing_if = "Option::is_none")]
    x: Option<String>,
    y: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

impl<'f> Interactive<'f> {
    /// Of a figure that is drawn in a window.
    pub fn new(figure: &'f Figure, window: &Window) -> Self {
        let count = figure.curves.first().map_or(0, |curve| curve.points.len());
        let by_row = figure.by_row && figure.curves.iter().all(|curve| curve.points.len() == count);
        let kept = by_row.then(|| kept_rows(&figure.curves, count));
        let points = |curve: &Curve| match &kept {
            Some(rows) => rows.iter().map(|row| curve.points[*row]).collect(),
            None => fewer(curve, window),
        };
        let mut first: Option<Vec<f64>> = None;
        let mut curves = Vec::new();
        for curve in &figure.curves {
            let (x, y): (Vec<f64>, Vec<f64>) = points(curve).into_iter().unzip();
            let shared = first.as_ref().is_some_and(|first| by_row && same(first, &x));
            let error = (!curve.error.is_empty()).then(|| floats(&curve.error));
            curves.push(Trace {
                label: &curve.label,
                role: curve.role,
                style: curve.style,
                phase: curve.phase,
                x: (!shared).then(|| floats(&x)),
                y: floats(&y),
                error,
            });
            first.get_or_insert(x);
        }
        let rows = kept.map(|rows| words(rows.iter().map(|row| (*row as u32).to_le_bytes())));
        Self {
            title: &figure.title,
            x: Axis { label: &figure.x_label, range: [window.x.start, window.x.end], names: &figure.x_names },
            y: Axis { label: &figure.y_label, range: [window.y.start, window.y.end], names: &[] },
            curves,
            rows,
            count: by_row.then_some(count),
            shaded: figure.shaded.iter().map(|part| [part.start, part.end]).collect(),
            levels: figure.levels.iter().map(|level| (&level.label[..], level.height)).collect(),
        }
    }
}

/// A heat map, for the script.
#[derive(Serialize)]
pub(super) struct InteractiveHeat<'f> {
    title: &'f str,
    legend: &'f str,
    /// Where its cells lie in the drawing: left, top, right, bottom.
    place: [i32; 4],
    sides: [HeatSide<'f>; 2],
    columns: usize,
    cells: String,
}

#[derive(Serialize)]
struct HeatSide<'f> {
    label: &'f str,
    range: [f64; 2],
    names: &'f [String],
}

impl<'f> InteractiveHeat<'f> {
    /// Of cells in rows, the first at the top.
    pub fn new(title: &'f str, legend: &'f str, sides: [&'f Side; 2], place: [i32; 4], cells: &[&Vec<f64>]) -> Self {
        let sides = sides.map(|side| match side {
            Side::Names(names) => HeatSide { label: "", range: [0.0, names.len() as f64], names },
            Side::Numbers { label, from, to } => HeatSide { label, range: [*from, *to], names: &[] },
        });
        let columns = cells.first().map_or(0, |row| row.len());
        let all: Vec<f64> = cells.iter().flat_map(|row| row.iter().copied()).collect();
        Self { title, legend, place, sides, columns, cells: floats(&all) }
    }
}

/// As JSON inside an HTML element.
pub(super) fn json(value: &impl Serialize) -> String {
    // Numbers, words and lists of them: nothing that JSON refuses.
    serde_json::to_string(value).unwrap_or_default().replace('<', "\\u003c")
}

fn same(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
}

/// Rows that show every curve: all of few; of many the first of each bucket, the extremes of each curve in it, and every break.
fn kept_rows(curves: &[Curve], count: usize) -> Vec<usize> {
    if count <= MOST {
        return (0..count).collect();
    }
    let bucket = (count * (1 + 2 * curves.len())).div_ceil(MOST);
    let mut kept = BTreeSet::from([count - 1]);
    for start in (0..count).step_by(bucket) {
        let rows = start..(start + bucket).min(count);
        kept.insert(start);
        kept.extend(rows.clone().filter(|row| curves.iter().all(|curve| curve.points[*row].1.is_nan())));
        for curve in curves {
            let height = |row: &usize| curve.points[*row].1;
            let finite = || rows.clone().filter(|row| height(row).is_finite());
            kept.extend(finite().min_by(|a, b| height(a).total_cmp(&height(b))));
            kept.extend(finite().max_by(|a, b| height(a).total_cmp(&height(b))));
        }
    }
    kept.into_iter().collect()
}

fn fewer(curve: &Curve, window: &Window) -> Vec<(f64, f64)> {
    match curve.style {
        Style::Line => decimate::line(&curve.points, window).join(&(f64::NAN, f64::NAN)),
        // The errors belong to the points as they are.
        _ if !curve.error.is_empty() => curve.points.clone(),
        Style::Dots => decimate::dots(&decimate::finite(&curve.points), window),
        Style::Stems => decimate::highest(&decimate::finite(&curve.points)),
    }
}

/// Numbers in 32 bits each.
fn floats(numbers: &[f64]) -> String {
    words(numbers.iter().map(|x| (*x as f32).to_le_bytes()))
}

/// Base64 of words of four bytes.
fn words(words: impl Iterator<Item = [u8; 4]>) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let bytes: Vec<u8> = words.flatten().collect();
    let mut text = String::with_capacity(bytes.len() * 4 / 3 + 4);
    for group in bytes.chunks(3) {
        let bits = group.iter().fold(0_u32, |bits, byte| bits << 8 | u32::from(*byte)) << (8 * (3 - group.len()));
        for digit in 0..4 {
            let index = bits >> (18 - 6 * digit) & 63;
            text.push(if digit <= group.len() { char::from(DIGITS[index as usize]) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::plot::Role;

    #[test]
    fn base64_is_that_of_the_standard() {
        assert_eq!(words([*b"Many", *b" han"].into_iter()), "TWFueSBoYW4=");
        assert_eq!(words([*b"Many", *b" han", *b"ds.."].into_iter()), "TWFueSBoYW5kcy4u");
    }

    #[test]
    fn of_many_rows_peaks_and_breaks_are_kept() {
        let mut y: Vec<f64> = vec![0.0; 100_000];
        (y[54_321], y[60_000]) = (5.0, f64::NAN);
        let x: Vec<f64> = (0..100_000).map(f64::from).collect();
        let kept = kept_rows(&[Curve::new("", Role::Model, &x, 1.0, &y)], y.len());
        assert!(kept.len() <= MOST + 10 && [0, 54_321, 60_000, 99_999].iter().all(|row| kept.contains(row)));
    }
}
