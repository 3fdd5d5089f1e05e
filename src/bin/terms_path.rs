//! The control path of one joint with every kind of term: what a drive pays in bytes for all of section 7, and proof that no term can panic or calls
//! double-precision arithmetic. `cargo xtask size` reads its symbols; there is nothing to run.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::mem::MaybeUninit;

use gmhm::memory::masing::Masing;
use gmhm::terms::compensated::CompensatedState;
use gmhm::terms::{Compensated, Sample};

type Joint = Compensated<f32, Masing<f32>>;
type JointState = CompensatedState<f32, 16, Masing<f32>>;

/// Coefficients that something else has written, as a loader does from a parameter block.
#[unsafe(link_section = ".uninit")]
static mut GEAR: MaybeUninit<Joint> = MaybeUninit::uninit();

/// The path of one joint.
#[unsafe(link_section = ".uninit")]
static mut JOINT: MaybeUninit<JointState> = MaybeUninit::uninit();

/// Never linked: an image that holds it is refused.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}

#[cortex_m_rt::entry]
fn main() -> ! {
    // SAFETY: this image is measured and never run; nothing else touches the two places.
    let (gear, joint) = unsafe { ((*black_box(&raw const GEAR)).assume_init_ref(), &mut *black_box(&raw mut JOINT)) };
    let state = joint.write(gear.start(&black_box(Sample::default())));
    loop {
        black_box(step(gear, state, &black_box(Sample::default())));
    }
}

/// The control tick.
#[inline(never)]
#[unsafe(no_mangle)]
fn step(gear: &Joint, state: &mut JointState, sample: &Sample<f32>) -> f32 {
    gear.step(state, sample).torque
}
