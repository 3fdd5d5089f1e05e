//! The worst call of the inverse of law `masing` along a test path so long that one in a million shows: ticks of the core clock under the emulator's instruction
//! count. `cargo xtask cost` turns them into instructions and holds them to what a control loop can afford.
#![no_std]
#![no_main]

#[path = "../cost/counter.rs"]
mod counter;
#[path = "../platform/mod.rs"]
mod platform;
#[path = "../test_path/mod.rs"]
#[allow(dead_code, reason = "every period here is the same")]
mod test_path;
#[path = "../cost/worst_case.rs"]
mod worst_case;

use gmhm::memory::masing::Masing;
use gmhm::{Gate, Inverse, Kernel, Law};
use platform::gears::{self, RATED_NM};
use worst_case::{peek, worst_case};

#[cfg(target_abi = "eabihf")]
type Number = f32;
#[cfg(not(target_abi = "eabihf"))]
type Number = gmhm::scalar::Fixed;

/// Torques among which the worst case is searched.
const TORQUES: u32 = 300_000;

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
    let (state, torque) = worst_case(&inverse, inverse.gear().start(Number::default()), TORQUES, load);
    let ticks = counter::ticks(CALLS, &[torque], |torque| peek(&inverse, &state, torque));
    say!("{} {} inverse of law `masing`, worst of 300 000", ticks, CALLS);
    Some(())
}
