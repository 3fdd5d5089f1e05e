//! The servo of one joint and nothing else, its law chosen at run time: what a drive pays in bytes, and proof that no law on it can panic or calls
//! double-precision arithmetic. `cargo xtask size` reads its symbols; there is nothing to run.
#![no_std]
#![no_main]

mod path;

use core::hint::black_box;

use gmhm::drive::servo::{Reference, Servo, ServoState};
use gmhm::feedforward::Controls;

type Joint = ServoState<f32, 16>;

path::image! {
    servo: Servo<f32>, state: Joint,
    start servo.start(black_box(0), black_box(0), black_box(0)),
    tick {
        let (controls, reference) = black_box((Controls::default(), Reference::default()));
        black_box(period(servo, state, &controls, &reference, black_box(0), black_box(0)));
    }
}

/// The control period, from the reference of the output and the counts of both encoders to the torque of the motor.
#[inline(never)]
#[unsafe(no_mangle)]
fn period(
    servo: &Servo<f32>,
    state: &mut Joint,
    controls: &Controls<f32>,
    reference: &Reference<f32>,
    motor: u32,
    output: u32,
) -> f32 {
    servo.period(state, controls, reference, motor, output)
}
