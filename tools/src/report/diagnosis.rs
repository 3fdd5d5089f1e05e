//! The report of a diagnosis: the finding in a sentence, the picture that convinces, then the evidence and what was rejected.

use super::bins::{BINS, binned, drawn_range};
use super::figures;
use super::page::{Page, Provenance, Section, Table, TableRow, Tone, Verdict};
use super::plot::{Curve, Drawing, Figure, HeatMap, Role, Side, Style};
use crate::diagnose::Finding;
use crate::diagnose::diagnosis::{Diagnosis, Effect, ParameterValue, UNKNOWN, Unit};
use crate::diagnose::report_data::ReportData;
use crate::number::{self, trimmed, whole};
use crate::recording::{Recording, TorqueUnit};

/// The page of a diagnosis of these recordings.
pub fn page(finding: &Finding, recordings: &[Recording], provenance: Provenance) -> Page {
    let unit = torque_unit(finding);
    let mut sections: Vec<Section> = known(finding, recordings, unit).into_iter().collect();
    sections.extend([picture(finding, unit), gain(finding, unit)]);
    if finding.diagnosis.mismatch {
        sections.push(effects(&finding.diagnosis));
        sections.push(places(finding, unit));
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
fn words(kind: &str) -> String {
    kind.replace('_', " ")
}

fn verdict(found: &Diagnosis) -> Verdict {
    if !found.mismatch {
        let sentence = "The recordings differ from the model only by noise.".to_owned();
        let rate = format!("False alarms: in {} of 100 recordings with noise alone.", 100.0 * found.false_alarm_rate);
        return Verdict { tone: Tone::Good, sentence, reasons: vec![rate] };
    }
    let name = |e: &Effect| {
        let class: Vec<String> = e.class().map(words).collect();
        match e.name.as_str() {
            UNKNOWN => "physics that no kind of the vocabulary explains".to_owned(),
            _ => class.join(" or "),
        }
    };
    let mut names: Vec<String> = found.effects.iter().map(name).collect();
    names.dedup();
    let share = 1.0 - (found.heldout.rms.extended / found.heldout.rms.refitted.max(f64::MIN_POSITIVE)).powi(2);
    let gained = if share > 0.0 {
        format!("with it, the squared error on rows held out is {} smaller", percent(share))
    } else {
        "nothing found improves the prediction of rows held out".to_owned()
    };
    let sentence = format!("The model leaves out {}; {gained}.", names.join(", and "));
    let all_named = found.effects.iter().all(|e| e.name != UNKNOWN && e.equivalents.is_empty());
    let reasons = found.effects.iter().map(|e| format!("{}: {}.", capital(&words(&e.name)), e.why)).collect();
    Verdict { tone: if all_named { Tone::Good } else { Tone::Caution }, sentence, reasons }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// A number that was not estimated.
fn as_given(value: f64) -> String {
    trimmed(value, 4)
}

/// A number to four digits.
fn four(value: f64) -> String {
    number::number(value, 4)
}

/// A coordinate of every row with its label; angles within a turn.
fn along<'s>(report_data: &'s ReportData, coordinate: &str) -> Option<(std::borrow::Cow<'s, [f64]>, &'static str)> {
    let see = &report_data.coordinates;
    let turn = |q: &Option<Vec<f64>>| {
        let degrees = |q: &f64| q.rem_euclid(std::f64::consts::TAU).to_degrees();
        q.as_ref().map(|q| q.iter().map(degrees).collect::<Vec<f64>>().into())
    };
    let scaled =
        |x: &Option<Vec<f64>>, by: f64| x.as_ref().map(|x| x.iter().map(|x| by * x).collect::<Vec<f64>>().into());
    let plain = |x: &'s [f64]| Some(std::borrow::Cow::Borrowed(x));
    let (values, label) = match axis(coordinate) {
        "motor_angle" => (turn(&see.motor), "motor angle within a turn in °"),
        "output_angle" => (turn(&see.output), "output angle within a turn in °"),
        "output_velocity" => (scaled(&see.velocity, 1.0), "output velocity in rad/s"),
        "acceleration" => (scaled(&see.acceleration, 1.0), "output acceleration in rad/s²"),
        "deflection" => (scaled(&see.deflection, 1e3), "deflection in mrad"),
        "deflection_rate" => (scaled(&see.rate, 1e3), "deflection rate in mrad/s"),
        "torque" => (plain(&see.torque), "torque of the model"),
        "torque_rate" => (plain(&see.torque_rate), "rate of the torque, per s"),
        "temperature" => (see.temperature.as_deref().and_then(plain), "temperature in °C"),
        _ => (plain(&see.time), "time in s"),
    };
    values.map(|v| (v, label))
}

/// What is drawn for a coordinate: memory shows along the deflection that it remembers.
fn axis(coordinate: &str) -> &str {
    match coordinate {
        "reversal" | "amplitude" => "deflection",
        own => own,
    }
}

/// What is left along a coordinate, before and after.
fn before_and_after(finding: &Finding, coordinate: &str, unit: TorqueUnit) -> Option<Drawing> {
    let (x, label) = along(&finding.report_data, coordinate)?;
    let verdict = &finding.verdict;
    let curve = |name: &str, role, residual: &[f64]| {
        let (points, error) = binned(&x, residual);
        let phase = figures::phase_of(if finding.diagnosis.mismatch { 2 } else { 1 })(role);
        Curve { label: name.into(), points, role, style: Style::Dots, error, phase }
    };
    let mut curves = vec![curve("base model refitted", Role::Second, &verdict.base.residual)];
    if finding.diagnosis.mismatch {
        curves.push(curve("with what was found", Role::Model, &verdict.extended.residual));
    }
    let figure = Figure {
        title: format!("Residual along the {}", words(coordinate)),
        x_label: label.into(),
        y_label: format!("mean of recording minus model in {}", unit.symbol()),
        curves,
        ..Figure::default()
    };
    Some(figure.draw())
}

/// A line of rows, broken between recordings.
fn recordings_apart(report_data: &ReportData, line: &[f64]) -> Vec<f64> {
    let ends = report_data.first_rows.iter().skip(1).copied().chain([line.len()]);
    let spans = report_data.first_rows.iter().copied().zip(ends);
    spans.flat_map(|(from, to)| line[from..to].iter().copied().chain([f64::NAN])).collect()
}

/// The torque over deflection, or else over velocity or angle, measured and by both models; over time what they leave where there is none of these.
pub fn drawing(finding: &Finding, recordings: &[Recording]) -> Drawing {
    let unit = torque_unit(finding);
    let of = if finding.model.name.is_empty() { String::new() } else { format!("{}: ", finding.model.name) };
    let first = torques(finding, recordings, unit, &of).into_iter().next();
    first.unwrap_or_else(|| residual_over_time(finding, unit))
}

fn torque_unit(finding: &Finding) -> TorqueUnit {
    if finding.diagnosis.unit == Unit::Ampere { TorqueUnit::Ampere } else { TorqueUnit::NewtonMetre }
}

/// What engineers know: the torque over deflection, or over velocity and angle, measured and by both models.
fn known(finding: &Finding, recordings: &[Recording], unit: TorqueUnit) -> Option<Section> {
    let figures = torques(finding, recordings, unit, "");
    let caption = |drawing| (drawing, "Recording and models, constant offsets included.".to_owned());
    (!figures.is_empty()).then(|| Section::new("Recording and models").figures(figures.into_iter().map(caption)))
}

fn torques(finding: &Finding, recordings: &[Recording], unit: TorqueUnit, of: &str) -> Vec<Drawing> {
    let measured: Vec<f64> = recordings.iter().filter_map(|r| r.torque.as_deref()).flatten().copied().collect();
    let verdict = &finding.verdict;
    if measured.len() != verdict.base.residual.len() {
        return Vec::new();
    }
    let apart = |line: &[f64]| recordings_apart(&finding.report_data, line);
    let modelled = |residual: &[f64]| -> Vec<f64> { measured.iter().zip(residual).map(|(t, r)| t - r).collect() };
    let (base, extended) = (apart(&modelled(&verdict.base.residual)), apart(&modelled(&verdict.extended.residual)));
    let measured = apart(&measured);
    let draw = |coordinate: &str| {
        let (x, label) = along(&finding.report_data, coordinate)?;
        let x = apart(&x);
        let mut curves = vec![Curve::new("recording", Role::Measured, &x, 1.0, &measured)];
        let phase = figures::phase_of(if finding.diagnosis.mismatch { 2 } else { 1 });
        let mut model = |name: &str, role, torque: &[f64]| {
            curves.push(Curve::new(name, role, &x, 1.0, torque).in_phase(phase(role)));
        };
        model("base model refitted", Role::Second, &base);
        if finding.diagnosis.mismatch {
            model("with what was found", Role::Model, &extended);
        }
        // Angles within a turn jump: a line would cross the figure.
        if coordinate.ends_with("angle") {
            curves = curves.into_iter().map(|curve| curve.styled(Style::Dots)).collect();
        }
        let title = capital(&format!("{of}{} over {}", unit.quantity(), words(coordinate)));
        let y_label = format!("{} in {}", unit.quantity(), unit.symbol());
        Some(Figure { title, x_label: label.into(), y_label, curves, by_row: true, ..Figure::default() }.draw())
    };
    let deflection = finding.report_data.coordinates.deflection.as_deref();
    let seen = finding.diagnosis.places.first().map_or("", |place| place.coordinate.as_str());
    // Without a loop the angle over which structure was seen comes first.
    let coordinates: &[&str] = match seen {
        _ if deflection.is_some_and(varies) => &["deflection", "output_velocity"],
        "motor_angle" => &["motor_angle", "output_velocity", "output_angle"],
        "output_angle" => &["output_angle", "output_velocity"],
        _ => &["output_velocity", "output_angle"],
    };
    coordinates.iter().filter_map(|coordinate| draw(coordinate)).collect()
}

/// Whether a signal has more than one value.
fn varies(signal: &[f64]) -> bool {
    signal.iter().any(|x| (x - signal[0]).abs() > 0.0)
}

fn residual_over_time(finding: &Finding, unit: TorqueUnit) -> Drawing {
    let found = &finding.diagnosis;
    let seconds: Vec<(f64, f64)> =
        found.places.first().map(|p| p.seconds.iter().map(|[a, b]| (*a, *b)).collect()).unwrap_or_default();
    let verdict = &finding.verdict;
    let apart = |line: &[f64]| recordings_apart(&finding.report_data, line);
    let (base, extended) = (apart(&verdict.base.residual), apart(&verdict.extended.residual));
    let mut over_time = vec![("base model refitted", Role::Second, &base[..])];
    if found.mismatch {
        over_time.push(("with what was found", Role::Model, &extended[..]));
    }
    let shaded: &[(f64, f64)] = if seconds.len() < 20 { &seconds } else { &[] };
    figures::residual_over_time(
        "Residual over time",
        &apart(&finding.report_data.coordinates.time),
        &over_time,
        shaded,
        unit,
    )
}

fn picture(finding: &Finding, unit: TorqueUnit) -> Section {
    let section = Section::new("Residual");
    let found = &finding.diagnosis;
    let first = found.places.first().map(|p| p.coordinate.as_str());
    let fallback = if finding.report_data.coordinates.deflection.is_some() { "deflection" } else { "output_velocity" };
    let coordinate = first.unwrap_or(fallback);
    let time = residual_over_time(finding, unit);
    let caption = "Recording minus model against time. Shaded: where the effect is strong.".to_owned();
    match before_and_after(finding, coordinate, unit) {
        Some(drawing) => section.figures([
            (drawing, format!("Means over {BINS} bins with their standard errors. What depends on the {} alone stands out; noise averages away.", words(coordinate))),
            (time, caption),
        ]),
        None => section.figure(time, caption),
    }
}

fn gain(finding: &Finding, unit: TorqueUnit) -> Section {
    let found = &finding.diagnosis;
    let from = match found.heldout.from {
        crate::diagnose::diagnosis::HeldoutFrom::Blocks => {
            "blocks of the same recordings, each predicted from the others"
        }
        crate::diagnose::diagnosis::HeldoutFrom::Recordings => "recordings not used in the fit",
    };
    let row = |name: &str, rms: &crate::diagnose::diagnosis::Rms| {
        TableRow::new([name.to_owned(), four(rms.given), four(rms.refitted), four(rms.extended)])
    };
    let table = Table {
        caption: format!("Root mean square of recording minus model in {}", unit.symbol()),
        head: ["rows", "model given", "base refitted", "extended"].map(str::to_owned).to_vec(),
        rows: vec![row("fitted", &found.rms), row("held out", &found.heldout.rms)],
    };
    Section::new("Error before and after").table(table).text(format!(
        "Held out: {from}. Estimated noise: {} {} rms, which is {} of what the {} model leaves.",
        four(found.noise_rms),
        unit.symbol(),
        percent(found.noise_rms / found.rms.extended.max(f64::MIN_POSITIVE)),
        if found.mismatch { "extended" } else { "refitted" }
    ))
}

fn effects(found: &Diagnosis) -> Section {
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
            rows.push(TableRow::new(["– curve".to_owned(), curve, String::new(), String::new()]));
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
    let head = ["effect", "share of the structure", "confidence", "side, unit"].map(str::to_owned).to_vec();
    Section::new("Effects found").table(Table {
        caption: "Parameters with intervals of ± two standard deviations".into(),
        head,
        rows,
    })
}

/// Cells of a heat map along each side.
const CELLS: (usize, usize) = (48, 24);

fn places(finding: &Finding, unit: TorqueUnit) -> Section {
    let found = &finding.diagnosis;
    let rows = found
        .places
        .iter()
        .map(|p| TableRow::new([words(&p.coordinate), percent(p.share), p.detail.clone()]))
        .collect();
    let head = ["coordinate", "share of the structure", "what is seen"].map(str::to_owned).to_vec();
    let mut section = Section::new("Where the residual has structure").table(Table {
        caption: "Coordinates along which the residual has structure".into(),
        head,
        rows,
    });
    let mut drawings = Vec::new();
    let first = found.places.first().map_or("time", |p| p.coordinate.as_str());
    let second = found.places.iter().skip(1).map(|p| p.coordinate.as_str()).find(|c| axis(c) != axis(first));
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
                "Orders of the motor turn, with what was found",
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
    for place in found.places.iter().skip(1).take(2) {
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

fn heat(finding: &Finding, horizontal: &str, vertical: &str, unit: TorqueUnit) -> Option<Drawing> {
    let ((x, x_label), (y, y_label)) =
        (along(&finding.report_data, horizontal)?, along(&finding.report_data, vertical)?);
    let ((x0, x1), (y0, y1)) = (drawn_range(&x), drawn_range(&y));
    if x1 <= x0 || y1 <= y0 {
        return None;
    }
    let mut sums = vec![vec![(0.0, 0.0); CELLS.0]; CELLS.1];
    let drawn = |i: usize| (x0..=x1).contains(&x[i]) && (y0..=y1).contains(&y[i]);
    for (i, r) in finding.verdict.base.residual.iter().enumerate().filter(|(i, _)| drawn(*i)) {
        let column = (((x[i] - x0) / (x1 - x0) * CELLS.0 as f64) as usize).min(CELLS.0 - 1);
        let row = (((y[i] - y0) / (y1 - y0) * CELLS.1 as f64) as usize).min(CELLS.1 - 1);
        sums[row][column].0 += 1.0;
        sums[row][column].1 += r;
    }
    let mean = |(n, sum): &(f64, f64)| if *n >= 3.0 { sum / n } else { f64::NAN };
    let map = HeatMap {
        title: format!("Residual over {} and {}", words(horizontal), words(vertical)),
        legend: format!("mean of recording minus model in {}", unit.symbol()),
        x: Side::Numbers { label: x_label.into(), from: x0, to: x1 },
        y: Side::Numbers { label: y_label.into(), from: y0, to: y1 },
        values: sums.iter().map(|row| row.iter().map(mean).collect()).collect(),
        limit: None,
        numbers: false,
    };
    Some(map.draw())
}

fn evidence(finding: &Finding) -> Section {
    let mut rows = Vec::new();
    for effect in &finding.verdict.effects {
        let free = effect.places.first().map_or("", |p| p.coordinate);
        rows.push(TableRow::new([words(&effect.name), whole(effect.gain), "–".into(), "taken".into()]).chosen(true));
        rows.push(TableRow::new([
            format!("– a free curve over {}", words(free)),
            whole(effect.free_gain),
            "–".into(),
            "what any law of that coordinate could explain, net of its freedom".into(),
        ]));
        for (kind, gain, numbers) in effect.tried.iter().filter(|(kind, ..)| *kind != effect.name).take(6) {
            let verdict = if effect.equivalents.contains(kind) { "cannot be distinguished" } else { "rejected" };
            rows.push(TableRow::new([format!("– {}", words(kind)), whole(*gain), numbers.to_string(), verdict.into()]));
        }
    }
    for (kind, gain, numbers) in finding.verdict.rejected.iter().take(6) {
        rows.push(TableRow::new([
            format!("beside all of it: {}", words(kind)),
            whole(*gain),
            numbers.to_string(),
            "rejected".into(),
        ]));
    }
    let head = ["explanation", "gain of −2 ln L", "numbers", ""].map(str::to_owned).to_vec();
    Section::new("The evidence, and what was rejected")
        .text("Each kind is refitted together with the base model, against noise whose colour is fitted with it. A name is given only where it explains what a free curve of the same coordinates can; kinds within 11 of the best are not told apart.")
        .table(Table { caption: "Explanations tried in the place of each effect".into(), head, rows })
}

fn bias(finding: &Finding) -> Section {
    let (base, extended) = (&finding.verdict.base.model, &finding.verdict.extended.model);
    let mut rows = Vec::new();
    let mut row = |name: &str, unit: &str, before: f64, after: f64| {
        let change = if after != 0.0 {
            {
                let percent = 100.0 * (before / after - 1.0);
                format!("{}{} %", if percent > 0.0 { "+" } else { "" }, number::number(percent, 3))
            }
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
            if let (crate::model::TermValue::Number(x), Some(crate::model::TermValue::Number(y))) =
                (value, b.values.get(key))
            {
                row(&format!("{}: {key}", words(&a.kind)), "", *x, *y);
            }
        }
    }
    let head = ["parameter", "unit", "without the effect", "with it", "bias"].map(str::to_owned).to_vec();
    Section::new("What the omission had done to the base model").table(Table {
        caption: "Parameters of the base model".into(),
        head,
        rows,
    })
}

fn open(found: &Diagnosis) -> Section {
    let section = Section::new("What stays open");
    let rows: Vec<TableRow> =
        found.undecidable.iter().map(|u| TableRow::new([words(&u.name), u.experiment.clone()])).collect();
    let section = if rows.is_empty() {
        section.text("Every kind of the vocabulary would have been seen at a plausible size.")
    } else {
        let head =
            ["kind that these recordings could not have shown", "experiment that would"].map(str::to_owned).to_vec();
        section.table(Table { caption: "Undecidable".into(), head, rows })
    };
    let next = found.next_experiment.clone();
    section.notes((!next.is_empty()).then(|| format!("Next experiment: {next}.")))
}
