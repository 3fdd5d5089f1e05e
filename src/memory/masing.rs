//! Law `masing`: turning points and Rayleigh branches, quasi-static, any deflection path (MODEL.md section 3).
//!
//! z = −e·θ·g(θ) + hA·η, where the loop shape η follows the path alone, without any parameter but A:
//!
//! ```text
//! initial curve from θ_0:     η = d·2δ(1 − δ),       δ = abs(θ − θ_0)/A, 0 for δ > 1
//! branch from (θ_s, η_s):     η = η_s + d·δ(2 − δ),  δ = abs(θ − θ_s)/A, 0 for δ > 2
//! ```
//!
//! Every branch is evaluated from its own turning point, so nothing accumulates: the error of η is a few units in the last place
//! after any number of samples.

mod route;

use heapless::Vec;

use route::open_loops;
pub(crate) use route::{Arc, View};

use super::fast_path::FastPath;
use super::{Frame, MemoryLaw, VaryingPeriod};
use crate::params::Params;
use crate::scalar::{Float, Scalar};

/// Units in the last place that η is right to.
const ROUNDED: f64 = 16.0;

/// A reversal of the deflection.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TurningPoint<S> {
    /// Deflection in input units.
    pub theta: S,
    /// Loop shape there, 1 at the middle of the rated cycle.
    pub eta: S,
}

impl<S: Scalar> TurningPoint<S> {
    /// Where no path ever turns, ahead of a rising (`sign` = 1) or falling one (−1).
    #[inline]
    fn far(sign: S) -> Self {
        Self { theta: S::from_f64(1e30).signed(sign), eta: S::ZERO }
    }
}

/// A branch from a turning point, or the initial curve: η = η_0 + s·(slope − bend·s), s = (θ − θ_0)/A, the last product up to 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Branch<S> {
    /// Where it starts: the newest turning point, or the origin of the initial curve.
    pub(super) anchor: TurningPoint<S>,
    /// 2, but for merged pairs.
    pub(super) slope: S,
    /// 2 on the initial curve, else 1; negative where it falls.
    pub(super) bend: S,
}

impl<S: Scalar> Branch<S> {
    /// The initial curve, rising (`sign` = 1) or falling (−1).
    #[inline]
    pub(super) fn initial(origin: S, sign: S) -> Self {
        Self { anchor: TurningPoint { theta: origin, eta: S::ZERO }, slope: S::TWO, bend: sign + sign }
    }

    #[inline]
    pub(super) fn from(anchor: TurningPoint<S>, sign: S) -> Self {
        Self { anchor, slope: S::TWO, bend: sign }
    }

    #[inline]
    fn eta(&self, frame: &Frame<S>, theta: S) -> S {
        let step = frame.fraction(theta - self.anchor.theta);
        self.anchor.eta + step * (self.slope - step.multiple(self.bend).min(S::TWO))
    }

    /// The branch, whose own past was merged, from where it is entered to the turning point that it heads for.
    #[inline]
    fn merged(self, frame: &Frame<S>, entry: TurningPoint<S>, target: TurningPoint<S>) -> Self {
        let [near, far] = [entry.theta, target.theta].map(|theta| frame.fraction(theta - self.anchor.theta));
        let [near_bent, far_bent] = [near, far].map(|step| step * step.multiple(self.bend).min(S::TWO));
        let length = far - near;
        if length == S::ZERO {
            return self;
        }
        let slope = (target.eta - entry.eta + (far_bent - near_bent)).over(length);
        let eta = entry.eta - near * slope + near_bent;
        Self { anchor: TurningPoint { eta, ..self.anchor }, slope, bend: self.bend }
    }
}

/// The path as the loop remembers it: up to `N` turning points.
///
/// When the stack is full the innermost pair is merged and counted; the affected branches are blended so that η stays continuous
/// and the error is gone once the loop has closed within which it was. `N` must be even and at least 4.
#[derive(Debug, Clone)]
pub struct Path<S, const N: usize> {
    /// Deflection after the play.
    filtered: S,
    eta: S,
    /// 1 rising, −1 falling, 0 before the first movement.
    sign: S,
    branch: Branch<S>,
    turning_points: Vec<TurningPoint<S>, N, u16>,
    origin: S,
    /// How far it came before it turned: −θ falling, θ rising.
    farthest: [S; 2],
    /// Twice the pairs given up so far, and 1 where the present loops still lack some.
    merged: u32,
    fast_path: FastPath<S>,
}

impl<S: Scalar, const N: usize> Path<S, N> {
    const ENOUGH_ROOM: () =
        assert!(N >= 4 && N.is_multiple_of(2), "the stack of turning points needs an even capacity of 4 or more");

    /// An unknown past at the deflection θ_0: η = 0.
    #[must_use]
    pub fn start(theta: S) -> Self {
        let () = Self::ENOUGH_ROOM;
        Self {
            filtered: theta,
            eta: S::ZERO,
            sign: S::ZERO,
            branch: Branch::initial(theta, S::ONE),
            turning_points: Vec::new(),
            origin: theta,
            farthest: [-theta, theta],
            merged: 0,
            fast_path: FastPath::none(S::ONE),
        }
    }

    /// η at the last sample, within ±1 once both tips were reached.
    #[must_use]
    pub fn eta(&self) -> S {
        self.eta
    }

    /// The deflection after the play, input units.
    #[must_use]
    pub fn filtered(&self) -> S {
        self.filtered
    }

    /// The turning points, outermost first. On the initial curve there are none.
    #[must_use]
    pub fn turning_points(&self) -> &[TurningPoint<S>] {
        &self.turning_points
    }

    /// Pairs of turning points given up so far because the stack was full.
    #[must_use]
    pub fn merged_pairs(&self) -> u32 {
        self.merged >> 1
    }

    /// Whether pairs were given up since the stack was last empty.
    #[must_use]
    pub fn is_merged(&self) -> bool {
        self.merged & 1 == 1
    }

    /// Whether a loop that is open may lack a pair that was given up: η is then an approximation.
    ///
    /// A full stack keeps its outermost `N` − 2 turning points. Pairs are given up within the innermost loop of these, so that none is lacked once it has closed.
    #[inline]
    #[must_use]
    pub fn may_lack_pairs(&self) -> bool {
        self.is_merged() && self.turning_points.len() >= N - 2
    }

    /// Half of what η may be apart after two pasts: (1 − max/A)(1 + min/A) over the deflections seen since the start.
    ///
    /// The past can only be one of those that end on one of the two rated branches through θ_0; between them lie the hysterons that
    /// switch outside [min, max]. Zero once a tip was reached.
    #[must_use]
    pub fn start_spread(&self, frame: &Frame<S>) -> S {
        let [below, above] = self.unseen(frame);
        below * above
    }

    /// How far η may be off because the past is unknown.
    ///
    /// At the last of the deflections min and max, the two pasts are as far apart as [`start_spread`](Self::start_spread) says to either side of (1 − max/A)(max − min)/A, max being the
    /// last, or −(1 + min/A)(max − min)/A. What η is off there it stays off on all loops within. The play may hide as much of the path as its width.
    #[must_use]
    pub fn start_uncertainty(&self, frame: &Frame<S>, half_play: S) -> S {
        let play = frame.fraction(half_play + half_play);
        let [below, above] = self.unseen(frame);
        let width = S::TWO - below - above;
        let Some((eta, is_largest)) = self.last_extreme().filter(|_| width >= play) else {
            let u = frame.clamped_fraction(self.filtered);
            return self.eta.abs() + (S::ONE - u) * (S::ONE + u) + play + play;
        };
        let (eta, beyond, before) = if is_largest { (eta, above, below) } else { (-eta, below, above) };
        let (off, spread) = ((eta - beyond * (width - play)).abs(), beyond * (before + play));
        // What rounding makes of nothing is nothing.
        if off <= S::from_f64(ROUNDED * S::EPSILON) { spread } else { off + spread }
    }

    /// How much of ±A was not seen since the start, below and above, over A.
    fn unseen(&self, frame: &Frame<S>) -> [S; 2] {
        self.reach().map(|far| frame.fraction(frame.rated() - far).max(S::ZERO))
    }

    /// η where the path was last at its least or largest deflection since the start, and whether that was the largest; `None` where merging took it.
    fn last_extreme(&self) -> Option<(S, bool)> {
        let [falling, rising] = self.reach();
        let is_extreme = |point: &&TurningPoint<S>| point.theta == rising || -point.theta == falling;
        let here = TurningPoint { theta: self.filtered, eta: self.eta };
        let last = Some(&here).filter(is_extreme).or_else(|| self.turning_points.iter().rfind(is_extreme))?;
        Some((last.eta, last.theta == rising))
    }

    /// −min and max of the deflections seen since the start.
    pub(crate) fn reach(&self) -> [S; 2] {
        let [falling, rising] = self.farthest;
        [falling.max(-self.filtered), rising.max(self.filtered)]
    }

    /// The deflection after the play that a sample leads to, and 1 or −1 by its side; `None` if it stays.
    #[inline]
    fn moved(&self, half_play: S, theta: S) -> Option<(S, S)> {
        let theta =
            if half_play > S::ZERO { self.filtered.max(theta - half_play).min(theta + half_play) } else { theta };
        if theta > self.filtered {
            Some((theta, S::ONE))
        } else if theta < self.filtered {
            Some((theta, -S::ONE))
        } else {
            None
        }
    }

    /// Moves to the next deflection and returns η there. `half_play` is half the width of the input play.
    #[inline]
    pub fn step(&mut self, frame: &Frame<S>, half_play: S, theta: S) -> S {
        let Some((theta, sign)) = self.moved(half_play, theta) else { return self.eta };
        let mut entry = TurningPoint { theta: self.filtered, eta: self.eta };
        let turns = sign != self.sign;
        if turns {
            self.turn(frame, sign, entry);
        }
        let (odd, loops) = (self.turning_points.len() % 2, self.turning_points.len() / 2);
        let there = theta.signed(sign);
        let target = |number: usize| self.turning_points.get(odd + 2 * number);
        // Mostly the innermost decides, else the outermost.
        let open = open_loops::<true>(loops, loops.wrapping_sub(1), |number| {
            target(number).is_some_and(|target| target.theta.signed(sign) > there)
        });
        if open == 0 {
            self.turning_points.clear();
            self.merged &= !1;
        } else if open < loops {
            entry = target(open).copied().unwrap_or(entry);
            self.turning_points.truncate(odd + 2 * open);
        }
        if turns || open < loops {
            self.enter(frame, half_play, entry);
        }
        self.filtered = theta;
        self.eta = self.branch.eta(frame, theta);
        self.eta
    }

    /// The same turns in another frame: their angles stay, η is computed anew.
    fn anew(&self, frame: &Frame<S>, half_play: S) -> Self {
        let mut path = Self { merged: self.merged & !1, ..Self::start(self.origin) };
        // The first turning point only mirrors the second.
        for point in self.turning_points.iter().skip(1) {
            path.step(frame, S::ZERO, point.theta);
        }
        path.step(frame, S::ZERO, self.filtered);
        path.farthest = self.farthest;
        path.see_ahead(frame, half_play);
        path
    }

    /// η at the next deflection, without moving there.
    #[must_use]
    pub fn peek(&self, frame: &Frame<S>, half_play: S, theta: S) -> S {
        let Some((theta, sign)) = self.moved(half_play, theta) else { return self.eta };
        if self.sign == S::ZERO {
            return Branch::initial(self.origin, sign).eta(frame, theta);
        }
        let mut ahead = self.ahead(sign);
        let there = theta.signed(sign);
        ahead.close(false, |target| target.theta.signed(sign) > there);
        ahead.branch(frame).eta(frame, theta)
    }

    /// The same step the short way, or false where there is none: the state is left alone.
    #[inline]
    fn fast_path(&mut self, frame: &Frame<S>, theta: S) -> bool {
        let Some([theta, eta]) = self.fast_path.follow(frame, self.filtered, theta, &self.branch) else {
            return false;
        };
        self.filtered = theta;
        self.eta = eta;
        true
    }

    /// Turns at the last sample; before the first movement there is nothing to turn.
    #[inline]
    fn turn(&mut self, frame: &Frame<S>, sign: S, here: TurningPoint<S>) {
        let first = self.sign == S::ZERO;
        self.sign = sign;
        let (far, way) = (&mut self.farthest[usize::from(sign < S::ZERO)], -here.theta.signed(sign));
        *far = far.max(way);
        // The other side is seen where the path comes back from it.
        if way > frame.doubted() {
            // Only what comes from here on counts.
            self.farthest = [-frame.rated(); 2];
        }
        if first {
            return;
        }
        if self.turning_points.is_empty() {
            self.push(TurningPoint { theta: self.origin + (self.origin - here.theta), eta: -here.eta });
        } else if self.turning_points.is_full() {
            self.turning_points.truncate(N - 2);
            self.merged = (self.merged | 1).saturating_add(2);
        }
        self.push(here);
    }

    fn push(&mut self, point: TurningPoint<S>) {
        // There is room: a full stack was shortened, an empty one holds two.
        let _ = self.turning_points.push(point);
    }

    /// Sets up the branch from the newest turning point, entered at `entry`.
    #[inline]
    fn enter(&mut self, frame: &Frame<S>, half_play: S, entry: TurningPoint<S>) {
        let (branch, target) = if let Some(&[target, anchor]) = self.turning_points.last_chunk::<2>() {
            let branch = Branch::from(anchor, self.sign);
            (if self.is_merged() { branch.merged(frame, entry, target) } else { branch }, Some(target.theta))
        } else {
            (Branch::initial(self.origin, self.sign), None)
        };
        self.branch = branch;
        self.fast_path = FastPath::new(frame, half_play, self.sign, &self.branch, target);
    }

    /// The short way of the present branch.
    fn see_ahead(&mut self, frame: &Frame<S>, half_play: S) {
        if self.sign != S::ZERO {
            let target = self.turning_points.last_chunk::<2>().map(|[target, _]| target.theta);
            self.fast_path = FastPath::new(frame, half_play, self.sign, &self.branch, target);
        }
    }
}

/// The coefficients of law `masing`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Masing<S> {
    /// eA/T_A.
    pub e: S,
    /// hA/T_A.
    pub h: S,
    /// Half the width of the input play, input units.
    pub half_play: S,
}

impl<S: Scalar> Masing<S> {
    /// The coefficients of a gear, whatever the law that its parameters name.
    #[must_use]
    pub fn new(params: &Params) -> Self {
        let a = params.rated_deflection_rad();
        let (memory, scale) = (params.memory(), params.torque_scale_nm());
        let half_play = 0.5 * memory.reversal_play_rad;
        Self {
            e: S::from_f64(memory.e() * a / scale),
            h: S::from_f64(memory.h() * a / scale),
            half_play: S::from_f64(if S::SI { half_play } else { half_play / a }),
        }
    }
}

impl<S: Float> VaryingPeriod<S> for Masing<S> {
    fn peek_after<const N: usize>(&self, frame: &Frame<S>, state: &Path<S, N>, theta: S, _period_s: S) -> S {
        self.h * state.peek(frame, self.half_play, theta) - self.e * frame.fraction(theta) * frame.gate(theta)
    }
}

impl<S: Scalar> MemoryLaw<S> for Masing<S> {
    type State<const N: usize> = Path<S, N>;

    fn start<const N: usize>(&self, _frame: &Frame<S>, theta: S) -> Path<S, N> {
        Path::start(theta)
    }

    #[inline]
    fn step<const N: usize>(&self, frame: &Frame<S>, state: &mut Path<S, N>, theta: S) {
        state.step(frame, self.half_play, theta);
    }

    #[inline]
    fn fast_path<const N: usize>(&self, frame: &Frame<S>, state: &mut Path<S, N>, theta: S) -> bool {
        state.fast_path(frame, theta)
    }

    #[inline]
    fn torque<const N: usize>(&self, frame: &Frame<S>, state: &Path<S, N>, theta: S) -> S {
        self.h * state.eta() - self.e * frame.fraction(theta) * frame.gate(theta)
    }

    fn single_valued(&self, frame: &Frame<S>, theta: S) -> S {
        -(self.e * frame.fraction(theta) * frame.gate(theta))
    }

    fn start_spread<const N: usize>(&self, frame: &Frame<S>, state: &Path<S, N>, _theta: S) -> S {
        self.h * state.start_spread(frame)
    }

    fn start_uncertainty<const N: usize>(&self, frame: &Frame<S>, state: &Path<S, N>, _theta: S) -> S {
        self.h * state.start_uncertainty(frame, self.half_play)
    }

    fn largest_spread(&self, frame: &Frame<S>) -> S {
        let left = frame.fraction(frame.rated());
        self.h * (left * left)
    }

    fn take_over<const N: usize>(
        &self,
        frame: &Frame<S>,
        _before: (&Self, &Frame<S>),
        state: &Path<S, N>,
        _theta: S,
    ) -> Path<S, N> {
        state.anew(frame, self.half_play)
    }

    fn merged_pairs<const N: usize>(&self, state: &Path<S, N>) -> u32 {
        state.merged_pairs()
    }
}

/// A law whose memory is, or may be, the path of law `masing`.
pub trait LoopPath<S: Scalar>: MemoryLaw<S> {
    /// The path, if this memory is one.
    fn path<const N: usize>(memory: &Self::State<N>) -> Option<&Path<S, N>>;
}

impl<S: Scalar> LoopPath<S> for Masing<S> {
    #[inline]
    fn path<const N: usize>(memory: &Path<S, N>) -> Option<&Path<S, N>> {
        Some(memory)
    }
}

impl<S: Scalar> Masing<S> {
    /// −u·g and η at the deflection that a path was last moved to: what [`e`](Self::e) and [`h`](Self::h) multiply in z/T_A.
    #[inline]
    #[must_use]
    pub fn columns<const N: usize>(frame: &Frame<S>, path: &Path<S, N>, theta: S) -> [S; 2] {
        let of_e = Self { e: S::ONE, h: S::ZERO, half_play: S::ZERO };
        [of_e.single_valued(frame, theta), path.eta()]
    }
}

/// −θ·g(θ): the column that e multiplies in law `masing`, rad.
#[must_use]
pub fn single_valued_column(frame: &Frame<f64>, theta_rad: f64) -> f64 {
    -theta_rad * frame.gate(theta_rad)
}
