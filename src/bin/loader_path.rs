//! Loader, law and inverse of one joint and nothing else, from the bytes of a prepared block to torques and back: what a drive pays in bytes that takes its parameters from
//! flash, and proof that nothing on the way can panic or calls double-precision arithmetic. `cargo xtask size` reads its symbols; there is nothing to run.
#![no_std]
#![no_main]

mod path;

use core::hint::black_box;

use gmhm::block::Prepared;
use gmhm::memory::masing::Masing;
use gmhm::{Inverse, State};

type Gear = Inverse<f32, Masing<f32>>;
type Joint = State<f32, 16, Masing<f32>>;

path::image! {
    gear: Gear, state: Joint,
    start gear.gear().start(black_box(0.0)),
    tick {
        black_box(load(black_box(&[])));
        black_box(step(gear, state, invert(gear, state, black_box(0.0))))
    }
}

/// At boot, from the bytes of the block.
#[inline(never)]
#[unsafe(no_mangle)]
fn load(block: &[u8]) -> Option<Gear> {
    Prepared::<f32>::load(block, 16).ok().map(|prepared| prepared.inverse)
}

/// The control tick, from deflection to torque.
#[inline(never)]
#[unsafe(no_mangle)]
fn step(gear: &Gear, state: &mut Joint, theta: f32) -> f32 {
    gear.gear().step(state, theta).torque
}

/// The control tick, from torque to deflection.
#[inline(never)]
#[unsafe(no_mangle)]
fn invert(gear: &Gear, state: &Joint, torque: f32) -> f32 {
    gear.peek(state, torque).theta
}
