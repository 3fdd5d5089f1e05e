//! Results as text for people.

use crate::estimate::Fit;
use crate::estimate::rivals::Comparison;
use crate::estimate::uncertainty::Estimated;
use crate::recording::TorqueUnit;

/// A fit: structure, parameters with standard deviations, what is left.
pub(super) fn fit(fit: &Fit) -> String {
    let unit = fit.model.torque_unit.symbol();
    let mut lines = Vec::new();
    if let Some(chosen) = fit.selection.iter().find(|c| c.chosen) {
        let of = match fit.selection.len() {
            1 => "as given".to_owned(),
            n => format!("chosen among {n} by held-out prediction"),
        };
        lines.push(format!("Structure {} ({of}), seed {}", chosen.name, fit.seed));
    }
    lines.extend(fit.uncertainty.parameters.iter().map(parameter));
    lines.extend(notes(&fit.uncertainty.parameters));
    lines.push(format!("Left over: {:.4} {unit} rms in {} rows, {:.4} held out", fit.rms, fit.rows, fit.heldout_rms));
    lines.join("\n") + "\n"
}

/// One parameter on a line.
fn parameter(p: &Estimated) -> String {
    let sd = p.sd.map_or("(not determined)".to_owned(), |sd| format!("± {sd:.1e}"));
    let bound = if p.at_bound { "  at its bound" } else { "" };
    format!("  {:<20} {:>13.5e}  {sd:<17} {}{bound}", p.name, p.value, p.unit)
}

/// What there is to say of parameters, each note once.
fn notes(parameters: &[Estimated]) -> Vec<String> {
    let mut notes: Vec<(Vec<&str>, &str)> = Vec::new();
    for p in parameters {
        let Some(note) = p.note.as_deref() else { continue };
        match notes.iter_mut().find(|(_, known)| *known == note) {
            Some((names, _)) => names.push(p.name),
            None => notes.push((vec![p.name], note)),
        }
    }
    notes.into_iter().map(|(names, note)| format!("  {}: {note}", names.join(", "))).collect()
}

/// Models beside each other.
pub(super) fn comparison(lines: &[Comparison], unit: TorqueUnit, seed: u64) -> String {
    let symbol = unit.symbol();
    let mut text = format!("Residual of the torque in {symbol}, seed {seed}\n");
    text += &format!(
        "  {:<32} {:>10} {:>12} {:>10} {:>10} {:>16}\n",
        "model", "parameters", "sum of sq.", "rms", "held out", "unseen recording"
    );
    for line in lines {
        let unseen = line.unseen_recording_rms.map_or("-".to_owned(), |rms| format!("{rms:.4}"));
        text += &format!(
            "  {:<32} {:>10} {:>12.4} {:>10.4} {:>10.4} {:>16}\n",
            line.model, line.parameters, line.rss, line.rms, line.heldout_rms, unseen
        );
    }
    text
}
