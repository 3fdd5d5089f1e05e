//! What a call of the core costs, and what the customary alternatives cost: ticks of the core clock under the emulator's instruction
//! count. `cargo xtask cost` turns them into instructions.
#![no_std]
#![no_main]

mod counter;
mod laws;
#[path = "../platform/mod.rs"]
mod platform;
mod rivals;

/// Calls a measurement: one tick is some fifty instructions.
const CALLS: u32 = 1000;

#[cortex_m_rt::entry]
fn main() -> ! {
    counter::start();
    laws::measure();
    rivals::measure();
    platform::end()
}

/// Measures a call over its inputs, in order and again from the first.
fn report<T: Copy>(name: &'static str, inputs: &[T], call: impl FnMut(T)) {
    let ticks = counter::ticks(CALLS, inputs, call);
    say!("{} {} {}", ticks, CALLS, name);
}
