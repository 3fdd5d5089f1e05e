//! A joint shared between the control interrupt and a main loop with the serial link.
#![no_std]
#![no_main]

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_semihosting::{debug, hprintln};
use critical_section::Mutex;
use gmhm::block::{Block, BlockError, ScalarKind, stamp, verify};
use gmhm::link::{CompensationSetting, Drive, Live, Port, Request, Tag};
use gmhm::store::{RamFlash, Store};
use gmhm_rtos_examples::{BLOCK, Joint, PERIODS, load, reference};

/// Shared: taken for as long as a period or a change of parameters takes, no longer.
static JOINT: Mutex<RefCell<Option<Joint>>> = Mutex::new(RefCell::new(None));
static TICKS: AtomicU32 = AtomicU32::new(0);

#[cortex_m_rt::exception]
fn SysTick() {
    let period = TICKS.load(Ordering::Relaxed).wrapping_add(1);
    TICKS.store(period, Ordering::Relaxed);
    critical_section::with(|key| {
        if let Some(joint) = JOINT.borrow(key).borrow_mut().as_mut() {
            // Here a drive would set its motor's reference.
            joint.period(reference(period));
        }
    });
}

/// The drive as the link sees it.
#[derive(Default)]
struct Shared {
    compensation: CompensationSetting,
}

impl Drive for Shared {
    fn arithmetic(&self) -> (ScalarKind, u16) {
        (ScalarKind::F32, 16)
    }

    fn is_enabled(&self) -> bool {
        false
    }

    fn adopt(&mut self, block: Option<&Block<'_>>) -> Result<(), BlockError> {
        // The slow part, while the interrupt goes on.
        let feed = block.map(|block| load(block.bytes())).transpose()?;
        critical_section::with(|key| {
            let mut joint = JOINT.borrow(key).borrow_mut();
            match (joint.as_mut(), feed) {
                (Some(joint), Some(feed)) => joint.take_over(feed),
                (None, Some(feed)) => *joint = Some(Joint::new(feed)),
                (_, None) => *joint = None,
            }
        });
        Ok(())
    }

    fn compensation(&self) -> CompensationSetting {
        self.compensation
    }

    fn set_compensation(&mut self, compensation: CompensationSetting) {
        self.compensation = compensation;
    }

    fn live(&self) -> Live {
        Live { ticks: TICKS.load(Ordering::Relaxed), ..Live::default() }
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    match run() {
        Some(answers) => hprintln!("interrupt: {} periods, {} answers", TICKS.load(Ordering::Relaxed), answers),
        None => debug::exit(debug::EXIT_FAILURE),
    }
    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}

fn run() -> Option<u32> {
    let mut peripherals = cortex_m::Peripherals::take()?;
    // Where the board has a flash, its driver stands here.
    let mut cells = [0xFF; 4096];
    let mut store = Store::new(RamFlash::<4, 1024>::new(&mut cells), 0..2048, 2048..4096).ok()?;
    let mut block = [0; 1024];
    let block = block.get_mut(..BLOCK.len())?;
    block.copy_from_slice(BLOCK);
    stamp(block, 1).ok()?;
    store.write(&verify(block).ok()?).ok()?;
    let (mut port, mut drive) = (Port::<_, 1024>::new(store, 1), Shared::default());
    port.boot(&mut drive)?;
    peripherals.SYST.set_clock_source(SystClkSource::Core);
    peripherals.SYST.set_reload(12_000);
    peripherals.SYST.clear_current();
    peripherals.SYST.enable_counter();
    peripherals.SYST.enable_interrupt();
    let mut answers = 0;
    while TICKS.load(Ordering::Relaxed) < PERIODS {
        // What a host sends comes from the UART; here a request for the live values now and then.
        port.receive(&Request::Live.encode(Tag::default()), &mut drive, |_| answers += 1);
        port.elapse(1, &mut drive);
        cortex_m::asm::wfi();
    }
    Some(answers)
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}
