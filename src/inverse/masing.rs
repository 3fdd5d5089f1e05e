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

impl<S: Scalar> Stretch<S> for SingleValued<'_, S> {
    type Work = S;

    #[inline]
    fn torque(&self, u: S, g: S) -> (S, S) {
        let eug = self.e * (u * g);
        (self.spring.torque(u, g).0 - eug, eug)
    }

    #[inline]
    fn slopes(&self, u: S, g: S, eug: S) -> [S; 2] {
        let [slope, bend] = self.spring.slopes(u, g, ());
        let twice = eug + eug;
        [slope - self.e * (g * g - u * u), bend + (twice + twice)]
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
    fn torque(&self, u: S, g: S) -> (S, S) {
        let (single, eug) = self.single.torque(u, g);
        (single + self.h * self.arc.at(u)[0], eug)
    }

    #[inline]
    fn slopes(&self, u: S, g: S, eug: S) -> [S; 2] {
        let [slope, bend] = self.single.slopes(u, g, eug);
        let [_, open, curl] = self.arc.at(u);
        [slope + self.h * (open * g), bend + self.h * (curl * (g * g) - open * u)]
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
        Self { u, g: ((S::ONE - u) * (S::ONE + u)).sqrt() }
    }

    #[inline]
    fn point(self) -> Point<S> {
        Point::of(self.u, self.g)
    }
}

/// An arc, the place where it is entered (`None`: the present one), and the place where it ends if that lies within the range.
struct Section<S> {
    arc: Arc<S>,
    low: Option<Place<S>>,
    high: Option<Place<S>>,
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
    /// Whether the torque is met at a place of the route or before.
    #[inline]
    fn holds(&self, place: Place<S>, eta: S) -> bool {
        self.torque <= self.single.torque(place.u, place.g).0 + self.h * eta
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
                return Section { arc, low, high: None };
            }
            let end = Place::at(end);
            if self.holds(end, eta) {
                return Section { arc, low, high: Some(end) };
            }
            low = Some(end);
        }
        let place = |knot: Knot<S>| Place::at(knot.u + self.half_play);
        let inside = |knot: Knot<S>| knot.u + self.half_play < self.reach;
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
        if flat_from < high.map_or(self.reach, |high| high.u) {
            let flat = Place::at(flat_from);
            let behind = low.map_or(here, |low| low.u) >= flat_from;
            if behind || !self.holds(flat, arc.at(flat_from)[0]) {
                return Section { arc: arc.flat(), low: if behind { low } else { Some(flat) }, high };
            }
            high = Some(flat);
        }
        Section { arc, low, high }
    }
}

impl<S: Scalar> Invertible<S> for Masing<S> {
    fn solve<const N: usize>(&self, task: &Task<S>, state: &Path<S, N>, theta: S) -> Solution<S> {
        let single = SingleValued { spring: task.spring, e: self.e };
        let (u, g) = (task.frame.fraction(theta), task.frame.gate(theta));
        let outside = u.abs() > task.reach;
        let (now, eug) = single.torque(u, g);
        let now = now + self.h * state.eta();
        let missing = task.aim.torque - now;
        if missing.abs() <= task.aim.tolerance && !outside {
            return Solution::held(theta);
        }
        let sign = if missing > S::ZERO { S::ONE } else { -S::ONE };
        let aim = task.aim.mirrored(sign);
        let (missing, here) = (missing.abs(), Place { u: u.signed(sign), g });
        let search = Search {
            single,
            h: self.h,
            torque: aim.torque,
            half_play: task.frame.fraction(self.half_play),
            reach: task.reach,
            missing,
            least_slope: if outside { S::ZERO } else { task.least_slope },
        };
        let Section { arc, low, high } = search.section(task, state, sign, here.u);
        let from = low.unwrap_or(here);
        let below = outside && from.u < -task.reach;
        if outside && (from.u >= task.reach || high.is_some_and(|high| high.u <= -task.reach)) {
            return task.edge(if from.u >= task.reach { sign } else { -sign });
        }
        let curve = Loop { single, h: self.h, arc };
        let from_point = from.point();
        let bracket = Bracket {
            low: if below { -task.reach_half_tangent } else { from_point.t },
            high: high.map_or(task.reach_half_tangent, |high| high.point().t),
            low_is_edge: below,
            high_is_edge: high.is_none(),
        };
        let (start, first) = if missing < S::from_f64(NEAR) && low.is_none() && !outside {
            (from_point, (now.signed(sign), eug.signed(sign)))
        } else {
            // Over A and T_A, the mean stiffness is about one.
            let end = high.map_or(task.reach, |high| high.u);
            let guess = (here.u + missing).max(from.u.max(-task.reach)).min(end);
            let start = Place::at(guess).point();
            (start, curve.torque(start.u, start.g))
        };
        let found = root(&curve, &aim, bracket, start, first);
        task.solution(&found, sign, theta)
    }

    fn solve_start(&self, task: &Task<S>) -> Solution<S> {
        task.solve_anywhere(&SingleValued { spring: task.spring, e: self.e }, Point::ZERO)
    }
}

/// Shares of the rated torque that are near enough to start from where the gear is.
const NEAR: f64 = 0.125;
