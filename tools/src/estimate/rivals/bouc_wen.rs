//! Bouc–Wen beside the elastic torque: T = f(θ) + F·w, dw/dθ = \[1 − abs(w)^n (β sgn(θ̇ w) + 1 − β)\]/θ_c (Bouc 1967; Wen, J. Eng. Mech. Div. ASCE 102, 1976),
//! w scaled to end at ±1.

use super::super::bounded::Bound::NonNegative;
use super::{Direction, ELASTIC, Rival, elastic};

/// θ_c is searched from a hundredth to ten rated deflections, n from 1 to 5, β from 0.5 (thermodynamically admissible) to 1.
pub fn bouc_wen(rated_deflection_rad: f64) -> Rival {
    let rival = Rival::new("Bouc–Wen", &[&ELASTIC[..], &[("F", NonNegative)]].concat(), move |nonlinear| {
        let (length, beta, power) = (rated_deflection_rad * nonlinear[0].exp(), nonlinear[1], nonlinear[2]);
        let mut direction = Direction::default();
        let mut w: f64 = 0.0;
        Box::new(move |theta, out| {
            let change = direction.step(theta);
            let slope = |w: f64| {
                let sign = if w == 0.0 { 0.0 } else { (change * w).signum() };
                1.0 - w.abs().powf(power) * (beta * sign + 1.0 - beta)
            };
            // Heun's rule in steps short against θ_c.
            let steps = (change.abs() / (0.05 * length)).ceil().clamp(1.0, 200.0);
            let step = change / (length * steps);
            for _ in 0..steps as usize {
                let first = slope(w);
                w = (w + 0.5 * step * (first + slope(w + step * first))).clamp(-1.0, 1.0);
            }
            elastic(theta, out);
            out[3] = w;
        })
    });
    let rival = rival.searching("ln(length/A)", 1e-2_f64.ln(), 10.0_f64.ln());
    rival.searching("beta", 0.5, 1.0).searching("n", 1.0, 5.0)
}
