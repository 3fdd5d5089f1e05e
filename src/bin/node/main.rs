//! A drive at the end of a serial line: parameters from its store, a gear stepped along a path, and the link that reads, tries and stores blocks.
//!
//! The path is a fixed one, so that a host can follow it: it begins anew whenever parameters come into force.
#![no_std]
#![no_main]

mod arithmetic;
#[cfg_attr(target_abi = "eabihf", path = "mps2.rs")]
#[cfg_attr(not(target_abi = "eabihf"), path = "microbit.rs")]
mod board;
#[path = "../test_path/mod.rs"]
#[allow(dead_code, reason = "this image walks at a constant period")]
mod test_path;

use arithmetic::Measures;
use board::{Board, Law, Number, ROOM};
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_semihosting::debug::{self, EXIT_FAILURE};
#[cfg(feature = "rtt")]
use defmt_rtt as _;
#[cfg(not(feature = "rtt"))]
use defmt_semihosting as _;
use gmhm::block::{Block, BlockError, Parameters, ScalarKind, ScalesRecord, TorqueUnit, Word};
use gmhm::diagnostics::{Diagnostics, SelfTest};
use gmhm::link::{CompensationSetting, Drive, Live, Port};
use gmhm::store::Store;
use gmhm::{Gear, Output, State};
use test_path::TestPath;

/// Turning points that it has room for.
const DEPTH: usize = 16;

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(mut core) = cortex_m::Peripherals::take() else { fail() };
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(0x00FF_FFFF);
    core.SYST.clear_current();
    core.SYST.enable_counter();
    let mut board = Board::start();
    let Ok(store) = Store::new(board::flash(), board::SLOTS[0].clone(), board::SLOTS[1].clone()) else { fail() };
    let mut port = Port::<_, ROOM>::new(store, board.nonce());
    let mut node = Node::default();
    port.boot(&mut node);
    let (mut before, mut clocks) = (SYST::get_current(), 0);
    loop {
        node.tick();
        // The counter counts down, in 24 bits; a loop takes less than its turn, but where a block is stored.
        let now = SYST::get_current();
        clocks += before.wrapping_sub(now) & 0x00FF_FFFF;
        before = now;
        port.elapse(clocks / board::CLOCKS_PER_MS, &mut node);
        clocks %= board::CLOCKS_PER_MS;
        while let Some(byte) = board.hear() {
            port.receive(&[byte], &mut node, |frame| frame.iter().for_each(|byte| board.say(*byte)));
        }
    }
}

/// The drive: a gear on its path.
#[derive(Default)]
struct Node {
    running: Option<Running>,
    compensation: CompensationSetting,
    diagnostics: Diagnostics,
    ticks: u32,
    loop_cost: u32,
}

/// What parameters in force have set going.
struct Running {
    gear: Gear<Number, Law>,
    state: State<Number, DEPTH, Law>,
    measures: Measures,
    output: Output<Number>,
    path: TestPath,
}

impl Running {
    /// The gear of a block, at the beginning of its path.
    fn of(block: &Block<'_>) -> Result<(Option<Self>, SelfTest), BlockError> {
        let parameters = Parameters::<Number, Law, ()>::of_block_in(block, DEPTH, TorqueUnit::NewtonMetre)?;
        let Some(gear) = parameters.gear else { return Ok((None, parameters.self_test)) };
        let scales = ScalesRecord::of_block(block)?;
        let running = Self {
            state: gear.start(Number::default()),
            gear,
            output: Output::default(),
            path: arithmetic::path(),
            measures: Measures { rated_rad: scales.rated_deflection_rad(), torque_nm: scales.torque_scale_nm() },
        };
        Ok((Some(running), parameters.self_test))
    }
}

impl Node {
    /// A control period.
    fn tick(&mut self) {
        let Some(running) = &mut self.running else { return };
        let began = SYST::get_current();
        let deflection = arithmetic::next_deflection(&mut running.path, &running.measures);
        let merged = running.gear.merged_pairs(&running.state);
        running.output = running.gear.step(&mut running.state, deflection);
        self.diagnostics.see_sample(&running.state.status());
        self.diagnostics.see_merged_pairs(merged, running.gear.merged_pairs(&running.state));
        // The counter counts down, in 24 bits.
        self.loop_cost = began.wrapping_sub(SYST::get_current()) & 0x00FF_FFFF;
        self.ticks = self.ticks.wrapping_add(1);
    }
}

impl Drive for Node {
    fn arithmetic(&self) -> (ScalarKind, u16) {
        (Number::KIND, DEPTH as u16)
    }

    fn is_enabled(&self) -> bool {
        false
    }

    fn adopt(&mut self, block: Option<&Block<'_>>) -> Result<(), BlockError> {
        let loaded = block.map(Running::of);
        if let Some(loaded) = &loaded {
            self.diagnostics.see_load(loaded.as_ref().map(|(_, self_test)| *self_test));
        }
        self.running = match loaded {
            None => None,
            Some(Ok((running, _))) => running,
            Some(Err(error)) => {
                defmt::error!("{}", error);
                return Err(error);
            }
        };
        self.ticks = 0;
        Ok(())
    }

    fn compensation(&self) -> CompensationSetting {
        self.compensation
    }

    fn set_compensation(&mut self, compensation: CompensationSetting) {
        self.compensation = compensation;
    }

    fn diagnostics(&self) -> Diagnostics {
        self.diagnostics
    }

    fn clear_diagnostics(&mut self) {
        self.diagnostics.clear();
    }

    fn live(&self) -> Live {
        let Some(Running { state, output, measures, .. }) = &self.running else { return Live::default() };
        let hysteresis_nm = arithmetic::torque_nm(output.hysteresis, measures);
        let (out_of_range, refused) = arithmetic::flags(state.status());
        Live {
            deflection_rad: arithmetic::deflection_rad(state.theta(), measures),
            torque_nm: arithmetic::torque_nm(output.torque, measures),
            hysteresis_nm,
            words: [output.torque.word(), output.hysteresis.word()],
            contribution_nm: self.compensation.of(hysteresis_nm),
            out_of_range,
            refused,
            ticks: self.ticks,
            loop_cost: self.loop_cost,
        }
    }
}

/// Ends the emulator, or halts for the debugger.
fn fail() -> ! {
    loop {
        debug::exit(EXIT_FAILURE);
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    fail()
}

#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    fail()
}
