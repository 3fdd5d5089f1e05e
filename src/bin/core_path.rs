//! The control path of one joint and nothing else, forward and inverse: what a drive pays in bytes, and proof that nothing on it can panic or calls
//! double-precision arithmetic. `cargo xtask size` reads its symbols; there is nothing to run. In `f32` on a core that has it in hardware, else in
//! fixed point, where no floating-point routine may be left either.
#![no_std]
#![no_main]

mod path;

use core::hint::black_box;

use gmhm::memory::masing::Masing;
use gmhm::{Inverse, State};

#[cfg(target_abi = "eabihf")]
type Number = f32;
#[cfg(not(target_abi = "eabihf"))]
type Number = gmhm::scalar::Fixed;

type Gear = Inverse<Number, Masing<Number>>;
type Joint = State<Number, 16, Masing<Number>>;

path::image! {
    gear: Gear, state: Joint,
    start gear.gear().start(black_box(Number::default())),
    tick black_box(step(gear, state, invert(gear, state, black_box(Number::default()))))
}

/// The control tick, from deflection to torque.
#[inline(never)]
#[unsafe(no_mangle)]
fn step(gear: &Gear, state: &mut Joint, theta: Number) -> Number {
    gear.gear().step(state, theta).torque
}

/// The control tick, from torque to deflection.
#[inline(never)]
#[unsafe(no_mangle)]
fn invert(gear: &Gear, state: &Joint, torque: Number) -> Number {
    gear.peek(state, torque).theta
}
