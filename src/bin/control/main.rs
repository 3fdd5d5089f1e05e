//! A control loop as a drive runs it: a timer interrupt reads two encoders, computes the torque of the gear and commands it; the main loop logs.
//!
//! The gear and its joint are those of a stored block: nothing is computed in double precision. In `f32` where the core has a unit for it, else in fixed point. The encoder chips and the PWM channel at the edges are simulated behind the traits of
//! `embedded-hal`: a board puts its own there. The interrupt is SysTick's; the nRF51 itself has none (its emulator does), and takes another timer.
#![no_std]
#![no_main]

mod bench;
#[path = "../platform/mod.rs"]
mod platform;

use core::cell::Cell;

use bench::{Channel, Chip};
use cortex_m::Peripherals;
use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{entry, exception};
use gmhm::block::{Prepared, verify};
use gmhm::drive::{As5047p, CentredPwm, EncoderPair, FromCounts, Joint, Mounting};
use gmhm::memory::masing::Masing;
use gmhm::scalar::{Extended, Scalar};
use gmhm::{Gear, State};
use platform::gears::{self, RATED_NM, RATED_RAD};

/// What the loop computes in.
#[cfg(target_abi = "eabihf")]
type Number = f32;
/// What a drive keeps in flash.
#[cfg(target_abi = "eabihf")]
const BLOCK: &[u8] = gears::BLOCK;
/// What the loop computes in.
#[cfg(not(target_abi = "eabihf"))]
type Number = gmhm::scalar::Fixed;
/// What a drive keeps in flash.
#[cfg(not(target_abi = "eabihf"))]
const BLOCK: &[u8] = gears::FIXED_BLOCK;

/// Core clocks of a control period: 1 ms at 25 MHz.
const PERIOD: u32 = 25_000;

/// Turning points that it has room for.
const DEPTH: usize = 16;

/// Periods from one log line to the next, and log lines.
const EVERY: u32 = 90;
const LINES: u32 = 16;

/// Turning points of the motor in counts: 304 are the rated deflection of the gear.
const SWINGS: &[i32] = &[300, -300, 200, -100, 150, 0, 250, -300, -300];

const ENCODER: Mounting = Mounting { counts_per_turn: bench::COUNTS_PER_TURN, reversed: false };
/// What the interrupt works on.
struct Control {
    joint: Joint<As5047p<Chip>, As5047p<Chip>, CentredPwm<Channel, Number>, Number>,
    gear: Gear<Number, Masing<Number>>,
    state: State<Number, DEPTH, Masing<Number>>,
    timer: SYST,
    report: Report,
}

/// What it tells the main loop.
#[derive(Clone, Copy, Default)]
struct Report {
    tick: u32,
    deflection: Number,
    torque: Number,
    duty: u16,
    faults: u32,
    overruns: u32,
}

static CONTROL: Mutex<Cell<Option<Control>>> = Mutex::new(Cell::new(None));
static REPORT: Mutex<Cell<Option<Report>>> = Mutex::new(Cell::new(None));

#[entry]
fn main() -> ! {
    let Some(control) = Peripherals::take().and_then(|peripherals| control(peripherals.SYST)) else {
        say!("the joint was refused");
        platform::end()
    };
    free(|section| CONTROL.borrow(section).set(Some(control)));
    for _ in 0..LINES {
        let report = loop {
            cortex_m::asm::wfi();
            if let Some(report) = free(|section| REPORT.borrow(section).take()) {
                break report;
            }
        };
        let shown = |x: Number, per_unit: f64, unit: f32| {
            let factor = if Number::SI { per_unit } else { per_unit * f64::from(unit) };
            x.to_counts(Number::factor_of(Extended::of_double(factor).unwrap_or(Extended::ZERO)))
        };
        say!(
            "tick {}: deflection {} urad, torque {} cN.m, duty {} of 1023, faults {}, overruns {}",
            report.tick,
            shown(report.deflection, 1e6, RATED_RAD),
            shown(report.torque, 1e2, RATED_NM),
            report.duty,
            report.faults,
            report.overruns,
        );
    }
    platform::end()
}

/// The joint, its timer running.
fn control(mut timer: SYST) -> Option<Control> {
    let block = verify(BLOCK).ok()?;
    let prepared = Prepared::<Number>::of_block(&block, DEPTH).ok()?;
    let full_scale = 1.2 * if Number::SI { f64::from(RATED_NM) } else { 1.0 };
    let (motor, output) = (As5047p::new(Chip::new(SWINGS)), As5047p::new(Chip::new(&[])));
    let sink = CentredPwm::new(Channel, full_scale);
    let pair = EncoderPair::new(&prepared.encoders(&block, ENCODER, ENCODER).ok()?).ok()?;
    let gear = *prepared.gear();
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(PERIOD - 1);
    timer.clear_current();
    timer.enable_interrupt();
    timer.enable_counter();
    Some(Control {
        joint: Joint::new(motor, output, sink, pair),
        state: gear.start(Number::ZERO),
        gear,
        timer,
        report: Report::default(),
    })
}

/// The control period.
#[exception]
fn SysTick() {
    static mut RUNNING: Option<Control> = None;
    if RUNNING.is_none() {
        *RUNNING = free(|section| CONTROL.borrow(section).take());
    }
    let Some(Control { joint, gear, state, timer, report }) = RUNNING else { return };
    // Reading the flag clears it: the timer's wrap that led here.
    timer.has_wrapped();
    let mut torque = Number::ZERO;
    let tick = joint.tick(|reading| {
        torque = gear.step(state, reading.deflection).torque;
        torque
    });
    report.tick += 1;
    match tick {
        Ok(reading) => *report = Report { deflection: reading.deflection, torque, duty: bench::duty(), ..*report },
        Err(_) => report.faults += 1,
    }
    if timer.has_wrapped() {
        report.overruns += 1;
    }
    if report.tick.is_multiple_of(EVERY) {
        free(|section| REPORT.borrow(section).set(Some(*report)));
    }
}
