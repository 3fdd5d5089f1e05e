//! Dahl's friction beside the elastic torque: T = f(θ) + F·w, dw/dθ = (1 − w·sgn θ̇)/θ_c (P. R. Dahl, *A solid friction model*, Aerospace Corp., 1968).

use crate::baselines::{Baseline, Direction, ELASTIC, elastic};
use crate::numerics::bounded::Bound::NonNegative;

/// θ_c is searched from a thousandth to ten rated deflections.
pub fn dahl(rated_deflection_rad: f64) -> Baseline {
    let baseline = Baseline::new("Dahl", &[&ELASTIC[..], &[("F", NonNegative)]].concat(), move |nonlinear| {
        let length = rated_deflection_rad * nonlinear[0].exp();
        let mut direction = Direction::default();
        let mut w = 0.0;
        Box::new(move |theta, out| {
            let change = direction.step(theta);
            // The equation solved exactly over a monotone step.
            w = direction.sign + (w - direction.sign) * (-change.abs() / length).exp();
            elastic(theta, out);
            out[3] = w;
        })
    });
    baseline.searching("ln(length/A)", 1e-3_f64.ln(), 10.0_f64.ln())
}
