//! The mechanics: motor, gear and load machine without any fault of measurement.

use gmhm::terms::compensated::CompensatedState;
use gmhm::terms::{Compensated, Domain, Sample};
use gmhm::{Gear, Params};

use super::error::BenchError;
use super::plan::{Drive, Plan};
use crate::model::Model;
use crate::physics::invert::crossing;
use crate::physics::term::{MOST_TERMS, no_terms};
use crate::physics::{CAPACITY, predict};
use crate::progress::{Progress, at_row};

/// The deflections that the encoders of a gear show when it is driven through the plan from rest, rad, the encoders' zero taken off.
///
/// Under a prescribed load the deflection is the one at which the gear carries the load, with whatever stands between the gear's deflection and the encoders' (kinematic
/// error, eccentricity, backlash). A prescribed deflection is the encoders'.
pub(super) fn deflections(
    model: &Model,
    params: &Params,
    plan: &Plan,
    input_rad: &[f64],
    progress: &dyn Progress,
) -> Result<Vec<f64>, BenchError> {
    let load = match &plan.drive {
        Drive::Deflection(deflection) => return Ok(deflection.clone()),
        Drive::Load(load) => load,
    };
    let mut stack = no_terms(model, Some(params.rated_deflection_rad()));
    for term in &model.terms {
        if term.info().is_some_and(|info| info.domain == Domain::Deflection) {
            predict::add(&mut stack, term)?;
        }
    }
    let ratio = model.gear.ratio.unwrap_or(0.0);
    let input_rate = rate(input_rad, &plan.time_s);
    let sample = |row: usize, theta: f64| Sample {
        time: plan.time_s[row],
        period: plan.time_s[row] - plan.time_s[row.saturating_sub(1)],
        motor_angle: ratio * input_rad[row],
        output_angle: input_rad[row] - theta - model.gear.deflection_zero_rad,
        deflection: theta,
        motor_velocity: ratio * input_rate[row],
        // Of the input, which the output follows but for its deflection: the torque is predicted along what is recorded.
        output_velocity: input_rate[row],
        ..Sample::default()
    };
    // Beyond ±A on the encoders the gear may still be within.
    let reach_rad = if stack.terms().is_empty() { 1.0 } else { 2.0 } * params.rated_deflection_rad();
    let scale_nm = params.torque_scale_nm();
    let gear = Compensated { gear: Gear::new(params), stack };
    let unreached = |row: usize| BenchError::LoadNotReached { time_s: plan.time_s[row], load_nm: load[row] };
    let at_start = |theta: f64| -> CompensatedState<f64, CAPACITY, _, MOST_TERMS> { gear.start(&sample(0, theta)) };
    let excess = |theta: f64| at_start(theta).last().base.torque - load[0];
    let mut theta = crossing(excess, 0.0, reach_rad, scale_nm).ok_or_else(|| unreached(0))?;
    let mut state = at_start(theta);
    let mut deflection = vec![theta];
    for (row, load_nm) in load.iter().enumerate().skip(1) {
        at_row(progress, "Simulating", row, load.len());
        let excess = |theta: f64| gear.step(&mut state.clone(), &sample(row, theta)).base.torque - load_nm;
        theta = crossing(excess, theta, reach_rad, scale_nm).ok_or_else(|| unreached(row))?;
        gear.step(&mut state, &sample(row, theta));
        deflection.push(theta);
    }
    Ok(deflection)
}

/// The derivative of samples by time: central differences, one-sided at the ends.
pub(super) fn rate(values: &[f64], time_s: &[f64]) -> Vec<f64> {
    let last = values.len() - 1;
    (0..=last)
        .map(|k| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
            (values[b] - values[a]) / (time_s[b] - time_s[a])
        })
        .collect()
}

/// A warm-up by `rise_k` over the recording, with half its length as time constant: a temperature that is no straight line in time. °C.
pub(super) fn temperatures(rise_k: f64, time_s: &[f64]) -> Vec<f64> {
    const ROOM_C: f64 = 22.0;
    let end_s = time_s.last().copied().unwrap_or(0.0);
    let risen = |t: f64| -f64::exp_m1(-2.0 * t / end_s);
    time_s.iter().map(|&t| ROOM_C + rise_k * risen(t) / risen(end_s)).collect()
}
