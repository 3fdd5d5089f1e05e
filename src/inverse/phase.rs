//! The inverse of law `phase`: one step ahead, in the direction that the torque asks for.

use super::solve::{Bracket, Point, Spring, Stretch, root};
use super::{Invertible, Solution, Task, gated};
use crate::memory::MemoryLaw;
use crate::memory::phase::{Phase, PhaseState, phase_step};
use crate::scalar::Float;

/// f + z with m = q·g + s·u + n·e^(−ρΔφ), where φ has risen by Δφ.
struct Fading<'a, S> {
    spring: &'a Spring<S>,
    law: Phase<S>,
    from: (S, S),
    transient: S,
}

impl<S: Float> Stretch<S> for Fading<'_, S> {
    type Work = [S; 3];

    #[inline]
    fn torque(&self, u: S, square: S, g: S) -> (S, [S; 3]) {
        let Phase { quadrature, in_phase, rho, gate } = self.law;
        let faded = self.transient * (-(rho * phase_step(self.from.0, self.from.1, u, g))).exp();
        let decay = rho * faded;
        let (steady, turned) = (quadrature * g + in_phase * u, in_phase * g - quadrature * u);
        let z = gated(gate, [steady + faded, turned - decay, rho * decay - steady], u, g);
        (self.spring.torque(u, square) + z[0], z)
    }

    #[inline]
    fn slopes(&self, u: S, square: S, _g: S, [_, turn, curl]: [S; 3]) -> [[S; 2]; 2] {
        [self.spring.slopes(u, square), [turn, curl]]
    }
}

impl<S: Float> Invertible<S> for Phase<S> {
    fn solve<const N: usize>(&self, task: &Task<S>, state: &PhaseState<S>, theta: S) -> Solution<S> {
        let z = MemoryLaw::<S>::torque::<N>(self, task.frame, state, theta);
        let u = task.frame.fraction(theta);
        let missing = task.torque - (task.elastic.torque(u) + z);
        if missing.abs() <= task.solver.limits.tolerance && u.abs() <= task.solver.reach {
            return Solution::held(theta);
        }
        let sign = if missing > S::ZERO { S::ONE } else { -S::ONE };
        let (u, g) = state.point();
        let from = (sign * u, g);
        if from.0 >= task.solver.reach {
            return task.edge(sign);
        }
        let ahead = Fading {
            spring: &task.solver.spring,
            law: *self,
            from,
            transient: sign * state.transient_towards(self, sign),
        };
        let below = from.0 < -task.solver.reach;
        let edge = task.solver.inner_half_tangent;
        let start = if below { Point::at(-edge) } else { Point::of(from.0, g) };
        let bracket = Bracket { low: start.t, high: edge, edge };
        let aim = task.torque.signed(sign);
        let (torque, work) = ahead.torque(start.u, start.u * start.u, start.g);
        let found = root(&ahead, (aim, &task.solver.limits), bracket, (start, aim - torque, work));
        task.solution(&found, sign, theta)
    }

    fn solve_start(&self, task: &Task<S>) -> Solution<S> {
        task.solve_unloaded()
    }
}
