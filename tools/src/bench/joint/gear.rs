//! The gear in the joint: the model's own, or one that is not the compensator's model.

use gmhm::{Elastic, Gear, Params, State};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use clap::ValueEnum;
use serde::Serialize;

use crate::bench::options::value_name;

/// Which gear sits in the joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Plant {
    /// The model's own
    #[default]
    Model,
    /// Maxwell slip with the model's elastic torque: ten elements, first loading 1 − exp(−3θ/A)
    MaxwellSlip,
    /// Three elements: a loop with corners
    Coarse,
    /// First loading 1 − exp(−12θ/A): slips early, similar to friction
    Early,
    /// First loading 1 − exp(−θ/A) up to 3 A: never slips completely
    Late,
    /// As maxwell-slip, on a spring that is 28 % softer about zero (soft windup)
    Windup,
    /// Eight elements of random reach and torque
    #[value(name = "random-1")]
    #[serde(rename = "random-1")]
    Random1,
    /// Eight others
    #[value(name = "random-2")]
    #[serde(rename = "random-2")]
    Random2,
    /// Eight others
    #[value(name = "random-3")]
    #[serde(rename = "random-3")]
    Random3,
}

impl Plant {
    /// Its name on the command line and in reports.
    pub fn name(self) -> String {
        value_name(&self)
    }
}

/// A gear that is driven by its deflection.
#[derive(Debug, Clone)]
pub enum JointGear {
    /// The model file's gear.
    Model(Gear<f64>, Box<State<f64, 64>>),
    /// An elastic torque with elastic slip elements for hysteresis.
    MaxwellSlip(MaxwellSlip),
    /// The middle between the branches of another gear's rated cycle: that gear without its hysteresis.
    Middle(Middle),
}

impl JointGear {
    /// The gear at rest, to be stepped at a constant period.
    pub fn of(plant: Plant, params: &Params, period_s: f64) -> Self {
        match Elements::of(plant) {
            None => {
                // Rows of a path are a time apart.
                let gear = Gear::with_period(params, period_s).unwrap_or_else(|_| Gear::new(params));
                Self::Model(gear, Box::new(gear.start(0.0)))
            }
            Some(elements) => Self::MaxwellSlip(MaxwellSlip::new(&elements, params)),
        }
    }

    /// The same without its hysteresis.
    pub fn middle(mut self, rated_deflection_rad: f64) -> Self {
        Self::Middle(Middle::of(&mut self, rated_deflection_rad))
    }

    /// Moves to a deflection and returns the torque there, N·m.
    pub fn step(&mut self, theta_rad: f64) -> f64 {
        match self {
            Self::Model(gear, state) => gear.step(state, theta_rad).torque,
            Self::MaxwellSlip(slip) => slip.step(theta_rad),
            Self::Middle(middle) => middle.torque_nm(theta_rad),
        }
    }
}

/// Reach over A and relative torque of each slip element, and how much softer than at the tips the spring is about zero.
#[derive(Debug, Clone, PartialEq)]
struct Elements {
    elements: Vec<[f64; 2]>,
    windup: f64,
}

impl Elements {
    /// None for the model's own gear.
    fn of(plant: Plant) -> Option<Self> {
        let (elements, windup) = match plant {
            Plant::Model => return None,
            Plant::MaxwellSlip => (exponential(3.0, 1.5, 10), 0.0),
            Plant::Coarse => (vec![[0.08, 0.4], [0.35, 0.35], [1.1, 0.25]], 0.0),
            Plant::Early => (exponential(12.0, 0.4, 10), 0.0),
            Plant::Late => (exponential(1.0, 3.0, 10), 0.0),
            Plant::Windup => (exponential(3.0, 1.5, 10), 0.28),
            Plant::Random1 => (random(1), 0.0),
            Plant::Random2 => (random(2), 0.0),
            Plant::Random3 => (random(3), 0.0),
        };
        Some(Self { elements, windup })
    }
}

/// Elements whose first loading runs along chords of 1 − e^(−rate·x) up to x = `end`.
fn exponential(rate: f64, end: f64, count: usize) -> Vec<[f64; 2]> {
    let loading = |x: f64| -f64::exp_m1(-rate * x);
    let reach = |i: usize| end * i as f64 / count as f64;
    // Where an element slips, the slope falls by its stiffness.
    let slope = |i: usize| {
        if i < count { (loading(reach(i + 1)) - loading(reach(i))) / (reach(i + 1) - reach(i)) } else { 0.0 }
    };
    (1..=count).map(|i| [reach(i), (slope(i - 1) - slope(i)) * reach(i)]).collect()
}

/// Eight elements of random reach, 0.02 to 2 of A on a logarithmic scale, and random torque.
fn random(seed: u64) -> Vec<[f64; 2]> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..8).map(|_| [0.02 * 100_f64.powf(rng.random()), -f64::ln(1.0 - rng.random::<f64>())]).collect()
}

/// T = f(θ) − ΔK·w·tanh(θ/w) + Σ k_i s_i, s_i ← clamp(s_i + Δθ, ±r_i): springs that slip at their reach r_i (Iwan 1966), and a soft windup of w = A/4.
///
/// f is the model's, and the elements are scaled so that the rated cycle is as wide at θ = 0 as the model's, 2hA.
#[derive(Debug, Clone)]
pub struct MaxwellSlip {
    elastic: Elastic,
    softer_nm_per_rad: f64,
    width_rad: f64,
    theta_rad: f64,
    /// Stiffness N·m/rad, reach rad, stretch rad.
    elements: Vec<[f64; 3]>,
}

impl MaxwellSlip {
    fn new(Elements { elements, windup }: &Elements, params: &Params) -> Self {
        let a = params.rated_deflection_rad();
        let elements = elements.iter().map(|[reach, torque]| [torque / (reach * a), reach * a, 0.0]).collect();
        let elastic = params.elastic();
        let softer_nm_per_rad = windup * elastic.c1_nm_per_rad;
        let mut gear = Self { elastic, softer_nm_per_rad, width_rad: 0.25 * a, theta_rad: 0.0, elements };
        let half_width_nm = {
            let mut gear = gear.clone();
            let [falling, _, rising] =
                [[a, 0.0], [-a, -a], [-a, 0.0]].map(|path| path.map(|theta| gear.step(theta))[1]);
            0.5 * (rising - falling)
        };
        let factor = params.memory().h() * a / half_width_nm;
        gear.elements.iter_mut().for_each(|[stiffness, ..]| *stiffness *= factor);
        gear
    }

    fn step(&mut self, theta_rad: f64) -> f64 {
        let change = theta_rad - self.theta_rad;
        self.theta_rad = theta_rad;
        let slip: f64 = self
            .elements
            .iter_mut()
            .map(|[stiffness, reach, stretch]| {
                *stretch = (*stretch + change).clamp(-*reach, *reach);
                *stiffness * *stretch
            })
            .sum();
        let softer_nm = self.softer_nm_per_rad * self.width_rad * (theta_rad / self.width_rad).tanh();
        self.elastic.torque_nm(theta_rad) - softer_nm + slip
    }
}

/// A torque that the deflection alone tells, between points, N·m. Beyond ±A it goes on straight.
#[derive(Debug, Clone)]
pub struct Middle {
    rated_deflection_rad: f64,
    torque_nm: Vec<f64>,
}

impl Middle {
    /// Intervals from tip to tip.
    const INTERVALS: usize = 4000;

    fn of(gear: &mut JointGear, rated_deflection_rad: f64) -> Self {
        let at = |k: usize| rated_deflection_rad * (2.0 * k as f64 / Self::INTERVALS as f64 - 1.0);
        let up: Vec<usize> = (0..=Self::INTERVALS).collect();
        let down: Vec<usize> = up.iter().rev().copied().collect();
        let mut along = |path: &[usize]| -> Vec<f64> { path.iter().map(|&k| gear.step(at(k))).collect() };
        along(&up);
        let falling = along(&down);
        let rising = along(&up);
        let torque_nm = rising.iter().zip(falling.iter().rev()).map(|(a, b)| 0.5 * (a + b)).collect();
        Self { rated_deflection_rad, torque_nm }
    }

    fn torque_nm(&self, theta_rad: f64) -> f64 {
        let place = 0.5 * (theta_rad / self.rated_deflection_rad + 1.0) * Self::INTERVALS as f64;
        let left = place.floor().clamp(0.0, (Self::INTERVALS - 1) as f64);
        let (low, high) = (self.torque_nm[left as usize], self.torque_nm[left as usize + 1]);
        low + (place - left) * (high - low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ValueEnum;
    use gmhm::Memory;

    fn params() -> Params {
        let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
        let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
        Params::new(1.168e-3, elastic, memory).unwrap()
    }

    #[test]
    fn every_gear_is_as_wide_as_the_model_and_runs_about_its_middle() {
        let (params, a) = (params(), 1.168e-3);
        for plant in Plant::value_variants() {
            let mut gear = JointGear::of(*plant, &params, 1e-3);
            let mut middle = gear.clone().middle(a);
            let mut at = |path: &[f64]| path.iter().map(|theta| gear.step(*theta)).last().unwrap();
            let [_, falling, rising] = [&[a, -a, a][..], &[0.0], &[-a, 0.0]].map(&mut at);
            let width = 2.0 * params.memory().h() * a;
            assert!((rising - falling - width).abs() < 1e-9 * width, "{plant:?}: {}", rising - falling);
            assert!((0.5 * (rising + falling) - middle.step(0.0)).abs() < 1e-9, "{plant:?}");
            assert!(middle.step(1.01 * a) > middle.step(a));
        }
    }
}
