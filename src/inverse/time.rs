//! The inverse of law `time`: one step ahead, the memory being a known part and one that grows with the deflection.

use super::solve::{Point, Spring, Stretch};
use super::{Invertible, InvertibleAfter, Solution, Task, gated};
use crate::memory::time::{Ahead, Time, TimeState};
use crate::params::Gate;
use crate::scalar::{Float, Scalar};

/// f + z with m = memory + growth·(u − from).
struct Growing<'a, S> {
    spring: &'a Spring<S>,
    ahead: Ahead<S>,
    gate: Gate,
}

impl<S: Scalar> Stretch<S> for Growing<'_, S> {
    type Work = [S; 3];

    #[inline]
    fn torque(&self, u: S, square: S, g: S) -> (S, [S; 3]) {
        let Ahead { from, memory, growth } = self.ahead;
        let z = gated(self.gate, [memory + growth * (u - from), growth * g, -(growth * u)], u, g);
        (self.spring.torque(u, square) + z[0], z)
    }

    #[inline]
    fn slopes(&self, u: S, square: S, _g: S, [_, turn, curl]: [S; 3]) -> [[S; 2]; 2] {
        [self.spring.slopes(u, square), [turn, curl]]
    }
}

fn solve<S: Scalar>(law: &Time<S>, task: &Task<S>, ahead: Ahead<S>, theta: S) -> Solution<S> {
    let u = task.frame.clamped_fraction(theta);
    let curve = Growing { spring: &task.solver.spring, ahead, gate: law.gate() };
    task.solve_anywhere(&curve, Point::of(u, task.frame.gate(theta)))
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
