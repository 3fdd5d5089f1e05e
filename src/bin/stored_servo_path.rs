//! The servo of one joint and its terms, from the bytes of a stored block to the torque of the motor: what a drive pays in bytes that sets up everything from flash, and proof that nothing
//! on the way can panic or calls double-precision arithmetic. `cargo xtask size` reads its symbols; there is nothing to run.
#![no_std]
#![no_main]

mod path;

use core::hint::black_box;

use gmhm::block::Parameters;
use gmhm::drive::{CompensatedServo, CompensatedServoState, Gains, Mounting, Reference, ServoSetup, TorqueShaft};
use gmhm::feedforward::{Controls, Limits, Settings};
use gmhm::terms::Sample;
use gmhm::terms::feedforward::CompensatedFeedForward;

type Servo = CompensatedServo<f32>;
type Joint = CompensatedServoState<f32, 16>;

path::image! {
    servo: Servo, state: Joint,
    start servo.start(black_box(0), black_box(0), black_box(0), &Sample::default()),
    tick {
        let (gains, limits, encoder) = black_box((GAINS, Limits::default(), Mounting { counts_per_turn: 1 << 20, reversed: false }));
        black_box(set_up(black_box(&[]), &gains, &limits, encoder));
        let (controls, reference, sample) = black_box((Controls::default(), Reference::default(), Sample::default()));
        black_box(period(servo, state, &controls, &reference, &sample, [black_box(0), black_box(0)]));
    }
}

const GAINS: Gains = Gains {
    period_s: 1e-3,
    position_per_s: 40.0,
    velocity_nms_per_rad: 0.05,
    integral_rad_per_s: 30.0,
    filter_rad_per_s: 900.0,
    limit_nm: 2.0,
};

/// At boot, from the bytes of the block and what the drive itself knows.
#[inline(never)]
#[unsafe(no_mangle)]
fn set_up(block: &[u8], gains: &Gains, limits: &Limits<f32>, encoder: Mounting) -> Option<Servo> {
    let parameters = Parameters::<f32>::load(block, 16).ok()?;
    let setup = ServoSetup {
        encoders: parameters.encoders(encoder, encoder).ok()?,
        reference_counts_per_turn: 1 << 30,
        gains: *gains,
        feed_forward: Settings::default(),
    };
    let feed_forward = CompensatedFeedForward::new(parameters.feed_forward(limits).ok()?, &parameters.terms);
    CompensatedServo::new(feed_forward, &setup, TorqueShaft::Motor).ok()
}

/// The control period, from the reference of the output and the counts of both encoders to the torque of the motor.
#[inline(never)]
#[unsafe(no_mangle)]
fn period(
    servo: &Servo,
    state: &mut Joint,
    controls: &Controls<f32>,
    reference: &Reference<f32>,
    sample: &Sample<f32>,
    [motor, output]: [u32; 2],
) -> f32 {
    servo.period(state, controls, reference, sample, motor, output)
}
