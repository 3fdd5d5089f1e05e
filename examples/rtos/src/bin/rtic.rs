//! A joint as a resource that the control task and the link's task share.
#![no_std]
#![no_main]

use cortex_m_semihosting::debug;

#[rtic::app(device = lm3s6965, dispatchers = [GPIOA])]
mod app {
    use cortex_m::peripheral::syst::SystClkSource;
    use cortex_m_semihosting::{debug, hprintln};
    use gmhm_rtos_examples::{BLOCK, Joint, PERIODS, load, reference};

    #[shared]
    struct Shared {
        joint: Option<Joint>,
        changes: u32,
    }

    #[local]
    struct Local {
        period: u32,
    }

    #[init]
    fn init(cx: init::Context) -> (Shared, Local) {
        let mut clock = cx.core.SYST;
        clock.set_clock_source(SystClkSource::Core);
        clock.set_reload(12_000);
        clock.clear_current();
        clock.enable_counter();
        clock.enable_interrupt();
        let _ = link::spawn();
        (Shared { joint: load(BLOCK).ok().map(Joint::new), changes: 0 }, Local { period: 0 })
    }

    #[task(binds = SysTick, priority = 2, local = [period], shared = [joint, changes])]
    fn control(cx: control::Context) {
        let period = cx.local.period;
        *period += 1;
        let now = *period;
        // Here a drive would set its motor's reference.
        (cx.shared.joint, cx.shared.changes).lock(|joint, changes| {
            if let Some(joint) = joint {
                joint.period(reference(now));
            }
            if now == PERIODS {
                hprintln!("rtic: {} periods, {} change of parameters", now, changes);
                let done = joint.is_some() && *changes == 1;
                debug::exit(if done { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
            }
        });
    }

    /// Where a host has sent a block.
    #[task(priority = 1, shared = [joint, changes])]
    async fn link(cx: link::Context) {
        // The slow part, while the control task goes on.
        let Ok(feed) = load(BLOCK) else { return };
        (cx.shared.joint, cx.shared.changes).lock(|joint, changes| {
            if let Some(joint) = joint {
                joint.take_over(feed);
                *changes += 1;
            }
        });
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}
