//! The report of a fit: good enough to flash or not, and why.

use super::figures::{self, Abscissa, symbol};
use super::fit_words::worded;
use super::note_words::notes;
use super::page::{Page, Provenance, Section, Table, TableRow, Verdict};
use super::plot::{Drawing, Role};
use super::{capitalised, stem};
use crate::fit::Fit;
use crate::fit::Method;
use crate::fit::coverage::{Coverage, JointCoverage};
use crate::fit::verdict::{Assessment, FitVerdict};
use crate::number::{estimate, number};
use crate::numerics::particle_swarm::Stop;
use crate::recording::{Recording, TorqueUnit};
use crate::regression::uncertainty::Estimated;

/// The page of a fit of these recordings, whose deflection has been derived.
pub fn page(fit: &Fit, assessment: &Assessment, recordings: &[Recording], provenance: Provenance) -> Page {
    let rows = Joined::new(fit, assessment, recordings);
    let unit = fit.model.torque_unit;
    Page {
        title: format!("Fit of {}", fit.model.name),
        verdict: verdict(&assessment.verdict, unit),
        sections: [
            Some(if fit.model.has_gear() { the_loop(&rows, fit, unit) } else { the_joint(&rows, fit, unit) }),
            Some(residual_section(fit, assessment, &rows, unit)),
            Some(parameters(fit)),
            assessment.coverage.as_ref().map(|coverage| exercised(coverage, fit)),
            assessment.joint_coverage.as_ref().map(moved),
            (!fit.selection.is_empty()).then(|| structures(fit, unit)),
            (!assessment.comparison.is_empty()).then(|| comparison(assessment, recordings, unit)),
            Some(search(fit)),
        ]
        .into_iter()
        .flatten()
        .collect(),
        provenance,
    }
}

/// A verdict as the head of a page.
fn verdict(verdict: &FitVerdict, unit: TorqueUnit) -> Verdict {
    let worded = worded(verdict, unit);
    // The sentence holds the first reason.
    let reasons = worded.reasons.iter().skip(1).map(|reason| capitalised(&reason.words) + ".").collect();
    Verdict { grade: worded.grade, sentence: worded.sentence, reasons }
}

/// All recordings one after the other, a row that is no number between them: no line leads from one to the next.
struct Joined {
    time_s: Vec<f64>,
    over: Abscissa,
    /// The deflection, or the output angle of a joint log, rad.
    at: Vec<f64>,
    measured: Vec<f64>,
    modelled: Vec<f64>,
    elastic: Vec<f64>,
    hysteresis: Vec<f64>,
    terms: Vec<(String, Vec<f64>)>,
    residual: Vec<f64>,
    unsettled_s: Vec<(f64, f64)>,
    names: Vec<String>,
    /// Names of the recordings that are fitted with what the gear remembered at their first row.
    followed: Vec<String>,
}

impl Joined {
    fn new(fit: &Fit, assessment: &Assessment, recordings: &[Recording]) -> Self {
        let mut all = Self {
            time_s: Vec::new(),
            over: if fit.model.has_gear() { Abscissa::DEFLECTION } else { Abscissa::OUTPUT_ANGLE },
            at: Vec::new(),
            measured: Vec::new(),
            modelled: Vec::new(),
            elastic: Vec::new(),
            hysteresis: Vec::new(),
            terms: Vec::new(),
            residual: Vec::new(),
            unsettled_s: Vec::new(),
            names: recordings.iter().map(|r| stem(&r.name)).collect(),
            followed: Vec::new(),
        };
        let remembered = |index: &usize| !fit.known_start[*index] && fit.unsettled_rows[*index] == 0;
        all.followed = (0..recordings.len()).filter(remembered).map(|index| all.names[index].clone()).collect();
        let mut begin = 0.0;
        for (index, recording) in recordings.iter().enumerate() {
            if index > 0 {
                all.lines().for_each(|line| line.push(f64::NAN));
            }
            let first = recording.time_s.first().copied().unwrap_or(0.0);
            let unsettled = fit.unsettled_rows[index];
            if unsettled > 0 {
                all.unsettled_s.push((begin, begin + recording.time_s[unsettled] - first));
            }
            let prediction = &assessment.predictions[index];
            all.time_s.extend(recording.time_s.iter().map(|t| begin + t - first));
            let at = recording.deflection_rad.as_deref().or(recording.theta_out_rad.as_deref());
            all.at.extend(at.unwrap_or_default());
            for (k, (name, values)) in prediction.terms.iter().enumerate() {
                if index == 0 {
                    all.terms.push((name.clone(), Vec::new()));
                }
                all.terms[k].1.extend(values);
            }
            all.measured.extend(recording.torque.as_deref().unwrap_or_default().iter().map(|t| t - fit.offsets[index]));
            all.modelled.extend(&prediction.torque);
            all.elastic.extend(&prediction.elastic);
            all.hysteresis.extend(&prediction.hysteresis);
            all.residual.extend(&assessment.residuals[index]);
            begin = all.time_s.last().copied().unwrap_or(begin);
        }
        all
    }

    /// Every line of rows.
    fn lines(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        let Self { time_s, at, measured, modelled, elastic, hysteresis, residual, terms, .. } = self;
        let fixed = [time_s, at, measured, modelled, elastic, hysteresis, residual];
        fixed.into_iter().chain(terms.iter_mut().map(|(_, values)| values))
    }

    fn loop_figure(&self, name: &str, unit: TorqueUnit) -> Drawing {
        let fitted: Vec<f64> =
            self.measured.iter().zip(&self.residual).map(|(torque, residual)| torque - residual).collect();
        let model: &[(&str, Role, &[f64])] = if self.followed.is_empty() {
            &[("model, from rest", Role::Model, &self.modelled)]
        } else {
            &[("model, from rest", Role::Second, &self.modelled), ("model, as fitted", Role::Model, &fitted)]
        };
        let what = if self.over == Abscissa::DEFLECTION { "Hysteresis loop" } else { "Joint log" };
        figures::torque_over(self.over, &format!("{what}: {name}"), &self.at, &self.measured, model, unit)
    }
}

/// The loop of all recordings, without their offsets, with the model's prediction, which starts each of them from rest.
pub fn loop_figure(fit: &Fit, assessment: &Assessment, recordings: &[Recording]) -> Drawing {
    Joined::new(fit, assessment, recordings).loop_figure(&fit.model.name, fit.model.torque_unit)
}

/// Torque over the output angle and what each term adds to it.
fn the_joint(rows: &Joined, fit: &Fit, unit: TorqueUnit) -> Section {
    let roles = [Role::Model, Role::Third, Role::Second, Role::Fourth];
    let parts: Vec<(&str, Role, &[f64])> =
        rows.terms.iter().zip(roles).map(|((name, values), role)| (name.as_str(), role, &values[..])).collect();
    Section::new("The joint").figures([
        (
            rows.loop_figure(&fit.model.name, unit),
            "Grey: recording, without its constant offset. Blue: the model, which never reads the recorded torque or current.".into(),
        ),
        (
            figures::parts_over_time("What each term adds", &rows.time_s, &parts, unit),
            "The terms of the model; their sum is the model's torque.".into(),
        ),
    ])
}

fn the_loop(rows: &Joined, fit: &Fit, unit: TorqueUnit) -> Section {
    let lines = match &rows.followed[..] {
        [] => "Blue: the model, which never reads the recorded torque. It starts with an empty memory.".to_owned(),
        names => {
            let which = if names.len() < rows.names.len() { format!(" ({})", names.join(", ")) } else { String::new() };
            format!(
                "Blue: the model as fitted, with the estimated memory at the first row{which}. Orange: a prediction, which starts with an empty memory and joins the loop at its first tip."
            )
        }
    };
    Section::new("The loop").figures([
        (rows.loop_figure(&fit.model.name, unit), format!("Grey: recording, without its constant offset. {lines}")),
        (
            figures::decomposition("Elastic and hysteresis torque", &rows.at, &rows.elastic, &rows.hysteresis, unit),
            "The two parts of the model: the elastic torque, and the hysteresis torque, which depends on the path."
                .into(),
        ),
    ])
}

fn residual_section(fit: &Fit, assessment: &Assessment, rows: &Joined, unit: TorqueUnit) -> Section {
    let symbol = unit.symbol();
    let time = match rows.names.len() {
        1 => "Time from the first row.".to_owned(),
        n => format!("The {n} recordings one after the other."),
    };
    let shaded = if rows.unsettled_s.is_empty() {
        ""
    } else {
        " Shaded: rows before the loop has settled. The fit does not use them because the past of the gear is unknown."
    };
    let structure = match assessment.structure {
        Some(s) if s.significant => format!(
            "{:.0} % of its power repeats from the first half to the second at the same position and direction, so it is not noise.",
            100.0 * s.share
        ),
        Some(_) => "No repeatable pattern found.".to_owned(),
        None => "The recordings are too short to decide whether it repeats.".to_owned(),
    };
    let over = [("", Role::Model, &rows.residual[..])];
    let joint = rows.over == Abscissa::OUTPUT_ANGLE;
    let residual_title = if joint { "Residual over output angle" } else { "Residual over deflection" };
    let head = ["rows".to_owned(), format!("rms in {symbol}"), format!("of the peak {}", unit.quantity())];
    let rows_of_errors = [("fitted", fit.rms), ("in blocks held out", fit.heldout_rms)].map(|(name, rms)| {
        let share = format!("{:.2} %", 100.0 * rms / assessment.torque_peak);
        TableRow::new([name.to_owned(), number(rms, 4), share])
    });
    let errors = Table::of("Fitted and held-out error", head, rows_of_errors);
    Section::new("Residual")
        .table(errors)
        .figures([
            (
                figures::residual_over_time("Residual over time", &rows.time_s, &over, &rows.unsettled_s, unit),
                time + shaded,
            ),
            (
                figures::residual_by_direction(residual_title, rows.over, &rows.at, &rows.residual, unit),
                format!("Split by direction of motion. {structure}"),
            ),
        ])
        .table(noise(fit, &rows.names, unit))
}

fn noise(fit: &Fit, names: &[String], unit: TorqueUnit) -> Table {
    let symbol = unit.symbol();
    // A joint log knows neither a loop that settles nor a deflection.
    let gear = fit.model.has_gear();
    let apart = fit.zeros_apart_rad().is_some();
    let near_standstill = fit.rows_near_standstill.iter().any(|rows| *rows > 0);
    let torque_steps = fit.noise.iter().any(|noise| noise.torque_step_nm.is_some());
    let deflection_steps = fit.noise.iter().any(|noise| noise.deflection_step_rad.is_some());
    let rows = fit.noise.iter().enumerate().map(|(index, noise)| {
        let colour = match noise.coefficients.len() {
            0 => "white".to_owned(),
            order => format!("coloured, AR({order})"),
        };
        let mut cells = vec![
            names[index].clone(),
            number(fit.offsets[index], 4),
            colour,
            number(noise.innovation_sd, 3),
            noise.outliers.to_string(),
        ];
        cells.extend(apart.then(|| number(fit.deflection_zeros[index].rad, 5)));
        cells.extend(gear.then(|| fit.unsettled_rows[index].to_string()));
        cells.extend(near_standstill.then(|| fit.rows_near_standstill[index].to_string()));
        let steps = [(torque_steps, noise.torque_step_nm), (deflection_steps, noise.deflection_step_rad)];
        let shown = steps.iter().filter(|(shown, _)| *shown);
        cells.extend(shown.map(|(_, step)| step.map_or("–".to_owned(), |s| number(s, 3))));
        TableRow::new(cells)
    });
    let mut head = vec![
        "recording".to_owned(),
        format!("offset in {symbol}"),
        "noise".to_owned(),
        format!("sd of its innovations in {symbol}"),
        "outliers (rows)".to_owned(),
    ];
    head.extend(apart.then(|| "zero of its deflection in rad".to_owned()));
    head.extend(gear.then(|| "unsettled start (rows)".to_owned()));
    head.extend(near_standstill.then(|| "noise near standstill (rows)".to_owned()));
    head.extend(torque_steps.then(|| format!("{} counted in steps of {symbol}", unit.quantity())));
    head.extend(deflection_steps.then(|| "deflection counted in steps of rad".to_owned()));
    Table::of("Each recording: the constant offset, the noise, and rows that are not used", head, rows)
}

fn parameters(fit: &Fit) -> Section {
    let row = |p: &Estimated| {
        let (value, sd, interval) = match p.sd {
            Some(sd) => {
                let (value, interval) = estimate(p.value, sd);
                (value, number(sd, 2), interval)
            }
            None => (number(p.value, 6), "–".to_owned(), "–".to_owned()),
        };
        let flag = match p {
            _ if p.at_bound => "at its bound",
            _ if p.undetermined && p.sd.is_none() => "not determined by itself",
            _ if p.undetermined => "undetermined",
            _ => "",
        };
        TableRow::new([p.name.to_string(), value, sd, interval, p.unit.to_string(), flag.to_owned()])
            .flagged(!flag.is_empty())
    };
    let how = match (fit.prewhitened, fit.leaves_physics()) {
        (true, _) => "Values with standard deviations under the noise found",
        (_, true) => {
            "Values of plain least squares, because a fit that treats the residual as noise predicts held-out rows worse; standard deviations from the scatter of blocks of rows"
        }
        _ => "Values of plain least squares; standard deviations from the scatter of blocks of rows",
    };
    let caption = format!("{how}; intervals of ± 2 standard deviations, about 95 %");
    let head = ["parameter", "value", "standard deviation", "interval", "unit", ""];
    let table = Table::of(caption, head, fit.uncertainty.parameters.iter().map(row));
    let notes = notes(&fit.uncertainty.parameters, |p| symbol(&p.name));
    let section = Section::new("Parameters").table(table).notes(notes);
    if fit.uncertainty.correlation.len() < 2 {
        return section;
    }
    section.figure(
        figures::correlation(&fit.uncertainty.correlated, &fit.uncertainty.correlation),
        "Near ±1 the recordings determine a combination of two parameters better than each of them. Parameters without a standard deviation have no correlation.",
    )
}

fn exercised(coverage: &Coverage, fit: &Fit) -> Section {
    let mrad = |x: f64| number(1e3 * x, 4);
    let (low, high) = coverage.deflection_rad;
    let lines = [
        ("rated deflection A", mrad(coverage.rated_deflection_rad), "mrad"),
        ("lowest deflection", mrad(low), "mrad"),
        ("highest deflection", mrad(high), "mrad"),
        ("reached on both sides", format!("{:.0}", 100.0 * coverage.reach()), "% of A"),
        ("strokes between reversals", coverage.strokes.to_string(), ""),
        ("reversals inside the extremes", coverage.inner_reversals.to_string(), ""),
        ("median rate of the deflection", mrad(coverage.rate_rad_per_s.0), "mrad/s"),
        ("95th percentile of the rate", mrad(coverage.rate_rad_per_s.1), "mrad/s"),
    ];
    let rows = lines.map(|(name, value, unit)| TableRow::new([name.to_owned(), value, unit.to_owned()]));
    let table = Table::of("", ["", "value", "unit"], rows);
    let mut notes = Vec::new();
    if fit.rated_is_largest_seen {
        notes.push("No rated deflection given: A is the largest recorded. c1–c3 and e depend on it; set --rated-deflection if you know it.".to_owned());
    }
    if coverage.inner_reversals == 0 {
        notes.push("No minor loops were recorded: behaviour there is extrapolated by the law.".to_owned());
    }
    Section::new("Range of the recordings")
        .figure(
            figures::coverage(coverage),
            "Colour: deflections and rates that were recorded. Elsewhere the model extrapolates.",
        )
        .table(table)
        .notes(notes)
}

/// Where joint logs went and how fast.
fn moved(coverage: &JointCoverage) -> Section {
    let ((low, high), (back, forth)) = (coverage.angle_rad, coverage.velocity_rad_per_s);
    let lines = [
        ("lowest output angle", low, "rad"),
        ("highest output angle", high, "rad"),
        ("fastest towards lower angles", -back, "rad/s"),
        ("fastest towards higher angles", forth, "rad/s"),
    ];
    let rows = lines.map(|(name, value, unit)| TableRow::new([name.to_owned(), number(value, 4), unit.to_owned()]));
    Section::new("Range of the recordings")
        .figure(
            figures::joint_coverage(coverage),
            "Colour: angles and velocities that were recorded. Elsewhere the model extrapolates. Friction requires motion in both directions, and several speeds to separate its parts.",
        )
        .table(Table::of("", ["", "value", "unit"], rows))
}

fn structures(fit: &Fit, unit: TorqueUnit) -> Section {
    let row = |c: &crate::fit::select::Candidate| {
        let word = match (c.chosen, c.tied) {
            (true, _) => "chosen",
            (false, true) => "predicts as well",
            _ => "",
        };
        TableRow::new([
            c.name.clone(),
            c.parameters.to_string(),
            number(c.rms, 4),
            number(c.heldout_rms, 4),
            word.to_owned(),
        ])
        .chosen(c.chosen)
    };
    let symbol = unit.symbol();
    let words = match fit.selection.len() {
        1 => "The law was given.".to_owned(),
        n => format!(
            "{n} structures were compared by their prediction of held-out rows. Of those that predict equally well the simplest is chosen. {} rows were used, spread over the whole of each recording.",
            fit.selection_rows
        ),
    };
    let errors = ["fitted", "held out"].map(|rows| format!("rms {rows} in {symbol}"));
    let head = ["structure".to_owned(), "parameters".to_owned()].into_iter().chain(errors).chain([String::new()]);
    let table = Table::of("", head, fit.selection.iter().map(row));
    Section::new("Law, kernel, gate, play").text(words).table(table)
}

fn comparison(assessment: &Assessment, recordings: &[Recording], unit: TorqueUnit) -> Section {
    let total: usize = recordings.iter().map(Recording::len).sum();
    let rows = if assessment.comparison_rows < total {
        format!(" {} rows were used, spread over the whole of each recording.", assessment.comparison_rows)
    } else {
        String::new()
    };
    Section::new("Comparison with other models")
        .figure(
            figures::comparison(&assessment.comparison, unit),
            format!("Every model is fitted to the same rows by the same estimator.{rows}"),
        )
        .table(comparison_table(&assessment.comparison, unit))
}

/// The comparison of models as a table.
pub fn comparison_table(lines: &[crate::fit::comparison::Comparison], unit: TorqueUnit) -> Table {
    let symbol = unit.symbol();
    let row = |(index, line): (usize, &crate::fit::comparison::Comparison)| {
        let errors = [Some(line.rms), Some(line.heldout_rms), line.unseen_recording_rms];
        let cells = [line.model.clone(), line.parameters.to_string()].into_iter();
        let cells = cells.chain(errors.into_iter().flatten().map(|rms| number(rms, 4)));
        let cost = line.instructions.map_or("–".to_owned(), |count| count.to_string());
        TableRow::new(cells.chain([cost])).chosen(index == 0)
    };
    let mut head = vec!["model".to_owned(), "parameters".to_owned()];
    head.extend(["fitted", "held out"].map(|rows| format!("rms {rows} in {symbol}")));
    // All lines have it, or none.
    if lines.iter().any(|line| line.unseen_recording_rms.is_some()) {
        head.push(format!("rms of unseen recordings in {symbol}"));
    }
    head.push("instructions a sample, Cortex-M4F, f32".to_owned());
    Table::of("", head, lines.iter().enumerate().map(row))
}

fn search(fit: &Fit) -> Section {
    let stop = match fit.stop {
        Stop::Exact => "nothing had to be searched: all parameters are linear and one factorisation gives the optimum",
        Stop::Converged => "further steps do not change the result",
        Stop::Evaluations => "the limit of evaluations was reached",
        Stop::Cancelled => "it was cancelled",
    };
    let method = match fit.method {
        Method::Auto => {
            "Linear parameters were eliminated exactly; the others were searched by a seeded particle swarm and refined."
        }
        Method::Pso => "The paper's particle swarm over all six parameters.",
    };
    Section::new("Search")
        .text(format!("{method} The search stopped because {stop}. {} passes over the recordings.", fit.evaluations))
}
