//! The servo of one joint and nothing else, its law chosen at run time: what a drive pays in bytes, and proof that no law on it can panic or calls
//! double-precision arithmetic. `cargo xtask size` reads its symbols; there is nothing to run.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::mem::MaybeUninit;

use gmhm::drive::servo::{Reference, Servo, ServoState};
use gmhm::feedforward::Controls;

type Joint = ServoState<f32, 16>;

/// Coefficients that something else has written, as a loader does from a parameter block.
#[unsafe(link_section = ".uninit")]
static mut GEAR: MaybeUninit<Servo<f32>> = MaybeUninit::uninit();

/// What the servo of one joint remembers.
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
    let (servo, joint) = unsafe { ((*black_box(&raw const GEAR)).assume_init_ref(), &mut *black_box(&raw mut JOINT)) };
    let state = joint.write(servo.start(black_box(0), black_box(0), black_box(0)));
    loop {
        let (controls, reference) = black_box((Controls::default(), Reference::default()));
        black_box(period(servo, state, &controls, &reference, black_box(0), black_box(0)));
    }
}

/// The control period, from the reference of the output and the counts of both encoders to the torque of the motor.
#[inline(never)]
#[unsafe(no_mangle)]
fn period(
    servo: &Servo<f32>,
    state: &mut Joint,
    controls: &Controls<f32>,
    reference: &Reference<f32>,
    motor: u32,
    output: u32,
) -> f32 {
    servo.period(state, controls, reference, motor, output)
}
