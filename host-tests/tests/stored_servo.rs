//! A servo of a stored block gives the torque of one that was built from SI parameters, bit for bit, in every law, with and without terms.

use std::f64::consts::TAU;

use crate::common::servos::{COUNTS, PERIOD_S, REFERENCE_COUNTS, counts, setup};
use crate::common::{A, params};
use gmhm::block::{CheckedTerms, Header, Identity, Joint, Parameters, Prepared, ScalarKind, Writer, verify};
use gmhm::drive::{CompensatedServo, Mounting, Reference, Servo, ServoSetup, TorqueShaft};
use gmhm::feedforward::{Controls, FeedForward, Limits, Settings, Source as Follows};
use gmhm::memory::AnyLaw;
use gmhm::terms::feedforward::CompensatedFeedForward;
use gmhm::terms::{Form, KeyInfo, Sample, Setting, Source, Stack, Value};
use gmhm::{Gate, Inverse, Kernel, Law, Params};

const ZERO_RAD: f64 = 0.1255;

/// The keys of the terms of this file.
struct Keys;

impl Source<f32> for Keys {
    fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, f32>> {
        Some(match (key.form, key.name) {
            (Form::Choice(_), _) => Value::Choice(0),
            (_, "orders") => Value::List(&[2.0]),
            (_, "cos_nm") => Value::List(&[2.0]),
            (_, "cos_rad") => Value::List(&[2e-5]),
            (Form::List { .. }, _) => Value::List(&[0.0]),
            (_, "torque_nm") => Value::Number(4.0),
            (_, "smoothing_rad_per_s") => Value::Number(0.02),
            (_, "reference_c") => Value::Number(20.0),
            (_, "per_k") => Value::Number(0.01),
            _ => Value::Number(0.5),
        })
    }
}

const KINDS: [&str; 5] = ["coulomb_friction", "torque_ripple", "kinematic_error", "thermal_friction", "inertia"];

fn every_law() -> [Params; 3] {
    [Law::Masing, Law::Phase, Law::Time].map(|law| params(law, Kernel::Deflection, Gate::Cycle))
}

/// What the servo of SI parameters is set to; its zero is that of the block.
fn servo_setup() -> ServoSetup {
    let setup = setup();
    let feed_forward = Settings {
        offset_slew_rad_per_s: 0.05,
        torque_slew_nm_per_s: 300.0,
        largest_rate_rad_per_s: 3.0,
        ..setup.feed_forward
    };
    ServoSetup {
        encoders: gmhm::drive::Setup { deflection_zero_rad: ZERO_RAD, ..setup.encoders },
        feed_forward,
        ..setup
    }
}

fn stored(params: &Params, kinds: &[&str]) -> Vec<u8> {
    let inverse = Inverse::<f32>::of(params, AnyLaw::new(params, PERIOD_S), PERIOD_S).expect("an inverse");
    let mut buffer = vec![0; 4096];
    let header = Header { period_s: PERIOD_S as f32, ..Header::new(Identity::of_name("joint 3"), ScalarKind::F32) };
    let mut writer = Writer::new(&mut buffer, header);
    writer.gear(inverse.gear(), params).expect("a gear");
    writer.inverse::<f32>(params, PERIOD_S).expect("an inverse");
    writer.self_test(inverse.gear(), Some(&inverse)).expect("room");
    writer.prepared(&inverse).expect("room");
    writer.joint(&Joint { ratio: Some(100.0), deflection_zero_rad: ZERO_RAD, motor_side: true }).expect("a joint");
    for kind in kinds {
        writer.term(kind, &Keys).expect("a term");
    }
    let length = writer.finish().expect("room");
    buffer.truncate(length);
    buffer
}

/// The reference and the counts of a period.
fn period(k: u32) -> (Reference<f32>, u32, u32, Sample<f32>) {
    let time = PERIOD_S * f64::from(k);
    let angle = 0.3 * (2.0 * time).sin();
    let (motor, output) = counts(angle, ZERO_RAD + 0.5 * A * (7.0 * time).sin());
    let sample = Sample {
        velocity: 0.6 * (2.0 * time).cos() as f32,
        acceleration: -1.2 * (2.0 * time).sin() as f32,
        temperature: 20.0 + 10.0 * time as f32,
        ..Sample::default()
    };
    let counts = (angle / TAU * f64::from(REFERENCE_COUNTS)).round() as i64;
    let torque = 15.0 * (7.0 * time).sin() as f32;
    (Reference { counts, torque, feed_forward: 0.1 }, motor, output, sample)
}

fn on(source: Follows) -> Controls<f32> {
    Controls { on: true, source, ratio: 0.8 }
}

#[test]
fn a_servo_of_a_stored_block_is_that_of_its_parameters() {
    let setup = servo_setup();
    let limits = Limits::of(&setup.feed_forward);
    let mounting = Mounting { counts_per_turn: COUNTS, reversed: false };
    for params in every_law() {
        let bytes = stored(&params, &[]);
        let block = verify(&bytes).expect("a block");
        let prepared = Prepared::<f32, AnyLaw<f32>>::of_block(&block, 16).expect("a good block");
        let loaded = Parameters::<f32, AnyLaw<f32>, ()>::of_block(&block, 16).expect("a good block");
        let encoders = prepared.encoders(&block, mounting, mounting).expect("a ratio");
        assert_eq!(loaded.encoders(mounting, mounting), Ok(encoders));
        let stored_setup = ServoSetup { encoders, ..setup };
        let of_block = |feed_forward| Servo::of_feed_forward(feed_forward, &stored_setup).expect("a servo");
        let servos = [
            Servo::new(&params, &setup).expect("a servo"),
            of_block(prepared.feed_forward(&limits).expect("limits")),
            of_block(loaded.feed_forward(&limits).expect("limits")),
        ];
        for source in [Follows::Reference, Follows::Measurement] {
            let (_, motor, output, _) = period(0);
            let mut states = servos.map(|servo| servo.start::<16>(motor, output, 0));
            for k in 0..3000 {
                let (reference, motor, output, _) = period(k);
                let torques: Vec<u32> = servos
                    .iter()
                    .zip(&mut states)
                    .map(|(servo, state)| servo.period(state, &on(source), &reference, motor, output).to_bits())
                    .collect();
                assert!(
                    torques.iter().all(|torque| *torque == torques[0]),
                    "{:?}, {source:?}, {k}",
                    params.memory().law
                );
                assert_eq!(states[0].contribution(), states[1].contribution());
            }
            assert!(states[0].contribution().hysteresis != 0.0);
        }
    }
}

#[test]
fn so_is_one_with_terms() {
    let setup = servo_setup();
    let limits = Limits::of(&setup.feed_forward);
    let mounting = Mounting { counts_per_turn: COUNTS, reversed: false };
    for params in every_law() {
        let bytes = stored(&params, &KINDS);
        let block = verify(&bytes).expect("a block");
        let prepared = Prepared::<f32, AnyLaw<f32>>::of_block(&block, 16).expect("a good block");
        let terms: CheckedTerms<8> = prepared.terms(&block).expect("terms");
        let encoders = prepared.encoders(&block, mounting, mounting).expect("a ratio");

        let mut stack = Stack::<f32, 8>::of_gear(Setting { sigma: 1.0, c1: 2.4737e4, rated_deflection: A as f32 });
        for kind in KINDS {
            stack.add(kind, &Keys).expect("a term");
        }
        let of = |feed_forward, stack: &Stack<f32, 8>, setup: &ServoSetup| {
            let feed_forward = CompensatedFeedForward::new(feed_forward, stack);
            CompensatedServo::new(feed_forward, setup, TorqueShaft::Motor).expect("a servo")
        };
        let from_si = of(FeedForward::<f32>::new(&params, &setup.feed_forward).expect("settings"), &stack, &setup);
        let from_block = of(
            prepared.feed_forward(&limits).expect("limits"),
            &terms.plant(&block),
            &ServoSetup { encoders, ..setup },
        );
        let (_, motor, output, sample) = period(0);
        let mut states = [&from_si, &from_block].map(|servo| servo.start::<16>(motor, output, 0, &sample));
        for k in 0..3000 {
            let (reference, motor, output, sample) = period(k);
            let [one, other] = [&from_si, &from_block];
            let [a, b] = &mut states;
            let torques = [(one, a), (other, b)].map(|(servo, state)| {
                servo.period(state, &on(Follows::Reference), &reference, &sample, motor, output).to_bits()
            });
            assert_eq!(torques[0], torques[1], "{:?}, {k}", params.memory().law);
        }
    }
}
