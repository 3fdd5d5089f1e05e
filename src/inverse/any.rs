//! The inverse of whichever law the parameters name.

use super::{Invertible, InvertibleAfter, Solution, Task};
use crate::memory::{AnyLaw, AnyMemory};
use crate::scalar::Float;

impl<S: Float> Invertible<S> for AnyLaw<S> {
    fn solve<const N: usize>(&self, task: &Task<S>, state: &AnyMemory<S, N>, theta: S) -> Solution<S> {
        match (self, state) {
            (Self::Masing(law), AnyMemory::Masing(state)) => law.solve(task, state, theta),
            (Self::Phase(law), AnyMemory::Phase(state)) => law.solve::<N>(task, state, theta),
            (Self::Time(law), AnyMemory::Time(state)) => law.solve::<N>(task, state, theta),
            _ => Solution::refused(theta),
        }
    }

    fn solve_start(&self, task: &Task<S>) -> Solution<S> {
        match self {
            Self::Masing(law) => law.solve_start(task),
            Self::Phase(law) => law.solve_start(task),
            Self::Time(law) => law.solve_start(task),
        }
    }
}

impl<S: Float> InvertibleAfter<S> for AnyLaw<S> {
    fn solve_after<const N: usize>(
        &self,
        task: &Task<S>,
        state: &AnyMemory<S, N>,
        theta: S,
        period_s: S,
    ) -> Solution<S> {
        match (self, state) {
            (Self::Time(law), AnyMemory::Time(state)) => law.solve_after::<N>(task, state, theta, period_s),
            _ => self.solve(task, state, theta),
        }
    }
}
