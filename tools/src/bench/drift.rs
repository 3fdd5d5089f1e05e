//! A gear that warms: its coefficients go from those of the model to others, in proportion to time.

use super::error::BenchError;
use super::joint::gear::{JointGear, Plant};
use super::stage::Stage;
use crate::kinds::coulomb_friction;
use crate::model::Model;
use crate::progress::Progress;
use crate::recording::Recording;

/// Stiffness at the end, over that of the model.
const STIFFNESS: f64 = 0.9;
/// Hysteresis at the end, over that of the model.
const HYSTERESIS: f64 = 1.2;
/// Coulomb friction at start and end, of the rated torque: the model does not know it.
const FRICTION: [f64; 2] = [0.002, 0.001];
/// Speed over which friction reverses, rated deflections a second.
const SMOOTHING_PER_S: f64 = 0.1;
/// Standard deviation of the torque's noise, of the rated torque.
pub(super) const NOISE: f64 = 0.01;

/// The recording of perfect sensors, and the model of the gear at its end.
///
/// Given the deflection, the torque is linear in the coefficients: with T_0 that of the cold gear and T_1 that of the warm one, both by the core, T = T_0 + (T_1 − T_0)·t/t_end.
/// Another plant warms in the same way: the middle between its branches is the stiffness, the rest the hysteresis. The model at the end then holds the friction alone of it.
pub(super) fn record(
    stage: &Stage,
    model: &Model,
    plant: Plant,
    progress: &dyn Progress,
) -> Result<(Recording, Model), BenchError> {
    let (rated_nm, rated_rad) = (stage.params.rated_torque_nm(), stage.params.rated_deflection_rad());
    let with_friction = |model: &Model, share: f64| {
        let mut model = model.clone();
        model.terms.push(coulomb_friction(share * rated_nm, SMOOTHING_PER_S * rated_rad));
        model
    };
    let mut warm = model.clone();
    if let Some(elastic) = &mut warm.elastic {
        elastic.c1_nm_per_rad *= STIFFNESS;
        elastic.c2_nm_per_rad3 *= STIFFNESS;
        elastic.c3_nm_per_rad5 *= STIFFNESS;
    }
    if let Some(memory) = &mut warm.memory {
        memory.alpha *= HYSTERESIS;
    }
    let without_friction = warm.clone();
    let warm = with_friction(&warm, FRICTION[1]);
    let mut recording = stage.record_under(&with_friction(model, FRICTION[0]), progress)?;
    let mut last = stage.record(&warm)?;
    if plant != Plant::Model {
        let [cold_nm, warm_nm] = torques(stage, plant, model.gear.deflection_zero_rad, &recording);
        exchange(&mut recording, &stage.record(model)?, &cold_nm);
        exchange(&mut last, &stage.record(&without_friction)?, &warm_nm);
    }
    let end_s = recording.time_s.last().copied().unwrap_or(1.0);
    if let (Some(cold), Some(warm)) = (&mut recording.torque, &last.torque) {
        for ((torque, warm), time_s) in cold.iter_mut().zip(warm).zip(&recording.time_s) {
            *torque += (warm - *torque) * time_s / end_s;
        }
    }
    Ok((recording, warm))
}

/// The torques of another plant along a recording's deflections, cold and warm.
fn torques(stage: &Stage, plant: Plant, zero_rad: f64, recording: &Recording) -> [Vec<f64>; 2] {
    let period_s = recording.time_s.get(1).map_or(1.0, |second| second - recording.time_s[0]);
    let mut gear = JointGear::of(plant, &stage.params, period_s);
    let mut middle = gear.clone().middle(stage.params.rated_deflection_rad());
    let deflections = recording.deflection_rad.iter().flatten();
    deflections
        .map(|theta| {
            let (torque, middle) = (gear.step(theta - zero_rad), middle.step(theta - zero_rad));
            (torque, STIFFNESS * middle + HYSTERESIS * (torque - middle))
        })
        .unzip::<_, _, Vec<f64>, Vec<f64>>()
        .into()
}

/// Takes the torques of a model off a recording and adds those of another gear.
fn exchange(recording: &mut Recording, model: &Recording, other: &[f64]) {
    let (Some(torque), Some(of_model)) = (&mut recording.torque, &model.torque) else { return };
    for ((torque, of_model), other) in torque.iter_mut().zip(of_model).zip(other) {
        *torque += other - of_model;
    }
}
