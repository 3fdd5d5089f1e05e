//! Maxwell slip beside the elastic torque: T = f(θ) + Σ w_i·s_i, each s_i an elastic slip element (stop operator) of reach r_i, w_i ≥ 0 (Iwan 1966; Lampaert,
//! Al-Bender, Swevers, *A generalized Maxwell-slip friction model*, 2003).

use crate::baselines::{Baseline, Direction, ELASTIC, elastic};
use crate::numerics::bounded::Bound::NonNegative;

/// Reaches spread evenly up to twice the rated deflection, where a stroke from tip to tip slips the last element; with the weights that makes n + 3 parameters.
pub fn maxwell_slip(rated_deflection_rad: f64, count: usize) -> Baseline {
    let mut columns = ELASTIC.to_vec();
    columns.extend((0..count).map(|_| ("w", NonNegative)));
    Baseline::new(format!("Maxwell slip, {count} elements"), &columns, move |_| {
        let reach = |i: usize| 2.0 * rated_deflection_rad * (i + 1) as f64 / (count + 1) as f64;
        let reaches: Vec<f64> = (0..count).map(reach).collect();
        let mut stretched = vec![0.0_f64; count];
        let mut direction = Direction::default();
        Box::new(move |theta, out| {
            let change = direction.step(theta);
            elastic(theta, out);
            for ((s, r), out) in stretched.iter_mut().zip(&reaches).zip(&mut out[3..]) {
                *s = (*s + change).clamp(-r, *r);
                *out = *s;
            }
        })
    })
}
