//! The control path of one joint with its adaptation and nothing else: what a drive pays in bytes beside `core_path`, and proof that nothing on it can panic or calls
//! double-precision arithmetic. `cargo xtask size` reads its symbols; there is nothing to run.
#![no_std]
#![no_main]

mod path;

use core::hint::black_box;

use gmhm::adapt::{Adaptation, AdaptationState, Change};
use gmhm::memory::masing::Masing;
use gmhm::{Inverse, State};

type Gear = (Inverse<f32, Masing<f32>>, Adaptation<f32>);
type Joint = (State<f32, 16, Masing<f32>>, AdaptationState<f32>);

path::image! {
    gear: Gear, state: Joint,
    start (gear.0.gear().start(black_box(0.0)), gear.1.start()),
    tick black_box((step(gear, state, invert(gear, state, black_box(0.0))), adapt(gear, state, black_box(0.0))))
}

/// The control tick, from deflection to torque.
#[inline(never)]
#[unsafe(no_mangle)]
fn step((inverse, _): &Gear, (path, _): &mut Joint, theta: f32) -> f32 {
    inverse.gear().step(path, theta).torque
}

/// The control tick, from torque to deflection.
#[inline(never)]
#[unsafe(no_mangle)]
fn invert((inverse, _): &Gear, (path, _): &Joint, torque: f32) -> f32 {
    inverse.peek(path, torque).theta
}

/// The control tick of the adaptation.
#[inline(never)]
#[unsafe(no_mangle)]
fn adapt((_, adaptation): &Gear, (path, adapted): &mut Joint, torque: f32) -> Change {
    adaptation.period(adapted, path, torque)
}
