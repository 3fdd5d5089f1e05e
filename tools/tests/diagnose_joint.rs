//! What is found of a joint. Synthetic recordings.

use gmhm_tools::diagnose::suggestion::Suggestion;
use gmhm_tools::diagnose::{Finding, Options, diagnose};
use gmhm_tools::model::{Base, GearSection, Model, Term, TermValue, TorqueSide};
use gmhm_tools::recording::Recording;

const PERIOD_S: f64 = 0.002;
const ROWS: u32 = 8000;

/// Noise without structure, the same in every run, of some 0.6 of its amplitude rms.
fn noise(row: u32) -> f64 {
    let row = f64::from(row);
    (row * 12.9898).sin() * (row * row * 0.078_233).cos()
}

/// A joint of ratio 100 that moves by `angle_and_velocity`, its torque, and a base model of gravity alone.
fn joint(angle_and_velocity: impl Fn(f64) -> (f64, f64), torque: impl Fn(f64) -> f64) -> (Recording, Model) {
    let time_s: Vec<f64> = (0..ROWS).map(|row| PERIOD_S * f64::from(row)).collect();
    let (angle, velocity): (Vec<f64>, Vec<f64>) = time_s.iter().map(|t| angle_and_velocity(*t)).unzip();
    let recording = Recording {
        name: "joint".into(),
        torque: Some(time_s.iter().zip(0..).map(|(t, row)| torque(*t) + 0.05 * noise(row)).collect()),
        theta_out_rad: Some(angle.into()),
        velocity_out_rad_per_s: Some(velocity.into()),
        time_s: time_s.into(),
        ..Recording::default()
    };
    let values = [("cos_nm", 0.0), ("sin_nm", 5.0)].map(|(key, value)| (key.to_owned(), TermValue::Number(value)));
    let terms = vec![Term { kind: "gravity_load".to_owned(), values: values.into_iter().collect() }];
    let gear = GearSection { ratio: Some(100.0), torque_side: TorqueSide::Motor, ..GearSection::default() };
    (recording, Model { gear, terms, ..Model::default() })
}

fn diagnosed((recording, base): (Recording, Model)) -> Finding {
    diagnose(&[recording], &base, &[], &Options::default(), &()).unwrap()
}

/// Sorted names.
fn names(found: &Finding) -> Vec<&str> {
    let mut names: Vec<&str> = found.diagnosis.effects.iter().map(|e| e.name.as_str()).collect();
    names.sort_unstable();
    names
}

/// The delay of the extended model, s; 0 where it has none.
fn found_delay_s(found: &Finding) -> f64 {
    let delay = found.model.terms.iter().find_map(|term| term.values.get("delay_s"));
    if let Some(TermValue::Number(delay_s)) = delay { *delay_s } else { 0.0 }
}

/// A term of the base.
fn term(kind: &str, values: &[(&str, f64)]) -> Term {
    let values = values.iter().map(|(key, value)| ((*key).to_owned(), TermValue::Number(*value))).collect();
    Term { kind: kind.to_owned(), values }
}

/// A number of the first term of a kind.
fn number_of(model: &Model, kind: &str, key: &str) -> f64 {
    let term = model.terms.iter().find(|term| term.kind == kind).unwrap();
    let TermValue::Number(value) = term.values[key] else { panic!("{key} is no number") };
    value
}

/// Two sines of the output: angle and velocity.
fn two_sines(t: f64) -> (f64, f64) {
    (0.3 * t.sin() + 0.1 * (2.3 * t).sin(), 0.3 * t.cos() + 0.23 * (2.3 * t).cos())
}

/// Two sines of the output, up to 1.9 rad/s: angle and velocity.
fn fast_sines(t: f64) -> (f64, f64) {
    let (slow, fast) = (1.2 * t, 3.1 * t);
    (0.9 * slow.sin() + 0.25 * fast.sin(), 1.08 * slow.cos() + 0.775 * fast.cos())
}

#[test]
fn a_ripple_is_found_behind_a_delay_that_turns_its_phase() {
    for delay_s in [0.012, -0.008] {
        let torque = |t: f64| {
            let (angle, velocity) = two_sines(t - delay_s);
            5.0 * angle.sin() + 2.0 * (velocity / 0.02).tanh() + 1.5 * (400.0 * angle + 0.3).sin()
        };
        let found = diagnosed(joint(two_sines, torque));
        let names: Vec<&str> = found.diagnosis.effects.iter().map(|e| e.name.as_str()).collect();
        for kind in ["time_skew", "torque_ripple", "coulomb_friction"] {
            assert!(names.contains(&kind), "{kind} is not in {names:?}");
        }
        let delay = found_delay_s(&found);
        assert!((delay - delay_s).abs() < 2e-4, "{delay} s is not {delay_s} s");
    }
}

/// 125 Hz: the delay is less than two rows, and turns a ripple by up to 2.3 rad. One that keeps its amplitude is better smoothed, too.
#[test]
fn a_delay_of_less_than_two_rows_is_found_beside_a_ripple() {
    let torque = |t: f64| {
        let (angle, velocity) = fast_sines(t - 0.0125);
        5.0 * angle.sin() + 1.2 * (velocity / 0.02).tanh() + 1.9 * (100.0 * angle + 0.3).sin()
    };
    let (mut recording, base) = joint(fast_sines, torque);
    let fourth = |line: &[f64]| line.iter().step_by(4).copied().collect::<Vec<f64>>();
    recording.torque = recording.torque.map(|line| fourth(&line).into());
    recording.theta_out_rad = recording.theta_out_rad.map(|line| fourth(&line).into());
    recording.velocity_out_rad_per_s = None;
    recording.time_s = fourth(&recording.time_s).into();
    let found = diagnosed((recording, base));
    assert_eq!(names(&found), ["coulomb_friction", "time_skew", "torque_ripple"]);
    let delay = found_delay_s(&found);
    assert!((delay - 0.0125).abs() < 2e-4, "{delay} s is not 0.0125 s");
}

/// A motor that turns half a turn, one way, at a speed that hardly changes.
#[test]
fn the_cogging_of_half_a_turn_is_found() {
    let angle_and_velocity = |t: f64| (0.19 * t + 0.02 * (2.0 * t).sin(), 0.19 + 0.04 * (2.0 * t).cos());
    let cogging =
        |q: f64| (7.0 * q).sin() + 0.5 * (14.0 * q + 1.0).cos() + 0.6 * (28.0 * q).sin() + 0.4 * (12.0 * q).cos();
    let (mut motor, mut base) = joint(angle_and_velocity, |t| cogging(angle_and_velocity(t).0));
    motor.theta_in_rad = motor.theta_out_rad.clone();
    base.gear.ratio = Some(1.0);
    base.terms = vec![term("coulomb_friction", &[("torque_nm", 0.1), ("smoothing_rad_per_s", 0.01)])];
    let found = diagnosed((motor, base));
    assert_eq!(names(&found), ["torque_ripple"]);
    let left = found.diagnosis.heldout.rms;
    assert!(left.extended < 0.2 * left.refitted, "{left:?}");
}

/// Strokes at 0.1 rad/s: angle and velocity, the smoothed sum of the first harmonics of a square wave.
fn even_strokes(t: f64) -> (f64, f64) {
    let base = 1.6;
    (0..4).map(|k| f64::from(2 * k + 1)).fold((0.0, 0.0), |(angle, velocity), n| {
        let share = 0.1 * 4.0 / std::f64::consts::PI * (0.2 * n).sin() / (0.2 * n) / n;
        (angle - share / (n * base) * (n * base * t).cos(), velocity + share * (n * base * t).sin())
    })
}

/// The sign of the friction changes over two thirds of the speed, in another shape than that of its kind: viscous friction is nearly as close.
#[test]
fn friction_seen_at_one_speed_does_not_rise_beyond_it() {
    let torque = |t: f64| {
        let (angle, velocity) = even_strokes(t);
        5.0 * angle.sin() + 0.3 * (velocity / 0.065).atan()
    };
    let found = diagnosed(joint(even_strokes, torque));
    let effect = &found.diagnosis.effects[0];
    assert_eq!((names(&found), effect.name.as_str()), (vec!["coulomb_friction"], "coulomb_friction"));
    assert!(effect.equivalents.iter().any(|kind| kind == "viscous_friction"), "{:?}", effect.equivalents);
}

/// A joint with friction, and a base model of gravity alone that takes its torque on the wrong side.
fn on_the_wrong_side() -> (Recording, Model) {
    let motion = |t: f64| (0.8 * (1.2 * t).sin(), 0.96 * (1.2 * t).cos());
    let torque = |t: f64| {
        let (angle, velocity) = motion(t);
        5.0 * angle.sin() + 3.0 * (velocity / 0.02).tanh() + 3.0 * velocity
    };
    let (recording, mut base) = joint(motion, torque);
    base.gear.torque_side = TorqueSide::Output;
    (recording, base)
}

#[test]
fn a_wrong_side_of_the_torque_is_not_made_up_for_by_friction_of_the_position() {
    let found = diagnosed(on_the_wrong_side());
    assert_eq!(names(&found), ["coulomb_friction", "viscous_friction"]);
    assert_eq!(found.model.gear.torque_side, TorqueSide::Motor);
}

/// The base has all the friction that there is, on the wrong side: it may not drive the joint.
#[test]
fn friction_of_the_base_on_the_wrong_side_of_the_torque_is_held_and_said() {
    let (recording, mut base) = on_the_wrong_side();
    base.terms.push(term("coulomb_friction", &[("torque_nm", 1.0), ("smoothing_rad_per_s", 0.02)]));
    base.terms.push(term("viscous_friction", &[("damping_nms_per_rad", 1.0)]));
    let found = diagnosed((recording, base));
    assert!(found.diagnosis.suggestions.contains(&Suggestion::TorqueSide(TorqueSide::Motor)));
    assert_eq!(found.model.gear.torque_side, TorqueSide::Motor);
    assert_eq!(names(&found), [""; 0]);
    let friction = number_of(&found.model, "coulomb_friction", "torque_nm");
    assert!((friction - 3.0).abs() < 0.1, "{friction} N·m");
}

/// Beside gravity that the base lacks, a negative inertia would explain part of it: the torque of either follows the angle.
#[test]
fn the_inertia_of_a_base_is_not_negative() {
    let torque = |t: f64| {
        let acceleration = -0.3 * t.sin() - 0.529 * (2.3 * t).sin();
        5.0 * two_sines(t).0.sin() + acceleration
    };
    let (recording, mut base) = joint(two_sines, torque);
    base.terms = vec![term("inertia", &[("inertia_kgm2", 0.5)])];
    let found = diagnosed((recording, base));
    assert_eq!(number_of(&found.verdict.base.model, "inertia", "inertia_kgm2"), 0.0);
    assert_eq!(names(&found), ["gravity_load"]);
    let inertia = number_of(&found.model, "inertia", "inertia_kgm2");
    assert!((inertia - 1.0).abs() < 0.05, "{inertia} kg·m²");
}

#[test]
fn a_dip_of_friction_and_a_rise_with_the_velocity_that_hide_each_other_are_found_together() {
    let torque = |t: f64| {
        let (angle, velocity) = two_sines(t);
        let dry = 3.0 + 4.0 * (-(velocity / 0.05).abs()).exp();
        5.0 * angle.sin() + dry * (velocity / 0.02).tanh() + 8.0 * velocity
    };
    let found = diagnosed(joint(two_sines, torque));
    assert_eq!(names(&found), ["coulomb_friction", "stribeck_friction", "viscous_friction"]);
    let left = found.diagnosis.heldout.rms;
    assert!(left.extended < 0.01 * left.refitted, "{left:?}");
}

/// A recording beside a simulation that says gravity and inertia, and the base that has nothing but it.
fn simulated(
    motion: impl Fn(f64) -> (f64, f64),
    simulation: impl Fn(f64) -> f64,
    torque: impl Fn(f64) -> f64,
) -> (Recording, Model) {
    let (mut recording, mut base) = joint(motion, torque);
    recording.torque_sim_nm = Some(recording.time_s.iter().map(|t| simulation(*t)).collect());
    base.terms.clear();
    base.gear.base = Base::Simulation;
    (recording, base)
}

#[test]
fn friction_of_the_position_is_found_beside_presliding_alone() {
    // Dahl's friction over 0.02 rad, by steps so small that its path is exact.
    let mut state = 0.0_f64;
    let mut last = two_sines(0.0).0;
    let presliding: Vec<f64> = (0..ROWS)
        .map(|row| {
            let angle = two_sines(PERIOD_S * f64::from(row)).0;
            let step = angle - last;
            last = angle;
            state = step.signum() - (step.signum() - state) * (-step.abs() / 0.02).exp();
            state
        })
        .collect();
    for order in [1.0, 3.0] {
        let torque = |t: f64| {
            let (angle, velocity) = two_sines(t);
            let friction = 3.0 * presliding[(t / PERIOD_S).round() as usize];
            5.0 * angle.sin() + friction + 1.5 * (order * angle + 0.8).cos() * (velocity / 0.01).tanh()
        };
        let found = diagnosed(joint(two_sines, torque));
        assert_eq!(names(&found), ["position_dependent_friction", "presliding_friction"], "order {order}");
    }
}

#[test]
fn viscous_friction_of_a_lower_exponent_is_not_called_coulomb_friction_too() {
    // 5 % off the textbook.
    let torque = |t: f64| {
        let (angle, velocity) = fast_sines(t);
        let speed = velocity.abs();
        5.0 * angle.sin() + 6.0 * velocity.signum() * speed.powf(0.72) * (1.0 + 0.05 * (3.0 * speed).sin())
    };
    let found = diagnosed(joint(fast_sines, torque));
    assert_eq!(names(&found), ["viscous_friction"]);
    let exponent = found.model.terms.iter().find_map(|term| term.values.get("exponent"));
    assert!(matches!(exponent, Some(TermValue::Number(p)) if (p - 0.72).abs() < 0.1), "{exponent:?}");
}

#[test]
fn a_dip_of_friction_is_not_made_up_for_by_friction_of_the_position() {
    let motion = |t: f64| {
        let (slow, fast) = (0.9 * t, 3.1 * t);
        (0.6 + 0.5 * slow.sin() + 0.1 * fast.sin(), 0.45 * slow.cos() + 0.31 * fast.cos())
    };
    let torque = |t: f64| {
        let (angle, velocity) = motion(t);
        let dry = 3.0 + (-(velocity / 0.08).powi(2)).exp() + 0.5 * (3.0 * angle + 0.4).cos();
        5.0 * angle.sin() + dry * (velocity / 0.004).tanh() + 0.4 * velocity
    };
    let found = diagnosed(joint(motion, torque));
    assert_eq!(names(&found), ["coulomb_friction", "position_dependent_friction", "stribeck_friction"]);
}

#[test]
fn friction_follows_the_simulated_load_beside_a_payload() {
    let simulation = |t: f64| 20.0 * two_sines(t).0.sin() + 3.0;
    let torque = |t: f64| {
        let (angle, velocity) = two_sines(t);
        simulation(t) + 6.0 * (angle + 0.4).cos() + 0.15 * simulation(t).abs() * (velocity / 0.02).tanh()
    };
    let found = diagnosed(simulated(two_sines, simulation, torque));
    assert_eq!(names(&found), ["gravity_load", "load_dependent_friction"]);
    let left = found.diagnosis.heldout.rms;
    assert!(left.extended < 0.03 * left.refitted, "{left:?}");
}

/// A simulation that is too large by a gain, and a payload whose gravity cancels most of it: its 16 N·m are more than the torque recorded.
#[test]
fn a_payload_may_be_as_large_as_the_simulated_torque() {
    let acceleration = |t: f64| -0.3 * t.sin() - 0.1 * 2.3_f64.powi(2) * (2.3 * t).sin();
    let simulation = |t: f64| 22.0 * two_sines(t).0.cos() + 3.0 * acceleration(t) + 3.0 * (1.7 * t).sin();
    let torque = |t: f64| {
        let (angle, velocity) = two_sines(t);
        0.7 * simulation(t) - 16.0 * (angle - 0.1).cos() + 2.0 * velocity.signum() * velocity.abs().powf(0.7)
    };
    let found = diagnosed(simulated(two_sines, simulation, torque));
    assert_eq!(names(&found), ["gravity_load", "torque_scale", "viscous_friction"]);
}

#[test]
fn friction_on_the_other_side_of_the_torque_is_found_behind_a_payload() {
    let simulation = |t: f64| 20.0 * two_sines(t).0.sin() + 3.0;
    let torque = |t: f64| {
        let (angle, velocity) = two_sines(t);
        simulation(t) + 6.0 * (angle + 0.4).cos() + 0.15 * (velocity / 0.02).tanh()
    };
    let (recording, mut base) = simulated(two_sines, simulation, torque);
    base.gear.torque_side = TorqueSide::Output;
    let found = diagnosed((recording, base));
    assert_eq!(names(&found), ["coulomb_friction", "gravity_load"]);
    assert!(found.diagnosis.suggestions.contains(&Suggestion::TorqueSide(TorqueSide::Motor)));
}

#[test]
fn a_damper_that_records_its_displacement_as_a_deflection_moves_by_it() {
    let (mut recording, mut base) = joint(two_sines, |_| 0.0);
    base.terms = vec![term("inertia", &[("inertia_kgm2", 0.0)])];
    // Friction of 8 N·m that reverses over 40 mrad of travel (Dahl).
    let path = recording.theta_out_rad.take().unwrap();
    let mut share = 0.0_f64;
    let friction = path.windows(2).map(|step| {
        let travel = step[1] - step[0];
        share += (travel - share * travel.abs()) / 0.04;
        8.0 * share
    });
    let friction: Vec<f64> = std::iter::once(0.0).chain(friction).collect();
    let noisy = recording.torque.take().unwrap();
    recording.torque = Some(noisy.iter().zip(&friction).map(|(noise, friction)| noise + friction).collect());
    recording.velocity_out_rad_per_s = None;
    recording.deflection_rad = Some(path);
    let found = diagnosed((recording.clone(), base));
    assert_eq!(names(&found), ["presliding_friction"]);
    assert!((number_of(&found.model, "presliding_friction", "torque_nm") - 8.0).abs() < 0.2);
    // The model predicts a file with the same columns.
    let predicted = gmhm_tools::physics::predict(&found.model, None, &recording).unwrap();
    let missed = predicted.torque.iter().zip(&friction).map(|(model, truth)| (model - truth).powi(2)).sum::<f64>();
    assert!((missed / f64::from(ROWS)).sqrt() < 0.2, "{missed}");
}
