//! Presliding friction: friction that reverses over a distance of the output, not at a speed (Dahl 1968, exponent 1).
//!
//! T += σ F D, dD/dq = (1 − D sgn v)/r along the output, D(0) = 0. Over a step Δq in one direction s that is exactly
//! D ← s + (D − s) e^(−abs(Δq)/r).
//!
//! q is the output angle, of whichever source: q_o, or q_m/N where only the motor angle is recorded. A step is shorter than half a turn, so q may be reduced to one turn.

use core::f64::consts::{PI, TAU};

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::{Sample, sign};
use crate::scalar::Float;

const TORQUE: KeyInfo = KeyInfo::linear("torque_nm", "N·m", "F, far from a reversal").within(0.0, 50.0);
const RADIUS: KeyInfo =
    KeyInfo::shape("radius_rad", "rad", "r, the distance of the output over which it reverses by 1 − 1/e")
        .positive()
        .within(1e-4, 5e-2);

/// A torque against the movement that builds up over a distance.
#[derive(Debug, Clone, PartialEq)]
pub struct PreslidingFriction<S> {
    torque: S,
    inverse_radius: S,
}

/// D, and where the output was.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PreslidingState<S> {
    angle: Option<S>,
    strain: S,
}

impl<S: Float> Physics<S> for PreslidingFriction<S> {
    const INFO: KindInfo = KindInfo {
        name: "presliding_friction",
        side: Side::Plant,
        domain: Domain::Friction,
        equation: "T += σ F D, dD/dq = (1 − D sgn v)/r",
        coordinates: &[Coordinate::Reversal],
        needs: &[Need::OutputAngle],
        keys: &[TORQUE, RADIUS],
        hides_behind: "coulomb_friction with a wide smoothing; nonlocal_memory",
        instructions: 211,
    };
    type State = PreslidingState<S>;

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        let torque = reader.setting.sigma * reader.number(&TORQUE)?;
        let inverse = reader.number(&RADIUS)?.recip();
        // So small a radius that its inverse overflows is reached in any step.
        let inverse_radius = if inverse.is_finite() { inverse } else { S::from_f64(S::LARGEST) };
        Ok(Self { torque, inverse_radius })
    }

    #[inline]
    fn torque(&self, state: &mut PreslidingState<S>, sample: &Sample<S>) -> S {
        let angle = sample.output_angle;
        let mut step = angle - state.angle.replace(angle).unwrap_or(angle);
        if step.abs() > S::from_f64(PI) {
            step = step - S::from_f64(TAU) * (step * S::from_f64(1.0 / TAU)).round();
        }
        let gap = sign(step) - state.strain;
        // 1 − e^(−x) without losing the digits of short steps.
        state.strain = state.strain - gap * (-(step.abs() * self.inverse_radius)).exp_m1();
        self.torque * state.strain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run<const N: usize>(path: [f64; N]) -> [f64; N] {
        let friction = PreslidingFriction { torque: 2.0, inverse_radius: 10.0 };
        let mut state = PreslidingState::default();
        path.map(|output_angle| friction.torque(&mut state, &Sample { output_angle, ..Sample::default() }))
    }

    #[test]
    fn the_strain_is_that_of_the_exact_solution_however_the_path_is_sampled() {
        let exp = libm::exp;
        let found = run([0.3, 0.35, 0.5, 0.5, 0.4]);
        let up = 1.0 - exp(-2.0);
        let expected = [0.0, 1.0 - exp(-0.5), up, up, -1.0 + (up + 1.0) * exp(-1.0)];
        for (x, d) in found.into_iter().zip(expected) {
            assert!(libm::fabs(x - 2.0 * d) < 1e-15, "{found:?}");
        }
    }

    #[test]
    fn an_angle_of_one_turn_serves_as_well() {
        let whole = run([3.0, 3.1, 3.2, 3.1]);
        let reduced = run([3.0, 3.1, 3.2 - TAU, 3.1]);
        for (x, y) in whole.into_iter().zip(reduced) {
            assert!(libm::fabs(x - y) < 1e-13);
        }
    }
}
