//! The mechanics: motor, gear and load machine without any fault of measurement.

use gmhm::{Gear, Params, State};

use super::BenchError;
use super::plan::{Drive, Plan};
use crate::physics::CAPACITY;

/// The deflections of a gear that starts from rest at θ = 0 and is driven through the plan, rad.
pub(super) fn deflections(params: &Params, plan: &Plan) -> Result<Vec<f64>, BenchError> {
    match &plan.drive {
        Drive::Deflection(deflection) => Ok(deflection.clone()),
        Drive::Load(load) => {
            let gear = Gear::<f64>::new(params);
            let mut state = gear.start::<CAPACITY>(0.0);
            let mut time_s = 0.0;
            let mut rows = plan.time_s.iter().zip(load);
            rows.try_fold(Vec::with_capacity(load.len()), |mut deflection, (&t, &load_nm)| {
                let theta = under_load(params, &gear, &state, load_nm, t - time_s)
                    .ok_or(BenchError::LoadNotReached { time_s: t, load_nm })?;
                gear.step_after(&mut state, theta, t - time_s);
                time_s = t;
                deflection.push(theta);
                Ok(deflection)
            })
        }
    }
}

/// The deflection nearest to the present one at which the gear, `period_s` later, carries the load. `None` where there is none within ±A.
///
/// A bracket that doubles, then false position (Illinois), until the torque is met within 1e-12 of the rated torque.
pub(in crate::bench) fn under_load(
    params: &Params,
    gear: &Gear<f64>,
    state: &State<f64, CAPACITY>,
    load_nm: f64,
    period_s: f64,
) -> Option<f64> {
    let excess = |theta: f64| {
        let mut state = state.clone();
        gear.step_after(&mut state, theta, period_s).torque - load_nm
    };
    let (rated_rad, scale_nm) = (params.rated_deflection_rad(), params.torque_scale_nm());
    let tolerance_nm = 1e-12 * scale_nm;
    let mut near = (state.theta(), excess(state.theta()));
    if near.1.abs() <= tolerance_nm {
        return Some(near.0);
    }
    let direction = -near.1.signum();
    let mut step = near.1.abs() * rated_rad / scale_nm;
    let mut far = near;
    while far.1 * near.1 > 0.0 {
        if direction * far.0 >= rated_rad {
            return (far.1.abs() <= 1e-9 * scale_nm).then_some(far.0);
        }
        near = far;
        let theta = (far.0 + direction * step).clamp(-rated_rad, rated_rad);
        far = (theta, excess(theta));
        step *= 2.0;
    }
    for _ in 0..200 {
        let theta = far.0 - far.1 * (far.0 - near.0) / (far.1 - near.1);
        let here = (theta, excess(theta));
        if here.1.abs() <= tolerance_nm || theta == far.0 || theta == near.0 {
            return Some(theta);
        }
        if here.1 * far.1 < 0.0 {
            near = far;
        } else {
            near.1 *= 0.5;
        }
        far = here;
    }
    Some(far.0)
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
