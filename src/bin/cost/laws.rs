//! The laws of the core, step by step.

use gmhm::inverse::Invertible;
use gmhm::memory::MemoryLaw;
use gmhm::memory::masing::Masing;
use gmhm::memory::phase::Phase;
use gmhm::memory::time::Time;
use gmhm::scalar::Float;
use gmhm::{Gate, Gear, Inverse, Kernel, Law, Params, State};

use crate::platform::gears::{self, RATED_NM, RATED_RAD};
use crate::{CALLS, report, report_from, say, ticks};

const POINTS: usize = 16;
const PERIOD_S: f64 = 1e-4;

/// Measures every law.
pub fn measure() {
    if masing().and_then(|()| phase()).and_then(|()| time()).is_none() {
        say!("0 1 parameters refused");
    }
}

/// The published gear with another memory.
fn published(law: Law, kernel: Kernel, gate: Gate) -> Option<Params> {
    gears::published(law, kernel, gate, 0.0).ok()
}

/// One call as a control loop makes it: the torque alone is wanted.
#[inline(never)]
fn step<L: MemoryLaw<f32>>(gear: &Gear<f32, L>, state: &mut State<f32, POINTS, L>, theta: f32) -> f32 {
    gear.step(state, theta).torque
}

/// One call of the inverse: the deflection alone is wanted.
#[inline(never)]
fn peek<L: Invertible<f32>>(inverse: &Inverse<f32, L>, state: &State<f32, POINTS, L>, torque: f32) -> f32 {
    inverse.peek(state, torque).theta
}

/// The inverse along a sine of 100 samples, the gear following; the gear's own step is taken off.
#[inline(never)]
fn invert_sine<L: Invertible<f32>>(name: &'static str, inverse: &Inverse<f32, L>, amplitude_nm: f32) {
    let mut state = after(inverse.gear(), [1.0, -1.0, 0.0]);
    let sine: [f32; 100] =
        core::array::from_fn(|k| amplitude_nm * Float::sin(core::f32::consts::TAU * k as f32 / 100.0));
    let mut path = [(0.0, 0.0); 100];
    // Twice, so that the loop is closed.
    for _ in 0..2 {
        for (place, torque) in path.iter_mut().zip(sine) {
            let theta = peek(inverse, &state, torque);
            step(inverse.gear(), &mut state, theta);
            *place = (torque, theta);
        }
    }
    let mut following = state.clone();
    let both = ticks(&path, |(torque, theta)| {
        let found = peek(inverse, &following, torque);
        step(inverse.gear(), &mut following, theta) + found
    });
    let mut following = state.clone();
    let steps = ticks(&path, |(torque, theta)| step(inverse.gear(), &mut following, theta) + torque);
    say!("{} {} {}", both.saturating_sub(steps), CALLS, name);
}

/// Away from a reversal: a thousand samples from −0.99 A to 0.99 A.
#[inline(never)]
fn rise<L: MemoryLaw<f32>>(name: &'static str, gear: &Gear<f32, L>) {
    let samples: [f32; 1000] = core::array::from_fn(|k| RATED_RAD * 0.99 * (k as f32 / 500.0 - 1.0));
    let mut state = after(gear, [1.0, -1.0, -0.99]);
    report(name, &samples, |theta| step(gear, &mut state, theta));
}

/// The state after these turning points, in A.
fn after<L: MemoryLaw<f32>>(gear: &Gear<f32, L>, turns: impl IntoIterator<Item = f32>) -> State<f32, POINTS, L> {
    let mut state = gear.start(0.0);
    for turn in turns {
        step(gear, &mut state, turn * RATED_RAD);
    }
    state
}

#[inline(never)]
fn masing() -> Option<()> {
    let params = published(Law::Masing, Kernel::Deflection, Gate::Cycle)?;
    let gear = Gear::<f32, _>::with_law(&params, Masing::new(&params));

    rise("law `masing`, away from a reversal", &gear);

    let rising = after(&gear, [1.0, -1.0, 0.0]);
    report_from("law `masing`, reversal", &rising, -0.5 * RATED_RAD, |state, theta| step(&gear, state, theta));

    // Shrinking strokes, the last one rising: sixteen turning points and no more room.
    let full = after(&gear, (0..POINTS).map(|k| (0.9 - 0.05 * k as f32) * if k % 2 == 0 { 1.0 } else { -1.0 }));
    report_from("law `masing`, reversal with a full stack", &full, 0.12 * RATED_RAD, |state, theta| {
        step(&gear, state, theta)
    });
    report_from("law `masing`, full stack wiped out", &full, -0.95 * RATED_RAD, |state, theta| {
        step(&gear, state, theta)
    });
    report_from("law `masing`, reversal that wipes out a full stack", &full, 0.95 * RATED_RAD, |state, theta| {
        step(&gear, state, theta)
    });

    let inverse = Inverse::of(&params, Masing::new(&params), 0.0).ok()?;
    invert_sine("inverse of law `masing`, mean of a sine", &inverse, 0.95 * RATED_NM);
    report("inverse of law `masing`, across a full stack", &[-0.97 * RATED_NM], |torque| peek(&inverse, &full, torque));

    let gear = Gear::<f32>::new(&params);
    rise("law `masing` chosen at run time, away from a reversal", &gear);
    Some(())
}

#[inline(never)]
fn phase() -> Option<()> {
    let params = published(Law::Phase, Kernel::Deflection, Gate::Cycle)?;
    let gear = Gear::<f32, _>::with_law(&params, Phase::new(&params));
    rise("law `phase`, away from a reversal", &gear);
    invert_sine(
        "inverse of law `phase`, mean of a sine",
        &Inverse::of(&params, *gear.law(), 0.0).ok()?,
        0.5 * RATED_NM,
    );
    let rising = after(&gear, [1.0, -1.0, 0.0]);
    report_from("law `phase`, reversal by a large step", &rising, -0.95 * RATED_RAD, |state, theta| {
        step(&gear, state, theta)
    });
    Some(())
}

#[inline(never)]
fn time() -> Option<()> {
    for (name, inverse_name, kernel, gate) in [
        (
            "law `time`, kernel `deflection`, gate `cycle`",
            "inverse of law `time`, kernel `deflection`, gate `cycle`, mean of a sine",
            Kernel::Deflection,
            Gate::Cycle,
        ),
        (
            "law `time`, kernel `rate`, gate `none`",
            "inverse of law `time`, kernel `rate`, gate `none`, mean of a sine",
            Kernel::Rate,
            Gate::None,
        ),
    ] {
        let params = published(Law::Time, kernel, gate)?;
        let gear = Gear::<f32, _>::with_law(&params, Time::new(&params, PERIOD_S));
        rise(name, &gear);
        invert_sine(inverse_name, &Inverse::of(&params, *gear.law(), PERIOD_S).ok()?, 0.8 * RATED_NM);
    }
    Some(())
}
