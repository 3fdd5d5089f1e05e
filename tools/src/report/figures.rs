//! The figures that the commands write: which curves, in which units.

use super::plot::{Bars, Curve, Figure, Role};
use crate::estimate::rivals::Comparison;
use crate::recording::TorqueUnit;

const MRAD: f64 = 1e3;
const DEFLECTION: &str = "torsional deflection θ in mrad";

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
) -> String {
    let mut curves = vec![Curve::new("recording", Role::Measured, deflection_rad, MRAD, measured)];
    curves.extend(models.iter().map(|(label, role, torque)| Curve::new(*label, *role, deflection_rad, MRAD, torque)));
    Figure { title: title.into(), x_label: DEFLECTION.into(), y_label: torque_axis("torque T", unit), curves }.to_svg()
}

/// The two parts of the torque against deflection: elastic f and hysteresis z.
pub fn decomposition(
    title: &str,
    deflection_rad: &[f64],
    elastic: &[f64],
    hysteresis: &[f64],
    unit: TorqueUnit,
) -> String {
    let curves = vec![
        Curve::new("elastic torque f", Role::Third, deflection_rad, MRAD, elastic),
        Curve::new("hysteresis torque z", Role::Second, deflection_rad, MRAD, hysteresis),
    ];
    Figure { title: title.into(), x_label: DEFLECTION.into(), y_label: torque_axis("torque", unit), curves }.to_svg()
}

/// What each model leaves of the measured torque, against deflection. The last model's dots lie on top.
pub fn residual(
    title: &str,
    deflection_rad: &[f64],
    measured: &[f64],
    models: &[(&str, Role, &[f64])],
    unit: TorqueUnit,
) -> String {
    let curves = models
        .iter()
        .map(|(label, role, torque)| {
            let left: Vec<f64> = measured.iter().zip(*torque).map(|(a, b)| a - b).collect();
            Curve::new(*label, *role, deflection_rad, MRAD, &left)
        })
        .collect();
    let y_label = torque_axis("recording minus model", unit);
    Figure { title: title.into(), x_label: DEFLECTION.into(), y_label, curves }.to_svg()
}

/// What each model leaves in blocks held out.
pub fn comparison(lines: &[Comparison], unit: TorqueUnit) -> String {
    Bars {
        title: "What each model leaves of the torque".into(),
        x_label: torque_axis("rms error in blocks held out,", unit),
        bars: lines.iter().map(|line| (line.model.clone(), line.heldout_rms)).collect(),
    }
    .to_svg()
}
