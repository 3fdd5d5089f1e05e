//! Creep: the flexspline gives way over seconds and recovers.
//!
//! T += Σ K_j x_j with x_j = ∫ e^(−(t−s)/τ_j) θ̇ ds from 0 at the start. For θ linear between samples, exact at any period Δ:
//! x ← E x + (1 − E) τ/Δ · Δθ, E = e^(−Δ/τ). What sums round off is carried on, so slow elements hold in `f32`.

use heapless::Vec;

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

/// The most time constants.
pub const MOST_TAUS: usize = 8;

const TAU: KeyInfo = KeyInfo::shape_list("tau_s", "s", MOST_TAUS, "τ_j").positive().within(0.3, 1e4);
const STIFFNESS: KeyInfo = KeyInfo::linear_list("stiffness_nm_per_rad", "N·m/rad", MOST_TAUS, "K_j").within(0.0, 5e3);

/// Relaxing springs in parallel.
#[derive(Debug, Clone, PartialEq)]
pub struct Creep<S> {
    elements: Vec<Element<S>, MOST_TAUS>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Element<S> {
    rate_per_s: S,
    stiffness: S,
}

/// How far each spring is strained, rad.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CreepState<S> {
    theta: Option<S>,
    strains: [Strain<S>; MOST_TAUS],
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Strain<S> {
    x: S,
    carry: S,
}

impl<S: Float<Carry = S>> Physics<S> for Creep<S> {
    const INFO: KindInfo = KindInfo {
        name: "creep",
        side: Side::Plant,
        domain: Domain::Torque,
        equation: "T += Σ K_j ∫ e^(−(t−s)/τ_j) θ̇ ds",
        coordinates: &[Coordinate::Reversal, Coordinate::Time],
        needs: &[Need::Deflection],
        keys: &[TAU, STIFFNESS],
        hides_behind: "thermal and sensor drift",
        instructions: 260,
    };
    type State = CreepState<S>;

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        let taus = reader.list::<MOST_TAUS>(&TAU)?;
        let stiffnesses = reader.list_like(&STIFFNESS, &taus, &TAU)?;
        let mut elements = Vec::new();
        // An element without torque adds nothing.
        for (&tau, &stiffness) in taus.iter().zip(&stiffnesses).filter(|(_, stiffness)| **stiffness != S::ZERO) {
            // There is room: the lists are no longer.
            let _ = elements.push(Element { rate_per_s: tau.recip(), stiffness });
        }
        Ok(Self { elements })
    }

    #[inline]
    fn torque(&self, state: &mut CreepState<S>, sample: &Sample<S>) -> S {
        let step = sample.deflection - state.theta.replace(sample.deflection).unwrap_or(sample.deflection);
        let period = sample.period.max(S::ZERO);
        self.elements.iter().zip(&mut state.strains).fold(S::ZERO, |sum, (element, strain)| {
            let x = period * element.rate_per_s;
            let forgotten = -(-x).exp_m1();
            let kept_of_step = if x > S::ZERO { forgotten.over(x) } else { S::ONE };
            S::leak(&mut strain.x, &mut strain.carry, forgotten, [(kept_of_step, step), (S::ZERO, S::ZERO)]);
            sum + element.stiffness * strain.x
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_and_a_rest_follow_the_integral() {
        let mut elements = Vec::new();
        let _ = elements.push(Element { rate_per_s: 0.5, stiffness: 10.0 });
        let creep = Creep { elements };
        let mut state = CreepState::default();
        let mut at = |deflection, period| creep.torque(&mut state, &Sample { deflection, period, ..Sample::default() });
        assert_eq!(at(3.0, 0.0), 0.0);
        // A ramp of 1 rad over 4 s, in two uneven samples: K τ/T (1 − e^(−T/τ)).
        at(3.25, 1.0);
        let ramp = 10.0 * 0.5 * (1.0 - libm::exp(-2.0));
        assert!(libm::fabs(at(4.0, 3.0) - ramp) < 1e-12);
        assert!(libm::fabs(at(4.0, 6.0) - ramp * libm::exp(-3.0)) < 1e-12);
    }
}
