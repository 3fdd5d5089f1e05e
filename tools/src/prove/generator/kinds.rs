//! Every kind of MODEL.md section 7 and of the open world: how one is drawn, and which columns could stand in for it.

use std::collections::BTreeMap;

use super::motion::{MotionKind, Plan, Warmth};
use super::physics::{Angle, Knee, Outside, Piece, Sign, World};
use crate::diagnose::diagnosis::ParameterValue;
use crate::prove::generator::rng::Rng;

/// The kinds of MODEL.md section 7, `unknown` apart.
pub const KINDS: [&str; 22] = [
    "kinematic_error",
    "torque_ripple",
    "encoder_eccentricity",
    "gravity_load",
    "coulomb_friction",
    "viscous_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "position_dependent_friction",
    "viscous_damping",
    "inertia",
    "soft_windup",
    "stiffness_asymmetry",
    "backlash",
    "nonlocal_memory",
    "creep",
    "time_skew",
    "thermal_stiffness",
    "thermal_zero_drift",
    "thermal_friction",
    "sensor_drift",
    "wear",
];

/// Physics of no list: kinds of the open world.
pub const OUTSIDE: [&str; 8] =
    ["loaded_ripple", "dead_spot", "one_sided_loop", "cubic_drift", "notch", "burst", "detent", "jerky"];

/// A hidden effect: pieces with relative weights, scaled together until it leaves the size asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Hidden {
    /// Its kind.
    pub kind: String,
    /// Its shape, in the generator's words.
    pub shape: String,
    /// The shape is the one that model files describe: its parameters can be compared.
    pub library_shape: bool,
    /// What it is made of.
    pub pieces: Vec<(Piece, f64)>,
}

/// Columns that a kind could explain something with.
#[derive(Debug, Clone, PartialEq)]
pub struct Family {
    /// Its kind.
    pub kind: &'static str,
    /// The columns, their weights free.
    pub pieces: Vec<Piece>,
    /// Shape parameters tuned besides.
    pub tuned: usize,
    /// The weight must be positive to be this kind.
    pub positive: bool,
}

/// The kinds that the equation of `kind` holds as parts.
pub fn parts(kind: &str) -> &'static [&'static str] {
    match kind {
        "stribeck_friction" => &["coulomb_friction", "viscous_friction"],
        "presliding_friction" => &["coulomb_friction"],
        _ => &[],
    }
}

/// Kinds of friction.
pub const FRICTION: [&str; 6] = [
    "coulomb_friction",
    "viscous_friction",
    "stribeck_friction",
    "presliding_friction",
    "load_dependent_friction",
    "position_dependent_friction",
];

/// [`coordinates`] as a key holds them.
pub fn coordinate_names(kind: &str) -> Vec<String> {
    coordinates(kind).iter().map(|name| (*name).to_owned()).collect()
}

/// The coordinates of MODEL.md section 7 in which `kind` shows.
pub fn coordinates(kind: &str) -> &'static [&'static str] {
    match kind {
        "kinematic_error" | "torque_ripple" | "loaded_ripple" => &["motor_angle"],
        "notch" => &["motor_angle", "output_velocity", "frequency"],
        "encoder_eccentricity" | "gravity_load" | "dead_spot" => &["output_angle"],
        "coulomb_friction" | "viscous_friction" | "stribeck_friction" => &["output_velocity"],
        "presliding_friction" => &["reversal", "output_velocity"],
        "torque_scale" => &["torque"],
        "load_dependent_memory" => &["reversal", "torque", "deflection", "deflection_rate", "amplitude"],
        "thermal_friction" => &["temperature", "output_velocity"],
        "load_dependent_friction" => &["torque", "output_velocity"],
        "position_dependent_friction" => &["motor_angle", "output_angle", "output_velocity"],
        "viscous_damping" => &["deflection_rate"],
        "inertia" => &["acceleration"],
        "jerky" => &["acceleration", "output_velocity"],
        "soft_windup" | "stiffness_asymmetry" | "detent" => &["deflection", "torque"],
        "backlash" => &["deflection", "reversal", "deflection_rate"],
        "nonlocal_memory" | "one_sided_loop" => &["reversal", "deflection", "deflection_rate", "amplitude"],
        "creep" => &["reversal", "time", "deflection"],
        "time_skew" => &["torque_rate", "deflection_rate"],
        "thermal_stiffness" | "thermal_zero_drift" => &["temperature"],
        "sensor_drift" | "wear" | "cubic_drift" => &["time"],
        "burst" => &["time", "frequency"],
        _ => &[],
    }
}

/// Is a joint log able to hold `kind` beside its base (gravity, inertia, Coulomb and viscous friction)?
pub fn fits_a_joint(kind: &str) -> bool {
    matches!(
        kind,
        "torque_ripple"
            | "stribeck_friction"
            | "presliding_friction"
            | "load_dependent_friction"
            | "position_dependent_friction"
            | "thermal_zero_drift"
            | "thermal_friction"
            | "sensor_drift"
            | "notch"
            | "cubic_drift"
            | "burst"
            | "jerky"
    )
}

/// Experiments that show `kind`.
pub fn motions(kind: &str) -> &'static [MotionKind] {
    use MotionKind::{BandLimited, LockedCycles, Running, RunningBandLimited};
    match kind {
        "kinematic_error"
        | "torque_ripple"
        | "encoder_eccentricity"
        | "gravity_load"
        | "loaded_ripple"
        | "dead_spot"
        | "notch"
        | "position_dependent_friction"
        | "thermal_friction" => &[Running, RunningBandLimited],
        "coulomb_friction" | "stribeck_friction" | "load_dependent_friction" | "viscous_friction" | "jerky" => {
            &[Running, LockedCycles]
        }
        "viscous_damping" | "time_skew" | "inertia" => &[LockedCycles, BandLimited, Running],
        "creep" | "nonlocal_memory" | "backlash" | "soft_windup" => &[LockedCycles, BandLimited],
        _ => &[LockedCycles, Running, BandLimited],
    }
}

/// Does `kind` act over seconds and more, so that a recording must be long?
pub fn slow(kind: &str) -> bool {
    kind.starts_with("thermal")
        || matches!(
            kind,
            "creep" | "sensor_drift" | "wear" | "cubic_drift" | "gravity_load" | "encoder_eccentricity" | "dead_spot"
        )
}

/// Lets the temperature move where `kind` needs it to, and the motion be one that shows it.
pub fn prepare(kind: &str, rng: &mut Rng, plan: &mut Plan) {
    if kind.starts_with("thermal") {
        plan.warmth = if rng.chance(0.5) {
            Warmth::WarmUp { rise: rng.uniform(6.0, 15.0), tau_s: rng.uniform(8.0, 30.0) }
        } else {
            Warmth::Swing { rise: rng.uniform(3.0, 8.0), period_s: rng.uniform(15.0, 40.0) }
        };
    }
    if kind.contains("friction") {
        plan.reversal_s = rng.uniform(2.5, 7.0);
    }
    if matches!(kind, "inertia" | "jerky") {
        // The acceleration in a corner has no end: what samples show of it is only how differences are taken.
        plan.triangular = false;
    }
}

fn wave(pieces: &mut Vec<(Piece, f64)>, rng: &mut Rng, orders: &[f64], make: impl Fn(f64, bool) -> Piece) {
    for (i, &order) in orders.iter().enumerate() {
        let (a, phase) = (if i == 0 { 1.0 } else { rng.uniform(0.2, 0.7) }, rng.phase());
        pieces.extend([(make(order, false), a * phase.cos()), (make(order, true), a * phase.sin())]);
    }
}

/// Draws one effect of `kind` for a gear that moves as `world` does.
pub fn draw(kind: &str, rng: &mut Rng, world: &World) -> Hidden {
    let fastest = world.velocity.iter().fold(1e-9_f64, |m, v| m.max(v.abs()));
    let end = world.time_s[world.time_s.len() - 1];
    let a = world.rated;
    let reference = world.temperature.as_ref().map_or(20.0, |t| t[0]);
    let width = fastest * rng.log_uniform(0.01, 0.05);
    let sign = rng.pick(&[Sign::Tanh, Sign::Tanh, Sign::Atan, Sign::Root, Sign::Clip, Sign::Dahl]);
    let plain = rng.pick(&[Sign::Tanh, Sign::Tanh, Sign::Root]);
    let mut shape = String::new();
    let mut library = true;
    let one = |piece| vec![(piece, 1.0)];
    let mut pieces = Vec::new();
    match kind {
        "kinematic_error" => {
            let orders: &[f64] = rng.pick(&[&[2.0][..], &[2.0, 4.0], &[1.0, 2.0], &[1.0, 2.0, 4.0]]);
            wave(&mut pieces, rng, orders, |order, sine| Piece::AngleDeflection { angle: Angle::Motor, order, sine });
        }
        "torque_ripple" => {
            let orders: &[f64] = rng.pick(&[&[1.0][..], &[2.0], &[3.0], &[1.0, 3.0], &[6.0], &[2.0, 5.0], &[5.43]]);
            wave(&mut pieces, rng, orders, |order, sine| Piece::AngleTorque { angle: Angle::Motor, order, sine });
        }
        "encoder_eccentricity" => {
            wave(&mut pieces, rng, &[1.0], |order, sine| Piece::AngleDeflection { angle: Angle::Output, order, sine });
        }
        "gravity_load" => {
            wave(&mut pieces, rng, &[1.0], |order, sine| Piece::AngleTorque { angle: Angle::Output, order, sine });
        }
        "coulomb_friction" => {
            (shape, library) = (format!("{sign:?}").to_lowercase(), sign == Sign::Tanh);
            pieces = one(Piece::Friction { sign, width });
        }
        "viscous_friction" => pieces = one(Piece::Viscous),
        "stribeck_friction" => {
            let exponent = rng.pick(&[0.5, 1.0, 1.0, 2.0, 2.0, 0.0]);
            let velocity = fastest * rng.uniform(0.08, 0.3);
            (shape, library) =
                (format!("{plain:?}, exponent {exponent}").to_lowercase(), plain == Sign::Tanh && exponent > 0.0);
            let (drop, slope) = (rng.uniform(0.4, 1.2), rng.uniform(0.0, 0.3) / fastest);
            pieces = vec![
                (Piece::Friction { sign: plain, width }, 1.0),
                (Piece::Stribeck { sign: plain, width, velocity, exponent }, drop),
                (Piece::Viscous, slope),
            ];
        }
        "load_dependent_friction" => {
            (shape, library) = (format!("{plain:?}").to_lowercase(), plain == Sign::Tanh);
            pieces = one(Piece::LoadFriction { sign: plain, width });
        }
        "position_dependent_friction" => {
            let angle = if rng.chance(0.6) { Angle::Motor } else { Angle::Output };
            let orders: &[f64] = if angle == Angle::Motor { rng.pick(&[&[1.0][..], &[2.0]]) } else { &[1.0] };
            (shape, library) = (format!("{angle:?}").to_lowercase(), plain == Sign::Tanh);
            wave(&mut pieces, rng, orders, |order, sine| Piece::AngleFriction {
                angle,
                order,
                sine,
                sign: plain,
                width,
            });
            // Within a part of a turn a wave of the friction may be of one sign: that which brakes.
            let taken = |(piece, weight): &(Piece, f64)| match *piece {
                Piece::AngleFriction { angle, order, sine, .. } => {
                    let waves = world.wave(angle, order, sine);
                    weight * waves.iter().zip(&world.velocity).map(|(wave, v)| wave * v.abs()).sum::<f64>()
                }
                _ => 0.0,
            };
            if pieces.iter().map(taken).sum::<f64>() < 0.0 {
                pieces.iter_mut().for_each(|(_, weight)| *weight = -*weight);
            }
        }
        "viscous_damping" => pieces = one(Piece::Rate),
        "inertia" => pieces = one(Piece::Acceleration),
        "soft_windup" if rng.chance(0.25) => {
            (shape, library) = ("piecewise".to_owned(), false);
            let (w1, w2) = (a * rng.uniform(0.08, 0.2), a * rng.uniform(0.3, 0.6));
            pieces = vec![
                (Piece::Windup { knee: Knee::Clip, width: w1 }, 1.0),
                (Piece::Windup { knee: Knee::Clip, width: w2 }, 0.5),
            ];
        }
        "soft_windup" => {
            let knee = rng.pick(&[Knee::Tanh, Knee::Rational, Knee::Gaussian, Knee::Atan]);
            (shape, library) = (format!("{knee:?}").to_lowercase(), knee != Knee::Atan);
            pieces = one(Piece::Windup { knee, width: a * rng.log_uniform(0.06, 0.25) });
        }
        "stiffness_asymmetry" if rng.chance(0.5) => {
            shape = "abs".to_owned();
            pieces = vec![(Piece::Abs, rng.sign())];
        }
        "stiffness_asymmetry" => {
            shape = "square".to_owned();
            pieces = vec![(Piece::Square, rng.sign())];
        }
        "backlash" if rng.chance(0.5) => {
            shape = "clearance".to_owned();
            let largest = world.base.iter().fold(0.0_f64, |m, t| m.max(t.abs()));
            pieces = one(Piece::Clearance { contact_nm: largest * rng.log_uniform(2e-3, 2e-2) });
        }
        "backlash" => {
            shape = "play".to_owned();
            pieces = one(Piece::Play);
        }
        "nonlocal_memory" => {
            let count = rng.pick(&[1, 2, 3]);
            pieces = (0..count)
                .map(|_| {
                    let radius = a * rng.log_uniform(0.04, 0.4);
                    (Piece::Stop { radius }, rng.uniform(0.5, 1.0) / radius)
                })
                .collect();
            shape = format!("{count} sliders");
        }
        "creep" if rng.chance(0.25) => {
            (shape, library) = ("stretched exponential".to_owned(), false);
            pieces = one(Piece::Creep { tau: rng.log_uniform(2.0, 6.0), exponent: rng.uniform(0.5, 0.8) });
        }
        "creep" => {
            let count = rng.pick(&[1, 1, 2, 3]);
            pieces = (0..count)
                .map(|_| (Piece::Creep { tau: rng.log_uniform(1.5, 12.0), exponent: 1.0 }, rng.uniform(0.4, 1.0)))
                .collect();
            shape = format!("{count} time constants");
        }
        "time_skew" if rng.chance(0.3) => {
            (shape, library) = ("lag".to_owned(), false);
            pieces = one(Piece::Lag);
        }
        "time_skew" => {
            shape = "delay".to_owned();
            pieces = one(Piece::Delay);
        }
        "thermal_stiffness" => pieces = one(Piece::WarmStiffness { reference }),
        "thermal_zero_drift" => pieces = vec![(Piece::WarmZero { reference }, rng.sign())],
        "thermal_friction" => pieces = one(Piece::WarmFriction { reference }),
        "sensor_drift" => pieces = vec![(Piece::Time, rng.sign())],
        "wear" => {
            let start = end * rng.uniform(0.25, 0.6);
            let choice = rng.pick(&["step", "ramp", "sigmoid"]);
            let duration = if choice == "step" { 1e-3 } else { end * rng.uniform(0.15, 0.35) };
            (shape, library) = (choice.to_owned(), choice != "sigmoid");
            pieces = one(Piece::Wear { start, duration, sigmoid: choice == "sigmoid" });
        }
        _ => {
            (shape, library) = (kind.to_owned(), false);
            let order = rng.pick(&[1.0, 2.0, 3.0]);
            pieces = one(Piece::Outside(match kind {
                "loaded_ripple" => Outside::LoadedRipple { order },
                "dead_spot" => {
                    let middle = world.output[world.output.len() / rng.pick(&[2, 3, 4])];
                    Outside::DeadSpot { angle: middle, width: rng.uniform(0.1, 0.4) }
                }
                "one_sided_loop" => Outside::OneSidedLoop,
                "cubic_drift" => Outside::CubicDrift,
                "notch" => Outside::Notch {
                    velocity: fastest * rng.uniform(0.35, 0.6),
                    width: fastest * rng.uniform(0.08, 0.2),
                    order,
                },
                "burst" => {
                    let start = end * rng.uniform(0.2, 0.6);
                    Outside::Burst { frequency: rng.uniform(3.0, 15.0), start, end: start + end * 0.2 }
                }
                "detent" => Outside::Detent { pitch: rng.uniform(0.15, 0.4) },
                _ => {
                    let sharpest = world.acceleration.iter().fold(1e-9_f64, |m, v| m.max(v.abs()));
                    Outside::Jerky { velocity: 0.2 * fastest, acceleration: 0.1 * sharpest }
                }
            }));
        }
    }
    Hidden { kind: kind.to_owned(), shape, library_shape: library, pieces }
}

/// The parameters that a model file would hold for `hidden` with its weights multiplied by `scale`: those that can be
/// compared with an estimate.
pub fn parameters(hidden: &Hidden, scale: f64) -> BTreeMap<String, ParameterValue> {
    let mut keys = BTreeMap::new();
    let number = |x: f64| ParameterValue::Number(x);
    let first = hidden.pieces.first().map_or(0.0, |p| p.1 * scale);
    let unit = if matches!(hidden.kind.as_str(), "kinematic_error" | "encoder_eccentricity") { "rad" } else { "nm" };
    let (mut orders, mut cosines, mut sines) = (Vec::new(), Vec::new(), Vec::new());
    for (piece, weight) in &hidden.pieces {
        if let Piece::AngleDeflection { order, sine, .. }
        | Piece::AngleTorque { order, sine, .. }
        | Piece::AngleFriction { order, sine, .. } = *piece
        {
            if sine {
                sines.push(weight * scale);
            } else {
                orders.push(order);
                cosines.push(weight * scale);
            }
        }
    }
    match hidden.kind.as_str() {
        "kinematic_error" | "torque_ripple" | "position_dependent_friction" => {
            keys.insert("orders".to_owned(), ParameterValue::List(orders));
            keys.insert(format!("cos_{unit}"), ParameterValue::List(cosines));
            keys.insert(format!("sin_{unit}"), ParameterValue::List(sines));
        }
        "encoder_eccentricity" | "gravity_load" => {
            keys.insert(format!("cos_{unit}"), number(cosines[0]));
            keys.insert(format!("sin_{unit}"), number(sines[0]));
        }
        "coulomb_friction" => drop(keys.insert("torque_nm".to_owned(), number(first))),
        "viscous_friction" | "viscous_damping" => {
            drop(keys.insert("damping_nms_per_rad".to_owned(), number(first)));
        }
        "load_dependent_friction" => drop(keys.insert("mu".to_owned(), number(first))),
        "inertia" => drop(keys.insert("inertia_kgm2".to_owned(), number(first))),
        "stiffness_asymmetry" => {
            let key = if hidden.shape == "square" { "stiffness_nm_per_rad2" } else { "stiffness_nm_per_rad" };
            keys.insert(key.to_owned(), number(first));
        }
        "backlash" => drop(keys.insert("half_gap_rad".to_owned(), number(first))),
        "time_skew" => drop(keys.insert("delay_s".to_owned(), number(first))),
        "thermal_stiffness" => {
            keys.insert("per_k".to_owned(), number(first));
            if let Some((Piece::WarmStiffness { reference }, _)) = hidden.pieces.first() {
                keys.insert("reference_c".to_owned(), number(*reference));
            }
        }
        "thermal_friction" => drop(keys.insert("per_k".to_owned(), number(first))),
        "thermal_zero_drift" => drop(keys.insert("nm_per_k".to_owned(), number(first))),
        "sensor_drift" => drop(keys.insert("nm_per_s".to_owned(), number(first))),
        "wear" => drop(keys.insert("stiffness_drop_nm_per_rad".to_owned(), number(first))),
        "soft_windup" if hidden.library_shape => {
            if let Piece::Windup { width, .. } = hidden.pieces[0].0 {
                keys.insert("width_rad".to_owned(), number(width));
                keys.insert("stiffness_drop_nm_per_rad".to_owned(), number(first));
            }
        }
        _ => {}
    }
    keys
}
