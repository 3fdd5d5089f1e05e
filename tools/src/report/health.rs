//! The report of the condition of a gear.

use super::figures::{self, TrendAxis};
use super::page::{Page, Provenance, Section, Table, TableRow, Verdict};
use super::plot::Drawing;
use super::stem;
use crate::fit::verdict::Grade;
use crate::health::{Against, Health};
use crate::number::{number, plus_minus};
use crate::numerics::extremes::range;
use crate::report::health_words::words;

/// The page.
pub fn page(health: &Health, provenance: Provenance) -> Page {
    let changed = health.changes.iter().any(|c| c.moved);
    let tested = health.changes.iter().any(|c| c.p_value.is_some());
    let alone = health.conditions.len() == 1;
    let grade = if changed || !tested && !alone { Grade::Caution } else { Grade::Good };
    let mut sections = if alone { Vec::new() } else { vec![changes(health), trends(health)] };
    sections.push(conditions(health));
    let beside = health.against.as_ref().filter(|_| !alone).map(|against| beside(health, against));
    let second = sections.len().min(1);
    sections.splice(second..second, beside);
    sections.push(definitions(health));
    let title = match alone {
        true => "Condition of a gear".to_owned(),
        false => format!("Condition of a gear over {} states", health.conditions.len()),
    };
    let verdict = Verdict { grade, sentence: health.sentence(), reasons: health.reasons() };
    Page { title, verdict, sections, provenance }
}

fn changes(health: &Health) -> Section {
    let optional = |value: Option<f64>, digits| value.map_or("–".to_owned(), |v| number(v, digits));
    let row = |c: &crate::health::change::Change| {
        let cells = [
            words(c.name).to_owned(),
            number(c.first, 5),
            number(c.last, 5),
            c.sd.map_or_else(|| number(c.change, 3), |sd| plus_minus(c.change, 2.0 * sd)),
            c.unit.clone(),
            format!("{} %", number(100.0 * c.relative, 3)),
            optional(c.detectable.map(|d| 100.0 * d / c.first.abs()), 2),
            c.p_value.map_or("–".to_owned(), probability),
            match (c.moved, c.p_value) {
                (true, _) => "changed",
                (false, Some(_)) => "",
                (false, None) => "not tested",
            }
            .to_owned(),
        ];
        TableRow::new(cells).chosen(c.moved)
    };
    let head = ["", "first", "last", "change ± 2 sd", "unit", "relative change", "visible from, %", "p-value", ""];
    let table = Table::of("From the first state to the last", head, health.changes.iter().map(row));
    let rate = number(100.0 * health.false_alarm_rate, 2);
    Section::new("Changes").table(table).text(format!(
        "A quantity has changed if the values of all states differ by more than their standard deviations allow. False alarms: {rate} % of the tables of a gear that has not changed. \u{201c}Visible from\u{201d}: the change from first to last that is detected in nine of ten cases."
    ))
}

fn probability(p: f64) -> String {
    if p < 1e-12 { "< 10⁻¹²".to_owned() } else { number(p, 2) }
}

fn axis(health: &Health) -> TrendAxis {
    let names = health.conditions.iter().map(|c| stem(&c.name)).collect();
    TrendAxis { label: "state, in the order given".into(), names, values: None }
}

fn points(health: &Health, index: usize) -> Vec<(f64, Option<f64>)> {
    health.conditions.iter().map(|c| (c.quantities[index].value, c.quantities[index].sd)).collect()
}

fn trends(health: &Health) -> Section {
    let axis = axis(health);
    let order = (0..health.changes.len()).rev();
    // Catalogue figures stand last in the list and are shown first.
    let (figures, parameters): (Vec<usize>, Vec<usize>) = order.partition(|k| is_figure(health.changes[*k].name));
    let draw = |k: usize| -> (Drawing, String) {
        let change = &health.changes[k];
        let label = format!("{} in {}", words(change.name), change.unit);
        let caption = if change.moved { "Changed." } else { "" };
        (figures::trend(words(change.name), &axis, &label, &points(health, k), &[]), caption.to_owned())
    };
    Section::new("Trends").figures(figures.into_iter().rev().chain(parameters.into_iter().rev()).map(draw))
}

fn is_figure(name: &str) -> bool {
    name.starts_with('K') || name.ends_with("_arcmin")
}

fn conditions(health: &Health) -> Section {
    let mut head =
        vec!["state".to_owned(), "temperature in °C".to_owned(), format!("residual rms in {}", health.unit.symbol())];
    head.extend(health.changes.iter().map(|c| format!("{} in {}", words(c.name), c.unit)));
    let row = |c: &crate::health::condition::Condition| {
        let fixed = [
            c.name.clone(),
            c.temperature_c.map_or("–".to_owned(), |t| number(t, 3)),
            c.rms.map_or("–".to_owned(), |rms| number(rms, 3)),
        ];
        let values = c.quantities.iter().map(|q| match q.sd {
            Some(sd) => plus_minus(q.value, 2.0 * sd),
            None => number(q.value, 5),
        });
        TableRow::new(fixed.into_iter().chain(values))
    };
    let table = Table::of("± are two standard deviations", head, health.conditions.iter().map(row));
    Section::new("The states").table(table)
}

fn beside(health: &Health, against: &Against) -> Section {
    let name = &against.property.property;
    let row = |r: &crate::health::against::Regression| {
        TableRow::new([
            words(r.name).to_owned(),
            number(r.at_mean, 5),
            r.unit.clone(),
            r.sd.map_or_else(|| number(r.slope, 3), |sd| plus_minus(r.slope, 2.0 * sd)),
            format!("{} %", number(100.0 * r.relative_slope, 3)),
            number(r.scatter, 3),
            r.p_value.map_or("–".to_owned(), probability),
            if r.significant { "significant" } else { "" }.to_owned(),
        ])
        .chosen(r.significant)
    };
    let head = [
        String::new(),
        format!("value at the mean of {name}"),
        "unit".to_owned(),
        format!("slope per {} ± 2 sd", against.property.unit()),
        "relative slope".to_owned(),
        "scatter over standard deviation".to_owned(),
        "p-value".to_owned(),
        String::new(),
    ];
    let caption = "Weighted least squares; standard deviations widened where the values scatter more about the line";
    let table = Table::of(caption, head, against.regressions.iter().map(row));
    let axis =
        TrendAxis { label: against.property.label(), values: Some(against.property.values.clone()), ..axis(health) };
    let ends = range(&against.property.values);
    let draw = |(k, r): (usize, &crate::health::against::Regression)| {
        let line = [ends.0, ends.1].map(|x| (x, r.at_mean + r.slope * (x - r.mean)));
        let label = format!("{} in {}", words(r.name), r.unit);
        let caption = if r.significant { "Significant slope." } else { "No slope beyond its uncertainty." };
        (figures::trend(words(r.name), &axis, &label, &points(health, k), &line), caption.to_owned())
    };
    // The parameters, whose meaning is the question; the catalogue figures follow from them.
    let shown = against.regressions.iter().enumerate().filter(|(_, r)| r.significant || !is_figure(r.name)).map(draw);
    Section::new(format!("Dependence on {name}")).table(table).figures(shown)
}

fn definitions(health: &Health) -> Section {
    let unit = health.unit.symbol();
    let rating = &health.rating;
    let torque = |t: f64| format!("{} {unit}", number(t, 4));
    Section::new("Definitions").notes([
        format!(
            "All states are of the structure {}. The catalogue figures are those of the model, twisted slowly between ± the rated torque {} with the input locked; the torques of the breakpoints are T1 = {} and T2 = {}.",
            health.structure,
            torque(rating.rated_torque),
            torque(rating.t1),
            torque(rating.t2)
        ),
        "K1, K2 and K3 are secants of the mean of the two branches: from 0 to T1, from T1 to T2, from T2 to the rated torque.".to_owned(),
        "Hysteresis loss is the deflection between the branches at no torque. Lost motion is the whole deflection of a closed cycle between ± 4 % of the rated torque.".to_owned(),
    ])
}
