//! Gears whose coefficients drift, their motions, and torque sensors with faults: what an adaptation is held to. It uses nothing of the core.
//!
//! Torques are those of [`Masing`]: the loop shape by its list of turning points, everything else by the present coefficients.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::Constants;
use crate::masing::Masing;

/// Coefficients at a time: SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// c1, c2, c3.
    pub elastic: [f64; 3],
    /// e, N·m/rad.
    pub e: f64,
    /// h, N·m/rad.
    pub h: f64,
}

impl Coefficients {
    /// Those of a gear.
    pub fn of(gear: &Constants) -> Self {
        Self { elastic: [gear.c1, gear.c2, gear.c3], e: gear.e(), h: gear.h() }
    }

    /// Stiffness and hysteresis multiplied.
    pub fn scaled(self, stiffness: f64, hysteresis: f64) -> Self {
        Self { elastic: self.elastic.map(|c| c * stiffness), e: self.e * hysteresis, h: self.h * hysteresis }
    }
}

/// A gear whose coefficients may be others at every sample.
#[derive(Debug, Clone)]
pub struct Gear {
    rated: f64,
    shape: Masing,
}

impl Gear {
    /// At a deflection, its past unknown. The loop shape is that of a gear with nothing but a loop of half-width 1 N·m.
    pub fn new(gear: &Constants, theta: f64) -> Self {
        let bare = Constants { c1: 0.0, c2: 0.0, c3: 0.0, alpha: 1.0 / gear.a, beta: 0.0, omega: 1.0, ..*gear };
        Self { rated: gear.a, shape: Masing::new(bare, 256, 0.0, theta) }
    }

    /// The torque at the next deflection, N·m.
    pub fn step(&mut self, now: &Coefficients, theta: f64) -> f64 {
        let shape = self.shape.step(theta);
        let [c1, c2, c3] = now.elastic;
        let gate = ((self.rated - theta) * (self.rated + theta)).max(0.0).sqrt() / self.rated;
        c1 * theta + c2 * theta.powi(3) + c3 * theta.powi(5) - now.e * theta * gate + now.h * self.rated * shape
    }
}

/// How the deflection moves, as a share of A over time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// A sine of 1 Hz to 0.9.
    Sine,
    /// Strokes of 10 s between ±0.98.
    Slow,
    /// Nine tones from 0.1 to 2 Hz.
    Tones,
    /// 0.5 Hz between 0.1 and 0.95, after one stroke to either side.
    OneSided,
    /// Moves of 0.3 s to random places with rests of 0.7 s.
    Moves,
    /// 5 Hz to 0.3.
    Fast,
    /// 0.5 Hz to 0.08 about places that change every 20 s.
    Small,
    /// Standing still at 0.5 but for the first stroke to either side.
    Still,
}

impl Motion {
    /// The five that faults are tried on.
    pub const FIVE: [Self; 5] = [Self::Sine, Self::Slow, Self::Tones, Self::OneSided, Self::Moves];
    /// All but the one that stands still.
    pub const MOVING: [Self; 7] =
        [Self::Sine, Self::Slow, Self::Tones, Self::OneSided, Self::Moves, Self::Fast, Self::Small];
    /// All.
    pub const ALL: [Self; 8] =
        [Self::Sine, Self::Slow, Self::Tones, Self::OneSided, Self::Moves, Self::Fast, Self::Small, Self::Still];
}

/// A motion from a seed.
#[derive(Debug, Clone)]
pub struct Mover {
    motion: Motion,
    tones: Vec<(f64, f64)>,
    rng: ChaCha8Rng,
    from: f64,
    to: f64,
    begun: f64,
}

impl Mover {
    /// At the start.
    pub fn new(motion: Motion, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let tones = (0..9).map(|k| (0.1 * 20_f64.powf(f64::from(k) / 8.0), rng.random_range(0.0..TAU))).collect();
        Self { motion, tones, rng, from: 0.0, to: 0.0, begun: 0.0 }
    }

    /// θ/A at a time, called with rising times.
    pub fn at(&mut self, t: f64) -> f64 {
        // Two seconds to both tips and back make the past known.
        let first = 2.0;
        if t < first {
            return 0.99 * (TAU * t / first).sin();
        }
        let t = t - first;
        match self.motion {
            Motion::Sine => 0.9 * (TAU * t).sin(),
            Motion::Slow => {
                let cycle = (t / 20.0 + 0.25).fract();
                0.98 * (if cycle < 0.5 { 4.0 * cycle - 1.0 } else { 3.0 - 4.0 * cycle })
            }
            Motion::Tones => {
                let sum: f64 = self.tones.iter().map(|(f, p)| (TAU * f * t + p).sin() - p.sin()).sum();
                (0.95 * sum / 6.0).clamp(-0.99, 0.99)
            }
            Motion::OneSided => 0.525 * (1.0 - (-t).exp()) - 0.425 * (TAU * 0.5 * t).sin() * (1.0 - (-t).exp()),
            Motion::Moves => {
                let (move_s, whole_s) = (0.3, 1.0);
                if t - self.begun >= whole_s {
                    (self.begun, self.from) = (t, self.to);
                    self.to = self.rng.random_range(-0.9..0.9);
                }
                let share = ((t - self.begun) / move_s).min(1.0);
                self.from + (self.to - self.from) * 0.5 * (1.0 - (0.5 * TAU * share).cos())
            }
            Motion::Fast => 0.3 * (TAU * 5.0 * t).sin(),
            Motion::Small => {
                if t - self.begun >= 20.0 {
                    (self.begun, self.from) = (t, self.to);
                    self.to = self.rng.random_range(-0.8..0.8);
                }
                let share = (t - self.begun).min(1.0);
                self.from + (self.to - self.from) * share + 0.08 * (TAU * 0.5 * t).sin()
            }
            Motion::Still => 0.5 * t.min(1.0),
        }
    }
}

/// What is wrong with the torque signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// Nothing.
    None,
    /// It stays where it is.
    Stuck,
    /// Zero and its noise.
    Zero,
    /// An offset, N·m.
    Offset(f64),
    /// An offset that grows, N·m a second.
    Drift(f64),
    /// Late, s.
    Delay(f64),
    /// A sample in this many is off by up to the rated torque.
    Spikes(u32),
    /// A sample in this many is off by up to half the rated torque, always the same way.
    SpikesUp(u32),
    /// A sample in this many is NaN.
    NotNumbers(u32),
    /// Nothing but NaN.
    AllNotNumbers,
}

/// A sensor of the torque.
#[derive(Debug, Clone)]
pub struct Sensor {
    /// Standard deviation of the white noise, N·m.
    pub white: f64,
    /// Of the coloured noise, N·m, and its correlation from sample to sample.
    pub coloured: [f64; 2],
    /// Size of spikes, N·m.
    pub rated: f64,
    rng: ChaCha8Rng,
    colour: f64,
    past: Vec<f64>,
    held: f64,
    grown: f64,
}

impl Sensor {
    /// A sensor from a seed.
    pub fn new(white: f64, coloured: [f64; 2], rated: f64, seed: u64) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
        Self { white, coloured, rated, rng, colour: 0.0, past: Vec::new(), held: 0.0, grown: 0.0 }
    }

    /// A draw of the standard normal distribution.
    fn normal(&mut self) -> f64 {
        let (a, b): (f64, f64) = (self.rng.random_range(f64::MIN_POSITIVE..1.0), self.rng.random());
        (-2.0 * a.ln()).sqrt() * (TAU * b).cos()
    }

    /// The torque with its noise, and what the sensor says of it under a fault, both N·m.
    pub fn read(&mut self, torque: f64, fault: Fault, period_s: f64) -> [f64; 2] {
        let [sd, correlation] = self.coloured;
        if sd > 0.0 {
            self.colour = correlation * self.colour + (1.0 - correlation * correlation).sqrt() * self.normal();
        }
        let noise = self.white * self.normal() + sd * self.colour;
        self.past.push(torque);
        let healthy = torque + noise;
        let late = |seconds: f64| {
            let samples = seconds / period_s;
            let (whole, part) = (samples.floor() as usize, samples.fract());
            let at = |back: usize| self.past[self.past.len().saturating_sub(1 + back)];
            at(whole) * (1.0 - part) + at(whole + 1) * part
        };
        let says = match fault {
            Fault::None => healthy,
            Fault::Stuck => self.held,
            Fault::Zero => noise,
            Fault::Offset(by) => healthy + by,
            Fault::Drift(rate) => {
                self.grown += rate * period_s;
                healthy + self.grown
            }
            Fault::Delay(seconds) => late(seconds) + noise,
            Fault::Spikes(one_in) if self.rng.random_ratio(1, one_in) => {
                healthy + self.rated * self.rng.random_range(-1.0..1.0)
            }
            Fault::SpikesUp(one_in) if self.rng.random_ratio(1, one_in) => {
                healthy + 0.5 * self.rated * self.rng.random_range(0.0..1.0)
            }
            Fault::NotNumbers(one_in) if self.rng.random_ratio(1, one_in) => f64::NAN,
            Fault::Spikes(_) | Fault::SpikesUp(_) | Fault::NotNumbers(_) => healthy,
            Fault::AllNotNumbers => f64::NAN,
        };
        if fault != Fault::Stuck {
            self.held = says;
        }
        if self.past.len() > 4096 {
            self.past.drain(..2048);
        }
        [healthy, says]
    }
}
