//! What a diagnosis draws: recording and models over a coordinate, what is left along it, over time, and over two coordinates.

use super::words;
use crate::diagnose::Finding;
use crate::diagnose::report_data::ReportData;
use crate::recording::{Recording, TorqueUnit};
use crate::report::bins::{binned, drawn_range};
use crate::report::plot::{Curve, Drawing, Figure, HeatMap, Role, Side, Style};
use crate::report::{capitalised, figures};

/// A coordinate of every row with its label; angles within a turn.
pub(super) fn along<'s>(
    report_data: &'s ReportData,
    coordinate: &str,
) -> Option<(std::borrow::Cow<'s, [f64]>, &'static str)> {
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
pub(super) fn axis(coordinate: &str) -> &str {
    match coordinate {
        "reversal" | "amplitude" => "deflection",
        own => own,
    }
}

/// What is left along a coordinate, before and after.
pub(super) fn before_and_after(finding: &Finding, coordinate: &str, unit: TorqueUnit) -> Option<Drawing> {
    let (x, label) = along(&finding.report_data, coordinate)?;
    let verdict = &finding.verdict;
    let curve = |name: &str, role, residual: &[f64]| {
        let (points, error) = binned(&x, residual);
        let phase = figures::phase_of(if finding.diagnosis.mismatch { 2 } else { 1 })(role);
        Curve { error, phase, ..Curve::through(name, role, Style::Dots, points) }
    };
    let mut curves = vec![curve("base model refitted", Role::Second, &verdict.base.residual)];
    if finding.diagnosis.mismatch {
        curves.push(curve("with the effects found", Role::Model, &verdict.extended.residual));
    }
    let title = format!("Residual along the {}", words(coordinate));
    let y_label = format!("mean of recording minus model in {}", unit.symbol());
    Some(Figure::of(title, label, y_label, curves).draw())
}

/// A line of rows, broken between recordings.
fn recordings_apart(report_data: &ReportData, line: &[f64]) -> Vec<f64> {
    let ends = report_data.first_rows.iter().skip(1).copied().chain([line.len()]);
    let spans = report_data.first_rows.iter().copied().zip(ends);
    spans.flat_map(|(from, to)| line[from..to].iter().copied().chain([f64::NAN])).collect()
}

pub(super) fn torques(finding: &Finding, recordings: &[Recording], unit: TorqueUnit, of: &str) -> Vec<Drawing> {
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
            model("with the effects found", Role::Model, &extended);
        }
        // Angles within a turn jump: a line would cross the figure.
        if coordinate.ends_with("angle") {
            curves = curves.into_iter().map(|curve| curve.styled(Style::Dots)).collect();
        }
        let title = capitalised(&format!("{of}{} over {}", unit.quantity(), words(coordinate)));
        let y_label = format!("{} in {}", unit.quantity(), unit.symbol());
        Some(Figure::of(title, label, y_label, curves).by_row().draw())
    };
    let deflection = finding.report_data.coordinates.deflection.as_deref();
    let seen = finding.diagnosis.locations.first().map_or("", |place| place.coordinate.as_str());
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

pub(super) fn residual_over_time(finding: &Finding, unit: TorqueUnit) -> Drawing {
    let found = &finding.diagnosis;
    let seconds: Vec<(f64, f64)> =
        found.locations.first().map(|p| p.seconds.iter().map(|[a, b]| (*a, *b)).collect()).unwrap_or_default();
    let verdict = &finding.verdict;
    let apart = |line: &[f64]| recordings_apart(&finding.report_data, line);
    let (base, extended) = (apart(&verdict.base.residual), apart(&verdict.extended.residual));
    let mut over_time = vec![("base model refitted", Role::Second, &base[..])];
    if found.mismatch {
        over_time.push(("with the effects found", Role::Model, &extended[..]));
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

/// Cells of a heat map along each side.
const CELLS: (usize, usize) = (48, 24);

pub(super) fn heat(finding: &Finding, horizontal: &str, vertical: &str, unit: TorqueUnit) -> Option<Drawing> {
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
