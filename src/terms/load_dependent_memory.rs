//! Hysteresis that is wider under load, a butterfly: slip elements whose torque follows the deflection.
//!
//! T += Σ w_i (1 − λ1 − λ2 + λ1 abs(θ/A) + λ2 (θ/A)²) stop_{r_i}\[θ\] with w_i = torque_i/r_i. The factor is 1 at θ = ±A and never below 0. The elements are those of
//! [`nonlocal_memory`](super::nonlocal_memory), which this kind is with λ1 = λ2 = 0.

use super::nonlocal_memory::{MOST_ELEMENTS, NonlocalState, SlipElements};
use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const RADIUS: KeyInfo =
    KeyInfo::shape_list("radius_rad", "rad", MOST_ELEMENTS, "r_i, the stroke at which an element slips")
        .positive()
        .within(1e-5, 2e-3);
const TORQUE: KeyInfo =
    KeyInfo::linear_list("torque_nm", "N·m", MOST_ELEMENTS, "torque at which an element slips at θ = ±A")
        .within(0.0, 20.0);
const LINEAR: KeyInfo = KeyInfo::shape("load_linear", "1", "λ1, growth with abs(θ/A)").optional().within(-0.5, 1.0);
const QUADRATIC: KeyInfo = KeyInfo::shape("load_quadratic", "1", "λ2, growth with (θ/A)²").optional().within(-0.5, 1.0);

/// Slip elements in parallel, scaled by the load.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadDependentMemory<S> {
    elements: SlipElements<S>,
    inverse_rated: S,
    linear: S,
    quadratic: S,
}

impl<S: Float> Physics<S> for LoadDependentMemory<S> {
    const INFO: KindInfo = KindInfo {
        name: "load_dependent_memory",
        side: Side::Plant,
        domain: Domain::Torque,
        equation: "T += Σ w_i (1 − λ1 − λ2 + λ1 abs(θ/A) + λ2 (θ/A)²) stop_{r_i}[θ]",
        coordinates: &[Coordinate::Reversal, Coordinate::Torque],
        needs: &[Need::Deflection],
        keys: &[RADIUS, TORQUE, LINEAR, QUADRATIC],
        hides_behind: "nonlocal_memory, load_dependent_friction",
        instructions: 191,
    };
    type State = NonlocalState<S>;

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        let elements = SlipElements::read(reader, &RADIUS, &TORQUE)?;
        let (linear, quadratic) = (reader.number(&LINEAR)?, reader.number(&QUADRATIC)?);
        let rated = reader.setting.rated_deflection;
        let inverse_rated = if rated > S::ZERO { rated.recip() } else { S::ZERO };
        if inverse_rated > S::ZERO && inverse_rated.is_finite() {
            Ok(Self { elements, inverse_rated, linear, quadratic })
        } else {
            Err(TermError::NoRatedDeflection)
        }
    }

    #[inline]
    fn torque(&self, state: &mut NonlocalState<S>, sample: &Sample<S>) -> S {
        let u = (sample.deflection * self.inverse_rated).abs();
        // 1 − u and (1 − u)(1 + u): the factor is exactly 1 at u = 1.
        let fall = (S::ONE - u) * (self.linear + self.quadratic * (S::ONE + u));
        let factor = if fall < S::ONE { S::ONE - fall } else { S::ZERO };
        factor * self.elements.torque(state, sample.deflection)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loop_is_wider_under_load_and_never_negative() {
        let elements = SlipElements::of(&[(1.0, 3.0)]);
        let memory = |linear: f64, quadratic| LoadDependentMemory {
            elements: elements.clone(),
            inverse_rated: 0.1,
            linear,
            quadratic,
        };
        let path = [0.0, 5.0, 10.0, 9.0, 0.0];
        let run = |memory: LoadDependentMemory<f64>| {
            let mut state = NonlocalState::default();
            path.map(|deflection| memory.torque(&mut state, &Sample { deflection, ..Sample::default() }))
        };
        assert_eq!(run(memory(0.5, 0.0)), [0.0, 3.0 * 0.75, 3.0, 0.0, -3.0 * 0.5]);
        assert_eq!(run(memory(0.0, 0.75)), [0.0, 3.0 * (0.25 + 0.75 * 0.25), 3.0, 0.0, -3.0 * 0.25]);
        // 1 − 2 + 2·0.5 = 0 at half load, and below 0 nearer to none.
        assert_eq!(run(memory(2.0, 0.0)), [0.0, 0.0, 3.0, 0.0, 0.0]);
        // Without dependence on the load these are the elements alone.
        assert_eq!(run(memory(0.0, 0.0)), [0.0, 3.0, 3.0, 0.0, -3.0]);
    }
}
