//! The instruction counter: SysTick under the emulator's `-icount shift=0`, where an instruction takes one nanosecond.

use core::hint::black_box;

use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

const MASK: u32 = 0x00ff_ffff;

/// Starts the counter.
pub fn start() {
    if let Some(peripherals) = Peripherals::take() {
        let mut timer = peripherals.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(MASK);
        timer.clear_current();
        timer.enable_counter();
    }
}

/// Ticks of the core clock that `calls` calls take beyond those of the loop around them; fewer than 2^24. The inputs serve in order, and again
/// from the first.
pub fn ticks<T: Copy, R>(calls: u32, inputs: &[T], call: impl FnMut(T) -> R) -> u32 {
    let empty = turns(calls, inputs, |input| input);
    turns(calls, inputs, call).saturating_sub(empty)
}

#[inline(never)]
fn turns<T: Copy, R>(calls: u32, inputs: &[T], mut work: impl FnMut(T) -> R) -> u32 {
    let before = SYST::get_current();
    let mut left = calls;
    while left > 0 {
        for &input in inputs.iter().take(left as usize) {
            black_box(work(black_box(input)));
            left -= 1;
        }
    }
    before.wrapping_sub(SYST::get_current()) & MASK
}
