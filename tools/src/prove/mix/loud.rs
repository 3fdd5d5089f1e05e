//! What the loud blocks hide.

use crate::prove::generator::{CaseSpec, Colour, OUTSIDE, PlantKind, Rng, omitted_kinds};

/// Kinds that a bench with a locked input shows side by side.
const LOCKED: [&str; 6] = [
    "soft_windup",
    "stiffness_asymmetry",
    "viscous_damping",
    "nonlocal_memory",
    "load_dependent_friction",
    "time_skew",
];
/// Kinds that a bench with a running motor shows side by side.
const RUNNING: [&str; 7] = [
    "kinematic_error",
    "torque_ripple",
    "gravity_load",
    "coulomb_friction",
    "viscous_friction",
    "load_dependent_friction",
    "position_dependent_friction",
];

/// A wave of the friction over the angle is at most this part of the friction that it is a wave of, rms: more would drive the joint over a part of the turn.
const LARGEST_WAVE: f64 = 0.6;

/// Case `count` of `block`, `simulation` or `loud`.
pub fn spec(block: &str, count: usize, rng: &mut Rng) -> CaseSpec {
    let mut spec = CaseSpec {
        block: block.to_owned(),
        plant_model: PlantKind::Gmhm,
        effects: Vec::new(),
        colour: Colour::Coloured,
        removed: Vec::new(),
        real: None,
        loud: true,
    };
    if block == "simulation" {
        spec.plant_model = PlantKind::Arm;
        let effects = rng.pick(&[2, 3, 4]);
        spec.effects = omitted(rng, effects, true);
        return spec;
    }
    match count % 8 {
        0 => spec.effects = bench(rng, &LOCKED, &[2, 3], 0.3, 1.5),
        1 | 5 => {
            spec.plant_model = PlantKind::ArmTerms;
            let effects = rng.pick(&[2, 3, 4, 5]);
            spec.effects = omitted(rng, effects, false);
        }
        // A tenth of the mismatch that another plant model makes.
        2 => {
            spec.plant_model = PlantKind::Maxwell;
            let kinds = rng.pick(&[&LOCKED[..3], &RUNNING[..]]);
            spec.effects = bench(rng, kinds, &[1, 2], 0.15, 0.4);
        }
        3 => spec.effects = bench(rng, &RUNNING, &[2, 3, 4, 5], 0.3, 1.5),
        4 => {
            spec.plant_model = PlantKind::Butterfly;
            spec.effects = bench(rng, &["viscous_damping", "torque_ripple", "kinematic_error"], &[0, 1], 0.15, 0.4);
        }
        6 => spec.plant_model = [PlantKind::Gmhm, PlantKind::ArmTerms, PlantKind::Arm][count / 8 % 3],
        _ => {
            let outside = rng.pick(&OUTSIDE);
            spec.effects = bench(rng, &["viscous_damping", "torque_ripple"], &[1], 0.3, 1.5);
            spec.effects.push((outside.to_owned(), rng.log_uniform(0.3, 1.5)));
        }
    }
    spec
}

fn omitted(rng: &mut Rng, count: usize, simulation: bool) -> Vec<(String, f64)> {
    let kinds = omitted_kinds(rng, count, simulation);
    let mut effects: Vec<(String, f64)> =
        kinds.into_iter().map(|kind| (kind.to_owned(), rng.log_uniform(0.15, 1.0))).collect();
    let whole = effects.iter().find(|e| matches!(e.0.as_str(), "coulomb_friction" | "stribeck_friction")).map(|e| e.1);
    let wave = effects.iter_mut().find(|e| e.0 == "position_dependent_friction");
    if let Some((whole, wave)) = whole.zip(wave) {
        wave.1 = wave.1.min(LARGEST_WAVE * whole);
    }
    effects
}

/// Some of `kinds`, each leaving between `least` and `most`, N·m.
fn bench(rng: &mut Rng, kinds: &[&str], counts: &[usize], least: f64, most: f64) -> Vec<(String, f64)> {
    let mut left = kinds.to_vec();
    (0..rng.pick(counts))
        .map(|_| {
            let kind = rng.pick(&left);
            left.retain(|k| *k != kind);
            (kind.to_owned(), rng.log_uniform(least, most))
        })
        .collect()
}
