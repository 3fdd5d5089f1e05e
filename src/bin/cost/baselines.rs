//! The models that `gmhm compare` sets beside the gear's own, as a drive would compute them. `gmhm compare` finds them in the table by these names.

use gmhm::scalar::{Float, Scalar};

use crate::platform::gears::RATED_RAD;
use crate::report;

/// Stiffness of every model, N·m/rad.
const STIFFNESS: f32 = 2.3e4;

/// Measures every model, the mean over a cycle.
#[inline(never)]
pub fn measure() {
    let path: [f32; 500] = core::array::from_fn(|k| {
        let up = if k < 250 { k } else { 500 - k };
        RATED_RAD * 0.99 * (up as f32 / 125.0 - 1.0)
    });
    report("linear spring", &path, spring);
    let mut lines = Lines { deflection: 0.0, falling: 0 };
    report("two lines", &path, |theta| lines.two(theta));
    report("four lines", &path, |theta| lines.four(theta));
    report("polynomial + Coulomb", &path, |theta| lines.polynomial(theta));
    let mut dahl = Friction { deflection: 0.0, z: 0.0 };
    report("Dahl", &path, |theta| dahl.dahl(theta));
    let mut bouc_wen = Friction { deflection: 0.0, z: 0.0 };
    report("Bouc–Wen, one Heun step", &path, |theta| bouc_wen.bouc_wen(theta));
    let mut bouc_wen = Friction { deflection: 0.0, z: 0.0 };
    report("Bouc–Wen", &path, |theta| bouc_wen.bouc_wen_power(theta));
    let (mut few, mut some, mut many, mut most) =
        (MaxwellSlip::<2>::new(), MaxwellSlip::<4>::new(), MaxwellSlip::<8>::new(), MaxwellSlip::<16>::new());
    report("Maxwell slip, 2 elements", &path, |theta| few.step(theta));
    report("Maxwell slip, 4 elements", &path, |theta| some.step(theta));
    report("Maxwell slip, 8 elements", &path, |theta| many.step(theta));
    let mut ten = MaxwellSlip::<10>::new();
    report("Maxwell slip, 10 elements", &path, |theta| ten.step(theta));
    report("Maxwell slip, 16 elements", &path, |theta| most.step(theta));
}

#[inline(never)]
fn spring(theta: f32) -> f32 {
    STIFFNESS * theta
}

/// f(θ) beside a model of hysteresis.
#[inline]
fn elastic(theta: f32) -> f32 {
    let square = theta * theta;
    theta * (STIFFNESS + square * (1e9 + square * -1.2e14))
}

/// Static curves, apart for rising and falling deflection.
struct Lines {
    deflection: f32,
    falling: usize,
}

impl Lines {
    #[inline]
    fn direction(&mut self, theta: f32) -> usize {
        if theta != self.deflection {
            self.falling = usize::from(theta < self.deflection);
        }
        self.deflection = theta;
        self.falling
    }

    #[inline(never)]
    fn two(&mut self, theta: f32) -> f32 {
        const LINES: [(f32, f32); 2] = [(STIFFNESS, 1.5), (1.02 * STIFFNESS, -1.5)];
        let (slope, level) = LINES[self.direction(theta)];
        slope * theta + level
    }

    #[inline(never)]
    fn four(&mut self, theta: f32) -> f32 {
        const LINES: [(f32, f32); 4] =
            [(STIFFNESS, 1.5), (0.9 * STIFFNESS, 1.4), (1.1 * STIFFNESS, -1.5), (STIFFNESS, -1.4)];
        let (slope, level) = LINES[2 * self.direction(theta) + usize::from(theta < 0.0)];
        slope * theta + level
    }

    #[inline(never)]
    fn polynomial(&mut self, theta: f32) -> f32 {
        const COULOMB: [f32; 2] = [1.5, -1.5];
        let friction = COULOMB[self.direction(theta)];
        theta * (STIFFNESS + theta * (1e3 + theta * (1e9 + theta * (1e9 + theta * -1.2e14)))) + friction
    }
}

/// A spring and one state of friction.
struct Friction {
    deflection: f32,
    z: f32,
}

impl Friction {
    /// dw/dθ = (1 − w·sgn θ̇)/θ_c, solved exactly over the increment.
    #[inline(never)]
    fn dahl(&mut self, theta: f32) -> f32 {
        const PER_LENGTH: f32 = -1.0e3;
        const FRICTION: f32 = 2.0;
        let increment = theta - self.deflection;
        self.deflection = theta;
        let end = if increment < 0.0 { -1.0 } else { 1.0 };
        self.z = end + (self.z - end) * (Scalar::abs(increment) * PER_LENGTH).exp();
        elastic(theta) + FRICTION * self.z
    }

    /// ż = A·ẋ − β·abs(ẋ)·z − γ·ẋ·abs(z), exponent one, one Heun step over the increment; T = f(θ) + z.
    #[inline(never)]
    fn bouc_wen(&mut self, theta: f32) -> f32 {
        const INITIAL_SLOPE: f32 = 6.0e3;
        const BETA: f32 = 1.2e3;
        const GAMMA: f32 = 4.0e2;
        let increment = theta - self.deflection;
        let path = Scalar::abs(increment);
        let slope = |z: f32| INITIAL_SLOPE * increment - BETA * path * z - GAMMA * increment * Scalar::abs(z);
        let first = slope(self.z);
        let second = slope(self.z + first);
        self.z += 0.5 * (first + second);
        self.deflection = theta;
        elastic(theta) + self.z
    }

    /// dw/dθ = \[1 − abs(w)^n (β sgn(θ̇ w) + 1 − β)\]/θ_c, the exponent any, one Heun step.
    #[inline(never)]
    fn bouc_wen_power(&mut self, theta: f32) -> f32 {
        const PER_LENGTH: f32 = 1.0e3;
        const FRICTION: f32 = 2.0;
        const POWER: f32 = 1.7;
        const BETA: f32 = 0.6;
        let increment = theta - self.deflection;
        let scaled = increment * PER_LENGTH;
        let slope = |w: f32| {
            let share = if increment * w < 0.0 { 1.0 - 2.0 * BETA } else { 1.0 };
            scaled * (1.0 - Scalar::abs(w).powf(POWER) * share)
        };
        let first = slope(self.z);
        let second = slope(self.z + first);
        self.z = (self.z + 0.5 * (first + second)).clamp_to(1.0);
        self.deflection = theta;
        elastic(theta) + FRICTION * self.z
    }
}

/// Elastic-slip elements side by side; T = f(θ) + Σ stiffness·stop.
struct MaxwellSlip<const N: usize> {
    deflection: f32,
    limits: [f32; N],
    stiffness: [f32; N],
    stops: [f32; N],
}

impl<const N: usize> MaxwellSlip<N> {
    fn new() -> Self {
        let limits = core::array::from_fn(|k| RATED_RAD * (k + 1) as f32 / N as f32);
        Self { deflection: 0.0, limits, stiffness: [2.5e3; N], stops: [0.0; N] }
    }

    #[inline(never)]
    fn step(&mut self, theta: f32) -> f32 {
        let increment = theta - self.deflection;
        self.deflection = theta;
        let mut torque = elastic(theta);
        for ((stop, limit), stiffness) in self.stops.iter_mut().zip(&self.limits).zip(&self.stiffness) {
            *stop = (*stop + increment).clamp_to(*limit);
            torque += stiffness * *stop;
        }
        torque
    }
}

pub trait ClampTo {
    /// Limited to ±`limit`.
    fn clamp_to(self, limit: Self) -> Self;
}

impl ClampTo for f32 {
    #[inline]
    fn clamp_to(self, limit: f32) -> f32 {
        if self > limit {
            limit
        } else if self < -limit {
            -limit
        } else {
            self
        }
    }
}
