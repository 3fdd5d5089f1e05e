//! From a stored block to the first torque: ticks of the core clock under the emulator's instruction count. `cargo xtask size` turns them into instructions.
#![no_std]
#![no_main]

#[path = "../cost/counter.rs"]
mod counter;
#[path = "../platform/mod.rs"]
#[allow(dead_code, reason = "one deflection is enough")]
mod platform;

use gmhm::block::{Header, Identity, Joint, Parameters, Prepared, PreparedLaw, ScalarKind, Writer};
use gmhm::inverse::Invertible;
use gmhm::memory::AnyLaw;
use gmhm::memory::masing::Masing;
use gmhm::memory::phase::Phase;
use gmhm::memory::time::Time;
use gmhm::{Gate, Inverse, Kernel, Law, Params};
use platform::gears::{self, RATED_RAD};

const PERIOD_S: f64 = 1e-4;
/// Loads of each block.
const CALLS: u32 = 20;

/// From the bytes of a block to the first torque.
type Loader = fn(&[u8]) -> Option<f32>;

#[cortex_m_rt::entry]
fn main() -> ! {
    counter::start();
    if measure().is_none() {
        say!("0 1 parameters refused");
    }
    platform::end()
}

#[inline(never)]
fn measure() -> Option<()> {
    let masing = published(Law::Masing)?;
    law(["law `masing`", "law `masing`, from a block without the words of its set-up"], &masing, Masing::new(&masing))?;
    let phase = published(Law::Phase)?;
    law(["law `phase`", "law `phase`, from a block without the words of its set-up"], &phase, Phase::new(&phase))?;
    let time = published(Law::Time)?;
    let names = ["law `time`", "law `time`, from a block without the words of its set-up"];
    law(names, &time, Time::new(&time, PERIOD_S))?;
    let call = |params| Inverse::<f32>::new(params).ok().map(|inverse| first_torque(&inverse));
    say!("{} 1 law `masing`, from SI units", counter::ticks(1, &[&masing], call));
    Some(())
}

fn published(law: Law) -> Option<Params> {
    gears::published(law, Kernel::Deflection, Gate::Cycle, 0.0).ok()
}

/// A law from blocks with and without the words of its set-up.
#[inline(never)]
fn law<L: PreparedLaw<f32>>(names: [&'static str; 2], params: &Params, law: L) -> Option<()> {
    let inverse = Inverse::of(params, law, PERIOD_S).ok()?;
    let loaders: [(Loader, bool); 2] = [(prepared_torque::<L>, true), (plain_torque, false)];
    for ((load, is_prepared), name) in loaders.into_iter().zip(names) {
        let mut buffer = [0; 768];
        let length = write(params, &inverse, &mut buffer, is_prepared)?;
        let block = buffer.get(..length)?;
        load(block)?;
        say!("{} {} {}", counter::ticks(CALLS, &[block], load), CALLS, name);
    }
    Some(())
}

#[inline(never)]
fn write<L: PreparedLaw<f32>>(
    params: &Params,
    inverse: &Inverse<f32, L>,
    buffer: &mut [u8],
    is_prepared: bool,
) -> Option<usize> {
    let header = Header { period_s: PERIOD_S as f32, ..Header::new(Identity::NONE, ScalarKind::F32) };
    let mut writer = Writer::new(buffer, header);
    writer.gear(inverse.gear(), params).ok()?;
    writer.inverse::<f32>(params, PERIOD_S).ok()?;
    writer.self_test(inverse.gear(), Some(inverse)).ok()?;
    if is_prepared {
        writer.prepared(inverse).ok()?;
    }
    writer.joint(&Joint::default()).ok()?;
    writer.finish().ok()
}

#[inline(never)]
fn prepared_torque<L: PreparedLaw<f32>>(block: &[u8]) -> Option<f32> {
    Prepared::<f32, L>::load(block, 16).ok().map(|prepared| first_torque(&prepared.inverse))
}

#[inline(never)]
fn plain_torque(block: &[u8]) -> Option<f32> {
    let parameters = Parameters::<f32, AnyLaw<f32>, ()>::load_any(block, 16).ok()?;
    parameters.inverse.map(|inverse| first_torque(&inverse))
}

/// The torque of a first step.
#[inline(never)]
fn first_torque<L: Invertible<f32>>(inverse: &Inverse<f32, L>) -> f32 {
    let mut state = inverse.gear().start::<16>(0.0);
    inverse.gear().step(&mut state, 0.5 * RATED_RAD).torque
}
