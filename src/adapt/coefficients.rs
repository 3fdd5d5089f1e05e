//! Normalised coefficients of parameters, and parameters of changed coefficients.

use super::triangle::dot;
use super::{COEFFICIENTS, Coefficients};
use crate::elastic::{Elastic, Polynomial};
use crate::gear::Gear;
use crate::memory::Frame;
use crate::memory::masing::Masing;
use crate::params::{Memory, ParamError, Params};
use crate::scalar::Float;

/// The normalised coefficients of a gear, the other way round.
pub(super) fn of<S: Float>(gear: &Gear<S, Masing<S>>) -> Coefficients<S> {
    let Polynomial { k1, k3, k5 } = *gear.elastic().polynomial();
    let Masing { e, h, .. } = *gear.law();
    [h, e, k5, k3, k1]
}

/// A block's parameters with changes of their normalised coefficients. e and h become α, β and ω with the block's β² + ω².
///
/// # Errors
/// What [`Params::new`] does not accept.
pub fn changed<S: Float>(block: &Params, change: &Coefficients<S>) -> Result<Params, ParamError> {
    let [k1, k3, k5, e, h] = change.map(S::to_f64);
    let a = block.rated_deflection_rad();
    let unit = block.torque_scale_nm() / a;
    let (elastic, memory) = (block.elastic(), block.memory());
    let elastic = Elastic {
        c1_nm_per_rad: elastic.c1_nm_per_rad + k1 * unit,
        c2_nm_per_rad3: elastic.c2_nm_per_rad3 + k3 * unit / (a * a),
        c3_nm_per_rad5: elastic.c3_nm_per_rad5 + k5 * unit / (a * a * a * a),
    };
    let (e, h) = ((memory.e() + e * unit).max(0.0), (memory.h() + h * unit).max(0.0));
    let speed = libm::sqrt(memory.beta_per_s * memory.beta_per_s + memory.omega_per_s * memory.omega_per_s);
    let size = libm::sqrt(e * e + h * h);
    let memory = if size > 0.0 {
        let per_unit = speed / size;
        Memory { alpha: size * speed, beta_per_s: e * per_unit, omega_per_s: h * per_unit, ..memory }
    } else {
        Memory { alpha: 0.0, ..memory }
    };
    Params::new(a, elastic, memory)
}

/// γ's row: Σ p·x/Σ p² over both branches of the rated cycle.
pub(super) fn common<S: Float>(frame: &Frame<S>, block: &Coefficients<S>) -> Coefficients<S> {
    const POINTS: u8 = 16;
    let (mut sums, mut square) = ([S::ZERO; COEFFICIENTS], S::ZERO);
    for point in 0..=POINTS {
        let u = S::from_f64(f64::from(point)) * S::from_f64(2.0 / f64::from(POINTS)) - S::ONE;
        let theta = frame.deflection(u);
        for side in [S::ONE, -S::ONE] {
            let [a, b, c] = Polynomial::columns(u);
            let x = [(S::ONE - u * u).signed(side), -(u * frame.gate(theta)), c, b, a];
            let p = dot(&x, block);
            for (sum, x) in sums.iter_mut().zip(x) {
                *sum = *sum + p * x;
            }
            square = square + p * p;
        }
    }
    sums.map(|sum| sum.over(square))
}
