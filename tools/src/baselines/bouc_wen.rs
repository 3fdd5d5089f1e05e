//! Bouc–Wen beside the elastic torque: T = f(θ) + F·w, dw/dθ = \[1 − abs(w)^n (β sgn(θ̇ w) + 1 − β)\]/θ_c (Bouc 1967; Wen, J. Eng. Mech. Div. ASCE 102, 1976),
//! w scaled to end at ±1.

use crate::baselines::{Baseline, Direction, ELASTIC, elastic};
use crate::numerics::bounded::Bound::NonNegative;

/// A sample in as many steps of Heun's rule as its way asks for; n is searched from 1 to 5.
pub fn bouc_wen(rated_deflection_rad: f64) -> Baseline {
    // Short against θ_c.
    let steps = |lengths: f64| (lengths / 0.05).ceil().clamp(1.0, 200.0);
    let baseline = with("Bouc–Wen", rated_deflection_rad, |nonlinear| nonlinear[2], steps);
    baseline.searching("n", 1.0, 5.0)
}

/// As a drive computes it: a sample in one step, n = 1.
pub fn one_step(rated_deflection_rad: f64) -> Baseline {
    with("Bouc–Wen, one Heun step", rated_deflection_rad, |_| 1.0, |_| 1.0)
}

/// θ_c is searched from a hundredth to ten rated deflections, β from 0.5 (thermodynamically admissible) to 1.
fn with(name: &str, rated_deflection_rad: f64, power: fn(&[f64]) -> f64, steps: fn(f64) -> f64) -> Baseline {
    let columns = [&ELASTIC[..], &[("F", NonNegative)]].concat();
    let baseline = Baseline::new(name, &columns, move |nonlinear| {
        let (length, beta, power) = (rated_deflection_rad * nonlinear[0].exp(), nonlinear[1], power(nonlinear));
        let mut direction = Direction::default();
        let mut w: f64 = 0.0;
        Box::new(move |theta, out| {
            let change = direction.step(theta);
            let slope = |w: f64| {
                let sign = if w == 0.0 { 0.0 } else { (change * w).signum() };
                // The same number, without the logarithm.
                let bulk = if power == 1.0 { w.abs() } else { w.abs().powf(power) };
                1.0 - bulk * (beta * sign + 1.0 - beta)
            };
            let steps = steps(change.abs() / length);
            let step = change / (length * steps);
            for _ in 0..steps as usize {
                let first = slope(w);
                let next = (w + 0.5 * step * (first + slope(w + step * first))).clamp(-1.0, 1.0);
                // At its end it stays there, whatever steps are left.
                if next == w {
                    break;
                }
                w = next;
            }
            elastic(theta, out);
            out[3] = w;
        })
    });
    baseline.searching("ln(length/A)", 1e-2_f64.ln(), 10.0_f64.ln()).searching("beta", 0.5, 1.0)
}
