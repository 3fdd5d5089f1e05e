//! Results as text for people.

use crate::adapt::{Learnt, NAMES, Replay};
use crate::diagnose::diagnosis::{Diagnosis, ParameterValue, Unit};
use crate::fit::Fit;
use crate::fit::comparison::Comparison;
use crate::health::Health;
use crate::number::{number, plus_minus, trimmed};
use crate::recording::TorqueUnit;
use crate::regression::uncertainty::Estimated;
use crate::report::fit_words::held_invertible;

/// A replay: both errors, old and new coefficients with their standard deviations, warnings.
pub(super) fn adapt(replay: &Replay) -> String {
    let unit = replay.unit.symbol();
    let mut lines = vec![
        format!("Torque error one step ahead, rms in {unit}"),
        format!("  block    {}", four(replay.rms.block)),
        format!("  adapted  {}", four(replay.rms.adapted)),
        format!(
            "Taken over {} times, given back {} times, after {} stretches of motion",
            replay.taken_over_s.len(),
            replay.given_back_s.len(),
            replay.stretches
        ),
    ];
    if let Some(last) = replay.trace.last() {
        lines.push(format!("  {:<4} {:>14}    {}", "", "block", "estimate at the end"));
        let values = last.coefficients();
        lines.extend(NAMES.iter().enumerate().map(|(k, name)| {
            format!("  {name:<4} {:>14}    {}", number(replay.block[k], 5), plus_minus(values[k], last.sd[k]))
        }));
    }
    lines.extend(replay.warnings.iter().map(|warning| format!("Warning: {warning}")));
    lines.join("\n") + "\n"
}

/// What a drive has learnt, old beside new.
pub(super) fn learnt(learnt: &Learnt) -> String {
    let force = if learnt.taken_over { "adapted parameters are in force" } else { "the block is in force" };
    let mut lines = vec![
        format!("After {} stretches of motion, {force}", learnt.stretches),
        format!("  {:<4} {:>14} {:>14}    shadow", "", "block", "in force"),
    ];
    lines.extend(learnt.coefficients.iter().map(|of| {
        let [block, in_force] = [of.block, of.in_force].map(|value| number(value, 5));
        format!("  {:<4} {block:>14} {in_force:>14}    {} {}", of.name, plus_minus(of.shadow, of.sd), of.unit)
    }));
    lines.extend(learnt.warnings.iter().map(|warning| format!("Warning: {warning}")));
    lines.join("\n") + "\n"
}

/// A fit: structure, parameters with standard deviations, what is left.
pub(super) fn fit(fit: &Fit) -> String {
    let unit = fit.model.torque_unit.symbol();
    let mut lines = Vec::new();
    if let Some(chosen) = fit.selection.iter().find(|c| c.chosen) {
        let of = match fit.selection.len() {
            1 => "as given".to_owned(),
            n => format!(
                "chosen among {n} by held-out prediction on {} rows spread over the recordings",
                fit.selection_rows
            ),
        };
        lines.push(format!("Structure {} ({of}), seed {}", chosen.name, fit.seed));
    }
    if fit.selection.len() > 1 {
        lines.push(format!("  {:<24} {:>10} {:>12} {:>12}", "structure", "parameters", "rms fitted", "held out"));
        lines.extend(fit.selection.iter().map(|c| {
            let said = if c.chosen {
                "  chosen"
            } else if c.tied {
                "  predicts as well"
            } else {
                ""
            };
            format!("  {:<24} {:>10} {:>12} {:>12}{said}", c.name, c.parameters, four(c.rms), four(c.heldout_rms))
        }));
    }
    if let Some(words) = fit.held_invertible_up_to_rated().map(held_invertible) {
        lines.push(format!("The parameters are {words}; the recordings do not contradict it"));
    }
    if fit.leaves_physics() {
        lines.push("Plain least squares: the residual is more physics than noise. Standard deviations are from the scatter of blocks.".to_owned());
    }
    if let Some(rated) = fit.model.gear.rated_deflection_rad.filter(|_| fit.rated_is_largest_seen) {
        lines.push(format!(
            "No rated deflection given: using the largest recorded, {} rad. c1 to c3 and e depend on it; set --rated-deflection if you know it.",
            number(rated, 6)
        ));
    }
    if fit.zeros_apart_rad().is_some() {
        lines.push("Each recording has its own deflection zero; the model has the first:".to_owned());
        lines.extend(fit.deflection_zeros.iter().map(|zero| {
            let value = zero.sd_rad.map_or_else(|| number(zero.rad, 5), |sd| plus_minus(zero.rad, sd));
            format!("  {}  {value} rad", zero.recording)
        }));
    }
    let width = fit.uncertainty.parameters.iter().map(|p| p.name.len()).max().unwrap_or(0);
    lines.extend(fit.uncertainty.parameters.iter().map(|p| parameter(p, width)));
    lines.extend(notes(&fit.uncertainty.parameters));
    let left_out = match fit.unsettled_rows.iter().sum::<usize>() {
        0 => String::new(),
        rows => format!(" ({rows} before the loop has settled are left out)"),
    };
    lines.push(format!(
        "Residual: {} {unit} rms over {} rows{left_out}; {} on blocks held out. ± is one standard deviation.",
        four(fit.rms),
        fit.rows,
        four(fit.heldout_rms)
    ));
    lines.join("\n") + "\n"
}

/// A diagnosis: verdict, places, effects, what stays open.
pub(super) fn diagnosis(found: &Diagnosis) -> String {
    let unit = if found.unit == Unit::Ampere { "A" } else { "N·m" };
    let mut lines = Vec::new();
    if !found.mismatch {
        lines.push(format!("No structure beyond noise (false alarms: {}).", percent(found.false_alarm_rate)));
    }
    for effect in &found.effects {
        let class = match effect.equivalents.as_slice() {
            [] => String::new(),
            others => format!(" (or {}: the recordings cannot distinguish them)", others.join(", ")),
        };
        let share = percent(effect.share);
        lines.push(format!("{}{class}: {share} of the structure, confidence {:.2}", effect.name, effect.confidence));
        lines.push(format!("    {}", effect.why));
        lines.extend(effect.curve().map(|curve| format!("    curve                        {curve}")));
        for (name, parameter) in effect.parameters.iter().filter(|_| effect.curve().is_none()) {
            let number = |x: f64, sd: Option<&f64>| match sd {
                Some(sd) => plus_minus(x, *sd),
                None => trimmed(x, 6),
            };
            let sds = parameter.sd.as_ref().map_or(&[][..], ParameterValue::numbers);
            let value = match &parameter.value {
                ParameterValue::Text(text) => text.clone(),
                value => {
                    let numbers = value.numbers().iter().enumerate();
                    numbers.map(|(i, x)| number(*x, sds.get(i))).collect::<Vec<_>>().join(", ")
                }
            };
            let unit = if parameter.unit == "1" { "" } else { &parameter.unit };
            lines.push(format!("    {name:<28} {value} {unit}").trim_end().to_owned());
        }
    }
    for place in &found.places {
        let stretches: Vec<String> = place.seconds.iter().take(4).map(|[a, b]| format!("{a:.1}-{b:.1} s")).collect();
        let more = if place.seconds.len() > 4 { " …" } else { "" };
        let share = percent(place.share);
        lines.push(format!("Seen in {}: {share}, {} ({}{more})", place.coordinate, place.detail, stretches.join(", ")));
    }
    let row = |name: &str, rms: &crate::diagnose::diagnosis::Rms| {
        format!("  {name:<10} {:>12} {:>14} {:>12}", four(rms.given), four(rms.refitted), four(rms.extended))
    };
    lines.push(format!("Residual, rms in {unit}"));
    lines.push(format!("  {:<10} {:>12} {:>14} {:>12}", "rows", "model given", "base refitted", "extended"));
    lines.push(row("fitted", &found.rms));
    lines.push(row("held out", &found.heldout.rms));
    if !found.undecidable.is_empty() {
        let names: Vec<&str> = found.undecidable.iter().map(|u| u.name.as_str()).collect();
        lines.push("These recordings cannot show:".to_owned());
        lines.extend(wrapped(&names));
    }
    if !found.next_experiment.is_empty() {
        lines.push(format!("Next bench test: {}", found.next_experiment));
    }
    lines.join("\n") + "\n"
}

/// Four significant digits.
fn four(x: f64) -> String {
    number(x, 4)
}

/// Columns of the terminal that a list fills.
const WIDTH: usize = 100;

/// Names after each other, indented, as many a line as there is room for.
fn wrapped(names: &[&str]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for name in names {
        match lines.last_mut() {
            Some(line) if line.len() + name.len() + 3 <= WIDTH => *line += &format!(", {name}"),
            last => {
                last.into_iter().for_each(|line| line.push(','));
                lines.push(format!("    {name}"));
            }
        }
    }
    lines
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// One parameter on a line.
fn parameter(p: &Estimated, width: usize) -> String {
    let value = match p.sd {
        Some(sd) => plus_minus(p.value, sd),
        None => format!("{} (not determined)", number(p.value, 5)),
    };
    let bound = if p.at_bound { "  at its bound" } else { "" };
    format!("  {:<width$}  {value:<28} {}{bound}", p.name, p.unit)
}

/// What there is to say of parameters, each note once.
fn notes(parameters: &[Estimated]) -> Vec<String> {
    let mut notes: Vec<(Vec<&str>, &str)> = Vec::new();
    for p in parameters {
        let Some(note) = p.note.as_deref() else { continue };
        match notes.iter_mut().find(|(_, known)| *known == note) {
            Some((names, _)) => names.push(&p.name),
            None => notes.push((vec![&p.name], note)),
        }
    }
    notes.into_iter().map(|(names, note)| format!("  {}: {note}", names.join(", "))).collect()
}

/// Models beside each other.
pub(super) fn comparison(lines: &[Comparison], unit: TorqueUnit, seed: u64) -> String {
    let symbol = unit.symbol();
    let mut text = format!("Residual of the torque in {symbol}, seed {seed}\n");
    text += &format!(
        "  {:<32} {:>10} {:>12} {:>10} {:>10} {:>16} {:>12}\n",
        "model", "parameters", "sum of sq.", "rms", "held out", "unseen recording", "instructions"
    );
    for line in lines {
        let unseen = line.unseen_recording_rms.map_or("-".to_owned(), four);
        let cost = line.instructions.map_or("-".to_owned(), |count| count.to_string());
        text += &format!(
            "  {:<32} {:>10} {:>12} {:>10} {:>10} {:>16} {cost:>12}\n",
            line.model,
            line.parameters,
            four(line.rss),
            four(line.rms),
            four(line.heldout_rms),
            unseen
        );
    }
    if lines.iter().all(|line| line.unseen_recording_rms.is_none()) {
        text += "Unseen recording: give several, at other amplitudes and rates, and each is held out whole in turn\n";
    }
    text + "Instructions: a sample on a Cortex-M4F in f32, counted in the emulator\n"
}

/// A series of states: the finding, then each quantity.
pub(super) fn health(health: &Health) -> String {
    let mut lines = vec![health.sentence()];
    lines.extend(health.reasons().into_iter().map(|reason| format!("  {reason}")));
    let rating = &health.rating;
    let unit = health.unit.symbol();
    lines.push(format!(
        "Structure {}, seed {}; rated torque {} {unit}, T1 {} {unit}, T2 {} {unit}; false alarms {} %",
        health.structure,
        health.seed,
        four(rating.rated_torque),
        four(rating.t1),
        four(rating.t2),
        100.0 * health.false_alarm_rate
    ));
    if let [only] = &health.conditions[..] {
        let knows_sd = only.quantities.iter().any(|q| q.sd.is_some());
        lines.extend(only.quantities.iter().map(|q| {
            let sd = match (knows_sd, q.sd) {
                (true, sd) => format!(" ± {:<10}", sd.map_or("-".to_owned(), |sd| number(2.0 * sd, 2))),
                (false, _) => String::new(),
            };
            format!("  {:<24} {:>13}{sd} {}", q.name, number(q.value, 5), q.unit)
        }));
        lines.push(match knows_sd {
            true => "± two standard deviations".to_owned(),
            false => "No uncertainty: write it beside the model by gmhm fit --json (gear.toml, gear.json)".to_owned(),
        });
        return lines.join("\n") + "\n";
    }
    lines.push(format!(
        "  {:<24} {:>13} {:>13} {:>10} {:>10} {:>10}  {}",
        "", "first", "last", "change %", "± 2 sd %", "p-value", "unit"
    ));
    for change in &health.changes {
        let percent = |sd: f64| format!("{:.3}", 200.0 * sd / change.first.abs());
        lines.push(format!(
            "  {:<24} {:>13} {:>13} {:>10} {:>10} {:>10}  {}{}",
            change.name,
            number(change.first, 6),
            number(change.last, 6),
            format!("{:.3}", 100.0 * change.relative).replace('-', "−"),
            change.sd.map_or("-".to_owned(), percent),
            change.p_value.map_or("-".to_owned(), |p| if p < 1e-12 { "< 10⁻¹²".to_owned() } else { number(p, 2) }),
            change.unit,
            if change.moved { "  moved" } else { "" }
        ));
    }
    lines.join("\n") + "\n"
}
