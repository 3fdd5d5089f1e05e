//! A joint that belongs to the control task alone; other parameters come to it by a signal.
#![no_std]
#![no_main]

use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_semihosting::{debug, hprintln};
use embassy_executor::{Executor, Spawner};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use gmhm_rtos_examples::{BLOCK, Feed, Joint, PERIODS, load, reference};
use static_cell::StaticCell;

/// A control period begins.
static PERIOD: Signal<CriticalSectionRawMutex, ()> = Signal::new();
/// Other parameters, loaded and ready.
static PARAMETERS: Signal<CriticalSectionRawMutex, Feed> = Signal::new();
static EXECUTOR: StaticCell<Executor> = StaticCell::new();
static JOINT: StaticCell<Joint> = StaticCell::new();

#[cortex_m_rt::exception]
fn SysTick() {
    PERIOD.signal(());
}

#[embassy_executor::task]
async fn control(joint: &'static mut Joint) {
    let (mut changes, mut largest) = (0, 0.0_f32);
    for period in 1..=PERIODS {
        PERIOD.wait().await;
        if let Some(feed) = PARAMETERS.try_take() {
            joint.take_over(feed);
            changes += 1;
        }
        // Here a drive would set its motor's reference.
        largest = largest.max(joint.period(reference(period)).change);
    }
    hprintln!(
        "embassy: {} periods, {} change of parameters, steps up to {} urad",
        PERIODS,
        changes,
        (1e6 * largest) as u32
    );
    debug::exit(if changes == 1 { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
}

#[embassy_executor::task]
async fn link() {
    // Where a host has sent a block: the slow part here, in a task of lower urgency.
    if let Ok(feed) = load(BLOCK) {
        PARAMETERS.signal(feed);
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let (Some(mut peripherals), Ok(feed)) = (cortex_m::Peripherals::take(), load(BLOCK)) else { fail() };
    peripherals.SYST.set_clock_source(SystClkSource::Core);
    peripherals.SYST.set_reload(12_000);
    peripherals.SYST.clear_current();
    peripherals.SYST.enable_counter();
    peripherals.SYST.enable_interrupt();
    let joint = JOINT.init(Joint::new(feed));
    EXECUTOR.init(Executor::new()).run(|spawner: Spawner| match (control(joint), link()) {
        (Ok(control), Ok(link)) => {
            spawner.spawn(control);
            spawner.spawn(link);
        }
        _ => fail(),
    })
}

fn fail() -> ! {
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    fail()
}
