//! Which columns each kind could explain a leftover with: the grid behind the theoretical class of equivalents.

use super::kinds::Family;
use super::physics::{Angle, Knee, Piece, Sign, World};

/// All families of all kinds, for a world that moves as `world` does; `orders` are those that the truth holds.
pub fn all(world: &World, orders: &[f64]) -> Vec<Family> {
    let mut families = Vec::new();
    let mut add = |kind, pieces: Vec<Piece>, tuned, positive| {
        families.push(Family { kind, pieces, tuned, positive });
    };
    let fastest = world.velocity.iter().fold(1e-9_f64, |m, v| m.max(v.abs()));
    let end = world.time_s[world.time_s.len() - 1];
    let a = world.rated;
    let reference = world.temperature.as_ref().map_or(20.0, |t| t[0]);
    let pair = |orders: &[f64], make: &dyn Fn(f64, bool) -> Piece| -> Vec<Piece> {
        orders.iter().flat_map(|&k| [make(k, false), make(k, true)]).collect()
    };
    let mut sets: Vec<Vec<f64>> = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0].iter().map(|&k| vec![k]).collect();
    if !orders.is_empty() && !sets.iter().any(|s| s == orders) {
        sets.push(orders.to_vec());
    }
    for set in &sets {
        let deflection = |order, sine| Piece::AngleDeflection { angle: Angle::Motor, order, sine };
        let torque = |order, sine| Piece::AngleTorque { angle: Angle::Motor, order, sine };
        add("kinematic_error", pair(set, &deflection), set.len(), false);
        add("torque_ripple", pair(set, &torque), set.len(), false);
    }
    let eccentric = |order, sine| Piece::AngleDeflection { angle: Angle::Output, order, sine };
    let gravity = |order, sine| Piece::AngleTorque { angle: Angle::Output, order, sine };
    add("encoder_eccentricity", pair(&[1.0], &eccentric), 0, false);
    add("gravity_load", pair(&[1.0], &gravity), 0, false);
    for width in [0.005, 0.01, 0.02, 0.04, 0.08].map(|x| x * fastest) {
        let sign = Sign::Tanh;
        add("coulomb_friction", vec![Piece::Friction { sign, width }], 1, true);
        add("load_dependent_friction", vec![Piece::LoadFriction { sign, width }], 1, true);
        let turning = |angle| move |order: f64, sine: bool| Piece::AngleFriction { angle, order, sine, sign, width };
        for order in [1.0, 2.0] {
            add("position_dependent_friction", pair(&[order], &turning(Angle::Motor)), 2, false);
        }
        add("position_dependent_friction", pair(&[1.0], &turning(Angle::Output)), 2, false);
        for velocity in [0.06, 0.12, 0.25].map(|x| x * fastest) {
            for exponent in [0.5, 1.0, 2.0] {
                let bump = Piece::Stribeck { sign, width, velocity, exponent };
                // The Coulomb and viscous parts of the law are free beside the bump.
                add("stribeck_friction", vec![bump, Piece::Friction { sign, width }, Piece::Viscous], 3, true);
            }
        }
    }
    for width in [0.002, 0.005, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32].map(|x| x * fastest) {
        add("presliding_friction", vec![Piece::Friction { sign: Sign::Dahl, width }], 1, true);
    }
    add("viscous_friction", vec![Piece::Viscous], 0, true);
    add("viscous_damping", vec![Piece::Rate], 0, true);
    add("inertia", vec![Piece::Acceleration], 0, true);
    for knee in [Knee::Tanh, Knee::Rational, Knee::Gaussian, Knee::Clip] {
        for width in [0.04, 0.07, 0.1, 0.14, 0.2, 0.28, 0.4, 0.6].map(|x| x * a) {
            add("soft_windup", vec![Piece::Windup { knee, width }], 1, false);
        }
    }
    add("stiffness_asymmetry", vec![Piece::Square], 0, false);
    add("stiffness_asymmetry", vec![Piece::Abs], 0, false);
    let largest = world.base.iter().fold(1e-9_f64, |m, t| m.max(t.abs()));
    for contact in [0.002, 0.01, 0.02] {
        add("backlash", vec![Piece::Clearance { contact_nm: contact * largest }], 0, true);
    }
    add("backlash", vec![Piece::Play], 0, true);
    for radius in [0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.45, 0.7].map(|x| x * a) {
        add("nonlocal_memory", vec![Piece::Stop { radius }], 1, false);
        add("load_dependent_memory", vec![Piece::Stop { radius }, Piece::LoadedStop { radius }], 1, false);
    }
    for tau in [1.0, 2.0, 4.0, 8.0, 16.0] {
        add("creep", vec![Piece::Creep { tau, exponent: 1.0 }], 1, false);
    }
    add("time_skew", vec![Piece::Delay], 0, false);
    add("encoder_skew", vec![Piece::Skew], 0, false);
    if world.temperature.is_some() {
        add("thermal_stiffness", vec![Piece::WarmStiffness { reference }], 0, false);
        add("thermal_zero_drift", vec![Piece::WarmZero { reference }], 0, false);
        add("thermal_friction", vec![Piece::WarmFriction { reference }], 0, false);
    }
    add("sensor_drift", vec![Piece::Time], 0, false);
    for start in [0.0, 0.2, 0.3, 0.4, 0.5, 0.6].map(|x| x * end) {
        for duration in [1e-3, 0.15 * end, 0.4 * end, end - start] {
            add("wear", vec![Piece::Wear { start, duration, sigmoid: false }], 2, false);
        }
    }
    // An angle that stands still says nothing of what turns with it.
    let travel = |q: &[f64]| q.iter().fold(f64::MIN, |m, x| m.max(*x)) - q.iter().fold(f64::MAX, |m, x| m.min(*x));
    let still = [(Angle::Motor, travel(&world.motor) < 1.0), (Angle::Output, travel(&world.output) < 0.1)];
    families.retain(|family| {
        !matches!(family.pieces[0],
            Piece::AngleDeflection { angle, .. } | Piece::AngleTorque { angle, .. } | Piece::AngleFriction { angle, .. }
                if still.contains(&(angle, true)))
    });
    if world.c1 == 0.0 {
        // A joint log has no deflection, and its base holds gravity, inertia, Coulomb and viscous friction already.
        families.retain(|f| super::kinds::fits_a_joint(f.kind));
    }
    families
}
