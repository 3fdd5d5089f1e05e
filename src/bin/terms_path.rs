//! The control path of one joint with every kind of term: what a drive pays in bytes for all of section 7, and proof that no term can panic or calls
//! double-precision arithmetic. `cargo xtask size` reads its symbols; there is nothing to run.
#![no_std]
#![no_main]

mod path;

use core::hint::black_box;

use gmhm::memory::masing::Masing;
use gmhm::terms::compensated::CompensatedState;
use gmhm::terms::{Compensated, Sample};

type Joint = Compensated<f32, Masing<f32>>;
type JointState = CompensatedState<f32, 16, Masing<f32>>;

path::image! {
    gear: Joint, state: JointState,
    start gear.start(&black_box(Sample::default())),
    tick black_box(step(gear, state, &black_box(Sample::default())))
}

/// The control tick.
#[inline(never)]
#[unsafe(no_mangle)]
fn step(gear: &Joint, state: &mut JointState, sample: &Sample<f32>) -> f32 {
    gear.step(state, sample).torque
}
