//! The inverse of law `masing`: the direction that the torque asks for, the branch that holds it, one root there.

use super::solve::{Bracket, Point, Spring, Start, Stretch, root};
use super::{Invertible, Solution, Task};
use crate::memory::masing::{Arc, Masing, Path, TurningPoint, View};
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

/// An arc and the u between which it holds the torque, the upper one within the range.
#[derive(Clone, Copy)]
struct Section<S> {
    arc: Arc<S>,
    low: S,
    high: S,
    /// Whether the torque need not rise all over the range along the arc, beyond those ends.
    tight: bool,
}

/// What the search for a section goes by. All mirrored where the deflection falls.
#[derive(Clone, Copy)]
struct Search<'a, S> {
    single: SingleValued<'a, S>,
    h: S,
    /// The torque that is looked for, above the present one.
    torque: S,
    /// That torque less the present one.
    missing: S,
    /// The present place.
    here: S,
    half_play: S,
    reach: S,
    /// The torque rises that steeply at least within the range, unless turning points were merged.
    least_slope: S,
}

impl<S: Scalar> Search<'_, S> {
    /// Whether the torque is met at a u of the way ahead or before.
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

    /// The section of the way ahead that holds the torque.
    #[inline(always)]
    fn section<const N: usize>(&self, path: &Path<S, N>, view: View<'_, S>) -> Section<S> {
        let mut ahead = path.ahead(view.sign);
        let place = |point: TurningPoint<S>| view.u(point.theta) + self.half_play;
        let (mut low, mut high) = (self.here, ahead.target.map_or(self.reach, place));
        // Mostly the torque does not reach the first target, and the least slope tells so.
        let may_close = high < self.reach && (ahead.merging || (high - self.here) * self.least_slope <= self.missing);
        if may_close
            && ahead.close(|target| {
                let place = place(target);
                place >= self.reach || self.holds(place, target.eta.signed(view.sign))
            })
        {
            low = place(ahead.entry).max(self.here);
            high = ahead.target.map_or(self.reach, place);
        }
        high = high.min(self.reach);
        let arc = Arc::of(view, &ahead.branch(view.frame)).delayed(self.half_play);
        // A merged branch may fall more steeply than others at its end.
        let falls = ahead.merging && self.least_slope + self.h * arc.slack(self.reach).min(S::ZERO) < S::ZERO;
        let section = Section { arc, low, high, tight: falls };
        if self.half_play > S::ZERO || arc.flat_from() < high {
            self.cut(section, view.u(path.filtered()) + self.half_play, path.eta().signed(view.sign))
        } else {
            section
        }
    }

    /// The part of a section that holds the torque, where it begins with a play that ends at a u, η standing still, or ends with the loop fully open.
    #[inline]
    fn cut(self, section: Section<S>, play_end: S, eta: S) -> Section<S> {
        let Section { arc, low, high, tight } = section;
        if self.half_play > S::ZERO && (play_end >= self.reach || self.holds(play_end, eta)) {
            let arc = Arc::constant(eta);
            return Section { arc, low: self.here, high: play_end.min(self.reach), tight: false };
        }
        let low = low.max(play_end);
        let flat_from = arc.flat_from();
        if flat_from >= high {
            return Section { arc, low, high, tight };
        }
        if low >= flat_from || !self.holds(flat_from, arc.eta(flat_from)) {
            return Section { arc: arc.flat(), low: low.max(flat_from), high, tight: true };
        }
        Section { arc, low, high: flat_from, tight: true }
    }
}

/// t = tan(φ/2) at u = sin φ.
#[inline(never)]
fn half_tangent<S: Scalar>(u: S) -> S {
    Point::of(u, u.cosine(u * u)).t
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
        let (ahead, torque) = (u.signed(sign), task.torque.signed(sign));
        if outside && ahead > S::ZERO {
            return task.edge(sign);
        }
        // From beyond the range the way leads through its lower end, where the torque is not known.
        let (here, missing) = if outside { (-task.reach, S::TWO) } else { (ahead, missing.abs()) };
        let search = Search {
            single,
            h: self.h,
            torque,
            missing,
            here,
            half_play: task.frame.fraction(self.half_play),
            reach: task.reach,
            least_slope: task.least_slope,
        };
        let Section { arc, low, high, tight } = search.section(state, View { frame: task.frame, sign });
        // The range is bracket enough where the torque rises all over it.
        let edge = task.reach_half_tangent;
        let [low_end, high_end] = if tight { [low, high].map(half_tangent) } else { [-edge, edge] };
        let bracket = Bracket { low: low_end, high: high_end, low_is_edge: outside, high_is_edge: high >= task.reach };
        let curve = Loop::new(single, self.h, &arc);
        let start = if missing < S::from_f64(NEAR) && low == here {
            Start::At(Point::of(here, g), (missing, eug.signed(sign)))
        } else {
            // Over A and T_A, the mean stiffness is about one.
            Start::Near((here + missing).max(low).min(high))
        };
        let found = root(&curve, (torque, task.limits), bracket, start);
        task.solution(&found, sign, theta)
    }

    fn solve_start(&self, task: &Task<S>) -> Solution<S> {
        let single = SingleValued { spring: task.spring, e: self.e };
        task.solve_anywhere(&Loop::new(single, self.h, &Arc::constant(S::ZERO)), Point::ZERO)
    }
}

/// Shares of the rated torque that are near enough to start from where the gear is.
const NEAR: f64 = 0.125;
