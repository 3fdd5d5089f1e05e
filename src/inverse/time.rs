//! The inverse of law `time`: one step ahead, the memory being a known part and one that grows with the deflection.

use super::solve::{Stretch, half_tangent};
use super::{Invertible, InvertibleAfter, Solution, Task, gated};
use crate::memory::time::{Ahead, Time, TimeState};
use crate::params::Gate;
use crate::scalar::{Float, Scalar};

/// m = memory + growth·(u − from).
struct Growing<S> {
    ahead: Ahead<S>,
    gate: Gate,
}

impl<S: Scalar> Stretch<S> for Growing<S> {
    #[inline]
    fn at(&self, u: S, g: S) -> [S; 3] {
        let Ahead { from, memory, growth } = self.ahead;
        let memory = [memory + growth * (u - from), growth * g, -(growth * u)];
        if self.gate == Gate::Cycle { gated(memory, u, g) } else { memory }
    }
}

fn solve<S: Scalar>(law: &Time<S>, task: &Task<S>, ahead: Ahead<S>, theta: S) -> Solution<S> {
    let u = task.frame.clamped_fraction(theta);
    task.solve_anywhere(&Growing { ahead, gate: law.gate() }, half_tangent(u, task.frame.gate(theta)))
}

impl<S: Scalar> Invertible<S> for Time<S> {
    fn solve<const N: usize>(&self, task: &Task<S>, state: &TimeState<S>, theta: S) -> Solution<S> {
        solve(self, task, self.ahead(task.frame, state), theta)
    }

    fn solve_start(&self, task: &Task<S>) -> Solution<S> {
        task.solve_unloaded()
    }
}

impl<S: Float> InvertibleAfter<S> for Time<S> {
    fn solve_after<const N: usize>(&self, task: &Task<S>, state: &TimeState<S>, theta: S, period_s: S) -> Solution<S> {
        solve(self, task, self.ahead_after(task.frame, state, period_s), theta)
    }
}
