//! The concealed cases: every kind can be hidden at the size asked for, from any seed, and the key is honest about it.

use crate::common::skips;
use gmhm_tools::prove::generator::{CaseSpec, Colour, KINDS, OUTSIDE, PlantKind, case, fits_a_joint, real_residuals};
use gmhm_tools::prove::key::{INDISTINGUISHABLE, Key, LARGE_SHARE, Role};
use gmhm_tools::prove::mix;

fn spec(plant_model: PlantKind, effects: &[(&str, f64)]) -> CaseSpec {
    CaseSpec {
        block: "test".to_owned(),
        plant_model,
        effects: effects.iter().map(|(k, s)| ((*k).to_owned(), *s)).collect(),
        colour: Colour::Any,
        removed: Vec::new(),
        real: None,
        loud: false,
    }
}

#[test]
fn every_kind_can_be_hidden_and_seen() {
    let mut visible = 0;
    for (i, kind) in KINDS.iter().chain(&OUTSIDE).enumerate() {
        let case = case(i as u64, &spec(PlantKind::Gmhm, &[(kind, 0.15)]));
        let effect = case.key.effects.first().unwrap_or_else(|| panic!("{kind} could not be hidden"));
        assert_eq!((&*effect.kind, effect.size_nm), (*kind, 0.15));
        assert!(effect.before_nm > 0.13, "{kind}: {} before the refit", effect.before_nm);
        assert!(!effect.coordinates.is_empty() && !effect.pieces.is_empty());
        if KINDS.contains(kind) {
            assert!(effect.class.iter().any(|k| k == kind), "{kind} is missing from its own class {:?}", effect.class);
        } else {
            assert!(effect.class.len() <= 1, "{kind} is explained by {:?}", effect.class);
        }
        for other in effect.class.iter().filter(|k| *k != kind) {
            assert!(effect.unexplained[other] < effect.evidence && effect.evidence > INDISTINGUISHABLE);
        }
        visible += usize::from(effect.visible);
        for recording in &case.recordings {
            let rows = recording.len();
            assert!(recording.torque.as_ref().is_some_and(|t| t.len() == rows && t.iter().all(|t| t.is_finite())));
            let theta = recording.deflection_rad.as_ref().unwrap();
            let rated = case.base.gear.rated_deflection_rad.unwrap();
            assert!(theta.iter().all(|x| x.abs() <= rated), "{kind} leaves the calibrated range");
        }
    }
    assert!(visible >= 28, "only {visible} of 30 effects can be seen");
}

#[test]
fn classes_hold_what_the_recording_cannot_tell_and_no_more() {
    let class = |seed, plant_model, kind| {
        let case = case(seed, &spec(plant_model, &[(kind, 0.15)]));
        (case.key.motion, case.key.effects[0].class.clone())
    };
    // With the input locked v = −θ̇, and friction that acts on v is damping.
    let mut locked = 0;
    for seed in 0..8 {
        let (motion, damping) = class(seed, PlantKind::Gmhm, "viscous_damping");
        if motion == "LockedCycles" || motion == "BandLimited" {
            locked += 1;
            assert_eq!(damping, ["viscous_damping", "viscous_friction"], "{motion}");
        }
        let (_, stribeck) = class(seed, PlantKind::Joint, "stribeck_friction");
        assert!(stribeck.len() <= 2, "{stribeck:?}");
    }
    assert!(locked > 1);
}

#[test]
fn a_joint_log_has_no_motor_side() {
    for kind in KINDS.iter().filter(|k| fits_a_joint(k)) {
        let case = case(5, &spec(PlantKind::Joint, &[(kind, 0.15)]));
        assert!(case.recordings[0].theta_in_rad.is_none() && case.recordings[0].deflection_rad.is_none());
        assert!(case.base.elastic.is_none() && case.base.terms.len() == 4);
    }
}

#[test]
fn the_same_seed_gives_the_same_case() {
    let spec = spec(PlantKind::Gmhm, &[("creep", 0.05), ("torque_ripple", 0.05)]);
    let (a, b, c) = (case(42, &spec), case(42, &spec), case(43, &spec));
    assert_eq!(a, b);
    assert_ne!(a.recordings, c.recordings);
    assert_eq!(a.key.sha256(), b.key.sha256());
}

#[test]
fn the_key_survives_its_file() {
    let case = case(u64::MAX - 3, &spec(PlantKind::Maxwell, &[("kinematic_error", 0.15)]));
    assert_eq!(case.key.effects.iter().filter(|e| e.role == Role::PlantModel).count(), 1);
    let again = Key::from_toml(&case.key.to_toml()).unwrap();
    assert_eq!(again, case.key);
    assert!(Key::from_toml("seed = 1").is_err());
}

#[test]
fn nothing_is_hidden_in_a_null_and_its_unseen_torque_is_the_base_models() {
    for seed in 0..6 {
        let case = case(seed, &spec(PlantKind::Gmhm, &[]));
        assert!(case.key.effects.is_empty());
        assert!(case.unseen[0].base_leaves_nm < 1e-6, "{}", case.unseen[0].base_leaves_nm);
    }
}

#[test]
fn real_residuals_carry_an_effect_like_any_noise() {
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/recordings"));
    let residuals = real_residuals(folder);
    if residuals.is_empty() {
        return skips::skipped("the residuals of real machines", "not beside the checkout");
    }
    assert!(residuals.len() >= 5);
    let mut spec = spec(PlantKind::Gmhm, &[("kinematic_error", 0.15)]);
    spec.real = Some(residuals[0].clone());
    let case = case(3, &spec);
    assert_eq!(case.key.noise, "real");
    assert!(case.recordings[0].torque.as_ref().unwrap().iter().all(|t| t.is_finite()));
}

#[test]
fn the_true_base_model_predicts_a_null_through_the_core() {
    // Two hysteresis codes that share nothing, a play profile here and turning points in the core, are the same law.
    let mut met = 0;
    for seed in 0..40 {
        let mut case = case(seed, &spec(PlantKind::Gmhm, &[]));
        if case.key.handed != "true" || !case.base.terms.is_empty() {
            continue;
        }
        met += 1;
        case.base.memory.as_mut().unwrap().reversal_play_rad = 0.0;
        let unseen = &mut case.unseen[0];
        let predicted = gmhm_tools::physics::predict(&case.base, None, &unseen.recording).unwrap();
        for (truth, core) in unseen.torque_nm.iter().zip(&predicted.torque) {
            assert!((truth - core).abs() < 1e-8, "{} {truth} {core}", case.key.motion);
        }
    }
    assert!(met >= 3);
}

fn rms(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt()
}

fn loud_cases(block: &'static str, cases: usize) -> Vec<gmhm_tools::prove::generator::Case> {
    mix::only(&[block], 5, cases, &[]).into_iter().map(|(index, spec)| case(index as u64, &spec)).collect()
}

#[test]
fn a_simulation_leaves_out_what_its_key_says() {
    for case in loud_cases("simulation", 8) {
        assert!((2..=4).contains(&case.key.effects.len()), "{:?}", case.key.effects.len());
        let (bare, noisy) = (&case.noise_free[0], &case.recordings[0]);
        let simulated = bare.torque_sim_nm.as_ref().unwrap();
        let left_out: Vec<f64> = bare.torque.as_ref().unwrap().iter().zip(simulated).map(|(t, s)| t - s).collect();
        let noise: Vec<f64> =
            noisy.torque.as_ref().unwrap().iter().zip(bare.torque.as_ref().unwrap()).map(|(a, b)| a - b).collect();
        let loudness = rms(&left_out) / rms(&noise);
        assert!((20.0..140.0).contains(&loudness), "{loudness}");
        for effect in &case.key.effects {
            let share = effect.share.unwrap();
            assert!((share - effect.before_nm / rms(&left_out)).abs() < 1e-9);
            assert_eq!(effect.visible, share >= LARGE_SHARE && effect.evidence >= INDISTINGUISHABLE);
            assert!(effect.size_nm <= effect.before_nm);
        }
        // The second motion is another one, with a simulation of its own and what that leaves out.
        let unseen = &case.unseen[0];
        let simulated = unseen.recording.torque_sim_nm.as_ref().unwrap();
        let left_out: Vec<f64> = unseen.torque_nm.iter().zip(simulated).map(|(t, s)| t - s).collect();
        assert!((rms(&left_out) - unseen.base_leaves_nm).abs() < 1e-9);
        assert_ne!(unseen.recording.theta_out_rad, bare.theta_out_rad);
    }
}

#[test]
fn loud_cases_cover_rates_plants_and_nulls() {
    let cases = loud_cases("loud", 16);
    let periods: Vec<f64> = cases.iter().map(|c| c.recordings[0].time_s[1] - c.recordings[0].time_s[0]).collect();
    assert!(periods.iter().any(|p| *p >= 0.008) && periods.iter().any(|p| *p <= 0.001), "{periods:?}");
    for plant in ["gmhm", "maxwell", "butterfly", "joint"] {
        assert!(cases.iter().any(|c| c.key.plant_model == plant), "{plant}");
    }
    assert!(cases.iter().any(|c| c.key.effects.is_empty()));
    for case in &cases {
        for plant in case.key.effects.iter().filter(|e| e.role == Role::PlantModel) {
            // The gear's own departure from the base is far from small.
            assert!(plant.size_nm > 5.0 * case.key.noise_rms_nm, "{} {}", plant.kind, plant.size_nm);
        }
    }
}
