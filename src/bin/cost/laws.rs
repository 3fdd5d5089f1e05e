//! The laws of the core, step by step.

use gmhm::inverse::Invertible;
use gmhm::memory::MemoryLaw;
use gmhm::memory::masing::Masing;
use gmhm::memory::time::Time;
use gmhm::scalar::{Float, Scalar};
use gmhm::{Gate, Gear, Inverse, Kernel, Law, Params, State};

use crate::platform::gears::{self, RATED_NM, RATED_RAD};
use crate::worst_case::{POINTS, peek, step, worst_case};
use crate::{CALLS, report, report_from, say, ticks};

const PERIOD_S: f64 = 1e-4;

/// Measures every law in `f32`.
#[cfg(target_abi = "eabihf")]
#[inline(never)]
pub fn measure() {
    if masing::<f32>().and_then(|()| chosen()).and_then(|()| phase()).and_then(|()| time::<f32>()).is_none() {
        say!("0 1 parameters refused");
    }
}

/// Measures the laws that fixed point has.
#[cfg(not(target_abi = "eabihf"))]
#[inline(never)]
pub fn measure() {
    use gmhm::scalar::Fixed;
    if masing::<Fixed>().and_then(|()| time::<Fixed>()).is_none() {
        say!("0 1 parameters refused");
    }
}

/// The published gear with another memory.
fn published(law: Law, kernel: Kernel, gate: Gate) -> Option<Params> {
    gears::published(law, kernel, gate, 0.0).ok()
}

/// What the core takes for a share of the rated deflection.
fn deflection<S: Scalar>(share: f64) -> S {
    S::from_f64(share * if S::SI { f64::from(RATED_RAD) } else { 1.0 })
}

/// What the core takes for a share of the rated torque.
fn load<S: Scalar>(share: f64) -> S {
    S::from_f64(share * if S::SI { f64::from(RATED_NM) } else { 1.0 })
}

/// The inverse along a sine of 100 samples, the gear following; the gear's own step is taken off.
#[inline(never)]
fn invert_sine<S: Scalar, L: Invertible<S>>(name: &'static str, inverse: &Inverse<S, L>, amplitude: f64) {
    let mut state = after(inverse.gear(), [1.0, -1.0, 0.0]);
    let sine: [S; 100] =
        core::array::from_fn(|k| load(amplitude * Float::sin(core::f64::consts::TAU * k as f64 / 100.0)));
    let mut path = [(S::ZERO, S::ZERO); 100];
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

/// The worst call of the inverse among many.
#[inline(never)]
fn invert_worst<S: Scalar, L: Invertible<S>>(name: &'static str, inverse: &Inverse<S, L>) {
    let (state, torque) = worst_case(inverse, after(inverse.gear(), [1.0, -1.0, 0.0]), TORQUES, load);
    report(name, &[torque], |torque| peek(inverse, &state, torque));
}

/// Torques among which the worst case is searched here.
const TORQUES: u32 = 5000;

/// Away from a reversal: a thousand samples from −0.99 A to 0.99 A.
#[inline(never)]
fn rise<S: Scalar, L: MemoryLaw<S>>(name: &'static str, gear: &Gear<S, L>) {
    let samples: [S; 1000] = core::array::from_fn(|k| deflection(0.99 * (k as f64 / 500.0 - 1.0)));
    let mut state = after(gear, [1.0, -1.0, -0.99]);
    report(name, &samples, |theta| step(gear, &mut state, theta));
}

/// The state after these turning points, in A.
fn after<S: Scalar, L: MemoryLaw<S>>(gear: &Gear<S, L>, turns: impl IntoIterator<Item = f64>) -> State<S, POINTS, L> {
    let mut state = gear.start(S::ZERO);
    for turn in turns {
        step(gear, &mut state, deflection(turn));
    }
    state
}

#[inline(never)]
fn masing<S: Scalar>() -> Option<()> {
    let params = published(Law::Masing, Kernel::Deflection, Gate::Cycle)?;
    let gear = Gear::<S, _>::with_law(&params, Masing::new(&params));

    rise("law `masing`, away from a reversal", &gear);

    let rising = after(&gear, [1.0, -1.0, 0.0]);
    report_from("law `masing`, reversal", &rising, deflection(-0.5), |state, theta| step(&gear, state, theta));

    // Shrinking strokes, the last one falling: sixteen turning points and no more room.
    let full = after(&gear, (0..POINTS).map(|k| (0.9 - 0.05 * k as f64) * if k % 2 == 0 { 1.0 } else { -1.0 }));
    report_from("law `masing`, reversal with a full stack", &full, deflection(0.12), |state, theta| {
        step(&gear, state, theta)
    });
    report_from("law `masing`, full stack wiped out", &full, deflection(-0.95), |state, theta| {
        step(&gear, state, theta)
    });
    report_from("law `masing`, reversal that wipes out a full stack", &full, deflection(0.95), |state, theta| {
        step(&gear, state, theta)
    });

    let inverse = Inverse::of(&params, *gear.law(), 0.0).ok()?;
    invert_sine("inverse of law `masing`, mean of a sine", &inverse, 0.95);
    report("inverse of law `masing`, across a full stack", &[load(-0.97)], |torque| peek(&inverse, &full, torque));
    invert_worst("inverse of law `masing`, worst of 5000", &inverse);
    Some(())
}

#[cfg(target_abi = "eabihf")]
#[inline(never)]
fn chosen() -> Option<()> {
    let params = published(Law::Masing, Kernel::Deflection, Gate::Cycle)?;
    rise("law `masing` chosen at run time, away from a reversal", &Gear::<f32>::new(&params));
    Some(())
}

#[cfg(target_abi = "eabihf")]
#[inline(never)]
fn phase() -> Option<()> {
    let params = published(Law::Phase, Kernel::Deflection, Gate::Cycle)?;
    let gear = Gear::<f32, _>::with_law(&params, gmhm::memory::phase::Phase::new(&params));
    rise("law `phase`, away from a reversal", &gear);
    invert_sine("inverse of law `phase`, mean of a sine", &Inverse::of(&params, *gear.law(), 0.0).ok()?, 0.5);
    let rising = after(&gear, [1.0, -1.0, 0.0]);
    report_from("law `phase`, reversal by a large step", &rising, deflection(-0.95), |state, theta| {
        step(&gear, state, theta)
    });
    Some(())
}

#[inline(never)]
fn time<S: Scalar>() -> Option<()> {
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
        let gear = Gear::<S, _>::with_law(&params, Time::new(&params, PERIOD_S));
        rise(name, &gear);
        invert_sine(inverse_name, &Inverse::of(&params, *gear.law(), PERIOD_S).ok()?, 0.8);
    }
    Some(())
}
