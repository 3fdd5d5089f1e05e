//! Laws `phase` and `time` by quadrature of the memory integral (MODEL.md section 4): the past fades by e^(−β·elapsed), and what each step
//! adds is integrated by Gauss and Legendre's rule.

use crate::{Constants, Weighed};

const NODES: usize = 10;

/// A Gauss–Legendre rule on [0, 1].
#[derive(Debug, Clone, Copy)]
struct Quadrature([(f64, f64); NODES]);

impl Quadrature {
    /// Nodes are the roots of the Legendre polynomial, by Newton from Chebyshev's.
    fn new() -> Self {
        let n = NODES as f64;
        Self(std::array::from_fn(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..20 {
                let (mut before, mut value) = (1.0, x);
                for k in 2..=NODES {
                    let k = k as f64;
                    (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
                }
                slope = n * (x * value - before) / (x * x - 1.0);
                x -= value / slope;
            }
            (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
        }))
    }

    /// ∫ from 0 to `length`, in panels of at most `panel`.
    fn integrate(&self, length: f64, panel: f64, integrand: impl Fn(f64) -> f64) -> f64 {
        let panels = (length / panel).ceil().max(1.0);
        let width = length / panels;
        let one = |p: f64| -> f64 { self.0.iter().map(|&(x, w)| w * integrand((p + x) * width)).sum() };
        (0..panels as u32).map(|p| one(f64::from(p))).sum::<f64>() * width
    }
}

/// The clock of the memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Clock {
    /// Pseudo-time φ/ω, φ = asin(θ/A): law `phase`.
    Pseudo,
    /// Real time, the sample period in s: law `time`.
    Real(f64),
}

/// The memory m and what it reads.
#[derive(Debug, Clone)]
pub struct Integral {
    gear: Constants,
    weighed: Weighed,
    gated: bool,
    clock: Clock,
    quadrature: Quadrature,
    theta: f64,
    m: f64,
}

impl Integral {
    /// A gear at θ_0 with m = 0; `gated` is the paper's gate `cycle`.
    pub fn new(gear: Constants, weighed: Weighed, gated: bool, clock: Clock, theta_0: f64) -> Self {
        Self { gear, weighed, gated, clock, quadrature: Quadrature::new(), theta: theta_0, m: 0.0 }
    }

    /// T = f(θ) + z after a move to θ, N·m.
    pub fn step(&mut self, theta: f64) -> f64 {
        match self.clock {
            Clock::Pseudo => self.turn(theta),
            Clock::Real(period) => self.wait(theta, period),
        }
        self.theta = theta;
        let gate = if self.gated { self.gear.gate(theta) } else { 1.0 };
        self.gear.elastic(theta) + gate * self.m
    }

    /// [`step`](Self::step) with another period than the usual, law `time`.
    pub fn step_after(&mut self, theta: f64, period: f64) -> f64 {
        let usual = std::mem::replace(&mut self.clock, Clock::Real(period));
        let torque = self.step(theta);
        self.clock = usual;
        torque
    }

    /// Real time: θ runs straight from the last sample to this one. A step without duration is a jump.
    fn wait(&mut self, theta: f64, period: f64) {
        let Constants { alpha, beta, .. } = self.gear;
        let (from, rise) = (self.theta, theta - self.theta);
        let added = match self.weighed {
            _ if period == 0.0 => {
                if self.weighed == Weighed::Rate {
                    alpha * rise
                } else {
                    0.0
                }
            }
            Weighed::Deflection => self
                .quadrature
                .integrate(period, 1.0 / beta, |s| -alpha * (-beta * (period - s)).exp() * (from + rise * s / period)),
            Weighed::Rate => {
                self.quadrature.integrate(period, 1.0 / beta, |s| alpha * (-beta * (period - s)).exp() * rise / period)
            }
        };
        self.m = self.m * (-beta * period).exp() + added;
    }

    /// Pseudo-time: θ = A sin φ, φ runs evenly from the last sample's to this one's, ω rad a second, whichever the direction.
    fn turn(&mut self, theta: f64) {
        let Constants { a, alpha, beta, omega, .. } = self.gear;
        let (from, to) = (self.phase(self.theta), self.phase(theta));
        let duration = (to - from).abs() / omega;
        let speed = omega * (to - from).signum();
        let panel = 0.5 / beta.max(omega);
        let added = self.quadrature.integrate(duration, panel, |s| {
            let (sin, cos) = (from + speed * s).sin_cos();
            let weighed = match self.weighed {
                Weighed::Deflection => -a * sin,
                Weighed::Rate => a * cos * speed,
            };
            alpha * (-beta * (duration - s)).exp() * weighed
        });
        self.m = self.m * (-beta * duration).exp() + added;
    }

    /// φ = asin(θ/A) within ±A, else ±π/2: from sine and cosine, as asin alone is ill-conditioned at the tips.
    fn phase(&self, theta: f64) -> f64 {
        let theta = theta.clamp(-self.gear.a, self.gear.a);
        (theta / self.gear.a).atan2(self.gear.gate(theta))
    }
}
