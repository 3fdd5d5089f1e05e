//! The inverse of law `masing`: the direction that the torque asks for, the branch that holds it, one root there.

use super::solve::{Bracket, Stretch, half_tangent, root};
use super::{Invertible, Solution, Task};
use crate::memory::masing::{Arc, Masing, Path};
use crate::scalar::Scalar;

/// z = −e·u·g + h·η(u).
struct Loop<S> {
    e: S,
    h: S,
    arc: Arc<S>,
}

impl<S: Scalar> Stretch<S> for Loop<S> {
    #[inline]
    fn at(&self, u: S, g: S) -> [S; 3] {
        let [eta, slope, bend] = self.arc.at(u);
        let (eug, gg, uu) = (self.e * (u * g), g * g, u * u);
        let twice = eug + eug;
        [
            self.h * eta - eug,
            self.h * (slope * g) - self.e * (gg - uu),
            self.h * (bend * gg - slope * u) + (twice + twice),
        ]
    }
}

/// A point of the route with its gate.
#[derive(Clone, Copy)]
struct Place<S> {
    u: S,
    g: S,
}

impl<S: Scalar> Place<S> {
    fn at(u: S) -> Self {
        Self { u, g: ((S::ONE - u) * (S::ONE + u)).sqrt() }
    }

    fn half_tangent(self) -> S {
        half_tangent(self.u, self.g)
    }
}

/// An arc, the place where it is entered, and the place where it ends if that lies within the range.
struct Section<S> {
    arc: Arc<S>,
    low: Place<S>,
    high: Option<Place<S>>,
}

impl<S: Scalar> Masing<S> {
    #[inline]
    fn torque_at(&self, task: &Task<S>, place: Place<S>, eta: S) -> S {
        task.spring.torque(place.u) + (self.h * eta - self.e * (place.u * place.g))
    }

    /// The section of the route that holds a torque above the present one. All mirrored by `sign` where the deflection falls.
    #[inline]
    fn section<const N: usize>(
        &self,
        task: &Task<S>,
        state: &Path<S, N>,
        sign: S,
        torque: S,
        here: Place<S>,
    ) -> Section<S> {
        let half_play = task.frame.fraction(self.half_play);
        let mut low = here;
        let reaches = |place: Place<S>, eta: S| torque <= self.torque_at(task, place, eta);
        if half_play > S::ZERO {
            let eta = sign * state.eta();
            let arc = Arc::constant(eta);
            let end = Place::at(sign * task.frame.fraction(state.filtered()) + half_play);
            if end.u >= task.reach {
                return Section { arc, low, high: None };
            }
            if reaches(end, eta) {
                return Section { arc, low, high: Some(end) };
            }
            low = end;
        }
        let (mut stage, mut route) = state.ahead(task.frame, sign);
        let (arc, mut high) = loop {
            let arc = stage.arc.delayed(half_play);
            let Some(end) = stage.end else { break (arc, None) };
            let u = end.u + half_play;
            if u >= task.reach {
                break (arc, None);
            }
            let place = Place::at(u);
            if reaches(place, end.eta) {
                break (arc, Some(place));
            }
            low = place;
            stage = route.resume(end);
        };
        let flat_from = arc.flat_from();
        if flat_from < high.map_or(task.reach, |high| high.u) {
            let place = Place::at(flat_from);
            let [eta, ..] = arc.at(flat_from);
            if low.u < flat_from && reaches(place, eta) {
                high = Some(place);
            } else {
                let low = if low.u < flat_from { place } else { low };
                return Section { arc: arc.flat(), low, high };
            }
        }
        Section { arc, low, high }
    }
}

impl<S: Scalar> Invertible<S> for Masing<S> {
    fn solve<const N: usize>(&self, task: &Task<S>, state: &Path<S, N>, theta: S) -> Solution<S> {
        let here = Place { u: task.frame.fraction(theta), g: task.frame.gate(theta) };
        let missing = task.aim.torque - self.torque_at(task, here, state.eta());
        if missing.abs() <= task.aim.tolerance && here.u.abs() <= task.reach {
            return Solution::held(theta);
        }
        let sign = if missing > S::ZERO { S::ONE } else { -S::ONE };
        let aim = task.aim.mirrored(sign);
        let Section { arc, low, high } =
            self.section(task, state, sign, aim.torque, Place { u: sign * here.u, ..here });
        let below = low.u < -task.reach;
        if low.u >= task.reach || high.is_some_and(|high| high.u <= -task.reach) {
            return task.edge(if low.u >= task.reach { sign } else { -sign });
        }
        let bracket = Bracket {
            low: if below { -task.reach_half_tangent } else { low.half_tangent() },
            high: high.map_or(task.reach_half_tangent, Place::half_tangent),
            low_is_edge: below,
            high_is_edge: high.is_none(),
        };
        let found = root(task.spring, &Loop { e: self.e, h: self.h, arc }, &aim, bracket, bracket.low);
        task.solution(&found, sign, theta)
    }

    fn solve_start(&self, task: &Task<S>) -> Solution<S> {
        let still = Loop { e: self.e, h: self.h, arc: Arc::constant(S::ZERO) };
        task.solve_anywhere(&still, S::ZERO)
    }
}
