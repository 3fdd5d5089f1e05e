//! The tables of a diagnosis: the error before and after, the effects with their parameters, the evidence, and open questions.

use super::words;
use crate::diagnose::Finding;
use crate::diagnose::diagnosis::{Diagnosis, HeldoutFrom, ParameterValue, Rms};
use crate::model::TermValue;
use crate::number::{self, percent, trimmed, whole};
use crate::recording::TorqueUnit;
use crate::report::page::{Section, Table, TableRow};

/// A number that was not estimated.
fn as_given(value: f64) -> String {
    trimmed(value, 4)
}

/// A number to four digits.
fn four(value: f64) -> String {
    number::number(value, 4)
}

pub(super) fn gain(finding: &Finding, unit: TorqueUnit) -> Section {
    let found = &finding.diagnosis;
    let from = match found.heldout.from {
        HeldoutFrom::Blocks => "blocks of the same recordings, each predicted from the others",
        HeldoutFrom::Recordings => "recordings not used in the fit",
    };
    let row = |name: &str, rms: &Rms| {
        TableRow::new([name.to_owned(), four(rms.given), four(rms.refitted), four(rms.extended)])
    };
    let caption = format!("Root mean square of recording minus model in {}", unit.symbol());
    let rows = [row("fitted", &found.rms), row("held out", &found.heldout.rms)];
    let table = Table::of(caption, ["rows", "model given", "base refitted", "extended"], rows);
    Section::new("Error before and after").table(table).text(format!(
        "Held out: {from}. Estimated noise: {} {} rms, {} of the residual of the {} model.",
        four(found.noise_rms),
        unit.symbol(),
        percent(found.noise_rms / found.rms.extended.max(f64::MIN_POSITIVE)),
        if found.mismatch { "extended" } else { "refitted" }
    ))
}

pub(super) fn effects(found: &Diagnosis) -> Section {
    let mut rows = Vec::new();
    for effect in &found.effects {
        let class: Vec<String> = effect.equivalents.iter().map(|k| words(k)).collect();
        let apart = if class.is_empty() {
            String::new()
        } else {
            format!(" (cannot be distinguished from {})", class.join(", "))
        };
        let side = format!("{:?}", effect.side).to_lowercase();
        rows.push(
            TableRow::new([
                words(&effect.name) + &apart,
                percent(effect.share),
                format!("{:.2}", effect.confidence),
                side,
            ])
            .chosen(true),
        );
        if let Some(curve) = effect.curve() {
            rows.push(TableRow::new(["– curve".to_owned(), curve.to_string(), String::new(), String::new()]));
        }
        for (name, parameter) in effect.parameters.iter().filter(|_| effect.curve().is_none()) {
            let sds = parameter.sd.as_ref().map_or(&[][..], ParameterValue::numbers);
            let value = match &parameter.value {
                ParameterValue::Text(text) => text.clone(),
                value => value
                    .numbers()
                    .iter()
                    .enumerate()
                    .map(|(i, x)| sds.get(i).map_or_else(|| as_given(*x), |sd| number::plus_minus(*x, 2.0 * sd)))
                    .collect::<Vec<_>>()
                    .join(", "),
            };
            rows.push(TableRow::new([format!("– {name}"), value, String::new(), parameter.unit.clone()]));
        }
    }
    let head = ["effect", "share of the structure", "confidence", "side, unit"];
    Section::new("Effects found").table(Table::of("Parameters with intervals of ± two standard deviations", head, rows))
}

pub(super) fn evidence(finding: &Finding) -> Section {
    let mut rows = Vec::new();
    for effect in &finding.verdict.effects {
        let free = effect.curves.first().map_or("", |p| p.coordinate);
        rows.push(TableRow::new([words(&effect.name), whole(effect.gain), "–".into(), "selected".into()]).chosen(true));
        rows.push(TableRow::new([
            format!("– a free curve over {}", words(free)),
            whole(effect.free_gain),
            "–".into(),
            "upper limit for any law of this coordinate, corrected for its parameters".into(),
        ]));
        for (kind, gain, numbers) in effect.tried.iter().filter(|(kind, ..)| *kind != effect.name).take(6) {
            let verdict = if effect.equivalents.contains(kind) { "cannot be distinguished" } else { "rejected" };
            rows.push(TableRow::new([format!("– {}", words(kind)), whole(*gain), numbers.to_string(), verdict.into()]));
        }
    }
    for (kind, gain, numbers) in finding.verdict.rejected.iter().take(6) {
        rows.push(TableRow::new([
            format!("in addition to all of it: {}", words(kind)),
            whole(*gain),
            numbers.to_string(),
            "rejected".into(),
        ]));
    }
    let head = ["explanation", "gain of −2 ln L", "numbers", ""];
    Section::new("Evidence and rejected explanations")
        .text("Each kind is refitted together with the base model, with a noise spectrum that is fitted too. A name is given only where it explains what a free curve of the same coordinates can; kinds within 11 of the best cannot be distinguished.")
        .table(Table::of("Explanations tried for each effect", head, rows))
}

pub(super) fn bias(finding: &Finding) -> Section {
    let (base, extended) = (&finding.verdict.base.model, &finding.verdict.extended.model);
    let mut rows = Vec::new();
    let mut row = |name: &str, unit: &str, before: f64, after: f64| {
        let change = if after != 0.0 {
            let percent = 100.0 * (before / after - 1.0);
            format!("{}{} %", if percent > 0.0 { "+" } else { "" }, number::number(percent, 3))
        } else {
            "–".to_owned()
        };
        rows.push(TableRow::new([name.to_owned(), unit.to_owned(), four(before), four(after), change]));
    };
    if let (Some(a), Some(b)) = (base.elastic, extended.elastic) {
        row("c1", "N·m/rad", a.c1_nm_per_rad, b.c1_nm_per_rad);
        row("c2", "N·m/rad³", a.c2_nm_per_rad3, b.c2_nm_per_rad3);
        row("c3", "N·m/rad⁵", a.c3_nm_per_rad5, b.c3_nm_per_rad5);
    }
    if let (Some(a), Some(b)) = (base.memory, extended.memory) {
        row("e", "N·m/rad", a.e(), b.e());
        row("h", "N·m/rad", a.h(), b.h());
    }
    for (a, b) in base.terms.iter().zip(&extended.terms) {
        for (key, value) in &a.values {
            if let (TermValue::Number(x), Some(TermValue::Number(y))) = (value, b.values.get(key)) {
                row(&format!("{}: {key}", words(&a.kind)), "", *x, *y);
            }
        }
    }
    let head = ["parameter", "unit", "without the effect", "with it", "bias"];
    Section::new("Effect of the omission on the base model").table(Table::of(
        "Parameters of the base model",
        head,
        rows,
    ))
}

pub(super) fn open(found: &Diagnosis) -> Section {
    let section = Section::new("Open questions");
    let rows: Vec<TableRow> =
        found.undecidable.iter().map(|u| TableRow::new([words(&u.name), u.experiment.clone()])).collect();
    let section = if rows.is_empty() {
        section.text("These recordings can show every kind of effect at a plausible size.")
    } else {
        section.table(Table::of("Undecidable", ["kind that these recordings cannot show", "experiment that can"], rows))
    };
    let next = found.next_experiment.to_string();
    let suggestions = found.suggestions.iter().map(|suggestion| format!("Probably wrong: {suggestion}."));
    section.notes(suggestions.chain((!next.is_empty()).then(|| format!("Next experiment: {next}."))))
}
