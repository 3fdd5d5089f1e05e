//! The inverse of law `masing` with changed coefficients, computed in the scalar alone: what an adaptation on the drive takes over.

use super::range::MasingRange;
use super::solve::{Limits, Spring};
use super::{Inverse, Solver};
use crate::elastic::{ElasticTorque, Polynomial};
use crate::gear::Gear;
use crate::memory::masing::Masing;
use crate::scalar::Float;

impl<S: Float> Inverse<S, Masing<S>> {
    /// The inverse of the same gear with changes of k1, k3, k5, e and h, over A and T_A as they are; e and h stay above zero. In `f32` some 25 000 instructions, none of
    /// double precision. The range ends where the torque rises by less than 0.002 T_A/A, so up to a thousandth sooner than that of [`Inverse::of`]; along it solutions are as exact.
    /// `None` where the torque need not rise about θ = 0, or for changes that are no numbers.
    #[must_use]
    pub fn changed(&self, [by_k1, by_k3, by_k5, by_e, by_h]: &[S; 5]) -> Option<Self> {
        let Polynomial { k1, k3, k5 } = *self.gear.elastic().polynomial();
        let Masing { e, h, half_play } = *self.gear.law();
        let polynomial = Polynomial { k1: k1 + *by_k1, k3: k3 + *by_k3, k5: k5 + *by_k5 };
        let (e, h) = ((e + *by_e).max(S::ZERO), (h + *by_h).max(S::ZERO));
        let Polynomial { k1, k3, k5 } = polynomial;
        if ![k1, k3, k5, e, h].into_iter().all(S::is_finite) {
            return None;
        }
        let MasingRange { reach, least_slope, bounds: [first, second, third] } = MasingRange::of(&polynomial, e, h)?;
        let tolerance = self.solver.limits.tolerance;
        let [two, six] = [2.0, 6.0].map(S::from_f64);
        let short = S::from_f64(1.0 - 4.0 * S::EPSILON);
        let inner_reach = if reach < S::ONE { reach * short } else { reach };
        let solver = Solver {
            spring: Spring::single(&polynomial),
            limits: Limits {
                tolerance,
                last_step: (six * tolerance).over(third).powf(S::from_f64(1.0 / 3.0)),
                last_chord: (two * tolerance).over(second.max(third)),
                last_width: tolerance.over(first),
            },
            least_slope,
            reach,
            inner_reach,
            inner_half_tangent: inner_reach.over(S::ONE + inner_reach.cosine(inner_reach * inner_reach)),
        };
        let gear = Gear::of(*self.gear.frame(), ElasticTorque::near(polynomial), Masing { e, h, half_play });
        Some(Self { gear: gear.with_largest_step(self.gear.largest_step()), solver, ..*self })
    }
}
