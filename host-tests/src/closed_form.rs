//! The memory integrals that can be solved by hand.

use crate::{Constants, Weighed};

/// m(t) on θ = A sin ωt from m(0) = 0, N·m: the paper's solution and that of the integral it prints.
pub fn cycle(gear: &Constants, weighed: Weighed, t: f64) -> f64 {
    let Constants { a, alpha, beta, omega, .. } = *gear;
    let (sin, cos) = (omega * t).sin_cos();
    let decay = (-beta * t).exp();
    let square = beta * beta + omega * omega;
    match weighed {
        // −∫ α e^(−β(t−s)) A sin ωs ds
        Weighed::Deflection => -a * alpha * (omega * decay + beta * sin - omega * cos) / square,
        // ∫ α e^(−β(t−s)) Aω cos ωs ds
        Weighed::Rate => a * alpha * omega * (beta * cos + omega * sin - beta * decay) / square,
    }
}

/// T(t) on θ = A sin ωt with the paper's gate abs(cos ωt), N·m.
pub fn cycle_torque(gear: &Constants, weighed: Weighed, t: f64) -> f64 {
    let (sin, cos) = (gear.omega * t).sin_cos();
    gear.elastic(gear.a * sin) + cos.abs() * cycle(gear, weighed, t)
}

/// T on the steady cycle of kernel `deflection` (the transient gone) at the phase ωt, N·m.
pub fn steady_torque(gear: &Constants, phase: f64) -> f64 {
    let (sin, cos) = phase.sin_cos();
    gear.elastic(gear.a * sin) + cos.abs() * gear.a * (gear.h() * cos - gear.e() * sin)
}

/// m(t) on the ramp θ = θ_0 + vt from m(0) = 0 in real time, N·m.
pub fn ramp(gear: &Constants, weighed: Weighed, theta_0: f64, v: f64, t: f64) -> f64 {
    let Constants { alpha, beta, .. } = *gear;
    let risen = -(-beta * t).exp_m1() / beta;
    match weighed {
        // −∫ α e^(−β(t−s)) (θ_0 + vs) ds
        Weighed::Deflection => -alpha * (theta_0 * risen + v * (t - risen) / beta),
        // ∫ α e^(−β(t−s)) v ds
        Weighed::Rate => alpha * v * risen,
    }
}
