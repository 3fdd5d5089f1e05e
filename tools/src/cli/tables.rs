//! Results as text for people.

use crate::adapt::{Learnt, NAMES, Replay};
use crate::diagnose::diagnosis::{Diagnosis, ParameterValue, Unit};
use crate::fit::Fit;
use crate::fit::comparison::Comparison;
use crate::health::Health;
use crate::number::{number, percent, plus_minus, trimmed};
use crate::recording::TorqueUnit;
use crate::regression::uncertainty::Estimated;
use crate::report::fit_words::held_invertible;
use crate::report::note_words::notes;
use crate::signal::plausible::Remark;
use crate::text_table::Head::{Numbers, Words};
use crate::text_table::text_table as table;

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
        let values = last.coefficients();
        let rows = NAMES
            .iter()
            .enumerate()
            .map(|(k, name)| [name.to_string(), number(replay.block[k], 5), plus_minus(values[k], last.sd[k])]);
        lines.push(table([Words(""), Numbers("block"), Words("estimate at the end")], rows));
    }
    lines.extend(replay.warnings.iter().map(|warning| format!("Warning: {warning}")));
    joined(&lines)
}

/// What a drive has learnt, old beside new.
pub(super) fn learnt(learnt: &Learnt) -> String {
    let force = if learnt.taken_over { "adapted parameters are in force" } else { "the block is in force" };
    let rows = learnt.coefficients.iter().map(|of| {
        let [block, in_force] = [of.block, of.in_force].map(|value| number(value, 5));
        [of.name.to_string(), block, in_force, plus_minus(of.shadow, of.sd), of.unit.to_string()]
    });
    let heads = [Words(""), Numbers("block"), Numbers("in force"), Words("shadow"), Words("")];
    let mut lines = vec![format!("After {} stretches of motion, {force}", learnt.stretches), table(heads, rows)];
    lines.extend(learnt.warnings.iter().map(|warning| format!("Warning: {warning}")));
    joined(&lines)
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
        let rows = fit.selection.iter().map(|c| {
            let said = if c.chosen {
                "chosen"
            } else if c.tied {
                "predicts as well"
            } else {
                ""
            };
            [c.name.to_string(), c.parameters.to_string(), four(c.rms), four(c.heldout_rms), said.to_owned()]
        });
        let heads = [Words("structure"), Numbers("parameters"), Numbers("rms fitted"), Numbers("held out"), Words("")];
        lines.push(table(heads, rows));
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
    let parameters = fit.uncertainty.parameters.iter().map(parameter);
    lines.push(table([Words(""), Words(""), Words(""), Words("")], parameters));
    lines.extend(notes(&fit.uncertainty.parameters, |p| &p.name).iter().map(|note| format!("  {note}")));
    let left_out = match fit.unsettled_rows.iter().sum::<usize>() {
        0 => String::new(),
        rows => format!(" ({rows} before the loop has settled are not used)"),
    };
    let rows = fit.rows_near_standstill.iter().sum();
    if rows > 0 {
        lines.push(Remark::NearStandstill { rows, of: fit.residuals.iter().map(Vec::len).sum() }.to_string());
    }
    lines.push(format!(
        "Residual: {} {unit} rms over {} rows{left_out}; {} on blocks held out. ± is one standard deviation.",
        four(fit.rms),
        fit.rows,
        four(fit.heldout_rms)
    ));
    joined(&lines)
}

/// A diagnosis: verdict, places, effects, open questions.
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
    for place in &found.locations {
        let stretches: Vec<String> = place.seconds.iter().take(4).map(|[a, b]| format!("{a:.1}-{b:.1} s")).collect();
        let more = if place.seconds.len() > 4 { " …" } else { "" };
        let share = percent(place.share);
        lines.push(format!("Seen in {}: {share}, {} ({}{more})", place.coordinate, place.detail, stretches.join(", ")));
    }
    lines.push(format!("Residual, rms in {unit}"));
    let heads = [Words("rows"), Numbers("model given"), Numbers("base refitted"), Numbers("extended")];
    let rows = [("fitted", &found.rms), ("held out", &found.heldout.rms)];
    let rows = rows.map(|(name, rms)| [name.to_owned(), four(rms.given), four(rms.refitted), four(rms.extended)]);
    lines.push(table(heads, rows));
    if !found.undecidable.is_empty() {
        let names: Vec<&str> = found.undecidable.iter().map(|u| u.name.as_str()).collect();
        lines.push("These recordings cannot show:".to_owned());
        lines.extend(wrapped(&names));
    }
    lines.extend(found.suggestions.iter().map(|suggestion| format!("Try {suggestion}")));
    let next = found.next_experiment.to_string();
    if !next.is_empty() {
        lines.push(format!("Next bench test: {next}"));
    }
    joined(&lines)
}

/// Lines and tables below each other; a table has its last line break.
fn joined(parts: &[String]) -> String {
    parts.iter().map(|part| format!("{}\n", part.trim_end_matches('\n'))).collect()
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

/// A parameter: name, value, unit, whether at a bound.
fn parameter(p: &Estimated) -> [String; 4] {
    let value = match p.sd {
        Some(sd) => plus_minus(p.value, sd),
        None => format!("{} (not determined)", number(p.value, 5)),
    };
    let bound = if p.at_bound { "at its bound" } else { "" };
    [p.name.to_string(), value, p.unit.to_string(), bound.to_owned()]
}

/// Models beside each other.
pub(super) fn comparison(lines: &[Comparison], unit: TorqueUnit, seed: u64) -> String {
    let symbol = unit.symbol();
    let rows = lines.iter().map(|line| {
        [
            line.model.to_string(),
            line.parameters.to_string(),
            four(line.rss),
            four(line.rms),
            four(line.heldout_rms),
            line.unseen_recording_rms.map_or("-".to_owned(), four),
            line.instructions.map_or("-".to_owned(), |count| count.to_string()),
        ]
    });
    let numbers = ["parameters", "sum of sq.", "rms", "held out", "unseen recording", "instructions"].map(Numbers);
    let [parameters, squares, rms, heldout, unseen, instructions] = numbers;
    let heads = [Words("model"), parameters, squares, rms, heldout, unseen, instructions];
    let mut text = format!("Residual of the torque in {symbol}, seed {seed}\n") + &table(heads, rows);
    if lines.iter().all(|line| line.unseen_recording_rms.is_none()) {
        text +=
            "Unseen recording: give several recordings at other amplitudes and rates; each is then held out in turn\n";
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
        let rows = only.quantities.iter().map(|q| {
            let sd = match (knows_sd, q.sd) {
                (true, sd) => format!("± {}", sd.map_or("-".to_owned(), |sd| number(2.0 * sd, 2))),
                (false, _) => String::new(),
            };
            [q.name.to_string(), number(q.value, 5), sd, q.unit.clone()]
        });
        lines.push(table([Words(""), Numbers(""), Words(""), Words("")], rows));
        lines.push(match knows_sd {
            true => "± two standard deviations".to_owned(),
            false => {
                "No uncertainty: write it beside the model with gmhm fit --json (gear.json for gear.toml)".to_owned()
            }
        });
        return joined(&lines);
    }
    let rows = health.changes.iter().map(|change| {
        let percent = |sd: f64| format!("{:.3}", 200.0 * sd / change.first.abs());
        [
            change.name.to_string(),
            number(change.first, 6),
            number(change.last, 6),
            format!("{:.3}", 100.0 * change.relative).replace('-', "−"),
            change.sd.map_or("-".to_owned(), percent),
            change.p_value.map_or("-".to_owned(), |p| if p < 1e-12 { "< 10⁻¹²".to_owned() } else { number(p, 2) }),
            change.unit.to_string(),
            if change.moved { "changed" } else { "" }.to_owned(),
        ]
    });
    let [first, last, by, sd, p] = ["first", "last", "change %", "± 2 sd %", "p-value"].map(Numbers);
    lines.push(table([Words(""), first, last, by, sd, p, Words("unit"), Words("")], rows));
    joined(&lines)
}
