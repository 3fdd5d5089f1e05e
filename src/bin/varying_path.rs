//! The control path of one joint whose samples come at uneven periods, forward and inverse, its law chosen at run time: what a drive pays in bytes, and proof that
//! no law on it can panic or calls double-precision arithmetic, the exponential of a period included. `cargo xtask size` reads its symbols; there is nothing to run.
#![no_std]
#![no_main]

mod path;

use core::hint::black_box;

use gmhm::{Inverse, State};

type Joint = State<f32, 16>;

path::image! {
    gear: Inverse<f32>, state: Joint,
    start gear.gear().start(black_box(0.0)),
    tick {
        let period_s = black_box(0.0);
        black_box(step(gear, state, invert(gear, state, black_box(0.0), period_s), period_s));
        black_box(peek(gear, state, black_box(0.0), period_s));
    }
}

/// The control tick, from deflection to torque.
#[inline(never)]
#[unsafe(no_mangle)]
fn step(gear: &Inverse<f32>, state: &mut Joint, theta: f32, period_s: f32) -> f32 {
    gear.gear().step_after(state, theta, period_s).torque
}

/// The same, the state staying as it is.
#[inline(never)]
#[unsafe(no_mangle)]
fn peek(gear: &Inverse<f32>, state: &Joint, theta: f32, period_s: f32) -> f32 {
    gear.gear().peek_after(state, theta, period_s)
}

/// The control tick, from torque to deflection.
#[inline(never)]
#[unsafe(no_mangle)]
fn invert(gear: &Inverse<f32>, state: &Joint, torque: f32, period_s: f32) -> f32 {
    gear.peek_after(state, torque, period_s).theta
}
