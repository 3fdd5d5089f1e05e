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

/// Ticks of the core clock that `calls` calls take, beyond those of as many turns of an empty loop over the same inputs. Fewer than 2^24.
#[inline(never)]
pub fn ticks<T: Copy>(calls: u32, inputs: &[T], mut call: impl FnMut(T)) -> u32 {
    let mut turns = |work: &mut dyn FnMut(T)| {
        let before = SYST::get_current();
        let mut left = calls;
        loop {
            for &input in inputs {
                if left == 0 {
                    return before.wrapping_sub(SYST::get_current()) & MASK;
                }
                left -= 1;
                work(black_box(input));
            }
        }
    };
    let empty = turns(&mut |input| {
        black_box(input);
    });
    turns(&mut call).saturating_sub(empty)
}
