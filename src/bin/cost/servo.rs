//! The feed-forward of a joint and the servo around it, once a control period.

use gmhm::drive::Gains;
use gmhm::drive::pair::{Mounting, Setup};
use gmhm::drive::servo::{Reference, Servo, ServoSetup};
use gmhm::drive::{CompensatedServo, TorqueShaft};
use gmhm::feedforward::{Controls, Demand, FeedForward, Settings, Source};
use gmhm::memory::AnyLaw;
use gmhm::memory::masing::Masing;
use gmhm::scalar::Float;
use gmhm::terms::feedforward::CompensatedFeedForward;
use gmhm::terms::{Sample, Setting, Stack};
use gmhm::{Gate, Kernel, Law, Params};

use crate::platform::gears::{self, RATED_NM, RATED_RAD};
use crate::{report, say, typical};

const PERIOD_S: f64 = 5e-4;
const COUNTS: u32 = 1 << 20;

/// Measures both along a swing of 100 periods.
#[inline(never)]
pub fn measure() {
    if feed_forward().and_then(|()| servo()).is_none() {
        say!("0 1 parameters refused");
    }
}

fn swing(k: usize) -> f32 {
    Float::sin(core::f32::consts::TAU * k as f32 / 100.0)
}

#[inline(never)]
fn feed_forward() -> Option<()> {
    let params = gears::published(Law::Masing, Kernel::Deflection, Gate::Cycle, 0.0).ok()?;
    let settings = Settings { period_s: PERIOD_S, ..Settings::default() };
    let feed_forward = FeedForward::<f32, _>::of(&params, Masing::new(&params), &settings).ok()?;
    for (name, source) in [
        ("feed-forward of law `masing`, along the reference", Source::Reference),
        ("feed-forward of law `masing`, along the measurement", Source::Measurement),
    ] {
        let mut state = feed_forward.start::<16>(0.0);
        let controls = Controls { on: true, source, ratio: 1.0 };
        let demands: [Demand<f32>; 100] = core::array::from_fn(|k| Demand {
            torque: 0.9 * RATED_NM * swing(k),
            deflection: 0.9 * RATED_RAD * swing(k + 99),
        });
        report(name, &demands, |demand| feed_forward.step(&mut state, &controls, &demand).offset);
    }
    Some(())
}

/// What a period brings: the reference, and the counts of motor and output.
type Period = (Reference<f32>, u32, u32);

#[inline(never)]
fn servo() -> Option<()> {
    let params = gears::published(Law::Masing, Kernel::Deflection, Gate::Cycle, 0.0).ok()?;
    let mounting = Mounting { counts_per_turn: COUNTS, reversed: false };
    let encoders = Setup {
        motor: mounting,
        output: mounting,
        ratio: (100, 1),
        deflection_zero_rad: 0.0,
        rated_deflection_rad: params.rated_deflection_rad(),
    };
    let gains = Gains {
        period_s: PERIOD_S,
        position_per_s: 60.0,
        velocity_nms_per_rad: 2.0,
        integral_rad_per_s: 60.0,
        filter_rad_per_s: 1900.0,
        limit_nm: 90.0,
    };
    let feed_forward = Settings { period_s: PERIOD_S, ..Settings::default() };
    let setup = ServoSetup { encoders, reference_counts_per_turn: 1 << 30, gains, feed_forward };
    let periods: [Period; 100] = core::array::from_fn(|k| {
        let turned = |counts: f32, k| ((counts * swing(k)) as i32).rem_euclid(COUNTS as i32) as u32;
        let reference =
            Reference { counts: (1e6 * swing(k)) as i64, torque: 0.9 * RATED_NM * swing(k), feed_forward: 0.0 };
        (reference, turned(1e5, k + 99), turned(1e3, k + 99))
    });
    of_gear(&params, &setup, &periods)?;
    with_terms(&compensated(&params, &setup)?, &periods);
    Some(())
}

#[inline(never)]
fn of_gear(params: &Params, setup: &ServoSetup, periods: &[Period]) -> Option<()> {
    let servo = Servo::<f32>::new(params, setup).ok()?;
    let mut state = servo.start::<16>(0, 0, 0);
    let controls = Controls { on: true, ..Controls::default() };
    report("period of a servo, law `masing` chosen at run time", periods, |(reference, motor, output)| {
        servo.period(&mut state, &controls, &reference, motor, output)
    });
    Some(())
}

/// A servo with friction that fades with the temperature. A frame of its own: the smallest board has little stack.
#[inline(never)]
fn compensated(params: &Params, setup: &ServoSetup) -> Option<CompensatedServo<f32, AnyLaw<f32>, 2>> {
    let setting = Setting { sigma: 1.0, c1: params.elastic().c1_nm_per_rad as f32, rated_deflection: RATED_RAD };
    let mut stack = Stack::of_gear(setting);
    for term in typical::every().filter(|term| ["coulomb_friction", "thermal_friction"].contains(&term.kind.name)) {
        stack.add(term.kind.name, &term).ok()?;
    }
    let feed_forward = FeedForward::new(params, &setup.feed_forward).ok()?;
    CompensatedServo::new(CompensatedFeedForward::new(feed_forward, &stack), setup, TorqueShaft::Output).ok()
}

#[inline(never)]
fn with_terms(servo: &CompensatedServo<f32, AnyLaw<f32>, 2>, periods: &[Period]) {
    let mut state = servo.start::<16>(0, 0, 0, &Sample::default());
    let controls = Controls { on: true, ..Controls::default() };
    let sample = Sample { velocity: 0.5, temperature: 25.0, ..Sample::default() };
    let name = "period of a servo, law `masing` chosen at run time, terms `coulomb_friction` and `thermal_friction`";
    report(name, periods, |(reference, motor, output)| {
        servo.period(&mut state, &controls, &reference, &sample, motor, output)
    });
}
