//! Sealed cases of an adaptation: a gear, what became of it, and a recording of it. It uses nothing of the core.
//!
//! A key is drawn from its seed; the keys stand in `tests/adapt_keys.csv`, written before anything was adapted. Who adapts gets the gear as it was and the recording.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::Constants;
use crate::drift::{Coefficients, Fault, Gear, Motion, Mover, Sensor};

/// Control period, s.
pub const PERIOD_S: f64 = 1e-3;
/// Length of a recording, s.
pub const SECONDS: f64 = 600.0;
/// After so many seconds the gear has become what it stays.
pub const CHANGED_S: f64 = 450.0;

/// What is to be found.
#[derive(Debug, Clone)]
pub struct Key {
    /// What all of it is drawn from.
    pub seed: u64,
    /// The gear as it was.
    pub gear: Constants,
    /// What its stiffness has become.
    pub stiffness: f64,
    /// What its hysteresis has become.
    pub hysteresis: f64,
    /// How it moves.
    pub motion: Motion,
    /// Standard deviation of the torque noise, of the rated torque.
    pub noise: f64,
}

/// A recording.
#[derive(Debug, Clone)]
pub struct Recording {
    /// Deflection, rad.
    pub deflection: Vec<f64>,
    /// Torque as measured, N·m.
    pub measured: Vec<f64>,
    /// Torque, N·m: part of the key.
    pub torque: Vec<f64>,
}

impl Key {
    /// The key of a seed.
    pub fn of_seed(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0xada9);
        let mut about = |value: f64, share: f64| value * rng.random_range(1.0 - share..1.0 + share);
        let published = Constants::PUBLISHED;
        let gear = Constants {
            a: about(published.a, 0.3),
            c1: about(published.c1, 0.3),
            // Small beside c1 at the rated deflection, whatever that is.
            c2: about(published.c2, 0.5),
            c3: about(published.c3, 0.2) * 0.3,
            alpha: about(published.alpha, 0.3),
            beta: about(published.beta, 0.3),
            omega: about(published.omega, 0.3),
        };
        let (stiffness, hysteresis) = (about(1.0, 0.1), about(1.0, 0.25));
        let noise = about(0.01, 0.5);
        let motion = Motion::FIVE[(seed % 5) as usize];
        Self { seed, gear, stiffness, hysteresis, motion, noise }
    }

    /// Its line among the keys.
    pub fn line(&self) -> String {
        let Self { seed, gear: Constants { a, c1, c2, c3, alpha, beta, omega }, stiffness, hysteresis, motion, noise } =
            self;
        format!(
            "{seed},{motion:?},{stiffness:?},{hysteresis:?},{noise:?},{a:?},{c1:?},{c2:?},{c3:?},{alpha:?},{beta:?},{omega:?}"
        )
    }

    /// The coefficients at a time.
    pub fn coefficients(&self, t: f64) -> Coefficients {
        let share = (t / CHANGED_S).min(1.0);
        Coefficients::of(&self.gear).scaled(1.0 + (self.stiffness - 1.0) * share, 1.0 + (self.hysteresis - 1.0) * share)
    }

    /// The same gear, which stays as it was.
    pub fn without_drift(&self) -> Self {
        Self { stiffness: 1.0, hysteresis: 1.0, ..self.clone() }
    }

    /// What a bench records within so many seconds.
    pub fn record(&self, seconds: f64) -> Recording {
        let rated = self.gear.elastic(self.gear.a).abs();
        let mut gear = Gear::new(&self.gear, 0.0);
        let mut mover = Mover::new(self.motion, self.seed);
        let mut sensor = Sensor::new(self.noise * rated, [0.0; 2], rated, self.seed);
        let mut recording = Recording { deflection: Vec::new(), measured: Vec::new(), torque: Vec::new() };
        for k in 0..(seconds / PERIOD_S) as u64 {
            let t = k as f64 * PERIOD_S;
            let theta = self.gear.a * mover.at(t);
            let torque = gear.step(&self.coefficients(t), theta);
            recording.deflection.push(theta);
            recording.torque.push(torque);
            recording.measured.push(sensor.read(torque, Fault::None, PERIOD_S)[1]);
        }
        recording
    }
}
