//! The report of a replay through the adaptation of the drive.

use super::page::{Page, Provenance, Section, Verdict};
use super::plot::{Curve, Drawing, Figure, Role};
use crate::adapt::{NAMES, Replay, TracePoint};
use crate::fit::verdict::Grade;
use crate::number::number;

/// The page.
pub fn page(replay: &Replay, provenance: Provenance) -> Page {
    let (block, adapted) = (replay.rms.block, replay.rms.adapted);
    let grade = if adapted > block || !replay.warnings.is_empty() { Grade::Caution } else { Grade::Good };
    let unit = replay.unit.symbol();
    let sentence = format!(
        "Torque error one step ahead: {} {unit} rms with the adapted parameters, {} {unit} with the block.",
        number(adapted, 3),
        number(block, 3)
    );
    let mut reasons = vec![format!(
        "Parameters were taken over {} times and given back {} times, after {} stretches of motion.",
        replay.taken_over_s.len(),
        replay.given_back_s.len(),
        replay.stretches
    )];
    reasons.extend(replay.warnings.iter().map(|warning| format!("Warning: {warning}.")));
    let errors = Section::new("Errors").figure(
        errors(replay),
        "Torque error one step ahead. Each row is predicted before it is used for the adaptation. One curve is for the block, the other for the parameters in force.",
    );
    let mut coefficients = Section::new("Coefficients").text(
        "The estimate with its standard deviation, before bounds are applied and before the sequential test accepts it. The horizontal line is the value of the block.",
    );
    coefficients = coefficients.figures((0..NAMES.len()).map(|k| (coefficient(replay, k), String::new())));
    let offset = Section::new("Torque signal").figure(
        offset(replay),
        "The learnt offset of the torque signal with its standard deviation. Nothing in force uses it.",
    );
    Page {
        title: "Adaptation on the drive".into(),
        verdict: Verdict { grade, sentence, reasons },
        sections: vec![errors, coefficients, offset],
        provenance,
    }
}

fn times(replay: &Replay) -> Vec<f64> {
    replay.trace.iter().map(|point| point.time_s).collect()
}

fn errors(replay: &Replay) -> Drawing {
    let curve = |label, role, of: fn(&TracePoint) -> f64| {
        let errors: Vec<f64> = replay.trace.iter().map(of).collect();
        Curve::new(label, role, &times(replay), 1.0, &errors)
    };
    let curves = [
        curve("block", Role::Second, |point| point.rms.block),
        curve("adapted", Role::Model, |point| point.rms.adapted),
    ];
    let y_label = format!("rms in {}", replay.unit.symbol());
    Figure::of("Torque error one step ahead", "time in s", y_label, curves).draw()
}

fn coefficient(replay: &Replay, k: usize) -> Drawing {
    let powers = ["/rad", "/rad³", "/rad⁵", "/rad", "/rad"];
    let y_label = format!("{} in {}{}", NAMES[k], replay.unit.symbol(), powers[k]);
    band(replay, NAMES[k], y_label, replay.block[k], |point| [point.coefficients()[k], point.sd[k]])
}

fn offset(replay: &Replay) -> Drawing {
    let y_label = format!("offset in {}", replay.unit.symbol());
    band(replay, "offset", y_label, 0.0, |point| [point.torque_offset, point.torque_offset_sd])
}

/// A value of the trace with its standard deviation, and what the block has of it.
fn band(replay: &Replay, title: &str, y_label: String, block: f64, of: impl Fn(&TracePoint) -> [f64; 2]) -> Drawing {
    let curve = |label: &str, role, side: f64| {
        let values: Vec<f64> = replay.trace.iter().map(&of).map(|[value, sd]| value + side * sd).collect();
        Curve::new(label, role, &times(replay), 1.0, &values)
    };
    let block = vec![block; replay.trace.len()];
    let curves = [
        curve("+ 1 sd", Role::Third, 1.0),
        curve("− 1 sd", Role::Third, -1.0),
        Curve::new("block", Role::Second, &times(replay), 1.0, &block),
        curve("estimate", Role::Model, 0.0),
    ];
    Figure::of(title, "time in s", y_label, curves).draw()
}
