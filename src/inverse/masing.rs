//! The inverse of law `masing`: the direction that the torque asks for, the branch that holds it, one root there.

use super::solve::{Bracket, Point, Spring, Stretch, root};
use super::{Invertible, Solution, Solver, Task};
use crate::memory::masing::{Arc, Masing, Path, TurningPoint, View};
use crate::scalar::Scalar;

/// f(u) − e·u·g: the part without a memory.
#[derive(Clone, Copy)]
struct SingleValued<'a, S> {
    spring: &'a Spring<S>,
    e: S,
}

/// The same with the loop, h·η(u) = level + (linear + quadratic·u)·u.
struct Loop<'a, S> {
    single: SingleValued<'a, S>,
    level: S,
    powers: [S; 2],
}

impl<'a, S: Scalar> Loop<'a, S> {
    #[inline]
    fn new(single: SingleValued<'a, S>, h: S, arc: &Arc<S>) -> Self {
        let [level, powers @ ..] = arc.powers(h);
        Self { single, level, powers }
    }
}

impl<S: Scalar> Stretch<S> for Loop<'_, S> {
    type Work = S;

    #[inline]
    fn torque(&self, u: S, square: S, g: S) -> (S, S) {
        let eug = self.single.e * (u * g);
        (self.level + self.single.spring.torque_with(self.powers, u, square) - eug, eug)
    }

    #[inline]
    fn slopes(&self, u: S, square: S, _g: S, eug: S) -> [[S; 2]; 2] {
        let twice = eug + eug;
        let by_u = self.single.spring.slopes_with(self.powers, u, square);
        [by_u, [self.single.e * ((square + square) - S::ONE), twice + twice]]
    }
}

/// What the search for the root goes by. All mirrored where the deflection falls.
struct Way<S> {
    /// The arc, and the t up to which it holds the torque.
    arc: Arc<S>,
    high: S,
    /// Where the search begins, u.
    from: S,
}

/// What the search for the arc goes by.
struct Search<'a, S> {
    law: &'a Masing<S>,
    spring: &'a Spring<S>,
    torque: S,
}

impl<S: Scalar> Search<'_, S> {
    /// By how much the torque at a u of the way is short of the aim. In fixed point within e·u/2 where the sign is known without the gate.
    #[inline(always)]
    fn short(&self, u: S, eta: S) -> S {
        let square = u * u;
        let short = self.torque - (self.spring.torque(u, square) + self.law.h * eta);
        let eu = self.law.e * u;
        // e·u·g lies between 0 and e·u, which often spares fixed point the square root.
        if !S::SI {
            let half = S::HALF * eu;
            if (short + half).abs() > half.abs() {
                return short + half;
            }
        }
        short + eu * u.cosine(square)
    }

    /// Whether the torque is met at a u of the way or before, where speed does not count.
    #[inline(never)]
    fn holds(&self, u: S, eta: S) -> bool {
        self.short(u, eta) <= S::ZERO
    }
}

/// t = tan(φ/2) at u = sin φ.
#[inline]
fn half_tangent<S: Scalar>(u: S) -> S {
    Point::of(u, u.cosine(u * u)).t
}

impl<S: Scalar> Masing<S> {
    /// The way to a torque that lies `missing` above the present one, at the mirrored place `here`.
    #[cold]
    #[inline(never)]
    fn way<const N: usize>(
        &self,
        solver: &Solver<S>,
        view: View<'_, S>,
        path: &Path<S, N>,
        (torque, here, missing): (S, S, S),
    ) -> Way<S> {
        let Solver { inner_reach: reach, inner_half_tangent: edge, .. } = *solver;
        let sign = view.sign;
        let search = Search { law: self, spring: &solver.spring, torque };
        let half_play = view.frame.fraction(self.half_play);
        let place = |point: TurningPoint<S>| view.u(point.theta) + half_play;
        // What is missing where the arc is entered.
        let (mut ahead, mut missing) = (path.ahead(sign), missing);
        // Over A and T_A, the mean stiffness is about one.
        let far = here + missing > place(ahead.target);
        ahead.close(far, |target| {
            let place = place(target);
            let short = if place < reach { search.short(place, target.eta.signed(sign)) } else { S::ZERO };
            let closes = short > S::ZERO;
            if closes {
                missing = short;
            }
            !closes
        });
        let mut low = place(ahead.entry).max(here);
        let mut high = place(ahead.target).min(reach);
        let mut arc = Arc::of(view, &ahead.branch(view.frame)).delayed(half_play);
        // The play comes first, η standing still, and the loop may end fully open.
        let (play_end, eta) = (view.u(path.filtered()) + half_play, path.eta().signed(sign));
        let flat_from = arc.flat_from();
        if play_end > here && search.holds(play_end.min(reach), eta) {
            (arc, low, high) = (Arc::constant(eta), here, play_end.min(reach));
        } else if flat_from < high {
            if low < flat_from && search.holds(flat_from, arc.eta(flat_from)) {
                high = flat_from;
            } else {
                (arc, low) = (arc.flat(), low.max(flat_from));
            }
        }
        let from = (low + missing).min(high);
        // Every arc is concave: only ahead may the torque fall along it.
        let high = if high < reach { half_tangent(high) } else { edge };
        Way { arc, high, from }
    }
}

impl<S: Scalar> Invertible<S> for Masing<S> {
    fn solve<const N: usize>(&self, task: &Task<S>, state: &Path<S, N>, theta: S) -> Solution<S> {
        let Solver { spring, limits, least_slope, reach, inner_reach, inner_half_tangent } = task.solver;
        let single = SingleValued { spring, e: self.e };
        let (u, g) = (task.frame.fraction(theta), task.frame.gate(theta));
        let outside = u.abs() > *reach;
        // A deflection outside may lie beyond κA.
        let elastic = task.elastic.torque(u);
        let missing = task.torque - (elastic - self.e * (u * g) + self.h * state.eta());
        if missing.abs() <= limits.tolerance && !outside {
            return Solution::held(theta);
        }
        let sign = if missing > S::ZERO { S::ONE } else { -S::ONE };
        let here = u.signed(sign);
        let (mut begin, mut missing) = (here, missing.abs());
        if outside {
            if here > S::ZERO {
                return task.edge(sign);
            }
            // The way leads through the lower end of the range, where the torque is not known.
            (begin, missing) = (-*inner_reach, S::TWO);
        }
        let aim = task.torque.signed(sign);
        // Mostly nothing changes on the way, and the least slope tells so.
        let view = View { frame: task.frame, sign };
        let Way { arc, high, from } = match state.clear(view) {
            Some((arc, room)) if !outside && self.half_play == S::ZERO && room * *least_slope > missing => {
                Way { arc, high: *inner_half_tangent, from: here }
            }
            _ => self.way(task.solver, view, state, (aim, begin, missing)),
        };
        let curve = Loop::new(single, self.h, &arc);
        // Never where the way leads from outside.
        let (g, missing) = if from == here {
            (g, missing)
        } else {
            let square = from * from;
            let g = from.cosine(square);
            (g, aim - curve.torque(from, square, g).0)
        };
        let bracket = Bracket { low: -*inner_half_tangent, high, edge: *inner_half_tangent };
        let start = (Point::of(from, g), missing, self.e * (from * g));
        let found = root(&curve, (aim, limits), bracket, start);
        task.solution(&found, sign, theta)
    }

    fn solve_start(&self, task: &Task<S>) -> Solution<S> {
        let single = SingleValued { spring: &task.solver.spring, e: self.e };
        task.solve_anywhere(&Loop::new(single, self.h, &Arc::constant(S::ZERO)), Point::ZERO)
    }
}
