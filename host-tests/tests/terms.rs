//! Terms: the registry against the documented keys, `f32` against `f64`, and inputs that are none.

use std::f64::consts::TAU;

use gmhm::scalar::Float;
use gmhm::terms::{
    Compensated, Domain, Form, KINDS, KeyInfo, KindInfo, Sample, Setting, Side, Source, Stack, Term, TermError, Value,
    kind,
};
use gmhm::{Elastic, Gear, Memory, Params};
use proptest::prelude::*;

/// Kinds, their side, and their keys, as model files have them.
const DOCUMENTED: [(&str, Side, &[&str]); 28] = [
    ("kinematic_error", Side::Plant, &["orders", "cos_rad", "sin_rad", "angle"]),
    ("torque_ripple", Side::Plant, &["orders", "cos_nm", "sin_nm", "angle"]),
    ("encoder_eccentricity", Side::Instrument, &["cos_rad", "sin_rad"]),
    ("gravity_load", Side::Plant, &["cos_nm", "sin_nm"]),
    ("coulomb_friction", Side::Plant, &["torque_nm", "smoothing_rad_per_s"]),
    ("viscous_friction", Side::Plant, &["damping_nms_per_rad", "exponent"]),
    (
        "stribeck_friction",
        Side::Plant,
        &[
            "coulomb_nm",
            "static_nm",
            "stribeck_velocity_rad_per_s",
            "exponent",
            "damping_nms_per_rad",
            "smoothing_rad_per_s",
        ],
    ),
    ("load_dependent_friction", Side::Plant, &["mu", "smoothing_rad_per_s"]),
    ("position_dependent_friction", Side::Plant, &["angle", "orders", "cos_nm", "sin_nm", "smoothing_rad_per_s"]),
    ("viscous_damping", Side::Plant, &["damping_nms_per_rad"]),
    ("inertia", Side::Plant, &["inertia_kgm2"]),
    (
        "soft_windup",
        Side::Plant,
        &[
            "shape",
            "stiffness_drop_nm_per_rad",
            "width_rad",
            "k1_nm_per_rad",
            "k2_nm_per_rad",
            "k3_nm_per_rad",
            "t1_nm",
            "t2_nm",
        ],
    ),
    ("stiffness_asymmetry", Side::Plant, &["shape", "stiffness_nm_per_rad2", "stiffness_nm_per_rad"]),
    ("backlash", Side::Plant, &["shape", "half_gap_rad"]),
    ("nonlocal_memory", Side::Plant, &["radius_rad", "torque_nm"]),
    ("creep", Side::Plant, &["tau_s", "stiffness_nm_per_rad"]),
    ("time_skew", Side::Instrument, &["delay_s"]),
    ("sensor_drift", Side::Instrument, &["nm_per_s"]),
    ("thermal_stiffness", Side::Plant, &["per_k", "reference_c"]),
    ("thermal_friction", Side::Plant, &["per_k", "reference_c"]),
    ("thermal_zero_drift", Side::Instrument, &["nm_per_k", "reference_c"]),
    ("wear", Side::Plant, &["shape", "stiffness_drop_nm_per_rad", "start_s", "duration_s"]),
    ("unknown", Side::Instrument, &["coordinate", "knots", "values_nm"]),
    ("torque_scale", Side::Instrument, &["gain_error"]),
    ("load_dependent_memory", Side::Plant, &["radius_rad", "torque_nm", "load_linear", "load_quadratic"]),
    ("presliding_friction", Side::Plant, &["torque_nm", "radius_rad"]),
    ("encoder_skew", Side::Instrument, &["delay_s"]),
    ("ripple_resonance", Side::Plant, &["orders", "cos_nm", "sin_nm", "frequency_hz", "damping_ratio", "angle"]),
];

#[test]
fn the_registry_holds_the_documented_kinds_and_keys() {
    assert_eq!(KINDS.len(), DOCUMENTED.len());
    for (name, side, keys) in DOCUMENTED {
        let info = kind(name).unwrap_or_else(|| panic!("{name} is not in the registry"));
        let found: Vec<&str> = info.keys.iter().map(|key| key.name).collect();
        assert_eq!((info.side, found.as_slice()), (side, keys), "{name}");
        for key in info.keys {
            assert!(!key.words.is_empty());
            if !matches!(key.form, Form::Choice(_)) && key.name != "knots" {
                assert!(key.plausible.0 < key.plausible.1, "{name} {}", key.name);
            }
        }
    }
}

/// Values of one term.
#[derive(Debug, Clone)]
struct Keys<S>(Vec<(&'static str, Vec<S>)>, usize);

impl<S: Float> Keys<S> {
    /// Values for a kind: numbers for its keys in turn (one a list element), and the number of its choice.
    fn new(info: &KindInfo, choice: usize, length: usize, number: &mut dyn FnMut(&KeyInfo, usize) -> f64) -> Self {
        let keys = info.keys.iter().filter(|key| !matches!(key.form, Form::Choice(_)));
        let values = keys.map(|key| {
            let count = if let Form::List { .. } = key.form { length } else { 1 };
            (key.name, (0..count).map(|i| S::from_f64(number(key, i))).collect())
        });
        Self(values.collect(), choice)
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

const RATED: f64 = 1.168e-3;

fn published() -> Params {
    let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
    let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
    Params::new(RATED, elastic, memory).unwrap()
}

fn setting<S: Float>() -> Setting<S> {
    Setting { sigma: -S::ONE, c1: S::from_f64(2.4737e4), rated_deflection: S::from_f64(RATED) }
}

fn compensated<S: Float<Carry = S>>(terms: impl IntoIterator<Item = Term<S>>) -> Compensated<S> {
    let mut stack = Stack::of_gear(setting());
    terms.into_iter().for_each(|term| stack.push(term).unwrap());
    Compensated { gear: Gear::new(&published()), stack }
}

fn read<S: Float<Carry = S>>(kind: &str, keys: &Keys<S>) -> Result<Term<S>, TermError> {
    Term::read(kind, keys, setting())
}

/// 20 s of a running joint at 1 kHz, rounded to `f32`. The motor angle is reduced to one turn.
fn ride() -> Vec<Sample<f32>> {
    let mut last = None::<f64>;
    (0..20_000_u32)
        .map(|k| {
            let t = f64::from(k) * 1e-3;
            let load = (1.3 * t).sin() * (0.6 + 0.4 * (0.31 * t).cos());
            let output = 1.5 * (0.7 * t).sin();
            let deflection = 0.98 * RATED * load;
            let rate = last.map_or(0.0, |x| (deflection - x) / 1e-3);
            last = Some(deflection);
            Sample {
                time: t as f32,
                period: if k == 0 { 0.0 } else { 1e-3 },
                motor_angle: (100.0 * (output + deflection)).rem_euclid(TAU) as f32,
                output_angle: output as f32,
                deflection: deflection as f32,
                deflection_rate: rate as f32,
                velocity: (1.05 * (0.7 * t).cos()) as f32,
                acceleration: (-0.735 * (0.7 * t).sin()) as f32,
                temperature: (25.0 + 0.4 * t) as f32,
                motor_velocity: (105.0 * (0.7 * t).cos()) as f32,
                output_velocity: (1.05 * (0.7 * t).cos()) as f32,
                simulated_torque: (30.0 * load) as f32,
                ..Sample::default()
            }
        })
        .collect()
}

fn widened(sample: &Sample<f32>) -> Sample<f64> {
    Sample {
        time: sample.time.into(),
        period: sample.period.into(),
        motor_angle: sample.motor_angle.into(),
        output_angle: sample.output_angle.into(),
        deflection: sample.deflection.into(),
        deflection_rate: sample.deflection_rate.into(),
        velocity: sample.velocity.into(),
        acceleration: sample.acceleration.into(),
        temperature: sample.temperature.into(),
        motor_velocity: sample.motor_velocity.into(),
        output_velocity: sample.output_velocity.into(),
        simulated_torque: sample.simulated_torque.into(),
        ..Sample::default()
    }
}

/// Values in the upper half of the plausible range, lists spread over it, the same in both precisions.
fn plausible(key: &KeyInfo, i: usize) -> f64 {
    let (low, high) = key.plausible;
    let value = match key.name {
        "orders" => [1.0, 2.0, 4.0][i],
        "frequency_hz" => 40.0,
        "knots" => [-0.8, 0.1, 0.9][i],
        "start_s" => 5.0,
        "duration_s" => 8.0,
        "reference_c" => 22.0,
        "half_gap_rad" => 3e-5,
        "k1_nm_per_rad" => 16e3,
        "k2_nm_per_rad" => 20e3,
        "k3_nm_per_rad" => 23e3,
        "t1_nm" => 4.0,
        "t2_nm" => 12.0,
        _ => low + (high - low) * [0.6, 0.75, 0.9][i],
    };
    f64::from(value as f32)
}

/// Largest error of the terms' torque in `f32` over that ride, as a share of the largest torque they have; deflection terms: error of the total over the rated torque.
const F32_ERRORS: [(&str, usize, f64); 34] = [
    ("kinematic_error", 0, 9.5e-7),
    ("torque_ripple", 0, 2.5e-7),
    ("encoder_eccentricity", 0, 1.5e-6),
    ("gravity_load", 0, 2.0e-7),
    ("coulomb_friction", 0, 1.5e-7),
    ("viscous_friction", 0, 5.5e-8),
    ("stribeck_friction", 0, 10.0e-8),
    ("load_dependent_friction", 0, 3.0e-7),
    ("position_dependent_friction", 1, 2.0e-7),
    ("viscous_damping", 0, 3.5e-8),
    ("inertia", 0, 5.0e-8),
    ("soft_windup", 0, 2.0e-7),
    ("soft_windup", 1, 1.5e-7),
    ("soft_windup", 2, 2.0e-7),
    ("soft_windup", 3, 1e-7),
    ("stiffness_asymmetry", 0, 1.5e-7),
    ("backlash", 0, 2.0e-7),
    ("backlash", 1, 2.0e-7),
    ("nonlocal_memory", 0, 1.5e-7),
    ("creep", 0, 1.5e-7),
    ("thermal_stiffness", 0, 1.5e-7),
    ("thermal_friction", 0, 1.5e-7),
    ("thermal_zero_drift", 0, 5.5e-8),
    ("sensor_drift", 0, 4.0e-8),
    ("wear", 1, 4.0e-8),
    ("unknown", 2, 7.5e-8),
    ("torque_scale", 0, 1e-7),
    ("load_dependent_memory", 0, 2.5e-7),
    ("presliding_friction", 0, 1.5e-6),
    ("encoder_skew", 0, 4.5e-7),
    ("ripple_resonance", 0, 3e-7),
    ("ripple_resonance", 1, 3.5e-7),
    ("torque_ripple", 1, 3.5e-7),
    ("viscous_friction", 1, 1.5e-7),
];

/// The gear with one term, and with some friction where the term scales friction.
fn with_term<S: Float<Carry = S>>(info: &KindInfo, choice: usize) -> Compensated<S> {
    // Orders of the output are above 1.
    let of_output = choice == 1 && info.keys.iter().any(|key| key.name == "angle" && key.appended);
    let mut number = |key: &KeyInfo, i: usize| match key.name {
        "orders" if of_output => [2.0, 3.0, 5.0][i],
        _ => plausible(key, i),
    };
    let mut term = |info: &KindInfo, choice| {
        let mut keys = Keys::<S>::new(info, choice, 3, &mut number);
        // Later keys are stated in a second row of their kind.
        keys.0.retain(|(name, _)| choice > 0 || info.key(name).is_some_and(|key| !key.appended));
        read(info.name, &keys).unwrap()
    };
    let friction = (info.domain == Domain::FrictionScale).then(|| term(kind("viscous_friction").unwrap(), 0));
    compensated(friction.into_iter().chain([term(info, choice)]))
}

#[test]
fn single_precision_is_as_good_as_stated() {
    let ride = ride();
    let mut wrong = Vec::new();
    for (name, choice, stated) in F32_ERRORS {
        let info = kind(name).unwrap();
        let (narrow, wide) = (with_term::<f32>(info, choice), with_term::<f64>(info, choice));
        let mut narrow_state = narrow.start::<16>(&ride[0]);
        let mut wide_state = wide.start::<16>(&widened(&ride[0]));
        let (mut error, mut largest) = (0.0_f64, 0.0_f64);
        for sample in &ride[1..] {
            let (a, b) = (narrow.step(&mut narrow_state, sample), wide.step(&mut wide_state, &widened(sample)));
            assert!(!a.refused && !b.refused, "{name}");
            if info.domain == Domain::Deflection {
                error = error.max((f64::from(a.torque) - b.torque).abs());
                largest = published().rated_torque_nm();
            } else {
                error = error.max((f64::from(a.terms) - b.terms).abs());
                largest = largest.max(b.terms.abs());
            }
        }
        let share = error / largest;
        if share > stated || share <= 0.3 * stated {
            wrong.push(format!("{name} {choice}: measured {share:.2e}, stated {stated:.1e}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Numbers that a broken sensor or file may hold.
fn hostile() -> impl Strategy<Value = f32> {
    prop_oneof![
        Just(f32::NAN),
        Just(f32::INFINITY),
        Just(-f32::MAX),
        Just(0.0_f32),
        Just(f32::MIN_POSITIVE),
        Just(1e-45_f32),
        any::<f32>(),
        -1.0..1.0_f32,
        -1e-3..1e-3_f32,
    ]
}

fn hostile_sample() -> impl Strategy<Value = Sample<f32>> {
    prop::collection::vec(hostile(), 12).prop_map(|x| Sample {
        time: x[0],
        period: x[1],
        motor_angle: x[2],
        output_angle: x[3],
        deflection: x[4],
        deflection_rate: x[5],
        velocity: x[6],
        acceleration: x[7],
        temperature: x[8],
        motor_velocity: x[9],
        output_velocity: x[10],
        simulated_torque: x[11],
        ..Sample::default()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn no_number_makes_a_term_panic_or_poisons_it(
        which in 0..KINDS.len(),
        choice in 0..12_usize,
        length in 1..40_usize,
        tame in any::<bool>(),
        numbers in prop::collection::vec(hostile(), 40),
        samples in prop::collection::vec(hostile_sample(), 1..20),
    ) {
        let info = &KINDS[which];
        let mut drawn = numbers.iter().cycle();
        let mut draw = |key: &KeyInfo, i: usize| {
            let hostile = f64::from(*drawn.next().unwrap());
            if tame { plausible(key, i % 3) + f64::from(i as u32) } else { hostile }
        };
        let keys = Keys::<f32>::new(info, choice, length, &mut draw);
        let Ok(term) = read(info.name, &keys) else { return Ok(()) };
        let gear = compensated([term]);
        let mut state = gear.start::<4>(&samples[0]);
        for sample in &samples {
            let total = gear.step(&mut state, sample);
            prop_assert!(total.torque.is_finite() && total.deflection.is_finite(), "{} {keys:?} {sample:?}", info.name);
        }
        // Whatever came before, a good sample is answered, unless the parameters alone overflow.
        let good = Sample { period: 1e-3, deflection: 1e-4, ..Sample::default() };
        let total = gear.step(&mut state, &good);
        prop_assert!(total.torque.is_finite());
        if tame {
            prop_assert!(!total.refused, "{} {keys:?}", info.name);
        }
    }
}

#[test]
fn a_correction_that_overflows_is_refused_and_forgotten() {
    let huge = -f32::MAX;
    let keys = Keys(vec![("cos_rad", vec![huge]), ("sin_rad", vec![huge])], 0);
    let gear = compensated([read::<f32>("encoder_eccentricity", &keys).unwrap()]);
    let at = |output_angle: f32| Sample { period: 1e-3, output_angle, deflection: 1e-4, ..Sample::default() };
    let mut state = gear.start::<4>(&at(0.76));
    assert!(state.last().refused && state.last().torque.is_finite() && state.last().deflection.is_finite());
    // A quarter of a turn against the phase nothing is left of the wave but rounding, and that is far outside every gear.
    for angle in [0.76, 2.356_194_5] {
        let total = gear.step(&mut state, &at(angle));
        assert!(total.refused && total.torque.is_finite() && total.deflection.is_finite());
    }
}

#[test]
fn lists_and_stacks_have_an_end() {
    for info in KINDS {
        for key in info.keys {
            let Form::List { most } = key.form else { continue };
            let keys = |length| Keys::<f64>::new(info, 0, length, &mut |_, i| 1.0 + i as f64);
            assert!(read(info.name, &keys(most)).is_ok(), "{}", info.name);
            let refused = read(info.name, &keys(most + 1));
            assert!(matches!(refused, Err(TermError::TooMany { most: m, .. }) if m == most), "{refused:?}");
            assert!(matches!(read(info.name, &keys(0)), Err(TermError::Empty { .. })), "{}", info.name);
        }
    }
    let mut stack = Stack::<f64, 2>::of_joint(setting());
    let drift = || read("sensor_drift", &Keys(vec![("nm_per_s", vec![1.0])], 0)).unwrap();
    stack.push(drift()).unwrap();
    stack.push(drift()).unwrap();
    assert_eq!(stack.push(drift()), Err(TermError::StackFull));
    assert_eq!(stack.plant().terms().len(), 0);
}

/// T_base is the load of a joint, and the simulated torque alone where there is one.
#[test]
fn friction_follows_the_load_of_a_joint_and_the_torque_of_a_simulation() {
    let keys =
        |values: &[(&'static str, f64)]| Keys(values.iter().map(|(key, value)| (*key, vec![*value])).collect(), 0);
    let friction = keys(&[("mu", 0.1), ("smoothing_rad_per_s", 1e-3)]);
    let gravity = keys(&[("cos_nm", 8.0), ("sin_nm", 0.0)]);
    let sample = Sample { velocity: 1.0, simulated_torque: -20.0, output_angle: 0.0, ..Sample::default() };
    for (mut stack, load) in [(Stack::<f64, 2>::of_joint(setting()), 8.0), (Stack::of_simulation(setting()), 20.0)] {
        stack.push(read("load_dependent_friction", &friction).unwrap()).unwrap();
        stack.push(read("gravity_load", &gravity).unwrap()).unwrap();
        let sigma = setting::<f64>().sigma;
        let torque = stack.torque(&mut stack.start(), &sample);
        let whole = stack.load(&mut stack.start(), &sample) + sigma * 0.1 * load;
        assert!((torque - whole).abs() < 1e-12, "{torque} N·m is not {whole} N·m");
        assert!((stack.load(&mut stack.start(), &sample).abs() - 8.0).abs() < 1e-12);
    }
}

/// With all places taken a new term makes room of one that does not go on.
#[test]
fn a_term_goes_on_where_all_places_are_taken() {
    fn torques<const K: usize>() -> Vec<f32> {
        let term = |name: &str| {
            kind(name).map(|info| Term::read(name, &Keys::new(info, 0, 1, &mut plausible), setting()).unwrap())
        };
        let gear = |names: [&str; 2]| {
            let mut stack = Stack::<f32, K>::of_gear(setting());
            names.iter().filter_map(|name| term(name)).for_each(|term| stack.push(term).unwrap());
            Compensated { gear: Gear::<f32>::new(&published()), stack }
        };
        let [before, after] = [["coulomb_friction", "creep"], ["viscous_friction", "creep"]].map(gear);
        let ride = ride();
        let mut state = before.start::<16>(&ride[0]);
        ride[1..2000].iter().for_each(|sample| _ = before.step(&mut state, sample));
        after.take_over(&before.gear, &mut state);
        ride[2000..2100].iter().map(|sample| after.step(&mut state, sample).torque).collect()
    }
    assert_eq!(torques::<2>(), torques::<8>());
}

#[test]
fn a_refused_sample_leaves_everything_as_it_was() {
    let ride = ride();
    for info in KINDS {
        let gear = with_term::<f32>(info, 0);
        let mut plain = gear.start::<16>(&ride[0]);
        let mut disturbed = gear.start::<16>(&ride[0]);
        for sample in &ride[1..200] {
            let refused = gear.step(&mut disturbed, &Sample { velocity: f32::NAN, ..*sample });
            assert!(refused.refused);
            let refused = gear.step(&mut disturbed, &Sample { deflection: 1e9, ..*sample });
            assert!(refused.refused);
            assert_eq!(gear.step(&mut plain, sample), gear.step(&mut disturbed, sample), "{}", info.name);
        }
    }
}
