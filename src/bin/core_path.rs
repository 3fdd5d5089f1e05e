//! The control path of one joint and nothing else, forward and inverse: what a drive pays in bytes, and proof that nothing on it can panic or calls
//! double-precision arithmetic. `cargo xtask size` reads its symbols; there is nothing to run.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::mem::MaybeUninit;

use gmhm::memory::masing::Masing;
use gmhm::{Inverse, State};

type Gear = Inverse<f32, Masing<f32>>;
type Joint = State<f32, 16, Masing<f32>>;

/// Coefficients that something else has written, as a loader does from a parameter block.
#[unsafe(link_section = ".uninit")]
static mut GEAR: MaybeUninit<Gear> = MaybeUninit::uninit();

/// The path of one joint.
#[unsafe(link_section = ".uninit")]
static mut JOINT: MaybeUninit<Joint> = MaybeUninit::uninit();

/// Never linked: an image that holds it is refused.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}

#[cortex_m_rt::entry]
fn main() -> ! {
    // SAFETY: this image is measured and never run; nothing else touches the two places.
    let (gear, joint) = unsafe { ((*black_box(&raw const GEAR)).assume_init_ref(), &mut *black_box(&raw mut JOINT)) };
    let state = joint.write(gear.gear().start(black_box(0.0)));
    loop {
        black_box(step(gear, state, invert(gear, state, black_box(0.0))));
    }
}

/// The control tick, from deflection to torque.
#[inline(never)]
#[unsafe(no_mangle)]
fn step(gear: &Gear, state: &mut Joint, theta_rad: f32) -> f32 {
    gear.gear().step(state, theta_rad).torque
}

/// The control tick, from torque to deflection.
#[inline(never)]
#[unsafe(no_mangle)]
fn invert(gear: &Gear, state: &Joint, torque_nm: f32) -> f32 {
    gear.peek(state, torque_nm).theta
}
