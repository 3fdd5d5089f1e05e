//! What lies ahead of a path: the loops that it would close, and the arcs that it would follow, if the deflection only rose, or only fell.

use super::{Branch, Path, TurningPoint};
use crate::memory::Frame;
use crate::scalar::Scalar;

/// The branch that a path is on if it goes on in one direction, turning first where that is the other way, and the loops that it would close there one
/// after the other.
///
/// A loop is the turning point that closes it, its target, and the one behind it, where its branch starts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ahead<'a, S> {
    branch: Branch<S>,
    /// Where the branch is entered.
    pub(crate) entry: TurningPoint<S>,
    /// Where it ends: far away on the initial curve.
    pub(crate) target: TurningPoint<S>,
    /// The loops beyond, outermost first.
    outer: &'a [[TurningPoint<S>; 2]],
    origin: S,
    sign: S,
    /// Whether the path was on another branch before, and this one has an end.
    entered: bool,
    pub(crate) merging: bool,
}

impl<S: Scalar> Ahead<'_, S> {
    /// Goes on across the loops that close, the innermost first; says whether any does. The innermost is asked first, or the middle one if the way is `far`.
    #[inline]
    pub(crate) fn close(&mut self, far: bool, mut stays_open: impl FnMut(TurningPoint<S>) -> bool) -> bool {
        let innermost = self.target;
        let target = |number: usize| self.outer.get(number).map_or(innermost, |&[target, _]| target);
        let loops = self.outer.len() + 1;
        let first = if far { self.outer.len() / 2 } else { self.outer.len() };
        let open = open_loops::<false>(loops, first, |number| stays_open(target(number)));
        if open == loops {
            return false;
        }
        self.entry = target(open);
        let next = open.checked_sub(1).and_then(|number| self.outer.get(number));
        self.entered = next.is_some();
        (self.branch, self.target) = match next {
            Some(&[target, anchor]) => (Branch::from(anchor, self.sign), target),
            None => (Branch::initial(self.origin, self.sign), TurningPoint::far(self.sign)),
        };
        true
    }

    /// The branch.
    #[inline]
    pub(crate) fn branch(&self, frame: &Frame<S>) -> Branch<S> {
        if self.entered && self.merging { self.branch.merged(frame, self.entry, self.target) } else { self.branch }
    }
}

/// How many of some loops stay open, the innermost, which has the highest number, closing first. The one of number `first` is asked first, then, if that is the
/// innermost and closes, perhaps the outermost.
#[inline]
pub(super) fn open_loops<const OUTERMOST_NEXT: bool>(
    loops: usize,
    first: usize,
    mut stays_open: impl FnMut(usize) -> bool,
) -> usize {
    // Those below `open` are known to be open, those from `closed` on to be closed.
    let (mut open, mut closed) = (0, loops);
    let mut number = first;
    while open < closed {
        if stays_open(number) {
            open = number + 1;
        } else {
            closed = number;
        }
        number = if OUTERMOST_NEXT && open == 0 && closed + 1 == loops { 0 } else { (open + closed) / 2 };
    }
    open
}

impl<S: Scalar, const N: usize> Path<S, N> {
    /// What lies ahead of the path if it rises (`sign` = 1) or falls (−1). Before the first movement the branch bends as the rising one.
    #[inline]
    pub(crate) fn ahead(&self, sign: S) -> Ahead<'_, S> {
        let points: &[TurningPoint<S>] = &self.turning_points;
        let here = TurningPoint { theta: self.filtered, eta: self.eta };
        let (branch, target, outer, entered, full);
        if self.sign == -sign {
            // A full stack gives up a pair.
            full = self.turning_points.is_full();
            let kept = if full { points.split_last_chunk::<2>().map_or(points, |(kept, _)| kept) } else { points };
            (target, outer) = match kept.split_last() {
                Some((&target, outer)) => (target, outer),
                None => (TurningPoint { theta: self.origin + (self.origin - here.theta), eta: -here.eta }, points),
            };
            (branch, entered) = (Branch::from(here, sign), true);
        } else {
            (target, outer) = match points.split_last_chunk::<2>() {
                Some((outer, &[target, _])) => (target, outer),
                None => (TurningPoint::far(sign), points),
            };
            (branch, entered, full) = (self.branch, false, false);
        }
        let (outer, origin, merging) = (outer.as_rchunks::<2>().1, self.origin, self.is_merged() || full);
        Ahead { branch, entry: here, target, outer, origin, sign, entered, merging }
    }
}

impl<S: Scalar, const N: usize> Path<S, N> {
    /// The arc that the path is on and the least way over which it stays there, over A, where the path goes on in the direction of the view along a branch
    /// from a turning point that was never merged. Such an arc stays a branch all over the range.
    #[inline]
    pub(crate) fn clear(&self, view: View<'_, S>) -> Option<(Arc<S>, S)> {
        let goes_on = self.branch.bend == view.sign && !self.is_merged();
        goes_on.then(|| (Arc::of(view, &self.branch), view.u(self.fast_path.end(view.sign) - self.filtered)))
    }
}

/// How a path is seen: in u = θ/A, and mirrored where the deflection falls (u → −u, η → −η), so that it always rises.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View<'a, S> {
    pub(crate) frame: &'a Frame<S>,
    pub(crate) sign: S,
}

impl<S: Scalar> View<'_, S> {
    pub(crate) fn u(&self, theta: S) -> S {
        self.frame.fraction(theta).signed(self.sign)
    }
}

/// η(u) = η_0 + s·(slope − bend·s), s = u − u_0: every branch, the initial curve and blended branches alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Arc<S> {
    from: S,
    eta: S,
    slope: S,
    /// 0, 1 or 2.
    bend: S,
}

impl<S: Scalar> Arc<S> {
    /// η = const, as within the input play and before the start.
    pub(crate) fn constant(eta: S) -> Self {
        Self { from: S::ZERO, eta, slope: S::ZERO, bend: S::ZERO }
    }

    /// A branch.
    #[inline]
    pub(crate) fn of(view: View<'_, S>, branch: &Branch<S>) -> Self {
        let Branch { anchor, slope, bend } = *branch;
        Self { from: view.u(anchor.theta), eta: anchor.eta.signed(view.sign), slope, bend: bend.abs() }
    }

    #[inline]
    pub(crate) fn eta(&self, u: S) -> S {
        let step = u - self.from;
        self.eta + step * (self.slope - step.multiple(self.bend))
    }

    /// h·η by powers of u.
    #[inline]
    pub(crate) fn powers(&self, h: S) -> [S; 3] {
        let bent = self.from.multiple(self.bend);
        [h * self.eta - (h * self.from) * (self.slope + bent), h * (self.slope + bent + bent), -h.multiple(self.bend)]
    }

    /// Where a loop is fully open; it then keeps the η of its turning point.
    #[inline]
    pub(crate) fn flat_from(&self) -> S {
        self.from + S::ONE + S::TWO - self.bend
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
}
