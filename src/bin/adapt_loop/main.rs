//! A torque loop on a gear that warms for ten minutes: stiffness −10 %, hysteresis +20 %, torque noise 1 % of the rated torque. The deflection that is commanded is the inverse of the wanted
//! torque and of what an integrator adds; the inverse is that of the block as it was, of the block and what the adaptation has taken over, or of the gear as it is.
//!
//! A line a minute: rms of the torque error of each, mN·m. `cargo xtask emulate` compares them with the file beside.
#![no_std]
#![no_main]

#[path = "../platform/mod.rs"]
mod platform;

use gmhm::adapt::{Adaptation, Change, Settings};
use gmhm::block::Prepared;
use gmhm::elastic::Polynomial;
use gmhm::memory::masing::Masing;
use gmhm::scalar::{Float, Scalar};
use gmhm::{Gear, Inverse, State};

use platform::gears::{BLOCK, RATED_NM};

const PERIOD_S: f32 = 1e-3;
const MINUTES: u32 = 10;
const PERIODS_A_MINUTE: u32 = 60_000;
/// Periods after which the inverse of the gear as it is is set up anew.
const TRUTH_PERIODS: u32 = 1000;
/// Gain of the integrator, 1/s.
const GAIN_PER_S: f32 = 5.0;
/// Standard deviation of the torque noise, of the rated torque.
const NOISE: f32 = 0.01;

type MasingInverse = Inverse<f32, Masing<f32>>;

#[cortex_m_rt::entry]
fn main() -> ! {
    if run().is_none() {
        say!("parameters refused");
    }
    platform::end()
}

/// A loop: what it feeds forward, its gear's past, what it has added up.
struct Loop {
    inverse: MasingInverse,
    path: State<f32, 16, Masing<f32>>,
    integral: f32,
    noise: u32,
    squares: f32,
}

impl Loop {
    fn new(inverse: MasingInverse) -> Self {
        Self { path: inverse.gear().start(0.0), inverse, integral: 0.0, noise: 1, squares: 0.0 }
    }

    /// A control period; what the sensor measures.
    fn period(&mut self, gear: &Gear<f32, Masing<f32>>, [stiffness, hysteresis]: [f32; 2], wanted: f32) -> f32 {
        let theta = self.inverse.peek(&self.path, wanted + self.integral).theta;
        // Of the same path, all coefficients make the same loop.
        let out = gear.step(&mut self.path, theta);
        let torque = stiffness * (out.torque - out.hysteresis) + hysteresis * out.hysteresis;
        let measured = torque + NOISE * RATED_NM * self.normal();
        self.integral += GAIN_PER_S * PERIOD_S * (wanted - measured);
        self.squares += (wanted - torque) * (wanted - torque);
        measured
    }

    /// A draw that is nearly normal: twelve uniform ones.
    fn normal(&mut self) -> f32 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            sum += (self.noise >> 8) as f32 / 16_777_216.0;
        }
        sum
    }

    /// The rms error since the last call, mN·m.
    fn rms(&mut self) -> u32 {
        let mean = core::mem::take(&mut self.squares) / PERIODS_A_MINUTE as f32;
        (1e3 * Scalar::sqrt(mean) + 0.5) as u32
    }
}

/// The inverse of the block's gear, its stiffness and its hysteresis multiplied.
fn warmed(block: &MasingInverse, [stiffness, hysteresis]: [f32; 2]) -> Option<MasingInverse> {
    let Polynomial { k1, k3, k5 } = *block.gear().elastic().polynomial();
    let Masing { e, h, .. } = *block.gear().law();
    let [spring, memory] = [stiffness - 1.0, hysteresis - 1.0];
    block.changed(&[spring * k1, spring * k3, spring * k5, memory * e, memory * h])
}

/// sin x without double precision.
fn sine(x: f32) -> f32 {
    x.wrap_turn().sin_cos().0
}

fn run() -> Option<()> {
    let block = Prepared::<f32>::load(BLOCK, 16).ok()?.inverse;
    let gear = *block.gear();
    let adaptation = Adaptation::of_gear(&gear, &Settings { period_s: PERIOD_S, ..Settings::default() }).ok()?;
    let mut state = adaptation.start();
    let [mut fixed, mut adapted, mut truth] = [(); 3].map(|()| Loop::new(block));
    let (mut taken_over, mut given_back) = (0, 0);
    for minute in 0..MINUTES {
        for k in 0..PERIODS_A_MINUTE {
            let number = minute * PERIODS_A_MINUTE + k;
            let share = number as f32 / (MINUTES * PERIODS_A_MINUTE) as f32;
            let warm = [1.0 - 0.1 * share, 1.0 + 0.2 * share];
            // Whole periods of both tones are 20 s long.
            let turn = core::f32::consts::TAU * (number % 20_000) as f32 * PERIOD_S;
            let wanted = RATED_NM * (0.5 * sine(0.5 * turn) + 0.3 * sine(1.3 * turn));
            fixed.period(&gear, warm, wanted);
            if number.is_multiple_of(TRUTH_PERIODS) {
                truth.inverse = warmed(&block, warm)?;
            }
            truth.period(&gear, warm, wanted);
            let measured = adapted.period(&gear, warm, wanted);
            match adaptation.period(&mut state, &adapted.path, measured) {
                Change::None => {}
                Change::TakenOver => {
                    taken_over += 1;
                    adapted.inverse = adaptation.inverse(&state, &block)?;
                }
                Change::GivenBack => {
                    given_back += 1;
                    adapted.inverse = block;
                }
            }
        }
        say!("minute {}: fixed {}, adapted {}, truth {} mN.m", minute + 1, fixed.rms(), adapted.rms(), truth.rms());
    }
    say!("taken over {} times, given back {} times", taken_over, given_back);
    Some(())
}
