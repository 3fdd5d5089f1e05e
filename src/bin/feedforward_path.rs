//! The feed-forward of one joint and nothing else, from the torque reference to the motor's position: what a drive pays in bytes, and proof that nothing on it can
//! panic or calls double-precision arithmetic. `cargo xtask size` reads its symbols; there is nothing to run.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::mem::MaybeUninit;

use gmhm::feedforward::{Controls, Demand, FeedForward, FeedForwardState, MotorSide};
use gmhm::memory::masing::Masing;

type Gear = (FeedForward<f32, Masing<f32>>, MotorSide<f32>);
type Joint = FeedForwardState<f32, 16, Masing<f32>>;

/// Coefficients that something else has written, as a loader does from a parameter block.
#[unsafe(link_section = ".uninit")]
static mut GEAR: MaybeUninit<Gear> = MaybeUninit::uninit();

/// What the feed-forward of one joint remembers.
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
    let state = joint.write(gear.0.start(black_box(0.0)));
    loop {
        black_box(position(gear, state, &black_box(Controls::default()), &black_box(Demand::default()), black_box(0)));
    }
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
