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
    /// 0, 1 or 2.
    bend: S,
    /// The length after which the loop is fully open.
    span: S,
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

/// What a route holds beyond its first stage: the loops that it would close, outermost first.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Route<'a, S> {
    view: View<'a, S>,
    origin: S,
    pub(crate) merging: bool,
    loops: &'a [[TurningPoint<S>; 2]],
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
        Self { from: S::ZERO, eta, slope: S::ZERO, bend: S::ZERO, span: S::TWO + S::TWO }
    }

    fn branch(anchor: Knot<S>) -> Self {
        Self { from: anchor.u, eta: anchor.eta, slope: S::TWO, bend: S::ONE, span: S::TWO }
    }

    fn initial(origin: S) -> Self {
        Self { from: origin, eta: S::ZERO, slope: S::TWO, bend: S::TWO, span: S::ONE }
    }

    #[inline]
    pub(crate) fn eta(&self, u: S) -> S {
        let step = u - self.from;
        self.eta + step * (self.slope - step.multiple(self.bend))
    }

    /// The first two derivatives of h·η by u.
    #[inline]
    pub(crate) fn slopes(&self, u: S, h: S) -> [S; 2] {
        let (bent, curl) = ((u - self.from).multiple(self.bend), h.multiple(self.bend));
        [h * (self.slope - (bent + bent)), -(curl + curl)]
    }

    /// What merged pairs add to the derivative of η.
    #[inline]
    pub(crate) fn tilt(&self) -> S {
        self.slope - S::TWO
    }

    /// Where a loop is fully open; it then keeps the η of its turning point.
    #[inline]
    pub(crate) fn flat_from(&self) -> S {
        self.from + self.span
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
    #[cold]
    #[inline(never)]
    fn blended(self, entry: Knot<S>, target: Knot<S>) -> Self {
        let length = target.u - entry.u;
        if length > S::ZERO {
            let plain = |u: S| self.eta(u.min(self.flat_from()));
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
    fn u(&self, theta: S) -> S {
        self.frame.fraction(theta).signed(self.sign)
    }

    fn knot(&self, point: TurningPoint<S>) -> Knot<S> {
        Knot { u: self.u(point.theta), eta: point.eta.signed(self.sign) }
    }
}

impl<S: Scalar, const N: usize> Path<S, N> {
    /// The stage that the path enters by rising (`sign` = 1) or falling (−1), turning where that is the other way, and the route beyond.
    pub(crate) fn ahead<'a>(&'a self, frame: &'a Frame<S>, sign: S) -> (Stage<S>, Route<'a, S>) {
        let view = View { frame, sign };
        let direction = if sign > S::ZERO { Direction::Rising } else { Direction::Falling };
        let points: &[TurningPoint<S>] = &self.turning_points;
        let route = |outer: &'a [TurningPoint<S>], merging| Route {
            view,
            origin: self.origin,
            merging,
            loops: outer.as_rchunks::<2>().1,
        };
        if self.direction == direction || self.direction == Direction::Unknown {
            let Some((outer, &[target, _])) = points.split_last_chunk::<2>() else {
                return (Stage { arc: Arc::initial(view.u(self.origin)), end: None }, route(&[], false));
            };
            let arc = Arc::branch(view.knot(self.anchor));
            let arc = match self.blend {
                None => arc,
                Some(blend) => arc.tilted(view.u(blend.entry_theta), blend.entry_gap.signed(sign), blend.tilt),
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
                let origin = view.u(self.origin);
                let mirrored = Knot { u: origin + (origin - here.u), eta: -here.eta };
                (Stage { arc, end: Some(mirrored) }, route(&[], false))
            }
        }
    }
}

impl<S: Scalar> Route<'_, S> {
    /// Where the first stage ended, the route closes one loop after the other until it comes to a turning point that `holds`. Returns the stage
    /// that leads there and the turning point where that is entered. The further out, the more they hold.
    pub(crate) fn beyond(&self, end: Knot<S>, holds: impl Fn(Knot<S>) -> bool) -> (Stage<S>, Knot<S>) {
        let left = self.loops.partition_point(|&[target, _]| holds(self.view.knot(target)));
        let entry = self.loops.get(left).map_or(end, |&[target, _]| self.view.knot(target));
        let stage = match left.checked_sub(1).and_then(|i| self.loops.get(i)) {
            Some(&[target, anchor]) => {
                let target = self.view.knot(target);
                let arc = Arc::branch(self.view.knot(anchor));
                Stage { arc: if self.merging { arc.blended(entry, target) } else { arc }, end: Some(target) }
            }
            None => Stage { arc: Arc::initial(self.view.u(self.origin)), end: None },
        };
        (stage, entry)
    }
}
