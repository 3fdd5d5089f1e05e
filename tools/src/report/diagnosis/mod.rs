//! The report of a diagnosis: the finding in a sentence, the picture that convinces, then the evidence and what was rejected.

mod drawings;
mod tables;

use self::drawings::{along, axis, before_and_after, heat, residual_over_time, torques};
use self::tables::{bias, effects, evidence, gain, open};
use super::bins::BINS;
use super::capitalised;
use super::figures;
use super::page::{Page, Provenance, Section, Table, TableRow, Verdict};
use super::plot::Drawing;
use crate::diagnose::Finding;
use crate::diagnose::diagnosis::{Diagnosis, Effect, UNKNOWN, Unit};
use crate::fit::verdict::Grade;
use crate::number::percent;
use crate::recording::{Recording, TorqueUnit};

/// The page of a diagnosis of these recordings.
pub fn page(finding: &Finding, recordings: &[Recording], provenance: Provenance) -> Page {
    let unit = torque_unit(finding);
    let mut sections: Vec<Section> = known(finding, recordings, unit).into_iter().collect();
    sections.extend([picture(finding, unit), gain(finding, unit)]);
    if finding.diagnosis.mismatch {
        sections.push(effects(&finding.diagnosis));
        sections.push(locations(finding, unit));
        sections.push(evidence(finding));
        sections.push(bias(finding));
    }
    sections.push(open(&finding.diagnosis));
    if !finding.remarks.is_empty() {
        let remarks = finding.remarks.iter().map(ToString::to_string);
        sections.insert(0, Section::new("Remarks").notes(remarks));
    }
    Page {
        title: format!("Diagnosis of {}", finding.model.name),
        verdict: verdict(&finding.diagnosis),
        sections,
        provenance,
    }
}

/// A kind as people say it.
pub(super) fn words(kind: &str) -> String {
    kind.replace('_', " ")
}

fn verdict(found: &Diagnosis) -> Verdict {
    if !found.mismatch {
        let sentence = "The recordings differ from the model only by noise.".to_owned();
        let rate = format!("False alarms: in {} of 100 recordings with noise alone.", 100.0 * found.false_alarm_rate);
        return Verdict { grade: Grade::Good, sentence, reasons: vec![rate] };
    }
    let name = |e: &Effect| {
        let class: Vec<String> = e.class().map(words).collect();
        match e.name.as_str() {
            UNKNOWN => "physics that no kind of the library explains".to_owned(),
            _ => class.join(" or "),
        }
    };
    let mut names: Vec<String> = found.effects.iter().map(name).collect();
    names.dedup();
    let share = 1.0 - (found.heldout.rms.extended / found.heldout.rms.refitted.max(f64::MIN_POSITIVE)).powi(2);
    let gained = if share > 0.0 {
        format!("with it, the squared error on held-out rows is {} smaller", percent(share))
    } else {
        "no effect found improves the prediction of held-out rows".to_owned()
    };
    let sentence = format!("The model lacks {}; {gained}.", names.join(", and "));
    let all_named = found.effects.iter().all(|e| e.name != UNKNOWN && e.equivalents.is_empty());
    let reasons = found.effects.iter().map(|e| format!("{}: {}.", capitalised(&words(&e.name)), e.why)).collect();
    Verdict { grade: if all_named { Grade::Good } else { Grade::Caution }, sentence, reasons }
}

fn torque_unit(finding: &Finding) -> TorqueUnit {
    if finding.diagnosis.unit == Unit::Ampere { TorqueUnit::Ampere } else { TorqueUnit::NewtonMetre }
}

/// Torque over deflection, measured and by both models. Without a deflection: over velocity or angle. Without these: the residual over time.
pub fn drawing(finding: &Finding, recordings: &[Recording]) -> Drawing {
    let unit = torque_unit(finding);
    let of = if finding.model.name.is_empty() { String::new() } else { format!("{}: ", finding.model.name) };
    let first = torques(finding, recordings, unit, &of).into_iter().next();
    first.unwrap_or_else(|| residual_over_time(finding, unit))
}

/// The residual of both models over time.
pub fn residual(finding: &Finding) -> Drawing {
    residual_over_time(finding, torque_unit(finding))
}

/// What engineers know: the torque over deflection, or over velocity and angle, measured and by both models.
fn known(finding: &Finding, recordings: &[Recording], unit: TorqueUnit) -> Option<Section> {
    let figures = torques(finding, recordings, unit, "");
    let caption = |drawing| (drawing, "Recording and models, constant offsets included.".to_owned());
    (!figures.is_empty()).then(|| Section::new("Recording and models").figures(figures.into_iter().map(caption)))
}

fn picture(finding: &Finding, unit: TorqueUnit) -> Section {
    let section = Section::new("Residual");
    let found = &finding.diagnosis;
    let first = found.locations.first().map(|p| p.coordinate.as_str());
    let fallback = if finding.report_data.coordinates.deflection.is_some() { "deflection" } else { "output_velocity" };
    let coordinate = first.unwrap_or(fallback);
    let time = residual_over_time(finding, unit);
    let caption = "Recording minus model against time. Shaded: where the effect is strong.".to_owned();
    match before_and_after(finding, coordinate, unit) {
        Some(drawing) => section.figures([
            (drawing, format!("Means over {BINS} bins with their standard errors. An effect that depends only on the {} becomes visible; noise averages out.", words(coordinate))),
            (time, caption),
        ]),
        None => section.figure(time, caption),
    }
}

fn locations(finding: &Finding, unit: TorqueUnit) -> Section {
    let found = &finding.diagnosis;
    let rows = found
        .locations
        .iter()
        .map(|p| TableRow::new([words(&p.coordinate), percent(p.share), p.detail.to_string()]))
        .collect();
    let head = ["coordinate", "share of the structure", "what is seen"].map(str::to_owned).to_vec();
    let mut section = Section::new("Where the residual has structure").table(Table {
        caption: "Coordinates along which the residual has structure".into(),
        head,
        rows,
    });
    let mut drawings = Vec::new();
    let first = found.locations.first().map_or("time", |p| p.coordinate.as_str());
    let second = found.locations.iter().skip(1).map(|p| p.coordinate.as_str()).find(|c| axis(c) != axis(first));
    let second = second.unwrap_or(if axis(first) == "deflection" { "deflection_rate" } else { "deflection" });
    let second = if along(&finding.report_data, second).is_some() { second } else { "time" };
    if let Some(map) = heat(finding, first, second, unit) {
        drawings.push((map, "Mean residual of the refitted base model. A pattern of stripes depends on one coordinate alone, a chequered one on both.".to_owned()));
    }
    if let Some((before, after)) = &finding.report_data.orders {
        let strong: Vec<(f64, f64)> =
            before.iter().filter(|l| l.power > PROMINENT).map(|l| (l.order, l.power)).collect();
        let lines: Vec<(f64, f64)> = before.iter().map(|l| (l.order, l.power)).collect();
        let label = "power in multiples of the noise";
        drawings.push((
            figures::spectrum(
                "Orders of the motor turn, base model refitted",
                "order of the motor turn",
                label,
                &lines,
                Some(PROMINENT),
                &strong,
            ),
            "The orders are found in the angle domain; no harmonics are given.".to_owned(),
        ));
        let lines: Vec<(f64, f64)> = after.iter().map(|l| (l.order, l.power)).collect();
        drawings.push((
            figures::spectrum(
                "Orders of the motor turn, with the effects found",
                "order of the motor turn",
                label,
                &lines,
                Some(PROMINENT),
                &[],
            ),
            "The same after the extended model.".to_owned(),
        ));
    }
    let mut drawn = vec![axis(first)];
    for place in found.locations.iter().skip(1).take(2) {
        if drawn.contains(&axis(&place.coordinate)) {
            continue;
        }
        drawn.push(axis(&place.coordinate));
        if let Some(drawing) = before_and_after(finding, &place.coordinate, unit) {
            drawings.push((drawing, format!("The same along the {}.", words(&place.coordinate))));
        }
    }
    section = section.figures(drawings);
    section
}

/// A line of a spectrum is prominent beyond this many times the noise: noise alone passes it once in some thousand lines.
const PROMINENT: f64 = 8.0;
