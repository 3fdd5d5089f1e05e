//! How deep the calls of the core reach into the stack: it is painted below the caller, the calls are made along a path that leaves nothing out, and the paint
//! that is left is counted. `cargo xtask size` asserts and tabulates it.
#![no_std]
#![no_main]

mod platform;
mod test_path;
mod typical;

use core::hint::black_box;

use gmhm::block::{Header, Identity, Prepared, ScalarKind, Writer};
use gmhm::inverse::Invertible;
use gmhm::memory::masing::Masing;
use gmhm::memory::phase::Phase;
use gmhm::memory::time::Time;
use gmhm::terms::compensated::CompensatedState;
use gmhm::terms::{Compensated, Sample, Setting, Stack};
use gmhm::{Gate, Gear, Inverse, Kernel, Law, Params, State};
use platform::gears::{self, RATED_NM, RATED_RAD};
use test_path::TestPath;

const SAMPLES: u32 = 5_000;
const TERM_SAMPLES: u32 = 200;
const PERIOD_S: f64 = 1e-4;

/// Painted bytes below the caller.
const REACH: usize = 4096;
const PAINT: u32 = 0x5afe_57ac;

#[cortex_m_rt::entry]
fn main() -> ! {
    if published(Law::Masing).and_then(|masing| laws(&masing)).is_none() {
        say!("0 parameters refused");
    }
    platform::end()
}

fn published(law: Law) -> Option<Params> {
    gears::published(law, Kernel::Deflection, Gate::Cycle, 0.0).ok()
}

#[inline(never)]
fn laws(masing: &Params) -> Option<()> {
    law(("law `masing`", "inverse of law `masing`"), &Inverse::of(masing, Masing::new(masing), 0.0).ok()?);
    let phase = published(Law::Phase)?;
    law(("law `phase`", "inverse of law `phase`"), &Inverse::of(&phase, Phase::new(&phase), 0.0).ok()?);
    let time = published(Law::Time)?;
    let inverse = Inverse::of(&time, Time::new(&time, PERIOD_S), PERIOD_S).ok()?;
    law(("law `time`", "inverse of law `time`"), &inverse);
    loader(masing)?;
    let setting = Setting { sigma: -1.0, c1: masing.elastic().c1_nm_per_rad as f32, rated_deflection: RATED_RAD };
    let (mut deepest, mut name) = (0, ("", ""));
    for term in typical::every() {
        let mut stack = Stack::of_gear(setting);
        stack.add(term.kind.name, &term).ok()?;
        let depth = compensated(&Compensated { gear: Gear::with_law(masing, Masing::new(masing)), stack });
        if depth > deepest {
            (deepest, name) = (depth, (term.kind.name, term.shape.1));
        }
    }
    say!("{} law `masing` with the deepest of the terms, `{}` `{}`", deepest, name.0, name.1);
    Some(())
}

/// The loader of a prepared block.
#[inline(never)]
fn loader(masing: &Params) -> Option<()> {
    let mut buffer = [0; 512];
    let length = write(masing, &mut buffer)?;
    let block = buffer.get(..length)?;
    let deepest = depth(|| load(block));
    load(block).then(|| say!("{} loading a prepared block, its self-test included", deepest))
}

#[inline(never)]
fn write(masing: &Params, buffer: &mut [u8]) -> Option<usize> {
    let inverse = Inverse::<f32, _>::of(masing, Masing::new(masing), 0.0).ok()?;
    let mut writer = Writer::new(buffer, Header::new(Identity::NONE, ScalarKind::F32));
    writer.self_test(inverse.gear(), Some(&inverse)).ok()?;
    writer.prepared(&inverse).ok()?;
    writer.finish().ok()
}

#[inline(never)]
fn load(block: &[u8]) -> bool {
    Prepared::<f32>::load(black_box(block), 16).is_ok_and(|prepared| black_box(prepared.inverse.range()) > 0.0)
}

/// A law and its inverse along the path.
#[inline(never)]
fn law<L: Invertible<f32>>((step_name, peek_name): (&'static str, &'static str), inverse: &Inverse<f32, L>) {
    let mut state = inverse.gear().start::<16>(0.0);
    let (mut path, mut loads) = (TestPath::new(RATED_RAD), TestPath::new(RATED_NM));
    let (mut deepest_step, mut deepest_peek) = (0, 0);
    for _ in 0..SAMPLES {
        let (theta, load) = (path.next_deflection(), loads.next_deflection());
        deepest_peek = deepest_peek.max(depth(|| peek(inverse, &state, load)));
        deepest_step = deepest_step.max(depth(|| step(inverse.gear(), &mut state, theta)));
    }
    say!("{} {}", deepest_step, step_name);
    say!("{} {}", deepest_peek, peek_name);
}

#[inline(never)]
fn step<L: Invertible<f32>>(gear: &Gear<f32, L>, state: &mut State<f32, 16, L>, theta: f32) -> f32 {
    gear.step(state, theta).torque
}

#[inline(never)]
fn peek<L: Invertible<f32>>(inverse: &Inverse<f32, L>, state: &State<f32, 16, L>, torque: f32) -> f32 {
    inverse.peek(state, torque).theta
}

/// A gear with a term along the path.
#[inline(never)]
fn compensated(joint: &Compensated<f32, Masing<f32>, 1>) -> usize {
    let mut state = joint.start::<16>(&Sample::default());
    let mut path = TestPath::new(RATED_RAD);
    let mut deepest = 0;
    for k in 0..TERM_SAMPLES {
        let deflection = path.next_deflection();
        let sample =
            Sample { deflection, velocity: path.uneven(), motor_angle: 0.1 * (k % 60) as f32, ..Sample::default() };
        deepest = deepest.max(depth(|| compensate(joint, &mut state, &sample)));
    }
    deepest
}

#[inline(never)]
fn compensate(
    joint: &Compensated<f32, Masing<f32>, 1>,
    state: &mut CompensatedState<f32, 16, Masing<f32>, 1>,
    sample: &Sample<f32>,
) -> f32 {
    joint.step(state, sample).torque
}

/// Bytes of stack that a call takes.
#[inline(never)]
fn depth<R>(call: impl FnOnce() -> R) -> usize {
    let top = cortex_m::register::msp::read() as usize;
    let words = (top - REACH..top).step_by(size_of::<u32>());
    for word in words.clone() {
        // SAFETY: below the stack pointer of this function, which calls nothing here; RAM reaches farther, and nothing interrupts.
        unsafe { (word as *mut u32).write_volatile(PAINT) };
    }
    black_box(call());
    // SAFETY: as above.
    let touched = words.clone().find(|&word| unsafe { (word as *const u32).read_volatile() } != PAINT);
    top - touched.unwrap_or(top)
}
