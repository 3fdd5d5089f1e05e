//! The core, its inverse and its terms over 100,000 samples a law, as a running hash: every machine must print the same lines to the bit.
#![cfg_attr(target_os = "none", no_std, no_main)]

mod hash;
mod platform;
mod test_path;
mod typical;

use gmhm::inverse::Invertible;
use gmhm::memory::masing::Masing;
use gmhm::memory::time::Time;
use gmhm::scalar::{Fixed, Scalar};
use gmhm::terms::{Compensated, Sample, Setting, Stack};
use gmhm::{Gate, Gear, Inverse, InverseError, Kernel, Law, Output, Params, Solution, State};
use hash::Hash;
use platform::gears;
use test_path::TestPath;

const SAMPLES: u32 = 100_000;
const CHECKPOINT: u32 = 20_000;
const PERIOD_S: f32 = 1e-4;
const PLAY_RAD: f64 = 2e-6;

/// Samples of a kind of term: 100,000 over all kinds and shapes.
const TERM_SAMPLES: u32 = 3_300;

type Kind = (Kernel, Gate);

const KINDS: [Kind; 4] = [
    (Kernel::Deflection, Gate::Cycle),
    (Kernel::Deflection, Gate::None),
    (Kernel::Rate, Gate::Cycle),
    (Kernel::Rate, Gate::None),
];

#[cfg_attr(target_os = "none", cortex_m_rt::entry)]
fn main() -> ! {
    floating("masing", Law::Masing, KINDS[0], 0.0);
    floating("masing, play", Law::Masing, KINDS[0], PLAY_RAD);
    for (name, kind) in ["phase deflection cycle", "phase deflection none", "phase rate cycle", "phase rate none"]
        .into_iter()
        .zip(KINDS)
    {
        floating(name, Law::Phase, kind, 0.0);
    }
    for (name, kind) in
        ["time deflection cycle", "time deflection none", "time rate cycle", "time rate none"].into_iter().zip(KINDS)
    {
        floating(name, Law::Time, kind, 0.0);
    }
    varying("time rate none, varying period", KINDS[3]);
    terms();
    for (name, play_rad) in [("fixed point: masing", 0.0), ("fixed point: masing, play", PLAY_RAD)] {
        fixed(name, Law::Masing, KINDS[0], play_rad, |params| Inverse::of(params, Masing::new(params), 0.0));
    }
    for (name, kind) in [
        "fixed point: time deflection cycle",
        "fixed point: time deflection none",
        "fixed point: time rate cycle",
        "fixed point: time rate none",
    ]
    .into_iter()
    .zip(KINDS)
    {
        let period_s = f64::from(PERIOD_S);
        fixed(name, Law::Time, kind, 0.0, |params| Inverse::of(params, Time::new(params, period_s), period_s));
    }
    platform::end()
}

/// A law in `f32`, chosen at run time.
fn floating(name: &'static str, law: Law, (kernel, gate): Kind, play_rad: f64) {
    let Ok(params) = gears::published(law, kernel, gate, play_rad) else {
        return say!("{}: parameters refused", name);
    };
    let Ok(inverse) = Inverse::<f32>::with_period(&params, f64::from(PERIOD_S)) else {
        return say!("{}: no inverse", name);
    };
    constant(name, &inverse);
}

/// The same at sample periods that vary.
fn varying(name: &'static str, (kernel, gate): Kind) {
    let Ok(params) = gears::published(Law::Time, kernel, gate, 0.0) else {
        return say!("{}: parameters refused", name);
    };
    let Ok(inverse) = Inverse::<f32>::with_period(&params, 4.0 * f64::from(PERIOD_S)) else {
        return say!("{}: no inverse", name);
    };
    walk(name, &inverse, |state, theta, load, path| {
        let period_s = PERIOD_S * path.uneven();
        (inverse.peek_after(state, load, period_s), inverse.gear().step_after(state, theta, period_s))
    });
}

/// A law in fixed point.
fn fixed<L: Invertible<Fixed>>(
    name: &'static str,
    law: Law,
    (kernel, gate): Kind,
    play_rad: f64,
    invert: impl FnOnce(&Params) -> Result<Inverse<Fixed, L>, InverseError>,
) {
    let Ok(params) = gears::published(law, kernel, gate, play_rad) else {
        return say!("{}: parameters refused", name);
    };
    let Ok(inverse) = invert(&params) else {
        return say!("{}: no inverse", name);
    };
    constant(name, &inverse);
}

/// At a constant sample period.
fn constant<S: Word, L: Invertible<S>>(name: &'static str, inverse: &Inverse<S, L>) {
    walk(name, inverse, |state, theta, load, _| (inverse.peek(state, load), inverse.gear().step(state, theta)));
}

/// Prints the hash of all outputs at each checkpoint. `turn` inverts a torque, then steps to a deflection.
fn walk<S: Word, L: Invertible<S>>(
    name: &'static str,
    inverse: &Inverse<S, L>,
    mut turn: impl FnMut(&mut State<S, 16, L>, S, S, &mut TestPath) -> (Solution<S>, Output<S>),
) {
    let gear = inverse.gear();
    let mut state = gear.start::<16>(S::ZERO);
    let mut path = TestPath::new(gears::RATED_RAD);
    let mut loads = TestPath::new(gears::RATED_NM);
    let mut hash = Hash::new();
    for k in 1..=SAMPLES {
        let theta = S::input(path.next_deflection(), gears::RATED_RAD);
        let load = S::input(loads.next_deflection(), gears::RATED_NM);
        let (solution, out) = turn(&mut state, theta, load, &mut path);
        hash.add(solution.theta.word());
        hash.add(
            u32::from(solution.saturated)
                + 2 * u32::from(solution.refused)
                + 4 * u32::from(solution.converged)
                + 8 * u32::from(solution.steps),
        );
        let status = state.status();
        hash.add(out.torque.word());
        hash.add(out.elastic.word());
        hash.add(out.hysteresis.word());
        hash.add(gear.start_uncertainty(&state).word());
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
    let (c1, rated_deflection) = (params.elastic().c1_nm_per_rad as f32, gears::RATED_RAD);
    let setting = Setting { sigma: -1.0, c1, rated_deflection };
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
        let mut deflection = TestPath::new(gears::RATED_RAD);
        let mut motion = TestPath::new(1.0);
        let mut hash = Hash::new();
        for k in 1..=TERM_SAMPLES {
            let [output_angle, deflection_rate, velocity] = core::array::from_fn(|_| motion.next_deflection());
            let sample = Sample {
                time: PERIOD_S * k as f32,
                period: PERIOD_S,
                motor_angle: 0.07 * (k % 90) as f32,
                output_angle,
                deflection: deflection.next_deflection(),
                deflection_rate: gears::RATED_RAD * deflection_rate,
                velocity,
                acceleration: motion.next_deflection(),
                temperature: 25.0 + motion.uneven(),
                motor_velocity: 100.0 * velocity,
                output_velocity: velocity,
                simulated_torque: gears::RATED_NM * velocity,
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

/// A number of 32 bits.
trait Word: Scalar {
    /// What the core takes for an angle or a torque, `rated` being the rated one.
    fn input(value: f32, rated: f32) -> Self;

    /// Its bits.
    fn word(self) -> u32;
}

impl Word for f32 {
    fn input(value: f32, _rated: f32) -> Self {
        value
    }

    fn word(self) -> u32 {
        self.to_bits()
    }
}

impl Word for Fixed {
    fn input(value: f32, rated: f32) -> Self {
        Self::from_f64(f64::from(value / rated))
    }

    fn word(self) -> u32 {
        self.to_bits().cast_unsigned()
    }
}
