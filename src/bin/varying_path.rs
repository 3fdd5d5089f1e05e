//! The control path of one joint whose samples come at uneven periods, forward and inverse, its law chosen at run time: what a drive pays in bytes, and proof that
//! no law on it can panic or calls double-precision arithmetic, the exponential of a period included. `cargo xtask size` reads its symbols; there is nothing to run.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::mem::MaybeUninit;

use gmhm::{Inverse, State};

type Joint = State<f32, 16>;

/// Coefficients that something else has written, as a loader does from a parameter block.
#[unsafe(link_section = ".uninit")]
static mut GEAR: MaybeUninit<Inverse<f32>> = MaybeUninit::uninit();

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
