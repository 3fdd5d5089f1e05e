//! What a call of the core costs, and what the customary alternatives cost: ticks of the core clock under the emulator's instruction
//! count. `cargo xtask cost` turns them into instructions. In `f32` on a core that has it in hardware, else in fixed point.
#![no_std]
#![no_main]

#[cfg(target_abi = "eabihf")]
mod baselines;
mod counter;
mod laws;
#[cfg(target_abi = "eabihf")]
mod other_laws;
#[path = "../platform/mod.rs"]
mod platform;
#[cfg(target_abi = "eabihf")]
mod servo;
#[cfg(target_abi = "eabihf")]
mod terms;
#[path = "../test_path/mod.rs"]
#[allow(dead_code, reason = "every period here is the same")]
mod test_path;
#[cfg(target_abi = "eabihf")]
#[path = "../typical/mod.rs"]
mod typical;
mod worst_case;

use core::hint::black_box;

/// Calls a measurement: one tick is some fifty instructions.
const CALLS: u32 = 1000;

#[cortex_m_rt::entry]
fn main() -> ! {
    counter::start();
    laws::measure();
    #[cfg(target_abi = "eabihf")]
    {
        servo::measure();
        terms::measure();
        other_laws::measure();
        baselines::measure();
    }
    platform::end()
}

/// Ticks that a thousand calls take.
fn ticks<T: Copy, R>(inputs: &[T], call: impl FnMut(T) -> R) -> u32 {
    counter::ticks(CALLS, inputs, call)
}

/// Measures a call over its inputs.
fn report<T: Copy, R>(name: &'static str, inputs: &[T], call: impl FnMut(T) -> R) {
    say!("{} {} {}", ticks(inputs, call), CALLS, name);
}

/// Measures a call that starts from the same state every time.
fn report_from<S: Clone, T: Copy, R>(name: &'static str, state: &S, input: T, mut call: impl FnMut(&mut S, T) -> R) {
    let mut scratch = state.clone();
    let restoring = ticks(&[input], |input| {
        restore(&mut scratch, state);
        input
    });
    let all = ticks(&[input], |input| {
        restore(&mut scratch, state);
        call(&mut scratch, input)
    });
    say!("{} {} {}", all.saturating_sub(restoring), CALLS, name);
}

#[inline(never)]
fn restore<S: Clone>(scratch: &mut S, state: &S) {
    black_box(scratch).clone_from(state);
}
