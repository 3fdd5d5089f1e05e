//! The laws of the core, step by step.

use gmhm::memory::MemoryLaw;
use gmhm::memory::masing::Masing;
use gmhm::memory::phase::Phase;
use gmhm::memory::time::Time;
use gmhm::{Gate, Gear, Kernel, Law, ParamError, State};

use crate::platform::gears::{self, RATED_RAD};
use crate::{report, report_from, say};

const POINTS: usize = 16;
const PERIOD_S: f64 = 1e-4;

/// Measures every law.
pub fn measure() {
    if masing().and_then(|()| phase()).and_then(|()| time()).is_err() {
        say!("0 1 parameters refused");
    }
}

/// One call as a control loop makes it: the torque alone is wanted.
#[inline(never)]
fn step<L: MemoryLaw<f32>>(gear: &Gear<f32, L>, state: &mut State<f32, POINTS, L>, theta: f32) -> f32 {
    gear.step(state, theta).torque
}

/// A thousand samples from −0.99 A to 0.99 A.
fn rise() -> [f32; 1000] {
    core::array::from_fn(|k| RATED_RAD * 0.99 * (k as f32 / 500.0 - 1.0))
}

/// The state after these turning points, in A.
fn after<L: MemoryLaw<f32>>(gear: &Gear<f32, L>, turns: impl IntoIterator<Item = f32>) -> State<f32, POINTS, L> {
    let mut state = gear.start(0.0);
    for turn in turns {
        step(gear, &mut state, turn * RATED_RAD);
    }
    state
}

fn masing() -> Result<(), ParamError> {
    let params = gears::published(Law::Masing, Kernel::Deflection, Gate::Cycle, 0.0)?;
    let gear = Gear::<f32, _>::with_law(&params, Masing::new(&params));

    let mut state = after(&gear, [1.0, -1.0, -0.99]);
    report("law `masing`, away from a reversal", &rise(), |theta| step(&gear, &mut state, theta));

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

    let gear = Gear::<f32>::new(&params);
    let mut state = after(&gear, [1.0, -1.0, -0.99]);
    report("law `masing` chosen at run time, away from a reversal", &rise(), |theta| step(&gear, &mut state, theta));
    Ok(())
}

fn phase() -> Result<(), ParamError> {
    let params = gears::published(Law::Phase, Kernel::Deflection, Gate::Cycle, 0.0)?;
    let gear = Gear::<f32, _>::with_law(&params, Phase::new(&params));
    let mut state = after(&gear, [1.0, -1.0, -0.99]);
    report("law `phase`, away from a reversal", &rise(), |theta| step(&gear, &mut state, theta));
    let rising = after(&gear, [1.0, -1.0, 0.0]);
    report_from("law `phase`, reversal by a large step", &rising, -0.95 * RATED_RAD, |state, theta| {
        step(&gear, state, theta)
    });
    Ok(())
}

fn time() -> Result<(), ParamError> {
    for (name, kernel, gate) in [
        ("law `time`, kernel `deflection`, gate `cycle`", Kernel::Deflection, Gate::Cycle),
        ("law `time`, kernel `rate`, gate `none`", Kernel::Rate, Gate::None),
    ] {
        let params = gears::published(Law::Time, kernel, gate, 0.0)?;
        let gear = Gear::<f32, _>::with_law(&params, Time::new(&params, PERIOD_S));
        let mut state = after(&gear, [1.0, -1.0, -0.99]);
        report(name, &rise(), |theta| step(&gear, &mut state, theta));
    }
    Ok(())
}
