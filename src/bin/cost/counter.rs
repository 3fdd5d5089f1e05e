//! The counter: SysTick under the emulator's `-icount shift=0`, where an instruction takes one nanosecond; or readings in another unit, put into memory by
//! `cargo xtask cost`, which has added them up along a trace of the same run.

use core::hint::black_box;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

const MASK: u32 = 0x00ff_ffff;

/// Where readings are put: in memory of the emulated Cortex-M4F board that no image uses. Behind these words come their number and the readings.
#[cfg(all(target_abi = "eabihf", not(feature = "rtt")))]
const SCRIPT: (*const u32, [u32; 2]) = (0x2100_0000 as *const u32, [0x676d_686d, 0x636f_7374]);

/// Readings taken.
static READINGS: AtomicU32 = AtomicU32::new(0);

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
    let before = reading();
    let mut left = calls;
    while left > 0 {
        for &input in inputs.iter().take(left as usize) {
            black_box(work(black_box(input)));
            left -= 1;
        }
    }
    reading().wrapping_sub(before) & MASK
}

/// The counter's reading, rising; `cargo xtask cost` finds this function by its name.
#[inline(never)]
#[unsafe(no_mangle)]
fn reading() -> u32 {
    let number = READINGS.load(Ordering::Relaxed);
    READINGS.store(number + 1, Ordering::Relaxed);
    scripted(number).unwrap_or_else(|| MASK - SYST::get_current())
}

#[cfg(all(target_abi = "eabihf", not(feature = "rtt")))]
fn scripted(number: u32) -> Option<u32> {
    let (script, written) = SCRIPT;
    // SAFETY: the emulated board has memory there, that nothing writes once the core runs.
    let word = |index: u32| unsafe { script.add(index as usize).read_volatile() };
    (written == [word(0), word(1)] && number < word(2)).then(|| word(3 + number))
}

#[cfg(not(all(target_abi = "eabihf", not(feature = "rtt"))))]
fn scripted(_number: u32) -> Option<u32> {
    None
}
