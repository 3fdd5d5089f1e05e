//! The inverse of law `phase`: one step ahead, in the direction that the torque asks for.

use super::solve::{Bracket, Stretch, half_tangent, root};
use super::{Invertible, Solution, Task, gated};
use crate::memory::MemoryLaw;
use crate::memory::phase::{Phase, PhaseState, phase_step};
use crate::params::Gate;
use crate::scalar::Float;

/// m = q·g + s·u + n·e^(−ρΔφ), where φ has risen by Δφ.
struct Fading<S> {
    law: Phase<S>,
    from: (S, S),
    transient: S,
}

impl<S: Float> Stretch<S> for Fading<S> {
    #[inline]
    fn at(&self, u: S, g: S) -> [S; 3] {
        let Phase { quadrature, in_phase, rho, gate } = self.law;
        let faded = self.transient * (-(rho * phase_step(self.from.0, self.from.1, u, g))).exp();
        let decay = rho * faded;
        let (steady, turned) = (quadrature * g + in_phase * u, in_phase * g - quadrature * u);
        let memory = [steady + faded, turned - decay, rho * decay - steady];
        if gate == Gate::Cycle { gated(memory, u, g) } else { memory }
    }
}

impl<S: Float> Invertible<S> for Phase<S> {
    fn solve<const N: usize>(&self, task: &Task<S>, state: &PhaseState<S>, theta: S) -> Solution<S> {
        let z = MemoryLaw::<S>::torque::<N>(self, task.frame, state, theta);
        let u = task.frame.fraction(theta);
        let missing = task.aim.torque - (task.spring.torque(u) + z);
        if missing.abs() <= task.aim.tolerance && u.abs() <= task.reach {
            return Solution::held(theta);
        }
        let sign = if missing > S::ZERO { S::ONE } else { -S::ONE };
        let (u, g) = state.point();
        let from = (sign * u, g);
        if from.0 >= task.reach {
            return task.edge(sign);
        }
        let below = from.0 < -task.reach;
        let bracket = Bracket {
            low: if below { -task.reach_half_tangent } else { half_tangent(from.0, g) },
            high: task.reach_half_tangent,
            low_is_edge: below,
            high_is_edge: true,
        };
        let ahead = Fading { law: *self, from, transient: sign * state.transient_towards(self, sign) };
        let found = root(task.spring, &ahead, &task.aim.mirrored(sign), bracket, bracket.low);
        task.solution(&found, sign, theta)
    }

    fn solve_start(&self, task: &Task<S>) -> Solution<S> {
        task.solve_unloaded()
    }
}
