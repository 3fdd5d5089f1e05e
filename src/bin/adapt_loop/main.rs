//! A torque loop on a gear that warms for ten minutes: stiffness −10 %, hysteresis +20 %, torque noise 1 % of the rated torque. The deflection that is commanded is the inverse of the wanted
//! torque and of what an integrator adds; the inverse is that of the block as it was, of the block and what the adaptation has taken over, or of the gear as it is.
//!
//! A line a minute: rms of the torque error of each, mN·m. `cargo xtask emulate` compares them with the file beside.
#![no_std]
#![no_main]

#[path = "../platform/mod.rs"]
mod platform;

use gmhm::adapt::{Adaptation, Change, Settings};
use gmhm::memory::masing::Masing;
use gmhm::scalar::{Float, Scalar};
use gmhm::{Elastic, Gate, Gear, Inverse, Kernel, Law, Memory, Params, State};

use platform::gears::{self, RATED_NM};

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

fn inverse(params: &Params) -> Option<MasingInverse> {
    Inverse::of(params, Masing::new(params), 0.0).ok()
}

/// The block's gear, its stiffness and its hysteresis multiplied.
fn warmed(block: &Params, [stiffness, hysteresis]: [f32; 2]) -> Option<Params> {
    let (Elastic { c1_nm_per_rad, c2_nm_per_rad3, c3_nm_per_rad5 }, memory) = (block.elastic(), block.memory());
    let stiffness = f64::from(stiffness);
    let elastic = Elastic {
        c1_nm_per_rad: c1_nm_per_rad * stiffness,
        c2_nm_per_rad3: c2_nm_per_rad3 * stiffness,
        c3_nm_per_rad5: c3_nm_per_rad5 * stiffness,
    };
    let memory = Memory { alpha: memory.alpha * f64::from(hysteresis), ..memory };
    Params::new(block.rated_deflection_rad(), elastic, memory).ok()
}

fn run() -> Option<()> {
    let block = gears::published(Law::Masing, Kernel::Deflection, Gate::Cycle, 0.0).ok()?;
    let gear = Gear::<f32, _>::with_law(&block, Masing::new(&block));
    let settings = Settings { period_s: f64::from(PERIOD_S), ..Settings::default() };
    let adaptation = Adaptation::<f32>::new(&block, &settings).ok()?;
    let mut state = adaptation.start();
    let [mut fixed, mut adapted, mut truth] = [(); 3].map(|()| inverse(&block).map(Loop::new));
    let (fixed, adapted, truth) = (fixed.as_mut()?, adapted.as_mut()?, truth.as_mut()?);
    let (mut taken_over, mut given_back) = (0, 0);
    for minute in 0..MINUTES {
        for k in 0..PERIODS_A_MINUTE {
            let number = minute * PERIODS_A_MINUTE + k;
            let share = number as f32 / (MINUTES * PERIODS_A_MINUTE) as f32;
            let warm = [1.0 - 0.1 * share, 1.0 + 0.2 * share];
            // Whole periods of both tones are 20 s long.
            let turn = core::f32::consts::TAU * (number % 20_000) as f32 * PERIOD_S;
            let wanted = RATED_NM * (0.5 * Float::sin(0.5 * turn) + 0.3 * Float::sin(1.3 * turn));
            fixed.period(&gear, warm, wanted);
            if number.is_multiple_of(TRUTH_PERIODS) {
                truth.inverse = inverse(&warmed(&block, warm)?)?;
            }
            truth.period(&gear, warm, wanted);
            let measured = adapted.period(&gear, warm, wanted);
            match adaptation.period(&mut state, &adapted.path, measured) {
                Change::None => {}
                Change::TakenOver => {
                    taken_over += 1;
                    adapted.inverse = inverse(&adaptation.params(&state, &block).ok()?)?;
                }
                Change::GivenBack => {
                    given_back += 1;
                    adapted.inverse = inverse(&block)?;
                }
            }
        }
        say!("minute {}: fixed {}, adapted {}, truth {} mN.m", minute + 1, fixed.rms(), adapted.rms(), truth.rms());
    }
    say!("taken over {} times, given back {} times", taken_over, given_back);
    Some(())
}
