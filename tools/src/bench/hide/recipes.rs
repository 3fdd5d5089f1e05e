//! How an effect of each kind is drawn: everything but its size, from the seed and the experiment.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::draft::Draft;
use crate::bench::hide::measures::Measures;

/// The coordinates of `unknown`.
const COORDINATES: &[&str] = &[
    "deflection",
    "motor_angle",
    "output_angle",
    "output_velocity",
    "torque",
    "deflection_rate",
    "acceleration",
    "temperature",
    "time",
];

/// The shapes of a kind, none for most; `None` for what is no kind.
pub(super) fn shapes(kind: &str) -> Option<&'static [&'static str]> {
    Some(match kind {
        "soft_windup" => &["tanh", "rational", "gaussian", "piecewise"],
        "stiffness_asymmetry" => &["square", "abs"],
        "backlash" => &["clearance", "play"],
        "wear" => &["step", "ramp"],
        "position_dependent_friction" => &["motor", "output"],
        "unknown" => COORDINATES,
        "kinematic_error"
        | "torque_ripple"
        | "encoder_eccentricity"
        | "gravity_load"
        | "coulomb_friction"
        | "viscous_friction"
        | "stribeck_friction"
        | "load_dependent_friction"
        | "viscous_damping"
        | "inertia"
        | "nonlocal_memory"
        | "creep"
        | "time_skew"
        | "thermal_stiffness"
        | "thermal_zero_drift"
        | "thermal_friction"
        | "sensor_drift" => &[],
        _ => return None,
    })
}

/// Draws the effect; `None` for what is no kind. A shape that is given is not drawn.
pub(super) fn draw(kind: &str, shape: Option<&str>, measures: &Measures, random: &mut ChaCha8Rng) -> Option<Draft> {
    let known = shapes(kind)?;
    let shape = match shape {
        Some(shape) => shape,
        None if known.is_empty() => "",
        None => pick(known, random),
    };
    Some(match kind {
        "kinematic_error" => {
            let orders = [[1.0, 2.0], [2.0, 4.0], [2.0, 1.0]][random.random_range(0..3)];
            harmonics("kinematic_error", "rad", &orders, 1.0 / measures.stiffness(), random)
        }
        "torque_ripple" => {
            let known =
                [1.0, 2.0, 3.0, 4.0, 6.0, 7.0, 12.0].map(|k: f64| k.min(measures.highest_order().floor().max(1.0)));
            let first = pick(&known, random);
            harmonics("torque_ripple", "nm", &[first, if first > 1.0 { first - 1.0 } else { 2.0 }], 1.0, random)
        }
        "encoder_eccentricity" => {
            once("encoder_eccentricity", "cos_rad", "sin_rad", 1.0 / measures.stiffness(), random)
        }
        "gravity_load" => once("gravity_load", "cos_nm", "sin_nm", 1.0, random),
        "coulomb_friction" => smoothed(Draft::new("coulomb_friction").number("torque_nm", 1.0), measures, random),
        "viscous_friction" => Draft::new("viscous_friction").number("damping_nms_per_rad", 1.0 / measures.velocity),
        "stribeck_friction" => {
            let draft = Draft::new("stribeck_friction")
                .number("coulomb_nm", 0.6)
                .number("static_nm", random.random_range(1.0..1.4))
                .number("damping_nms_per_rad", random.random_range(0.2..0.6) / measures.velocity)
                .fixed("stribeck_velocity_rad_per_s", random.random_range(0.08..0.25) * measures.velocity)
                .fixed("exponent", random.random_range(0.7..2.0));
            smoothed(draft, measures, random)
        }
        "load_dependent_friction" => {
            smoothed(Draft::new("load_dependent_friction").number("mu", 1.0 / measures.torque_nm), measures, random)
        }
        "position_dependent_friction" => {
            let order = if shape == "motor" { pick(&[1.0, 2.0], random) } else { pick(&[1.0, 2.0, 3.0], random) };
            let draft = harmonics("position_dependent_friction", "nm", &[order], 1.0, random).text("angle", shape);
            smoothed(draft, measures, random)
        }
        "viscous_damping" => {
            Draft::new("viscous_damping").number("damping_nms_per_rad", 1.0 / measures.deflection_rate)
        }
        "inertia" => Draft::new("inertia").number("inertia_kgm2", 1.0 / measures.acceleration),
        "soft_windup" if shape == "piecewise" => {
            // A stiffness that falls below the catalogue's K3 by d up to T1 and by 0.4 d up to T2.
            let (k3, t1) = (measures.stiffness(), random.random_range(0.1..0.25) * measures.torque_nm);
            let drop = 1.0 / (0.4 * measures.deflection_rad);
            Draft::new("soft_windup")
                .text("shape", shape)
                .falling("k1_nm_per_rad", k3, drop)
                .falling("k2_nm_per_rad", k3, 0.4 * drop)
                .fixed("k3_nm_per_rad", k3)
                .fixed("t1_nm", t1)
                .fixed("t2_nm", t1 + random.random_range(0.2..0.45) * measures.torque_nm)
        }
        "soft_windup" => {
            let width = random.random_range(0.1..0.3) * measures.deflection_rad;
            Draft::new("soft_windup")
                .text("shape", shape)
                .number("stiffness_drop_nm_per_rad", 1.0 / width)
                .fixed("width_rad", width)
        }
        "stiffness_asymmetry" => {
            let (key, power) =
                if shape == "square" { ("stiffness_nm_per_rad2", 2) } else { ("stiffness_nm_per_rad", 1) };
            let per_nm = sign(random) / measures.deflection_rad.powi(power);
            Draft::new("stiffness_asymmetry").text("shape", shape).number(key, per_nm)
        }
        "backlash" => Draft::new("backlash").text("shape", shape).number("half_gap_rad", 1.0 / measures.stiffness()),
        "nonlocal_memory" => {
            // Three elements: one that slips early, one at half the stroke, one late.
            let bands = [(0.03, 0.12), (0.15, 0.4), (0.5, 0.9)];
            let radius = bands.map(|(low, high)| random.random_range(low..high) * measures.deflection_rad);
            let torque: Vec<f64> = radius.iter().map(|_| random.random_range(0.2..0.5)).collect();
            Draft::new("nonlocal_memory").list("torque_nm", torque).fixed_list("radius_rad", radius.to_vec())
        }
        "creep" => {
            let tau = random.random_range(0.02_f64..0.08) * measures.duration_s;
            let stiffness = vec![0.6 / measures.deflection_rad, 0.4 / measures.deflection_rad];
            Draft::new("creep").list("stiffness_nm_per_rad", stiffness).fixed_list("tau_s", vec![tau, 4.0 * tau])
        }
        "time_skew" => Draft::new("time_skew").number("delay_s", 1.0 / measures.torque_rate),
        "thermal_stiffness" => Draft::new("thermal_stiffness")
            .number("per_k", 1.0 / (measures.torque_nm * warming(measures)))
            .fixed("reference_c", measures.temperature_c.0),
        "thermal_zero_drift" => Draft::new("thermal_zero_drift")
            .number("nm_per_k", sign(random) / warming(measures))
            .fixed("reference_c", measures.temperature_c.0),
        "thermal_friction" => Draft::new("thermal_friction")
            .number("per_k", 1.0 / warming(measures))
            .fixed("reference_c", measures.temperature_c.0),
        "sensor_drift" => Draft::new("sensor_drift").number("nm_per_s", sign(random) / measures.duration_s),
        "wear" => {
            let start = random.random_range(0.3..0.6) * measures.duration_s;
            let length = if shape == "ramp" { random.random_range(0.15..0.4) * measures.duration_s } else { 0.0 };
            Draft::new("wear")
                .text("shape", shape)
                .number("stiffness_drop_nm_per_rad", 1.0 / measures.deflection_rad)
                .fixed("start_s", start)
                .fixed("duration_s", length)
        }
        "unknown" => unknown(shape, measures, random),
        _ => return None,
    })
}

/// Σ c_k cos(k q) + s_k sin(k q), the first order the largest, with random phases.
fn harmonics(kind: &'static str, unit: &str, orders: &[f64], per_nm: f64, random: &mut ChaCha8Rng) -> Draft {
    let (mut cos, mut sin) = (Vec::new(), Vec::new());
    for (at, _) in orders.iter().enumerate() {
        let size = per_nm * if at == 0 { 1.0 } else { random.random_range(0.15..0.4) };
        let phase = random.random_range(0.0..TAU);
        cos.push(size * phase.cos());
        sin.push(size * phase.sin());
    }
    let (cos_key, sin_key) = if unit == "rad" { ("cos_rad", "sin_rad") } else { ("cos_nm", "sin_nm") };
    Draft::new(kind).fixed_list("orders", orders.to_vec()).list(cos_key, cos).list(sin_key, sin)
}

/// One period a turn.
fn once(kind: &'static str, cos: &'static str, sin: &'static str, per_nm: f64, random: &mut ChaCha8Rng) -> Draft {
    let phase = random.random_range(0.0..TAU);
    Draft::new(kind).number(cos, per_nm * phase.cos()).number(sin, per_nm * phase.sin())
}

/// Friction that turns over within a few per cent of the fastest speed.
fn smoothed(draft: Draft, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
    draft.fixed("smoothing_rad_per_s", random.random_range(0.01..0.05) * measures.velocity)
}

/// A smooth random curve over the range of a coordinate.
fn unknown(coordinate: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
    const KNOTS: usize = 9;
    let about_zero = |largest: f64| (-largest, largest);
    let (low, high) = match coordinate {
        "motor_angle" => measures.motor_angle,
        "output_angle" => measures.output_angle,
        "output_velocity" => about_zero(measures.velocity),
        "torque" => about_zero(measures.torque_nm),
        "deflection_rate" => about_zero(measures.deflection_rate),
        "acceleration" => about_zero(measures.acceleration),
        "temperature" => measures.temperature_c,
        "time" => (0.0, measures.duration_s),
        _ => about_zero(measures.deflection_rad),
    };
    let knots = (0..KNOTS).map(|k| low + (high - low) * k as f64 / (KNOTS - 1) as f64).collect();
    let values = (0..KNOTS).map(|_| random.random_range(-1.0..1.0)).collect();
    Draft::new("unknown").text("coordinate", coordinate).fixed_list("knots", knots).list("values_nm", values)
}

fn warming(measures: &Measures) -> f64 {
    measures.temperature_c.1 - measures.temperature_c.0
}

fn sign(random: &mut ChaCha8Rng) -> f64 {
    if random.random() { 1.0 } else { -1.0 }
}

fn pick<T: Copy>(from: &[T], random: &mut ChaCha8Rng) -> T {
    from[random.random_range(0..from.len())]
}
