//! What lies ahead of a path: the arcs that it would follow if the deflection only rose, or only fell.
//!
//! In u = θ/A, and mirrored where the deflection falls (u → −u, η → −η), so that every route rises.

use super::{Direction, Path, TurningPoint};
use crate::memory::Frame;
use crate::scalar::Scalar;

/// η(u) = η_0 + s·(slope − bend·s), s = u − u_0: every branch, the initial curve and blended branches alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Arc<S> {
    from: S,
    eta: S,
    slope: S,
    bend: S,
}

/// A point of the route.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Knot<S> {
    pub(crate) u: S,
    pub(crate) eta: S,
}

/// One arc and the turning point that ends it; the initial curve has no end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stage<S> {
    pub(crate) arc: Arc<S>,
    pub(crate) end: Option<Knot<S>>,
}

/// The stages of a route beyond the present one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Route<'a, S> {
    view: View<'a, S>,
    origin: S,
    merging: bool,
    outer: &'a [TurningPoint<S>],
}

/// How turning points become knots.
#[derive(Debug, Clone, Copy)]
struct View<'a, S> {
    frame: &'a Frame<S>,
    sign: S,
}

impl<S: Scalar> Arc<S> {
    /// η = const, as within the input play and before the start.
    pub(crate) fn constant(eta: S) -> Self {
        Self { from: S::ZERO, eta, slope: S::ZERO, bend: S::ZERO }
    }

    fn branch(anchor: Knot<S>) -> Self {
        Self { from: anchor.u, eta: anchor.eta, slope: S::TWO, bend: S::ONE }
    }

    fn initial(origin: S) -> Self {
        Self { from: origin, eta: S::ZERO, slope: S::TWO, bend: S::TWO }
    }

    /// η and its first two derivatives by u.
    #[inline]
    pub(crate) fn at(&self, u: S) -> [S; 3] {
        let step = u - self.from;
        let bent = self.bend * step;
        [self.eta + step * (self.slope - bent), self.slope - (bent + bent), -(self.bend + self.bend)]
    }

    /// Where a loop is fully open; it then keeps the η of its turning point.
    #[inline]
    pub(crate) fn flat_from(&self) -> S {
        self.from + if self.bend > S::ONE { S::ONE } else { S::TWO }
    }

    /// What follows there.
    #[inline]
    pub(crate) fn flat(&self) -> Self {
        Self { slope: self.slope - S::TWO, bend: S::ZERO, ..*self }
    }

    /// The arc for a deflection that runs ahead of the filtered one.
    #[inline]
    pub(crate) fn delayed(&self, half_play: S) -> Self {
        Self { from: self.from + half_play, ..*self }
    }

    /// The arc between two points that both need not lie on it, because their past was merged.
    fn blended(self, entry: Knot<S>, target: Knot<S>) -> Self {
        let length = target.u - entry.u;
        if length > S::ZERO {
            let plain = |u: S| self.at(u.min(self.flat_from()))[0];
            let gap = entry.eta - plain(entry.u);
            let growth = (target.eta - plain(target.u) - gap).over(length);
            self.tilted(entry.u, gap, growth)
        } else {
            self
        }
    }

    /// The arc plus gap + growth·(u − entry).
    fn tilted(self, entry: S, gap: S, growth: S) -> Self {
        Self { eta: self.eta + gap + growth * (self.from - entry), slope: self.slope + growth, ..self }
    }
}

impl<S: Scalar> View<'_, S> {
    fn knot(&self, point: TurningPoint<S>) -> Knot<S> {
        Knot { u: self.sign * self.frame.fraction(point.theta), eta: self.sign * point.eta }
    }
}

impl<S: Scalar, const N: usize> Path<S, N> {
    /// The stage that the path enters by rising (`sign` = 1) or falling (−1), turning where that is the other way, and the route beyond.
    pub(crate) fn ahead<'a>(&'a self, frame: &'a Frame<S>, sign: S) -> (Stage<S>, Route<'a, S>) {
        let view = View { frame, sign };
        let direction = if sign > S::ZERO { Direction::Rising } else { Direction::Falling };
        let points: &[TurningPoint<S>] = &self.turning_points;
        let route = |outer, merging| Route { view, origin: sign * frame.fraction(self.origin), merging, outer };
        if self.direction == direction || self.direction == Direction::Unknown {
            let Some((&[target, _], outer)) = points.split_last_chunk().map(|(outer, pair)| (pair, outer)) else {
                return (Stage { arc: Arc::initial(sign * frame.fraction(self.origin)), end: None }, route(&[], false));
            };
            let arc = Arc::branch(view.knot(self.anchor));
            let arc = match self.blend {
                None => arc,
                Some(blend) => {
                    let growth = sign * blend.gap_growth * (blend.inverse_length * frame.rated());
                    arc.tilted(sign * frame.fraction(blend.entry_theta), sign * blend.entry_gap, growth)
                }
            };
            return (Stage { arc, end: Some(view.knot(target)) }, route(outer, self.merging));
        }
        let here = view.knot(TurningPoint { theta: self.filtered, eta: self.eta });
        let full = self.turning_points.is_full();
        let kept = if full { points.split_last_chunk::<2>().map_or(points, |(kept, _)| kept) } else { points };
        let merging = self.merging || full;
        let arc = Arc::branch(here);
        match kept.split_last() {
            Some((&target, outer)) => {
                let target = view.knot(target);
                let arc = if merging { arc.blended(here, target) } else { arc };
                (Stage { arc, end: Some(target) }, route(outer, merging))
            }
            None => {
                let origin = sign * frame.fraction(self.origin);
                let mirrored = Knot { u: origin + (origin - here.u), eta: -here.eta };
                (Stage { arc, end: Some(mirrored) }, route(&[], false))
            }
        }
    }
}

impl<S: Scalar> Route<'_, S> {
    /// The stage that resumes where the one before ended.
    pub(crate) fn resume(&mut self, entry: Knot<S>) -> Stage<S> {
        match self.outer.split_last_chunk::<2>() {
            Some((outer, &[target, anchor])) => {
                self.outer = outer;
                let target = self.view.knot(target);
                let arc = Arc::branch(self.view.knot(anchor));
                Stage { arc: if self.merging { arc.blended(entry, target) } else { arc }, end: Some(target) }
            }
            None => Stage { arc: Arc::initial(self.origin), end: None },
        }
    }
}
