//! The core, its inverse and its terms over 100,000 samples a law, as a running hash: every machine must print the same lines to the bit.
#![cfg_attr(target_os = "none", no_std, no_main)]

mod hash;
mod journey;
mod platform;
mod typical;

use gmhm::memory::masing::Masing;
use gmhm::terms::{Compensated, Sample, Setting, Stack};
use gmhm::{Gate, Gear, Inverse, Kernel, Law};
use hash::Hash;
use journey::Journey;
use platform::gears;

const SAMPLES: u32 = 100_000;
const CHECKPOINT: u32 = 20_000;
const PERIOD_S: f32 = 1e-4;

/// Samples of a kind of term: 100,000 over all kinds and shapes.
const TERM_SAMPLES: u32 = 3_300;

#[cfg_attr(target_os = "none", cortex_m_rt::entry)]
fn main() -> ! {
    let play_rad = 2e-6;
    let kinds = [
        (Kernel::Deflection, Gate::Cycle),
        (Kernel::Deflection, Gate::None),
        (Kernel::Rate, Gate::Cycle),
        (Kernel::Rate, Gate::None),
    ];
    walk("masing", Law::Masing, kinds[0], 0.0, false);
    walk("masing, play", Law::Masing, kinds[0], play_rad, false);
    for (name, kind) in ["phase deflection cycle", "phase deflection none", "phase rate cycle", "phase rate none"]
        .into_iter()
        .zip(kinds)
    {
        walk(name, Law::Phase, kind, 0.0, false);
    }
    for (name, kind) in
        ["time deflection cycle", "time deflection none", "time rate cycle", "time rate none"].into_iter().zip(kinds)
    {
        walk(name, Law::Time, kind, 0.0, false);
    }
    walk("time rate none, varying period", Law::Time, kinds[3], 0.0, true);
    terms();
    platform::end()
}

/// Prints the hash of all outputs at each checkpoint.
fn walk(name: &'static str, law: Law, (kernel, gate): (Kernel, Gate), play_rad: f64, varying: bool) {
    let Ok(params) = gears::published(law, kernel, gate, play_rad) else {
        return say!("{}: parameters refused", name);
    };
    let longest_s = f64::from(PERIOD_S) * if varying { 4.0 } else { 1.0 };
    let Ok(inverse) = Inverse::<f32>::with_period(&params, longest_s) else {
        return say!("{}: no inverse", name);
    };
    let gear = inverse.gear();
    let mut state = gear.start::<16>(0.0);
    let mut journey = Journey::new(gears::RATED_RAD);
    let mut loads = Journey::new(gears::RATED_NM);
    let mut hash = Hash::new();
    for k in 1..=SAMPLES {
        let (theta, load) = (journey.next_deflection(), loads.next_deflection());
        let (solution, out) = if varying {
            let period_s = PERIOD_S * journey.uneven();
            (inverse.peek_after(&state, load, period_s), gear.step_after(&mut state, theta, period_s))
        } else {
            (inverse.peek(&state, load), gear.step(&mut state, theta))
        };
        hash.add(solution.theta.to_bits());
        hash.add(
            u32::from(solution.saturated)
                + 2 * u32::from(solution.refused)
                + 4 * u32::from(solution.converged)
                + 8 * u32::from(solution.steps),
        );
        let status = state.status();
        hash.add(out.torque.to_bits());
        hash.add(out.elastic.to_bits());
        hash.add(out.hysteresis.to_bits());
        hash.add(gear.start_uncertainty(&state).to_bits());
        hash.add(u32::from(status.out_of_range) + 2 * u32::from(status.refused));
        if k % CHECKPOINT == 0 {
            say!("{}: after {} samples {:08x}{:08x}", name, k, hash.high(), hash.low());
        }
    }
    say!("{}: pairs merged {}", name, gear.merged_pairs(&state));
}

/// Prints the hash of a gear with one term beside its Coulomb friction, for each kind and shape.
fn terms() {
    let Ok(params) = gears::published(Law::Masing, Kernel::Deflection, Gate::Cycle, 0.0) else {
        return say!("terms: parameters refused");
    };
    let setting = Setting { sigma: -1.0, c1: params.elastic().c1_nm_per_rad as f32 };
    let mut friction = Stack::<f32, 2>::of_gear(setting);
    for term in typical::every().filter(|term| term.kind.name == "coulomb_friction") {
        if friction.add(term.kind.name, &term).is_err() {
            say!("terms: friction refused");
        }
    }
    for term in typical::every() {
        let mut stack = friction.clone();
        if stack.add(term.kind.name, &term).is_err() {
            say!("term {}: refused", term.kind.name);
            continue;
        }
        let joint = Compensated { gear: Gear::with_law(&params, Masing::new(&params)), stack };
        let mut state = joint.start::<16>(&Sample::default());
        let mut deflection = Journey::new(gears::RATED_RAD);
        let mut motion = Journey::new(1.0);
        let mut hash = Hash::new();
        for k in 1..=TERM_SAMPLES {
            let sample = Sample {
                time: PERIOD_S * k as f32,
                period: PERIOD_S,
                motor_angle: 0.07 * (k % 90) as f32,
                output_angle: motion.next_deflection(),
                deflection: deflection.next_deflection(),
                deflection_rate: gears::RATED_RAD * motion.next_deflection(),
                velocity: motion.next_deflection(),
                acceleration: motion.next_deflection(),
                temperature: 25.0 + motion.uneven(),
                ..Sample::default()
            };
            let total = joint.step(&mut state, &sample);
            hash.add(total.torque.to_bits());
            hash.add(total.terms.to_bits());
            hash.add(total.deflection.to_bits());
            hash.add(u32::from(total.refused));
        }
        let (name, shape) = (term.kind.name, term.shape.1);
        let comma = if shape.is_empty() { "" } else { ", " };
        say!("term {}{}{}: after {} samples {:08x}{:08x}", name, comma, shape, TERM_SAMPLES, hash.high(), hash.low());
    }
}
