//! A polynomial of fifth degree and Coulomb friction: T = Σ c_i θ^i + F·sgn θ̇.

use crate::baselines::{Baseline, Direction};
use crate::numerics::bounded::Bound::Free;

/// The usual static calibration curve with a friction band.
pub fn with_coulomb() -> Baseline {
    Baseline::new("polynomial + Coulomb", &["c1", "c2", "c3", "c4", "c5", "F"].map(|name| (name, Free)), |_| {
        let mut direction = Direction::default();
        Box::new(move |theta, out| {
            direction.step(theta);
            let mut power = 1.0;
            for value in &mut out[..5] {
                power *= theta;
                *value = power;
            }
            out[5] = direction.sign;
        })
    })
}
