//! What each kind of term adds to a sample of a compensated gear.

use core::f32::consts::TAU;

use gmhm::memory::masing::Masing;
use gmhm::scalar::Float;
use gmhm::terms::compensated::{CompensatedState, Total};
use gmhm::terms::{Compensated, Sample, Setting, Stack};
use gmhm::{Gate, Gear, Kernel, Law};

use crate::platform::gears::{self, RATED_RAD};
use crate::{CALLS, say, ticks, typical};

/// Samples of the ride.
const SAMPLES: usize = 50;

type Joint = Compensated<f32, Masing<f32>, 1>;

/// Measures every kind in every shape.
#[inline(never)]
pub fn measure() {
    let Ok(params) = gears::published(Law::Masing, Kernel::Deflection, Gate::Cycle, 0.0) else {
        return say!("0 1 parameters refused");
    };
    let c1 = params.elastic().c1_nm_per_rad as f32;
    let setting = Setting { sigma: -1.0, c1, rated_deflection: RATED_RAD };
    let bare = Joint { gear: Gear::with_law(&params, Masing::new(&params)), stack: Stack::of_gear(setting) };
    let ride = ride();
    let without = ride_through(&bare, &ride);
    say!("{} {} law `masing` in a compensated gear without terms", without, CALLS);
    for term in typical::every() {
        let name = term.kind.name;
        let mut joint = bare.clone();
        if joint.stack.add(name, &term).is_err() {
            say!("0 1 term `{}` was refused", name);
            continue;
        }
        let added = ride_through(&joint, &ride).saturating_sub(without);
        match term.shape {
            ("", _) => say!("{} {} term `{}`", added, CALLS, name),
            (key, word) => say!("{} {} term `{}`, {} `{}`", added, CALLS, name, key, word),
        }
    }
}

#[inline(never)]
fn ride_through(joint: &Joint, ride: &[Sample<f32>; SAMPLES]) -> u32 {
    let mut state = joint.start::<16>(&ride[0]);
    ticks(ride, |sample| step(joint, &mut state, &sample))
}

#[inline(never)]
fn step(joint: &Joint, state: &mut CompensatedState<f32, 16, Masing<f32>, 1>, sample: &Sample<f32>) -> Total<f32> {
    joint.step(state, sample)
}

/// A joint that swings.
fn ride() -> [Sample<f32>; SAMPLES] {
    core::array::from_fn(|k| {
        let turn = TAU * k as f32 / SAMPLES as f32;
        let (sin, cos) = Float::sin_cos(turn);
        Sample {
            time: 1e-3 * k as f32,
            period: 5e-4,
            motor_angle: turn,
            output_angle: sin,
            deflection: 0.95 * RATED_RAD * sin,
            deflection_rate: RATED_RAD * cos,
            velocity: cos,
            acceleration: -sin,
            temperature: 25.0 + sin,
            motor_velocity: 100.0 * cos,
            output_velocity: cos,
            simulated_torque: sin,
            ..Sample::default()
        }
    })
}
