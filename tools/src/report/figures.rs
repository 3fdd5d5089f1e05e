//! The figures that the commands show: which curves, in which units.

use super::plot::{Bars, Curve, Drawing, Figure, HeatMap, Level, Phase, Role, Side, Style};
use crate::fit::comparison::Comparison;
use crate::fit::coverage::{Coverage, JointCoverage};
use crate::recording::TorqueUnit;

const MRAD: f64 = 1e3;
const DEFLECTION: &str = "torsional deflection θ in mrad";

/// The coordinate that torques are drawn over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Abscissa {
    /// Label with the unit.
    pub label: &'static str,
    /// Units of the axis in a unit of the data.
    pub scale: f64,
    /// Short name.
    pub symbol: &'static str,
}

impl Abscissa {
    /// Torsional deflection, rad in the data.
    pub const DEFLECTION: Self = Self { label: DEFLECTION, scale: MRAD, symbol: "θ" };
    /// Output angle of a joint log.
    pub const OUTPUT_ANGLE: Self = Self { label: "output angle in rad", scale: 1.0, symbol: "angle" };
}

fn torque_axis(what: &str, unit: TorqueUnit) -> String {
    format!("{what} in {}", unit.symbol())
}

/// The hysteresis loop: torque against deflection, measured and by each model.
pub fn hysteresis_loop(
    title: &str,
    deflection_rad: &[f64],
    measured: &[f64],
    models: &[(&str, Role, &[f64])],
    unit: TorqueUnit,
) -> Drawing {
    torque_over(Abscissa::DEFLECTION, title, deflection_rad, measured, models, unit)
}

/// Torque over a coordinate, measured and by each model.
pub fn torque_over(
    over: Abscissa,
    title: &str,
    at: &[f64],
    measured: &[f64],
    models: &[(&str, Role, &[f64])],
    unit: TorqueUnit,
) -> Drawing {
    let mut curves = vec![Curve::new("recording", Role::Measured, at, over.scale, measured)];
    curves.extend(models.iter().map(|(label, role, torque)| Curve::new(*label, *role, at, over.scale, torque)));
    let what = if unit == TorqueUnit::Ampere { unit.quantity() } else { "torque T" };
    Figure::of(title, over.label, torque_axis(what, unit), curves).by_row().draw()
}

/// The two parts of the torque against deflection: elastic f and hysteresis z.
pub fn decomposition(
    title: &str,
    deflection_rad: &[f64],
    elastic: &[f64],
    hysteresis: &[f64],
    unit: TorqueUnit,
) -> Drawing {
    let curves = [
        Curve::new("elastic torque f", Role::Third, deflection_rad, MRAD, elastic),
        Curve::new("hysteresis torque z", Role::Second, deflection_rad, MRAD, hysteresis),
    ];
    Figure::of(title, DEFLECTION, torque_axis(unit.quantity(), unit), curves).by_row().draw()
}

/// What each model leaves of the measured torque, against deflection. The last model's dots lie on top.
pub fn residual(
    title: &str,
    deflection_rad: &[f64],
    measured: &[f64],
    models: &[(&str, Role, &[f64])],
    unit: TorqueUnit,
) -> Drawing {
    let curves = models.iter().map(|(label, role, torque)| {
        let residual: Vec<f64> = measured.iter().zip(*torque).map(|(a, b)| a - b).collect();
        Curve::new(*label, *role, deflection_rad, MRAD, &residual)
    });
    Figure::of(title, DEFLECTION, torque_axis("recording minus model", unit), curves).draw()
}

/// A residual over a coordinate, apart for rising and falling: structure shows where the clouds part.
pub fn residual_by_direction(title: &str, over: Abscissa, at: &[f64], residual: &[f64], unit: TorqueUnit) -> Drawing {
    let mut curves = [("rising", Role::Model), ("falling", Role::Second)].map(|(label, role)| {
        Curve::new(format!("{} {label}", over.symbol), role, &[], over.scale, &[]).styled(Style::Dots)
    });
    let mut rising = true;
    for (row, (x, residual)) in at.iter().zip(residual).enumerate() {
        let before = at[row.saturating_sub(1)];
        // Nothing comes before the first row of a recording.
        rising = if *x == before || before.is_nan() { rising } else { *x > before };
        let x = x * over.scale;
        let [up, down] = if rising { [*residual, f64::NAN] } else { [f64::NAN, *residual] };
        curves[0].points.push((x, up));
        curves[1].points.push((x, down));
    }
    Figure::of(title, over.label, torque_axis("recording minus model", unit), curves).by_row().draw()
}

/// Of several curves, which shows the base model and which the extended one.
pub fn phase_of(curves: usize) -> impl Fn(Role) -> Option<Phase> {
    move |role| match role {
        _ if curves < 2 => None,
        Role::Second => Some(Phase::Before),
        Role::Model => Some(Phase::After),
        _ => None,
    }
}

/// One or several residuals against time, seconds that stand out shaded. The last lies on top.
pub fn residual_over_time(
    title: &str,
    time_s: &[f64],
    residuals: &[(&str, Role, &[f64])],
    seconds: &[(f64, f64)],
    unit: TorqueUnit,
) -> Drawing {
    let phase = phase_of(residuals.len());
    let curve = |(label, role, residual): &(&str, Role, &[f64])| {
        Curve::new(*label, *role, time_s, 1.0, residual).styled(Style::Line).in_phase(phase(*role))
    };
    let figure =
        Figure::of(title, "time in s", torque_axis("recording minus model", unit), residuals.iter().map(curve));
    Figure { shaded: seconds.iter().map(|(from, to)| *from..*to).collect(), ..figure.by_row() }.draw()
}

/// Parts of a torque against time.
pub fn parts_over_time(title: &str, time_s: &[f64], parts: &[(&str, Role, &[f64])], unit: TorqueUnit) -> Drawing {
    let curve = |(label, role, torque): &(&str, Role, &[f64])| Curve::new(*label, *role, time_s, 1.0, torque);
    Figure::of(title, "time in s", torque_axis(unit.quantity(), unit), parts.iter().map(curve)).by_row().draw()
}

/// Lines of a spectrum, with the level that noise stays under.
pub fn spectrum(
    title: &str,
    x_label: &str,
    y_label: &str,
    lines: &[(f64, f64)],
    noise: Option<f64>,
    prominent: &[(f64, f64)],
) -> Drawing {
    let stems = |label, role, points: &[(f64, f64)]| Curve::through(label, role, Style::Stems, points.to_vec());
    let mut curves = vec![stems(if prominent.is_empty() { "" } else { "spectrum" }, Role::Measured, lines)];
    if !prominent.is_empty() {
        curves.push(stems("above the noise", Role::Second, prominent));
    }
    let levels = noise.map(|height| Level { label: "noise".into(), height }).into_iter().collect();
    Figure { levels, ..Figure::of(title, x_label, y_label, curves) }.draw()
}

/// Where in deflection and rate the rows of the recordings lie.
pub fn coverage(coverage: &Coverage) -> Drawing {
    let (a, fastest) = (coverage.rated_deflection_rad * MRAD, coverage.rate_rad_per_s.1 * MRAD);
    exercised(&coverage.cells, (DEFLECTION, -a, a), ("deflection rate in mrad/s", fastest))
}

/// Where in output angle and velocity the rows of joint logs lie.
pub fn joint_coverage(coverage: &JointCoverage) -> Drawing {
    let ((low, high), (back, forth)) = (coverage.angle_rad, coverage.velocity_rad_per_s);
    let angle = (Abscissa::OUTPUT_ANGLE.label, low, high);
    exercised(&coverage.cells, angle, ("output velocity in rad/s", forth.max(-back)))
}

fn exercised(cells: &[Vec<usize>], x: (&str, f64, f64), y: (&str, f64)) -> Drawing {
    let rows = cells.iter().flatten().sum::<usize>().max(1) as f64;
    // A square root brings out what was visited seldom.
    let share = |count: &usize| 10.0 * (*count as f64 / rows).sqrt();
    HeatMap {
        title: "Range of the recordings".into(),
        legend: "square root of the share of rows in %".into(),
        x: Side::Numbers { label: x.0.into(), from: x.1, to: x.2 },
        y: Side::Numbers { label: y.0.into(), from: -y.1, to: y.1 },
        values: cells.iter().map(|row| row.iter().map(share).collect()).collect(),
        limit: None,
        numbers: false,
    }
    .draw()
}

/// A matrix of correlations.
pub fn correlation<N: AsRef<str>>(names: &[N], matrix: &[Vec<f64>]) -> Drawing {
    let names: Vec<String> = names.iter().map(|name| symbol(name.as_ref()).to_owned()).collect();
    HeatMap {
        title: "Correlation of the parameters".into(),
        legend: "correlation of the estimates".into(),
        x: Side::Names(names.clone()),
        y: Side::Names(names),
        values: matrix.to_vec(),
        limit: Some(1.0),
        numbers: matrix.len() <= 12,
    }
    .draw()
}

/// One number at several recordings, fits or dates, with intervals of ± two standard deviations.
pub fn trend(title: &str, x: &TrendAxis, y_label: &str, points: &[(f64, Option<f64>)], line: &[(f64, f64)]) -> Drawing {
    let at = |k: usize| x.values.as_ref().map_or(k as f64, |values| values[k]);
    let values: Vec<(f64, f64)> = points.iter().enumerate().map(|(k, p)| (at(k), p.0)).collect();
    let regression = (!line.is_empty()).then(|| Curve::through("regression", Role::Second, Style::Line, line.to_vec()));
    let dots = Curve {
        error: points.iter().map(|p| p.1.map_or(f64::NAN, |sd| 2.0 * sd)).collect(),
        ..Curve::through("estimate ± 2 standard deviations", Role::Model, Style::Dots, values)
    };
    Figure {
        x_names: if x.values.is_some() { Vec::new() } else { x.names.clone() },
        ..Figure::of(title, &x.label, y_label, regression.into_iter().chain([dots]))
    }
    .draw()
}

/// The horizontal axis of a trend.
#[derive(Debug, Clone, PartialEq)]
pub struct TrendAxis {
    /// Label with the unit.
    pub label: String,
    /// Name of each point.
    pub names: Vec<String>,
    /// Place of each point; in order where absent.
    pub values: Option<Vec<f64>>,
}

/// What each model leaves in blocks held out.
pub fn comparison(lines: &[Comparison], unit: TorqueUnit) -> Drawing {
    Bars {
        title: "Torque error of each model".into(),
        x_label: torque_axis("rms error in blocks held out,", unit),
        bars: lines.iter().map(|line| (line.model.clone(), line.heldout_rms)).collect(),
    }
    .draw()
}

/// The symbol of a parameter of a model file.
pub fn symbol(name: &str) -> &str {
    match name {
        "alpha" => "α",
        "beta_per_s" => "β",
        "omega_per_s" => "ω",
        "rho" => "ρ",
        "deflection_zero_rad" => "θ₀",
        "reversal_play_rad" => "play",
        "gravity_load.cos_nm" | "gravity_load.cos_a" => "G cos",
        "gravity_load.sin_nm" | "gravity_load.sin_a" => "G sin",
        "inertia.inertia_kgm2" => "J",
        "coulomb_friction.torque_nm" | "coulomb_friction.torque_a" => "F_c",
        "coulomb_friction.smoothing_rad_per_s" => "v_s",
        "viscous_friction.damping_nms_per_rad" | "viscous_friction.damping_as_per_rad" => "B",
        _ if name.starts_with("c1_") || name.starts_with("c2_") || name.starts_with("c3_") => &name[..2],
        _ => name,
    }
}
