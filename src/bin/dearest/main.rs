//! The dearest call of the inverse of law `masing` along a journey so long that one in a million shows: ticks of the core clock under the emulator's instruction
//! count. `cargo xtask cost` turns them into instructions and holds them to what a control loop can afford.
#![no_std]
#![no_main]

#[path = "../cost/counter.rs"]
mod counter;
#[path = "../cost/dearest.rs"]
mod dearest;
#[path = "../journey/mod.rs"]
#[allow(dead_code, reason = "every period here is the same")]
mod journey;
#[path = "../platform/mod.rs"]
mod platform;

use dearest::{dearest, peek};
use gmhm::memory::masing::Masing;
use gmhm::{Gate, Inverse, Kernel, Law};
use platform::gears::{self, RATED_NM};

#[cfg(target_abi = "eabihf")]
type Number = f32;
#[cfg(not(target_abi = "eabihf"))]
type Number = gmhm::scalar::Fixed;

/// Torques among which the dearest is sought.
const JOURNEY: u32 = 300_000;

/// Calls that it is measured by.
const CALLS: u32 = 1000;

#[cortex_m_rt::entry]
fn main() -> ! {
    counter::start();
    if measure().is_none() {
        say!("0 1 parameters refused");
    }
    platform::end()
}

fn measure() -> Option<()> {
    use gmhm::scalar::Scalar;
    let params = gears::published(Law::Masing, Kernel::Deflection, Gate::Cycle, 0.0).ok()?;
    let inverse = Inverse::<Number, _>::of(&params, Masing::new(&params), 0.0).ok()?;
    let load = |share: f64| Number::from_f64(share * if Number::SI { f64::from(RATED_NM) } else { 1.0 });
    let (state, torque) = dearest(&inverse, inverse.gear().start(Number::default()), JOURNEY, load);
    let ticks = counter::ticks(CALLS, &[torque], |torque| peek(&inverse, &state, torque));
    say!("{} {} inverse of law `masing`, the dearest of 300 000", ticks, CALLS);
    Some(())
}
