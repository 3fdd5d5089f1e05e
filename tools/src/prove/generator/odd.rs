//! Shapes of loud effects: each effect of [`kinds`](super::kinds) with a part beside it that its textbook does not have.

use super::kinds::Hidden;
use super::linear;
use super::noise::rms;
use super::physics::{Angle, Knee, Outside, Piece, Sign, World};
use super::rng::Rng;

/// Adds a part to `hidden` that its own textbook cannot follow: 3 to 10 % of it, rms.
pub fn bend(hidden: &mut Hidden, rng: &mut Rng, world: &World) {
    let Some(piece) = odd(hidden, rng, world) else { return };
    let response = |piece: &Piece, w: f64| world.torque(piece, w).or_else(|| world.deflection(piece, w));
    let rows = world.time_s.len();
    let mut own = vec![0.0; rows];
    for (piece, weight) in &hidden.pieces {
        let Some(part) = response(piece, *weight) else { return };
        own.iter_mut().zip(part).for_each(|(o, p)| *o += p);
    }
    let Some(other) = response(&piece, 1.0) else { return };
    let beyond = rms(&linear::residual(&[vec![1.0; rows], own.clone()], &other));
    if beyond > 1e-9 * rms(&other) {
        let off = rng.uniform(0.03, 0.10);
        hidden.pieces.push((piece, rng.sign() * off * rms(&own) / beyond));
        hidden.shape = format!("{}, {:.1} % off it", hidden.shape, 100.0 * off);
        // Its parameters are no longer those of a model file.
        hidden.library_shape = false;
    }
}

/// A part of the same coordinates as `hidden` and of another shape; nothing where its pieces are not linear.
fn odd(hidden: &Hidden, rng: &mut Rng, world: &World) -> Option<Piece> {
    let fastest = world.velocity.iter().fold(1e-9_f64, |m, v| m.max(v.abs()));
    let sharpest = world.acceleration.iter().fold(1e-9_f64, |m, v| m.max(v.abs()));
    let order = rng.pick(&[3.0, 5.0]);
    let sign = Sign::Tanh;
    let angle_friction = Piece::AngleFriction { angle: Angle::Output, order, sine: true, sign, width: 0.02 * fastest };
    Some(match hidden.kind.as_str() {
        "kinematic_error" => Piece::AngleDeflection { angle: Angle::Motor, order, sine: true },
        "encoder_eccentricity" => Piece::AngleDeflection { angle: Angle::Output, order: 2.0, sine: true },
        "torque_ripple" => Piece::Outside(Outside::LoadedRipple { order }),
        "gravity_load" => Piece::AngleTorque { angle: Angle::Output, order: 2.0, sine: true },
        "coulomb_friction" if rng.chance(0.5) => angle_friction,
        "coulomb_friction" | "load_dependent_friction" => Piece::Friction { sign: Sign::Dahl, width: 0.2 * fastest },
        "viscous_friction" | "stribeck_friction" => Piece::Friction { sign, width: 0.4 * fastest },
        "position_dependent_friction" => angle_friction,
        "viscous_damping" => Piece::Friction { sign, width: 0.4 * fastest },
        "inertia" => Piece::Outside(Outside::Jerky { velocity: 0.3 * fastest, acceleration: 0.2 * sharpest }),
        "soft_windup" => Piece::Windup { knee: Knee::Atan, width: 0.4 * world.rated },
        "stiffness_asymmetry" if hidden.shape == "abs" => Piece::Square,
        "stiffness_asymmetry" => Piece::Abs,
        "nonlocal_memory" => Piece::Outside(Outside::OneSidedLoop),
        "creep" => Piece::Creep { tau: 1.0, exponent: 1.0 },
        "sensor_drift" => Piece::Outside(Outside::CubicDrift),
        _ => return None,
    })
}
