//! What the adaptation on the drive takes, once a control period beside the step of the law: ticks of the core clock under the emulator's instruction count.
//! `cargo xtask cost` turns them into instructions. An image of its own, as the other calls are inlined as a drive that has one of them would.
#![no_std]
#![no_main]

#[path = "../cost/counter.rs"]
mod counter;
#[path = "../platform/mod.rs"]
#[allow(dead_code, reason = "the torque is the law's own")]
mod platform;

use core::hint::black_box;

use gmhm::adapt::{Adaptation, Settings};
use gmhm::block::Prepared;
use gmhm::scalar::Float;

use platform::gears::{BLOCK, RATED_RAD};

const PERIOD_S: f32 = 1e-3;
/// Periods that are measured one by one: the end of a stretch and the work that follows it.
const AROUND: u32 = 260;
/// Calls along the motion.
const CALLS: u32 = 1000;
/// Calls of each.
const REPEATED: u32 = 100;

#[cortex_m_rt::entry]
fn main() -> ! {
    counter::start();
    if measure().is_none() {
        say!("0 1 parameters refused");
    }
    platform::end()
}

#[inline(never)]
fn restore<S: Clone>(scratch: &mut S, state: &S) {
    black_box(scratch).clone_from(state);
}

/// Measures its mean and its worst period along a sine of 5 Hz.
#[inline(never)]
fn measure() -> Option<()> {
    let gear = *Prepared::<f32>::load(BLOCK, 16).ok()?.gear();
    let adaptation = Adaptation::of_gear(&gear, &Settings { period_s: PERIOD_S, ..Settings::default() }).ok()?;
    let (mut path, mut state) = (gear.start::<16>(0.0), adaptation.start());
    let sine: [f32; 200] = core::array::from_fn(|k| {
        0.999 * RATED_RAD * (core::f32::consts::TAU * k as f32 / 200.0).wrap_turn().sin_cos().0
    });
    let mut period = |state: &mut _, number: u32| {
        let out = gear.step(&mut path, sine[number as usize % 200]);
        let _ = adaptation.period(state, &path, 0.97 * out.torque);
        path.clone()
    };
    // Along several stretches; the work of a stretch follows its end, so the next one ends as many periods later.
    let mut number = 0;
    for _ in 0..3 {
        let before = state.stretches();
        while state.stretches() == before && number < 20_000 {
            period(&mut state, number);
            number += 1;
        }
    }
    for _ in 0..1280 {
        period(&mut state, number);
        number += 1;
    }
    let mut worst = 0;
    let mut scratch = state;
    for _ in 0..AROUND {
        let before = state;
        let moved = period(&mut state, number);
        number += 1;
        let torque = 0.97 * gear.output(&moved).torque;
        let restoring = counter::ticks(REPEATED, &[torque], |torque| {
            restore(&mut scratch, &before);
            torque
        });
        let all = counter::ticks(REPEATED, &[torque], |torque| {
            restore(&mut scratch, &before);
            adaptation.period(&mut scratch, &moved, torque)
        });
        worst = worst.max(all.saturating_sub(restoring));
    }
    let (mut path, mut adapted) = (path.clone(), state);
    let both = counter::ticks(CALLS, &sine, |theta| {
        let out = gear.step(&mut path, theta);
        adaptation.period(&mut adapted, &path, 0.97 * out.torque)
    });
    let mut path = path.clone();
    let steps = counter::ticks(CALLS, &sine, |theta| 0.97 * gear.step(&mut path, theta).torque);
    say!("{} {} adaptation of law `masing`, mean of a period of 1 ms", both.saturating_sub(steps), CALLS);
    say!("{} {} adaptation of law `masing`, the worst period of 1 ms", black_box(worst), REPEATED);
    Some(())
}
