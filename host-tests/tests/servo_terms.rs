//! The servo with plant terms. Without terms it equals the plain servo bit for bit. With terms the link follows its reference better under friction and ripple. After bad input the torque recovers.
//!
//! `GMHM_FUZZ=10000000 cargo test --release -p gmhm-host-tests --test all servo_terms -- --nocapture` fuzzes as many periods; `GMHM_FUZZ_SEED` chooses others.

use std::f64::consts::TAU;

use crate::common::fuzz::{number, strange};
use crate::common::servos::*;
use crate::common::*;
use gmhm::drive::{CompensatedServo, CompensatedServoState, Reference, Servo, ServoSetup, TorqueShaft};
use gmhm::feedforward::{Controls, FeedForward, Settings, Source as Follows};
use gmhm::terms::feedforward::CompensatedFeedForward;
use gmhm::terms::{Form, KeyInfo, Sample, Setting, Source, Stack, Value};
use gmhm::{Gear, Params};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

type Terms = Stack<f32, 8>;
type Joint = CompensatedServoState<f32, 16>;

const FRICTION_NM: f32 = 4.0;
const SMOOTHING: f32 = 0.02;
const RIPPLE_NM: f32 = 2.0;

/// The keys of the terms of this file.
struct Keys;

impl Source<f32> for Keys {
    fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, f32>> {
        Some(match (key.form, key.name) {
            (Form::Choice(_), _) => Value::Choice(0),
            (_, "orders") => Value::List(&[2.0]),
            (_, "cos_nm") => Value::List(&[RIPPLE_NM]),
            (_, "cos_rad") => Value::List(&[2e-5]),
            (Form::List { .. }, _) => Value::List(&[0.0]),
            (_, "torque_nm") => Value::Number(FRICTION_NM),
            (_, "smoothing_rad_per_s") => Value::Number(SMOOTHING),
            (_, "reference_c") => Value::Number(20.0),
            (_, "per_k") => Value::Number(0.01),
            _ => Value::Number(0.5),
        })
    }
}

fn terms(sigma: f32, kinds: &[&str]) -> Terms {
    let mut terms = Terms::of_gear(Setting { sigma, c1: 2.4737e4, rated_deflection: A as f32 });
    for kind in kinds {
        terms.add(kind, &Keys).unwrap_or_else(|error| panic!("{kind}: {error}"));
    }
    terms
}

const EVERY: [&str; 8] = [
    "coulomb_friction",
    "viscous_friction",
    "torque_ripple",
    "kinematic_error",
    "thermal_friction",
    "thermal_stiffness",
    "presliding_friction",
    "inertia",
];

fn of(params: &Params, terms: &Terms, setup: &ServoSetup, torques: TorqueShaft) -> CompensatedServo<f32> {
    let feed_forward = FeedForward::<f32>::new(params, &setup.feed_forward).expect("an inverse");
    CompensatedServo::new(CompensatedFeedForward::new(feed_forward, terms), setup, torques).expect("a servo")
}

fn on(source: Follows) -> Controls<f32> {
    Controls { on: true, source, ratio: 1.0 }
}

/// The link's path, its velocity and acceleration.
fn path(time: f64) -> [f64; 3] {
    [0.3 * (2.0 * time).sin(), 0.6 * (2.0 * time).cos(), -1.2 * (2.0 * time).sin()]
}

fn reference_counts(angle: f64) -> i64 {
    (angle / TAU * f64::from(REFERENCE_COUNTS)).round() as i64
}

#[test]
fn without_terms_it_is_the_servo() {
    let (plain, with) = (servo(&masing()), of(&masing(), &terms(1.0, &[]), &setup(), TorqueShaft::Motor));
    for source in [Follows::Reference, Follows::Measurement] {
        let (motor, output) = counts(0.0, 0.0);
        let mut bare = plain.start::<16>(motor, output, 0);
        let mut state: Joint = with.start(motor, output, 0, &Sample::default());
        for k in 0..3000 {
            let time = PERIOD_S * f64::from(k);
            let [angle, ..] = path(time);
            let (motor, output) = counts(angle, 0.5 * A * (7.0 * time).sin());
            let torque = 15.0 * (7.0 * time).sin() as f32;
            let reference = Reference { counts: reference_counts(angle), torque, feed_forward: 0.1 };
            let expected = plain.period(&mut bare, &on(source), &reference, motor, output);
            let found = with.period(&mut state, &on(source), &reference, &Sample::default(), motor, output);
            assert_eq!(found.to_bits(), expected.to_bits(), "{source:?}, period {k}");
        }
    }
}

/// A motor, the published gear and a link, counted on the output side: how the link follows its path, rms over the second half, rad.
struct Plant {
    gear: Gear<f64>,
    sigma: f64,
    motor: [f64; 2],
    link: [f64; 2],
    torque: f64,
}

const MOTOR_KGM2: f64 = 2.0;
const LINK_KGM2: f64 = 3.0;

impl Plant {
    /// Moves on by a control period under a motor torque.
    fn period(&mut self, state: &mut gmhm::State<f64>, motor_nm: f64) {
        const STEPS: u32 = 20;
        let step = PERIOD_S / f64::from(STEPS);
        for _ in 0..STEPS {
            // With the torque taken on the motor side friction and ripple lie before the gear, else behind it.
            let speed = if self.sigma > 0.0 { self.motor[1] } else { self.link[1] };
            let ripple = f64::from(RIPPLE_NM) * (2.0 * 100.0 * self.motor[0]).cos();
            let joint = f64::from(FRICTION_NM) * (speed / f64::from(SMOOTHING)).tanh() + self.sigma * ripple;
            let [before, behind] = if self.sigma > 0.0 { [joint, 0.0] } else { [0.0, joint] };
            let damping = 30.0 * (self.motor[1] - self.link[1]);
            let carried = self.torque + damping;
            self.motor[1] += step * (motor_nm - carried - before) / MOTOR_KGM2;
            self.link[1] += step * (carried - behind) / LINK_KGM2;
            self.motor[0] += step * self.motor[1];
            self.link[0] += step * self.link[1];
            self.torque = self.gear.step(state, self.motor[0] - self.link[0]).torque;
        }
    }
}

/// The rms error of a link that follows its path, rad.
fn error_of(sigma: f64, kinds: &[&str]) -> f64 {
    let gains = gmhm::drive::Gains {
        position_per_s: 40.0,
        velocity_nms_per_rad: 200.0 * MOTOR_KGM2 / 100.0,
        integral_rad_per_s: 20.0,
        limit_nm: 90.0,
        ..gains()
    };
    let setup = ServoSetup { gains, ..setup() };
    let servo = of(&masing(), &terms(sigma as f32, kinds), &setup, TorqueShaft::Output);
    let gear = Gear::<f64>::new(&masing());
    let mut gear_state = gear.start(0.0);
    let [_, speed, _] = path(0.0);
    let mut plant = Plant { gear, sigma, motor: [0.0, speed], link: [0.0, speed], torque: 0.0 };
    let (motor, output) = counts(0.0, 0.0);
    let mut state: Joint = servo.start(motor, output, 0, &Sample::default());
    let (mut waiting, mut sum, mut rows) = (0.0, 0.0, 0.0);
    for k in 0..8000 {
        let time = PERIOD_S * f64::from(k);
        let [angle, velocity, acceleration] = path(time);
        let (motor, output) = counts(plant.link[0], plant.motor[0] - plant.link[0]);
        let torque = LINK_KGM2 * acceleration;
        let reference = Reference {
            counts: reference_counts(angle),
            torque: torque as f32,
            feed_forward: (torque + MOTOR_KGM2 * acceleration) as f32,
        };
        let sample = Sample { velocity: velocity as f32, temperature: 20.0, ..Sample::default() };
        let asked = servo.period(&mut state, &on(Follows::Reference), &reference, &sample, motor, output);
        plant.period(&mut gear_state, waiting);
        waiting = f64::from(asked);
        if k >= 4000 {
            sum += (plant.link[0] - path(time + PERIOD_S)[0]).powi(2);
            rows += 1.0;
        }
    }
    f64::sqrt(sum / rows)
}

#[test]
fn the_link_follows_in_spite_of_friction_and_ripple() {
    for sigma in [1.0, -1.0] {
        let without = error_of(sigma, &[]);
        let with = error_of(sigma, &["coulomb_friction", "torque_ripple"]);
        println!("sigma {sigma}: {without:.3e} rad without the terms, {with:.3e} rad with them");
        assert!(with < 0.4 * without, "sigma {sigma}: {with:e} rad, {without:e} rad without the terms");
    }
}

#[test]
fn a_joint_torque_is_a_share_of_the_motors() {
    // Standing at its reference, the servo gives what the terms ask for and nothing else.
    for (torques, share) in [(TorqueShaft::Motor, 0.01), (TorqueShaft::Output, 1.0)] {
        for sigma in [1.0, -1.0] {
            let stacked = terms(sigma, &["coulomb_friction", "thermal_friction"]);
            let limit_nm = 10.0;
            let gains = gmhm::drive::Gains { velocity_nms_per_rad: 0.0, limit_nm, ..gains() };
            let servo = of(&masing(), &stacked, &ServoSetup { gains, ..setup() }, torques);
            let (motor, output) = counts(0.0, 0.0);
            let mut state: Joint = servo.start(motor, output, 0, &Sample::default());
            let mut at = |velocity: f32, temperature: f32| {
                let sample = Sample { velocity, temperature, ..Sample::default() };
                let periods = (0..300).map(|_| {
                    servo.period(&mut state, &on(Follows::Reference), &Reference::default(), &sample, motor, output)
                });
                periods.last().expect("a period")
            };
            let [forward, warm, backward] = [at(0.5, 20.0), at(0.5, 30.0), at(-0.5, 20.0)];
            let expected = share * FRICTION_NM;
            assert!((forward - expected).abs() < 1e-3 * expected, "{torques:?} {sigma}: {forward}");
            assert!((warm - expected * (-0.1_f32).exp()).abs() < 1e-3 * expected, "{torques:?} {sigma}: {warm}");
            assert!((backward + expected).abs() < 1e-3 * expected, "{torques:?} {sigma}: {backward}");
        }
    }
}

#[test]
fn the_zero_of_the_encoders_moves_nothing() {
    let zero = 0.1255;
    let mut with_zero = setup();
    with_zero.encoders.deflection_zero_rad = zero;
    let servo = Servo::<f32>::new(&masing(), &with_zero).expect("a servo");
    let (motor, output) = counts(0.7, zero);
    let mut state = servo.start::<16>(motor, output, reference_counts(0.7));
    assert!(state.seen().deflection.abs() < 1e-5, "{} rad", state.seen().deflection);
    let reference = Reference { counts: reference_counts(0.7), ..Reference::default() };
    for _ in 0..100 {
        let torque = servo.period(&mut state, &Controls::default(), &reference, motor, output);
        // By a count of the output.
        assert!(torque.abs() < 0.01 * LIMIT_NM, "{torque} N·m at rest");
    }
}

/// The torque of a servo whose terms, gear, gains and start all change at a standing error.
#[test]
fn other_terms_make_no_step() {
    let first = of(&masing(), &terms(1.0, &["coulomb_friction"]), &setup(), TorqueShaft::Motor);
    let stiff = gmhm::drive::Gains { position_per_s: 80.0, velocity_nms_per_rad: 0.2, ..gains() };
    let stiff = ServoSetup { gains: stiff, ..setup() };
    let second = of(&masing(), &terms(-1.0, &EVERY), &stiff, TorqueShaft::Motor);
    let (motor, output) = counts(0.0, 0.0);
    let sample = Sample { velocity: 0.5, temperature: 40.0, ..Sample::default() };
    let reference = Reference { counts: 0, torque: 20.0, feed_forward: 0.0 };
    let mut state: Joint = first.start(motor, output, 0, &sample);
    let mut torque = 0.0_f32;
    let run = |servo: &CompensatedServo<f32>, state: &mut Joint, torque: &mut f32| {
        (0..300).fold(0.0_f32, |largest, _| {
            let now = servo.period(state, &on(Follows::Reference), &reference, &sample, motor, output);
            largest.max((std::mem::replace(torque, now) - now).abs())
        })
    };
    run(&first, &mut state, &mut torque);
    let most = 0.02 * LIMIT_NM + 0.03;
    second.take_over(&first, &mut state);
    let changed = run(&second, &mut state, &mut torque);
    assert!(changed <= most, "{changed} N·m at other terms");
    second.restart(&mut state, motor, output, 0);
    let restarted = run(&second, &mut state, &mut torque);
    assert!(restarted <= most, "{restarted} N·m at another start");
}

/// Whatever a period brings, the torque stays within its limit, and two good periods later it is that of a servo that saw nothing bad.
#[test]
fn fuzzed_servos_with_terms_stay_within_their_limit_and_come_back() {
    for (sigma, seed) in [(1.0, 0), (-1.0, 1)] {
        let servos =
            [&EVERY[..], &EVERY[..5]].map(|kinds| of(&masing(), &terms(sigma, kinds), &setup(), TorqueShaft::Motor));
        let mut dice = ChaCha8Rng::seed_from_u64(2 * number("GMHM_FUZZ_SEED", 1) + seed);
        let (motor, output) = counts(0.0, 0.0);
        let mut state: Joint = servos[0].start(motor, output, 0, &Sample::default());
        let (mut good, mut refused, mut servo, mut alike) = (0, 0_u64, 0, 0);
        for k in 0..number("GMHM_FUZZ", 100_000) / 2 {
            let time = k as f64 * PERIOD_S;
            let [angle, velocity, acceleration] = path(time);
            let deflection = 0.5 * A * (3.0 * time).sin();
            let (mut motor, mut output) = counts(angle, deflection);
            let mut reference = Reference {
                counts: reference_counts(angle),
                torque: (12.0 * (3.0 * time).sin()) as f32,
                feed_forward: 0.1,
            };
            let mut sample = Sample {
                time: time as f32,
                velocity: velocity as f32,
                acceleration: acceleration as f32,
                temperature: 25.0,
                motor_velocity: 100.0 * velocity as f32,
                output_velocity: velocity as f32,
                ..Sample::default()
            };
            let mut controls = on(if k / 5000 % 2 == 0 { Follows::Reference } else { Follows::Measurement });
            good += 1;
            if dice.random_range(0..10) == 0 {
                good = 0;
                match dice.random_range(0..10) {
                    0 => motor = dice.random(),
                    1 => output = dice.random(),
                    2 => reference.torque = strange(&mut dice),
                    3 => reference.feed_forward = strange(&mut dice),
                    4 => reference.counts = dice.random(),
                    5 => sample.velocity = strange(&mut dice),
                    6 => sample.temperature = strange(&mut dice),
                    7 => sample.acceleration = strange(&mut dice),
                    8 => controls.ratio = strange(&mut dice),
                    _ => {
                        (sample.velocity, sample.time, motor) = (strange(&mut dice), strange(&mut dice), dice.random())
                    }
                }
            }
            alike += 1;
            if dice.random_range(0..1000) == 0 {
                let next = 1 - servo;
                servos[next].take_over(&servos[servo], &mut state);
                (servo, alike) = (next, 0);
            }
            let torque = servos[servo].period(&mut state, &controls, &reference, &sample, motor, output);
            assert!(torque.abs() <= LIMIT_NM, "{torque} N·m in period {k}");
            let now = *state.compensation();
            let fed = [now.offset, now.gear_torque, now.joint_torque];
            assert!(fed.iter().all(|x| !x.is_nan()), "{now:?} in period {k}");
            // The range, and behind a take-over what is between two ends of it.
            assert!(now.offset.abs() <= 3.2 * A as f32, "{now:?} in period {k}");
            refused += u64::from(state.is_refused());
            // A period works on the counts of the one before.
            if good >= 2 {
                assert!(!state.is_refused() && !now.refused, "period {k}: {now:?}");
                // Behind a take-over it begins where a misread sample may have brought it.
                let most = if alike <= 100 { 65.0 * 31.0 } else { FRICTION_NM + 8.0 };
                assert!(now.joint_torque.abs() < most && now.gear_torque.abs() < most, "period {k}: {now:?}");
                let seen = f64::from(state.seen().deflection);
                assert!((seen - deflection).abs() < 0.02 * A, "period {k}: {seen} rad for {deflection} rad");
            }
        }
        println!("servo with terms, sigma {sigma}: {refused} periods refused");
        assert!(refused > 0);
    }
}

/// A sample without numbers counts as a period without a torque reference: what was fed forward fades, and is back within the ramp.
#[test]
fn what_is_fed_forward_fades_while_a_sensor_says_nothing() {
    let stacked = terms(1.0, &["coulomb_friction", "thermal_friction"]);
    let settings = Settings { period_s: PERIOD_S, ramp_s: RAMP_S, ..Settings::default() };
    assert_eq!(setup().feed_forward, settings);
    let servo = of(&masing(), &stacked, &setup(), TorqueShaft::Motor);
    let (motor, output) = counts(0.0, 0.0);
    let good = Sample { velocity: 0.5, temperature: 20.0, ..Sample::default() };
    let mut state: Joint = servo.start(motor, output, 0, &good);
    let mut last = 0.0;
    for (temperature, expected) in [(20.0, FRICTION_NM), (f32::NAN, 0.0), (20.0, FRICTION_NM)] {
        for _ in 0..(RAMP_S / PERIOD_S) as u32 + 2 {
            let sample = Sample { temperature, ..good };
            let _ = servo.period(&mut state, &on(Follows::Reference), &Reference::default(), &sample, motor, output);
            let now = state.compensation();
            assert_eq!(now.refused, temperature.is_nan());
            assert!((now.joint_torque - last).abs() <= 1.01 * FRICTION_NM * (PERIOD_S / RAMP_S) as f32, "{now:?}");
            last = now.joint_torque;
        }
        assert!((last - expected).abs() < 1e-3 * FRICTION_NM, "{last} at {temperature}");
    }
}
