//! Inverse and feed-forward with terms: what they find gives the torque asked for, by the gear that runs forward.

use gmhm::feedforward::{Controls, Demand, FeedForward, Settings, Source as Follows};
use gmhm::scalar::Float;
use gmhm::terms::feedforward::{CompensatedFeedForward, CompensatedInverse};
use gmhm::terms::{Compensated, Domain, Form, KINDS, KeyInfo, KindInfo, Sample, Setting, Side, Source, Stack, Value};
use gmhm::{Elastic, Gear, Inverse, Memory, Params};

const RATED: f64 = 1.168e-3;
const PERIOD_S: f64 = 1e-3;

fn published() -> Params {
    let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
    let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
    Params::new(RATED, elastic, memory).unwrap()
}

/// Values so mild that the torque still increases with the deflection.
fn mild(key: &KeyInfo) -> Vec<f64> {
    let (low, high) = key.plausible;
    match (key.form, key.name, key.unit) {
        (Form::List { .. }, "orders", _) => vec![2.0, 4.0],
        (Form::List { .. }, "cos_rad" | "sin_rad", _) => vec![3e-5, -1e-5],
        (Form::List { .. }, _, "rad") => vec![2e-4, 5e-4],
        (Form::List { .. }, _, "s") => vec![0.1, 10.0],
        (Form::List { .. }, _, "N·m/rad") => vec![400.0, 300.0],
        (Form::List { .. }, ..) => vec![0.4, 0.3],
        (_, "start_s" | "duration_s", _) => vec![0.7],
        (_, "reference_c", _) => vec![20.0],
        (_, "width_rad", _) => vec![3e-4],
        (_, "stiffness_drop_nm_per_rad", _) => vec![4e3],
        (_, "stiffness_nm_per_rad2", _) => vec![4e5],
        (_, "stiffness_nm_per_rad", _) => vec![300.0],
        (_, "k1_nm_per_rad", _) => vec![19e3],
        (_, "k2_nm_per_rad", _) => vec![21e3],
        (_, "k3_nm_per_rad", _) => vec![23e3],
        (_, "t1_nm", _) => vec![4.0],
        (_, "t2_nm", _) => vec![12.0],
        (_, "load_linear" | "load_quadratic", _) => vec![0.3],
        (_, "cos_nm" | "sin_nm", _) => vec![1.5],
        _ => vec![low + 0.02 * (high - low)],
    }
}

struct Keys<S>(Vec<(&'static str, Vec<S>)>, usize);

impl<S: Float> Keys<S> {
    fn of(info: &KindInfo, choice: usize) -> Self {
        let numbers = |key: &KeyInfo| (key.name, mild(key).into_iter().map(S::from_f64).collect());
        Self(info.keys.iter().map(numbers).collect(), choice)
    }
}

impl<S: Float> Source<S> for Keys<S> {
    fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, S>> {
        if let Form::Choice(_) = key.form {
            return Some(Value::Choice(self.1));
        }
        let (_, numbers) = self.0.iter().find(|(name, _)| *name == key.name)?;
        Some(if let Form::List { .. } = key.form { Value::List(numbers) } else { Value::Number(numbers[0]) })
    }
}

fn stack<S: Float<Carry = S>>(sigma: f64, kinds: &[(&str, usize)]) -> Stack<S, 8> {
    let setting =
        Setting { sigma: S::from_f64(sigma), c1: S::from_f64(2.4737e4), rated_deflection: S::from_f64(RATED) };
    let mut stack = Stack::of_gear(setting);
    for (name, choice) in kinds {
        let info = gmhm::terms::kind(name).unwrap();
        stack.add(name, &Keys::of(info, *choice)).unwrap();
    }
    stack
}

/// A joint that swings, the deflection left open.
fn sample<S: Float>(row: u32) -> Sample<S> {
    let t = PERIOD_S * f64::from(row);
    let of = S::from_f64;
    Sample {
        time: of(t),
        period: of(PERIOD_S),
        motor_angle: of((60.0 * (0.9 * t).sin()).rem_euclid(std::f64::consts::TAU)),
        output_angle: of(0.6 * (0.9 * t).sin()),
        velocity: of(0.54 * (0.9 * t).cos()),
        acceleration: of(-0.486 * (0.9 * t).sin()),
        temperature: of(20.0 + 4.0 * t),
        motor_velocity: of(54.0 * (0.9 * t).cos()),
        output_velocity: of(0.54 * (0.9 * t).cos()),
        ..Sample::default()
    }
}

fn torque_at(row: u32) -> f64 {
    let t = PERIOD_S * f64::from(row);
    14.0 * (1.7 * t).sin() + 5.0 * (6.1 * t).sin()
}

/// The largest difference between the torque asked for and that of the gear run forward to what was found, and the most that terms gave, N·m.
fn round_trip<S: Float<Carry = S>>(kinds: &[(&str, usize)], rows: u32) -> (f64, f64) {
    let stack = stack::<S>(-1.0, kinds);
    let params = published();
    let inverse =
        CompensatedInverse { inverse: Inverse::<S>::with_period(&params, PERIOD_S).unwrap(), stack: stack.clone() };
    let forward = Compensated { gear: Gear::<S>::with_period(&params, PERIOD_S).expect("a period"), stack };
    // The start takes the first sample: terms of the deflection stand between the gear at 0 and the encoders.
    let error = forward.stack.terms().iter().fold(S::ZERO, |sum, term| sum + term.deflection_error(&sample(0)));
    let first = Sample { deflection: error, ..sample(0) };
    let (mut state, mut run) = (inverse.start::<16>(&first), forward.start::<16>(&first));
    let (mut worst, mut most, mut last) = (0.0_f64, 0.0_f64, S::ZERO);
    for row in 0..rows {
        let asked = S::from_f64(torque_at(row));
        let sample = sample::<S>(row);
        let found = inverse.commit(&mut state, asked, &sample);
        assert!(
            found.converged && found.gear.converged && !found.gear.refused && !found.gear.saturated,
            "{kinds:?} {row}"
        );
        let rate = (found.gear.theta - last).over(S::from_f64(PERIOD_S));
        last = found.gear.theta;
        let total = forward.step(&mut run, &Sample { deflection: found.measured, deflection_rate: rate, ..sample });
        assert!(!total.refused);
        worst = worst.max((total.torque - asked).to_f64().abs());
        most = most.max(total.terms.to_f64().abs()).max(1e4 * error.to_f64().abs());
    }
    (worst, most)
}

/// Every plant kind and shape but backlash, which is not fed forward.
fn plant_kinds() -> Vec<(&'static str, usize)> {
    let plant = KINDS.iter().filter(|info| info.side == Side::Plant && info.name != "backlash");
    let choices = |info: &KindInfo| {
        info.keys.iter().find_map(|key| if let Form::Choice(words) = key.form { Some(words.len()) } else { None })
    };
    plant.flat_map(|info| (0..choices(info).unwrap_or(1)).map(move |choice| (info.name, choice))).collect()
}

#[test]
fn what_the_inverse_finds_gives_the_torque_with_every_term() {
    for kind in plant_kinds() {
        let (worst, most) = round_trip::<f64>(&[kind], 4000);
        let acts = gmhm::terms::kind(kind.0).unwrap().domain != Domain::FrictionScale;
        assert!((most > 1e-3 || !acts) && worst < 2e-9, "{kind:?}: {worst:e} N·m, terms to {most}");
    }
}

#[test]
fn terms_together_are_inverted_in_both_precisions() {
    let together = [
        ("kinematic_error", 0),
        ("soft_windup", 0),
        ("nonlocal_memory", 0),
        ("coulomb_friction", 0),
        ("load_dependent_friction", 0),
        ("thermal_friction", 0),
        ("thermal_stiffness", 0),
        ("creep", 0),
    ];
    let (worst, most) = round_trip::<f64>(&together, 4000);
    assert!(most > 0.5 && worst < 5e-9, "{worst:e} of {most}");
    let (worst, _) = round_trip::<f32>(&together, 4000);
    // 6e-6 of the rated torque.
    assert!(worst < 2e-4, "{worst:e}");
}

#[test]
fn the_feed_forward_gives_friction_on_its_own_side() {
    let params = published();
    let settings = Settings { period_s: PERIOD_S, ramp_s: PERIOD_S, ..Settings::default() };
    let kinds = [("coulomb_friction", 0), ("thermal_friction", 0), ("kinematic_error", 0)];
    let on = Controls { on: true, source: Follows::Reference, ratio: 1.0 };
    for sigma in [-1.0, 1.0] {
        let make = |kinds: &[(&str, usize)]| {
            let feed_forward = FeedForward::<f64>::new(&params, &settings).unwrap();
            CompensatedFeedForward::new(feed_forward, &stack::<f64>(sigma, kinds))
        };
        let (with, bare) = (make(&kinds), make(&[]));
        let friction = stack::<f64>(sigma, &kinds);
        let mut state = with.start::<16>(&sample(0));
        // Where the gear is, the kinematic error being no part of it.
        let deflection = -friction.terms()[2].deflection_error(&sample(0));
        let mut plain = bare.start::<16>(&Sample { deflection, ..sample(0) });
        for row in 0..3000 {
            let demand = |torque: f64| Demand { torque, deflection: 0.0 };
            let asked = torque_at(row);
            let found = with.step(&mut state, &on, &demand(asked), &sample(row));
            let expected = friction.torque(&mut friction.start(), &sample(row));
            let error = friction.terms()[2].deflection_error(&sample(row));
            assert!(!found.refused && (found.joint_torque - found.base.gain * expected).abs() < 1e-12);
            // By a sensor at the output the gear carries the friction beside what the link gets; by the motor's current it does not.
            let carried = if sigma < 0.0 { asked - expected } else { asked };
            let base = bare.step(&mut plain, &on, &demand(carried), &sample(row));
            assert!((found.offset - base.offset - found.base.gain * error).abs() < 1e-15, "{sigma} {row}");
        }
        // What is no number holds the terms and says so.
        let held = with.step(&mut state, &on, &Demand { torque: f64::NAN, deflection: 0.0 }, &sample(3000));
        assert!(held.refused && held.offset.is_finite() && held.joint_torque.is_finite());
        let cold = Sample { temperature: f64::NAN, ..sample(3001) };
        let held = with.step(&mut state, &on, &Demand { torque: 1.0, deflection: 0.0 }, &cold);
        assert!(held.refused && held.offset.is_finite());
        let good = with.step(&mut state, &on, &Demand { torque: 1.0, deflection: 0.0 }, &sample(3002));
        assert!(!good.refused);
    }
}

/// A gear that softens by 0.1 % a kelvin is wound up further when it is warm.
#[test]
fn a_warm_gear_is_wound_up_further() {
    let params = published();
    let settings = Settings { period_s: PERIOD_S, ramp_s: PERIOD_S, ..Settings::default() };
    let setting = Setting { sigma: -1.0, c1: 2.4737e4, rated_deflection: RATED };
    let mut soft = Stack::<f64, 8>::of_gear(setting);
    soft.add("thermal_stiffness", &Keys(vec![("per_k", vec![1e-3]), ("reference_c", vec![20.0])], 0)).unwrap();
    let compensated = CompensatedFeedForward::new(FeedForward::<f64>::new(&params, &settings).unwrap(), &soft);
    let on = Controls { on: true, source: Follows::Reference, ratio: 1.0 };
    let at = |temperature: f64| {
        let mut state = compensated.start::<16>(&Sample::default());
        let mut offset = 0.0;
        for row in 0..=1000 {
            let torque = 0.01 * f64::from(row);
            let sample = Sample { temperature, ..sample(row) };
            offset = compensated.step(&mut state, &on, &Demand { torque, deflection: 0.0 }, &sample).offset;
        }
        offset
    };
    let (cold, warm) = (at(20.0), at(60.0));
    // 4 % of c1 θ, over a slope of about c1.
    assert!((warm / cold - 1.0 - 0.04).abs() < 0.01, "{}", warm / cold);
}

/// Other terms and another spring with the loop running: nothing jumps, and after the ramp the contribution is that of a feed-forward that had them all along.
#[test]
fn other_terms_come_into_force_without_a_step() {
    const RAMP_S: f64 = 0.2;
    let params = published();
    let softer = {
        let elastic = Elastic { c1_nm_per_rad: 2.2e4, ..params.elastic() };
        Params::new(RATED, elastic, params.memory()).unwrap()
    };
    let settings = Settings { period_s: PERIOD_S, ramp_s: RAMP_S, ..Settings::default() };
    let on = Controls { on: true, source: Follows::Reference, ratio: 1.0 };
    let make = |params: &Params, kinds: &[(&str, usize)]| {
        let feed_forward = FeedForward::<f64>::new(params, &settings).unwrap();
        CompensatedFeedForward::new(feed_forward, &stack::<f64>(1.0, kinds))
    };
    let before = make(&params, &[("coulomb_friction", 0)]);
    let after = make(&softer, &[("thermal_friction", 0), ("coulomb_friction", 0), ("kinematic_error", 0)]);
    // Everything stands, so that whatever changes is the change of parameters.
    let (still, demand) = (sample(700), Demand { torque: 12.0, deflection: 0.0 });
    let mut state = before.start::<16>(&still);
    let mut last = *state.last();
    for _ in 0..1000 {
        last = before.step(&mut state, &on, &demand, &still);
    }
    let old = last;
    after.take_over(&before.feed_forward, &mut state);
    let (mut offset, mut torque) = (0.0_f64, 0.0_f64);
    for _ in 0..400 {
        let now = after.step(&mut state, &on, &demand, &still);
        offset = offset.max((now.offset - last.offset).abs());
        torque = torque.max((now.joint_torque - last.joint_torque).abs());
        last = now;
    }
    let share = 1.01 * PERIOD_S / RAMP_S;
    let (moved, turned) = ((last.offset - old.offset).abs(), (last.joint_torque - old.joint_torque).abs());
    assert!(moved > 1e-5 && turned > 1e-3, "the change is one: {moved:e} rad, {turned} N·m");
    assert!(
        offset <= share * moved && torque <= share * turned,
        "{offset:e} of {moved:e} rad, {torque} of {turned} N·m"
    );

    // A restart of the memory makes no step either.
    after.restart(&mut state, 0.0);
    let first = after.step(&mut state, &on, &demand, &still);
    assert!((first.offset - last.offset).abs() <= share * RATED);
    assert_eq!(first.joint_torque, last.joint_torque);
}

/// What a running joint answers, its own gear gives back at the next sample.
#[test]
fn a_running_gear_is_solved_with_its_terms() {
    let params = published();
    let kinds = [("coulomb_friction", 0), ("soft_windup", 0), ("kinematic_error", 0), ("thermal_stiffness", 0)];
    let inverse = Inverse::<f64>::new(&params).unwrap();
    let joint = Compensated { gear: *inverse.gear(), stack: stack::<f64>(-1.0, &kinds) };
    let mut state = joint.start::<16>(&Sample { period: PERIOD_S, ..sample(0) });
    for row in 1..2000 {
        let sample = Sample { period: PERIOD_S, ..sample(row) };
        let asked = torque_at(row);
        let solved = state.solve(&inverse, &joint.stack, asked, &sample);
        assert!(solved.converged && !solved.gear.refused, "{row}");
        let theta = solved.gear.theta;
        let rate = (theta - state.gear().theta()) / PERIOD_S;
        let moved = joint.step(&mut state, &Sample { deflection: solved.measured, deflection_rate: rate, ..sample });
        assert!(solved.gear.saturated || (moved.torque - asked).abs() < 1e-6, "{row}: {} for {asked}", moved.torque);
    }
    let none = state.solve(&inverse, &joint.stack, f64::NAN, &sample(2000));
    assert!(none.gear.refused && none.measured == state.gear().theta());
}
