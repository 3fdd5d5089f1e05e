//! The servo in lock-step: bodies carry it to the bit, and whatever comes over the line, nothing panics and nothing is set going by half.

use crate::common::masing;
use gmhm::drive::lockstep::{self, Drive, Period, Start};
use gmhm::drive::{Gains, Mounting, Reference, ServoSetup, Setup};
use gmhm::feedforward::{Controls, Settings, Source};
use gmhm::link::frame::{self, Receiver};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const COUNTS: u32 = 1 << 20;

fn start(source: Source) -> Start {
    let mounting = Mounting { counts_per_turn: COUNTS, reversed: false };
    let encoders = Setup {
        motor: mounting,
        output: mounting,
        ratio: (100, 1),
        deflection_zero_rad: 0.0,
        rated_deflection_rad: masing().rated_deflection_rad(),
    };
    let gains = Gains {
        period_s: 5e-4,
        position_per_s: 60.0,
        velocity_nms_per_rad: 2.0,
        integral_rad_per_s: 60.0,
        filter_rad_per_s: 1900.0,
        limit_nm: 90.0,
    };
    let feed_forward = Settings { period_s: gains.period_s, ramp_s: 0.1, ..Settings::default() };
    let setup = ServoSetup { encoders, reference_counts_per_turn: 1 << 30, gains, feed_forward };
    Start { params: masing(), setup, controls: Controls { on: true, source, ratio: 1.0 } }
}

/// The k-th period of a swing, the motor following a little behind.
fn period(k: u32) -> Period {
    let phase = 0.01 * f64::from(k);
    let reference = Reference {
        counts: (1e6 * phase.sin()) as i64,
        torque: (20.0 * (0.7 * phase.sin() + 0.3 * (3.1 * phase).sin())) as f32,
        feed_forward: (5.0 * phase.cos()) as f32,
    };
    let motor = (1e5 * (phase - 0.03).sin()).rem_euclid(f64::from(COUNTS)) as u32;
    Period { reference, motor, output: (1e3 * phase.sin()).rem_euclid(f64::from(COUNTS)) as u32 }
}

/// What a drive at the other end of a line of frames answers.
fn ask(drive: &mut Drive, request: &[u8]) -> Option<f32> {
    let mut line = Receiver::new();
    let frame = frame::encode(request);
    let heard = frame.iter().find_map(|byte| line.feed(*byte).map(<[u8]>::to_vec)).expect("a frame");
    drive.answer(&heard).and_then(|answer| lockstep::torque(&answer))
}

#[test]
fn a_drive_answers_the_torques_of_its_servo() {
    for source in [Source::Reference, Source::Measurement] {
        let start = start(source);
        let servo = start.servo().expect("a servo");
        let mut state = servo.start::<16>(0, 0, 0);
        let mut drive = Drive::default();
        assert_eq!(ask(&mut drive, &start.encode()), Some(0.0));
        let mut largest = 0.0_f32;
        for period in (0..5000).map(period) {
            let Period { reference, motor, output } = period;
            let torque = servo.period(&mut state, &start.controls, &reference, motor, output);
            assert_eq!(ask(&mut drive, &period.encode()).map(f32::to_bits), Some(torque.to_bits()));
            largest = largest.max(torque.abs());
        }
        assert!(largest > 1.0, "nothing happened: {largest}");
    }
}

#[test]
fn nothing_is_controlled_before_a_start_and_nothing_after_a_refused_one() {
    let mut drive = Drive::default();
    assert_eq!(ask(&mut drive, &period(1).encode()), None);
    let good = start(Source::Reference);
    assert_eq!(ask(&mut drive, &good.encode()), Some(0.0));
    assert!(ask(&mut drive, &period(1).encode()).is_some());
    let mut setup = good.setup;
    setup.encoders.motor.counts_per_turn = 0;
    assert_eq!(ask(&mut drive, &Start { setup, ..good }.encode()), None);
    assert_eq!(ask(&mut drive, &period(2).encode()), None);
}

#[test]
fn whatever_comes_nothing_panics() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let mut drive = Drive::default();
    for round in 0..20_000 {
        let mut body = match round % 3 {
            0 => start(Source::Measurement).encode().to_vec(),
            1 => period(round).encode().to_vec(),
            _ => Vec::new(),
        };
        for byte in &mut body {
            if random.random_range(0..20) == 0 {
                *byte = random.random();
            }
        }
        body.truncate(random.random_range(0..=body.len()));
        let _ = drive.answer(&body);
    }
}
