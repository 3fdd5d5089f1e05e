//! The feed-forward of one joint and nothing else, from the torque reference to the motor's position: what a drive pays in bytes, and proof that nothing on it can
//! panic or calls double-precision arithmetic. `cargo xtask size` reads its symbols; there is nothing to run.
#![no_std]
#![no_main]

mod path;

use core::hint::black_box;

use gmhm::feedforward::{Controls, Demand, FeedForward, FeedForwardState, MotorSide};
use gmhm::memory::masing::Masing;

type Gear = (FeedForward<f32, Masing<f32>>, MotorSide<f32>);
type Joint = FeedForwardState<f32, 16, Masing<f32>>;

path::image! {
    gear: Gear, state: Joint,
    start gear.0.start(black_box(0.0)),
    tick black_box(position(gear, state, &black_box(Controls::default()), &black_box(Demand::default()), black_box(0)))
}

/// The control period, from the reference of the output to the position of the motor.
#[inline(never)]
#[unsafe(no_mangle)]
fn position(
    (feed_forward, motor): &Gear,
    state: &mut Joint,
    controls: &Controls<f32>,
    demand: &Demand<f32>,
    counts: i64,
) -> i64 {
    motor.position(counts, feed_forward.step(state, controls, demand).offset)
}
