//! The inverse of law `masing`: the direction that the torque asks for, the branch that holds it, one root there.

use super::solve::{Bracket, Point, Spring, Stretch, root};
use super::{Invertible, Solution, Task};
use crate::memory::masing::{Arc, Knot, Masing, Path};
use crate::scalar::Scalar;

/// f(u) − e·u·g: the part without a memory.
#[derive(Clone, Copy)]
struct SingleValued<'a, S> {
    spring: &'a Spring<S>,
    e: S,
}

impl<S: Scalar> SingleValued<'_, S> {
    /// The torque and e·u·g.
    #[inline]
    fn torque(&self, u: S, square: S, g: S) -> (S, S) {
        let eug = self.e * (u * g);
        (self.spring.torque(u, square) - eug, eug)
    }
}

/// The same with the loop, h·η(u).
struct Loop<'a, S> {
    single: SingleValued<'a, S>,
    h: S,
    arc: Arc<S>,
}

impl<S: Scalar> Stretch<S> for Loop<'_, S> {
    type Work = S;

    #[inline]
    fn torque(&self, u: S, square: S, g: S) -> (S, S) {
        let (single, eug) = self.single.torque(u, square, g);
        (single + self.h * self.arc.eta(u), eug)
    }

    #[inline]
    fn slopes(&self, u: S, square: S, _g: S, eug: S) -> [[S; 2]; 2] {
        let [slope, bend] = self.single.spring.slopes(u, square);
        let [open, curl] = self.arc.slopes(u, self.h);
        let twice = eug + eug;
        [[slope + open, bend + curl], [self.single.e * ((square + square) - S::ONE), twice + twice]]
    }
}

/// A point of the route with its gate.
#[derive(Clone, Copy)]
struct Place<S> {
    u: S,
    g: S,
}

impl<S: Scalar> Place<S> {
    #[inline]
    fn at(u: S) -> Self {
        Self { u, g: u.cosine(u * u) }
    }

    #[inline]
    fn point(self) -> Point<S> {
        Point::of(self.u, self.g)
    }
}

/// An arc, the u where it is entered (`None`: the present place), and the u where it ends if that lies within the range.
struct Section<S> {
    arc: Arc<S>,
    low: Option<S>,
    high: Option<S>,
    /// Whether the torque need not rise all over the range along the arc, beyond those ends.
    tight: bool,
}

/// What the search for a section goes by.
struct Search<'a, S> {
    single: SingleValued<'a, S>,
    h: S,
    /// The torque that is looked for.
    torque: S,
    half_play: S,
    reach: S,
    /// That torque less the present one.
    missing: S,
    /// The torque rises that steeply at least within the range, unless turning points were merged.
    least_slope: S,
}

impl<S: Scalar> Search<'_, S> {
    /// Whether the torque is met at a u of the route or before.
    #[inline]
    fn holds(&self, u: S, eta: S) -> bool {
        let square = u * u;
        let excess = self.single.spring.torque(u, square) + self.h * eta - self.torque;
        let eu = self.single.e * u;
        // e·u·g lies between 0 and e·u, which often spares fixed point the root.
        if !S::SI {
            if excess > S::ZERO && excess >= eu {
                return true;
            }
            if excess < S::ZERO && excess < eu {
                return false;
            }
        }
        excess >= eu * u.cosine(square)
    }

    /// Whether the tilt of a merged branch may let the torque fall somewhere within the range.
    #[inline]
    fn falls(&self, arc: &Arc<S>) -> bool {
        arc.tilt() < S::ZERO && self.least_slope + self.h * arc.tilt() < S::ZERO
    }

    /// The section of the route that holds the torque, which is above the present one. All mirrored by `sign` where the deflection falls.
    #[inline]
    fn section<const N: usize>(&self, task: &Task<S>, state: &Path<S, N>, sign: S, here: S) -> Section<S> {
        let mut low = None;
        if self.half_play > S::ZERO {
            let eta = state.eta().signed(sign);
            let arc = Arc::constant(eta);
            let end = task.frame.fraction(state.filtered()).signed(sign) + self.half_play;
            if end >= self.reach {
                return Section { arc, low, high: None, tight: false };
            }
            if self.holds(end, eta) {
                return Section { arc, low, high: Some(end), tight: false };
            }
            low = Some(end);
        }
        let place = |knot: Knot<S>| knot.u + self.half_play;
        let inside = |knot: Knot<S>| place(knot) < self.reach;
        let (mut stage, route) = state.ahead(task.frame, sign);
        let mut high = None;
        if let Some(end) = stage.end
            && inside(end)
            && (route.merging || (end.u - here) * self.least_slope <= self.missing)
        {
            high = Some(place(end));
            if !self.holds(place(end), end.eta) {
                let (outer, entry) = route.beyond(end, |knot| !inside(knot) || self.holds(place(knot), knot.eta));
                low = Some(place(entry));
                stage = outer;
                high = stage.end.filter(|&end| inside(end)).map(place);
            }
        }
        let arc = stage.arc.delayed(self.half_play);
        let flat_from = arc.flat_from();
        if flat_from < high.unwrap_or(self.reach) {
            let behind = low.unwrap_or(here) >= flat_from;
            if behind || !self.holds(flat_from, arc.eta(flat_from)) {
                return Section { arc: arc.flat(), low: if behind { low } else { Some(flat_from) }, high, tight: true };
            }
            high = Some(flat_from);
        }
        Section { arc, low, high, tight: flat_from < self.reach || self.falls(&arc) }
    }
}

impl<S: Scalar> Invertible<S> for Masing<S> {
    fn solve<const N: usize>(&self, task: &Task<S>, state: &Path<S, N>, theta: S) -> Solution<S> {
        let single = SingleValued { spring: task.spring, e: self.e };
        let (u, g) = (task.frame.fraction(theta), task.frame.gate(theta));
        let outside = u.abs() > task.reach;
        let (now, eug) = single.torque(u, u * u, g);
        let now = now + self.h * state.eta();
        let missing = task.torque - now;
        if missing.abs() <= task.limits.tolerance && !outside {
            return Solution::held(theta);
        }
        let sign = if missing > S::ZERO { S::ONE } else { -S::ONE };
        let torque = task.torque.signed(sign);
        let (missing, here) = (missing.abs(), Place { u: u.signed(sign), g });
        let search = Search {
            single,
            h: self.h,
            torque,
            half_play: task.frame.fraction(self.half_play),
            reach: task.reach,
            missing,
            least_slope: if outside { S::ZERO } else { task.least_slope },
        };
        let Section { arc, low, high, tight } = search.section(task, state, sign, here.u);
        let from = low.unwrap_or(here.u);
        let from_place = || low.map_or(here, Place::at);
        let below = outside && from < -task.reach;
        if outside && (from >= task.reach || high.is_some_and(|high| high <= -task.reach)) {
            return task.edge(if from >= task.reach { sign } else { -sign });
        }
        let curve = Loop { single, h: self.h, arc };
        // The range is bracket enough where the torque rises all over it, and saves fixed point two divisions.
        let (tight, edge) = (S::SI || tight, task.reach_half_tangent);
        let from_point = if tight { from_place().point() } else { Point::ZERO };
        let bracket = Bracket {
            low: if tight && !below { from_point.t } else { -edge },
            high: high.filter(|_| tight).map_or(edge, |high| Place::at(high).point().t),
            low_is_edge: below,
            high_is_edge: high.is_none(),
        };
        let (start, first) = if missing < S::from_f64(NEAR) && low.is_none() && !outside {
            (if tight { from_point } else { here.point() }, (now.signed(sign), eug.signed(sign)))
        } else {
            // Over A and T_A, the mean stiffness is about one.
            let end = high.unwrap_or(task.reach);
            let guess = (here.u + missing).max(from).min(end);
            let start = Point::near(guess, &bracket);
            (start, curve.torque(start.u, start.u * start.u, start.g))
        };
        let found = root(&curve, (torque, task.limits), bracket, start, first);
        task.solution(&found, sign, theta)
    }

    fn solve_start(&self, task: &Task<S>) -> Solution<S> {
        let single = SingleValued { spring: task.spring, e: self.e };
        task.solve_anywhere(&Loop { single, h: self.h, arc: Arc::constant(S::ZERO) }, Point::ZERO)
    }
}

/// Shares of the rated torque that are near enough to start from where the gear is.
const NEAR: f64 = 0.125;
