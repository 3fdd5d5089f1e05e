//! The gear in the joint: the model's own, or one that is not the compensator's model.

use gmhm::{Elastic, Gear, Params, State};

/// A gear that is driven by its deflection.
#[derive(Debug, Clone)]
pub(super) enum JointGear {
    /// The model file's gear.
    Model(Gear<f64>, Box<State<f64, 64>>),
    /// The model's elastic torque with elastic slip elements for hysteresis.
    MaxwellSlip(MaxwellSlip),
}

impl JointGear {
    /// The model's gear at rest, to be stepped at a constant period.
    pub fn model(params: &Params, period_s: f64) -> Self {
        let gear = Gear::with_period(params, period_s);
        Self::Model(gear, Box::new(gear.start(0.0)))
    }

    /// A Maxwell-slip gear at rest, with the elastic torque of the model and about as wide a loop.
    pub fn maxwell_slip(params: &Params) -> Self {
        Self::MaxwellSlip(MaxwellSlip::like(params))
    }

    /// Moves to a deflection and returns the torque there, N·m.
    pub fn step(&mut self, theta_rad: f64) -> f64 {
        match self {
            Self::Model(gear, state) => gear.step(state, theta_rad).torque,
            Self::MaxwellSlip(slip) => slip.step(theta_rad),
        }
    }
}

/// T = f(θ) + Σ k_i s_i, s_i ← clamp(s_i + Δθ, ±r_i): springs that slip at their reach r_i (Iwan 1966).
///
/// Ten elements whose first loading approximates hA(1 − e^(−3θ/A)): an exponential, as Dahl's and Bouc's models have it, where law `masing` has a parabola;
/// stiffer at every reversal, and saturated well before the tip.
#[derive(Debug, Clone)]
pub(super) struct MaxwellSlip {
    elastic: Elastic,
    theta_rad: f64,
    /// Stiffness N·m/rad, reach rad, stretch rad.
    elements: Vec<[f64; 3]>,
}

impl MaxwellSlip {
    const ELEMENTS: usize = 10;

    fn like(params: &Params) -> Self {
        let a = params.rated_deflection_rad();
        let initial = |r: f64| -params.memory().h() * a * f64::exp_m1(-3.0 * r / a);
        let reach = |i: usize| 1.5 * a * i as f64 / Self::ELEMENTS as f64;
        // Between two reaches the first loading is a chord of the exponential; where an element slips, the slope falls by its stiffness.
        let slope = |i: usize| {
            if i < Self::ELEMENTS {
                (initial(reach(i + 1)) - initial(reach(i))) / (reach(i + 1) - reach(i))
            } else {
                0.0
            }
        };
        let elements = (1..=Self::ELEMENTS).map(|i| [slope(i - 1) - slope(i), reach(i), 0.0]);
        Self { elastic: params.elastic(), theta_rad: 0.0, elements: elements.collect() }
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
        self.elastic.torque_nm(theta_rad) + slip
    }
}
