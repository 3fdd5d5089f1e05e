//! The control path of one joint with its adaptation and nothing else: what a drive pays in bytes beside `core_path`, and proof that nothing on it can panic or calls
//! double-precision arithmetic. `cargo xtask size` reads its symbols; there is nothing to run.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::mem::MaybeUninit;

use gmhm::adapt::{Adaptation, AdaptationState, Change};
use gmhm::memory::masing::Masing;
use gmhm::{Inverse, State};

type Gear = (Inverse<f32, Masing<f32>>, Adaptation<f32>);
type Path = State<f32, 16, Masing<f32>>;
type Joint = (MaybeUninit<Path>, AdaptationState<f32>);

/// Coefficients that something else has written, as a loader does from a parameter block.
#[unsafe(link_section = ".uninit")]
static mut GEAR: MaybeUninit<Gear> = MaybeUninit::uninit();

/// What one joint remembers: its path is started, its adaptation is in order from reset on, as its memory is cleared then.
static mut JOINT: Joint = (MaybeUninit::uninit(), AdaptationState::new());

/// Never linked: an image that holds it is refused.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}

#[cortex_m_rt::entry]
fn main() -> ! {
    // SAFETY: this image is measured and never run; nothing else touches the two places.
    let (gear, (path, adapted)) =
        unsafe { ((*black_box(&raw const GEAR)).assume_init_ref(), &mut *black_box(&raw mut JOINT)) };
    let path = path.write(gear.0.gear().start(black_box(0.0)));
    loop {
        let theta = invert(gear, path, black_box(0.0));
        black_box((step(gear, path, theta), adapt(gear, path, adapted, black_box(0.0))));
    }
}

/// The control tick, from deflection to torque.
#[inline(never)]
#[unsafe(no_mangle)]
fn step((inverse, _): &Gear, path: &mut Path, theta: f32) -> f32 {
    inverse.gear().step(path, theta).torque
}

/// The control tick, from torque to deflection.
#[inline(never)]
#[unsafe(no_mangle)]
fn invert((inverse, _): &Gear, path: &Path, torque: f32) -> f32 {
    inverse.peek(path, torque).theta
}

/// The control tick of the adaptation.
#[inline(never)]
#[unsafe(no_mangle)]
fn adapt((_, adaptation): &Gear, path: &Path, adapted: &mut AdaptationState<f32>, torque: f32) -> Change {
    adaptation.period(adapted, path, torque)
}
