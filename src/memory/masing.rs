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

pub(crate) use route::{Arc, Knot};

use super::glide::Glide;
use super::{Frame, MemoryLaw, VaryingPeriod};
use crate::params::Params;
use crate::scalar::{Float, Scalar};

/// A reversal of the deflection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurningPoint<S> {
    /// Deflection in input units.
    pub theta: S,
    /// Loop shape there, 1 at the middle of the rated cycle.
    pub eta: S,
}

/// Direction of the deflection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Direction {
    Unknown,
    Rising,
    Falling,
}

/// The correction of a branch whose own past was merged: zero at the turning point it heads for, continuous where it is entered.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Blend<S> {
    entry_theta: S,
    entry_gap: S,
    /// Growth of the gap over θ/A.
    tilt: S,
}

/// The path as the loop remembers it: up to `N` turning points.
///
/// When the stack is full the innermost pair is merged and counted; the affected branches are blended so that η stays continuous
/// and the error is gone once the stack empties. `N` must be even and at least 4.
#[derive(Debug, Clone)]
pub struct Path<S, const N: usize> {
    /// Deflection after the play.
    filtered: S,
    eta: S,
    direction: Direction,
    /// Where the present branch starts: the newest turning point, or the origin of the initial curve.
    anchor: TurningPoint<S>,
    blend: Option<Blend<S>>,
    turning_points: Vec<TurningPoint<S>, N>,
    origin: S,
    lowest: S,
    highest: S,
    merging: bool,
    merged_pairs: u32,
    glide: Glide<S>,
}

impl<S: Scalar, const N: usize> Path<S, N> {
    const ENOUGH_ROOM: () =
        assert!(N >= 4 && N.is_multiple_of(2), "the stack of turning points needs an even capacity of 4 or more");

    /// An unknown past at the deflection θ_0: η = 0.
    pub fn start(theta: S) -> Self {
        let () = Self::ENOUGH_ROOM;
        Self {
            filtered: theta,
            eta: S::ZERO,
            direction: Direction::Unknown,
            anchor: TurningPoint { theta, eta: S::ZERO },
            blend: None,
            turning_points: Vec::new(),
            origin: theta,
            lowest: theta,
            highest: theta,
            merging: false,
            merged_pairs: 0,
            glide: Glide::none(),
        }
    }

    /// η at the last sample, within ±1 once both tips were reached.
    pub fn eta(&self) -> S {
        self.eta
    }

    /// The deflection after the play, input units.
    pub fn filtered(&self) -> S {
        self.filtered
    }

    /// The turning points, outermost first. On the initial curve there are none.
    pub fn turning_points(&self) -> &[TurningPoint<S>] {
        &self.turning_points
    }

    /// Pairs of turning points given up so far because the stack was full.
    pub fn merged_pairs(&self) -> u32 {
        self.merged_pairs
    }

    /// How far η may be off because the past is unknown: (1 − max/A)(1 + min/A) over the deflections seen since the start.
    ///
    /// The past can only be one of those that end on one of the two rated branches through θ_0; between them lie the hysterons that
    /// switch outside [min, max]. Zero once a tip was reached.
    pub fn start_uncertainty(&self, frame: &Frame<S>) -> S {
        let highest = self.highest.max(self.filtered);
        let lowest = self.lowest.min(self.filtered);
        let (above, below) = (frame.fraction(frame.rated() - highest), frame.fraction(frame.rated() + lowest));
        above.max(S::ZERO) * below.max(S::ZERO)
    }

    /// Moves to the next deflection and returns η there. `half_play` is half the width of the input play.
    #[inline]
    pub fn step(&mut self, frame: &Frame<S>, half_play: S, theta: S) -> S {
        let theta = if half_play > S::ZERO { self.filtered.clamp(theta - half_play, theta + half_play) } else { theta };
        let direction = if theta > self.filtered {
            Direction::Rising
        } else if theta < self.filtered {
            Direction::Falling
        } else {
            return self.eta;
        };
        let turned = if direction == self.direction { None } else { self.reverse(frame, half_play, direction) };
        let resumed = self.wipe_out(direction, theta);
        if let Some(entry) = resumed.or(turned) {
            self.enter(frame, half_play, entry);
        }
        self.filtered = theta;
        self.eta = self.branch(frame, theta);
        self.eta
    }

    /// The same step the short way, or false where there is none: the state is left alone.
    #[inline]
    fn glide(&mut self, frame: &Frame<S>, half_play: S, theta: S) -> bool {
        let Some([theta, eta]) = self.glide.follow(frame, half_play, self.filtered, theta, self.anchor) else {
            return false;
        };
        self.filtered = theta;
        self.eta = eta;
        true
    }

    /// Where the present branch ends; the initial curve has no end.
    #[inline]
    fn target(&self) -> Option<TurningPoint<S>> {
        self.turning_points.len().checked_sub(2).and_then(|i| self.turning_points.get(i)).copied()
    }

    /// η on the present branch.
    #[inline]
    fn branch(&self, frame: &Frame<S>, theta: S) -> S {
        let eta = self.plain_branch(frame, theta);
        match self.blend {
            None => eta,
            Some(blend) => eta + blend.entry_gap + blend.tilt * frame.fraction(theta - blend.entry_theta),
        }
    }

    /// The branch from the newest turning point, or the initial curve, without the correction of merged pairs.
    #[inline]
    fn plain_branch(&self, frame: &Frame<S>, theta: S) -> S {
        let step = frame.fraction(theta - self.anchor.theta);
        let mut travelled = step.abs();
        if self.turning_points.len() < 2 {
            travelled = travelled + travelled;
        }
        if travelled > S::TWO { self.anchor.eta } else { self.anchor.eta + step * (S::TWO - travelled) }
    }

    /// Turns at the last sample and returns the turning point; before the first movement there is none.
    fn reverse(&mut self, frame: &Frame<S>, half_play: S, direction: Direction) -> Option<TurningPoint<S>> {
        let first = self.direction == Direction::Unknown;
        self.direction = direction;
        if first {
            self.glide = self.short_way(frame, half_play, None);
            return None;
        }
        let here = TurningPoint { theta: self.filtered, eta: self.eta };
        if direction == Direction::Rising {
            self.lowest = self.lowest.min(here.theta);
        } else {
            self.highest = self.highest.max(here.theta);
        }
        if self.turning_points.is_empty() {
            let mirrored = TurningPoint { theta: self.origin + (self.origin - here.theta), eta: -here.eta };
            self.push(mirrored);
        } else if self.turning_points.is_full() {
            self.turning_points.truncate(N - 2);
            self.merging = true;
            self.merged_pairs = self.merged_pairs.saturating_add(1);
        }
        self.push(here);
        Some(here)
    }

    fn push(&mut self, point: TurningPoint<S>) {
        // There is room: a full stack was shortened, an empty one holds two.
        let _ = self.turning_points.push(point);
    }

    /// Drops the loops that a sample at `theta` closes, and returns the turning point where the resumed branch is entered.
    fn wipe_out(&mut self, direction: Direction, theta: S) -> Option<TurningPoint<S>> {
        let reaches = |target: S| if direction == Direction::Rising { theta >= target } else { theta <= target };
        let (_, loops) = self.turning_points.as_rchunks::<2>();
        let mut closed = 0;
        let mut entry = None;
        for &[target, _] in loops.iter().rev() {
            if !reaches(target.theta) {
                break;
            }
            closed += 2;
            entry = Some(target);
        }
        if entry.is_some() {
            let left = self.turning_points.len().saturating_sub(closed);
            self.turning_points.truncate(if left < 2 { 0 } else { left });
            self.merging &= left >= 2;
        }
        entry
    }

    /// The short way from the anchor.
    #[inline]
    fn short_way(&self, frame: &Frame<S>, half_play: S, target: Option<S>) -> Glide<S> {
        Glide::new(frame, half_play, self.direction == Direction::Rising, self.anchor.theta, target)
    }

    /// Sets up the branch from the newest turning point, entered at `entry`.
    fn enter(&mut self, frame: &Frame<S>, half_play: S, entry: TurningPoint<S>) {
        self.blend = None;
        let (Some(target), Some(&anchor)) = (self.target(), self.turning_points.last()) else {
            self.anchor = TurningPoint { theta: self.origin, eta: S::ZERO };
            self.glide = self.short_way(frame, half_play, None);
            return;
        };
        self.anchor = anchor;
        let length = frame.fraction(target.theta - entry.theta);
        if !self.merging || length == S::ZERO {
            self.glide = self.short_way(frame, half_play, Some(target.theta));
            return;
        }
        let entry_gap = entry.eta - self.plain_branch(frame, entry.theta);
        let target_gap = target.eta - self.plain_branch(frame, target.theta);
        let tilt = (target_gap - entry_gap).over(length);
        self.blend = Some(Blend { entry_theta: entry.theta, entry_gap, tilt });
        self.glide = Glide::none();
    }
}

/// The coefficients of law `masing`.
#[derive(Debug, Clone, Copy, PartialEq)]
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

impl<S: Float> VaryingPeriod<S> for Masing<S> {}

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
    fn glide<const N: usize>(&self, frame: &Frame<S>, state: &mut Path<S, N>, theta: S) -> bool {
        state.glide(frame, self.half_play, theta)
    }

    #[inline]
    fn torque<const N: usize>(&self, frame: &Frame<S>, state: &Path<S, N>, theta: S) -> S {
        self.h * state.eta() - self.e * frame.fraction(theta) * frame.gate(theta)
    }

    fn single_valued(&self, frame: &Frame<S>, theta: S) -> S {
        -(self.e * frame.fraction(theta) * frame.gate(theta))
    }

    fn start_uncertainty<const N: usize>(&self, frame: &Frame<S>, state: &Path<S, N>, _theta: S) -> S {
        self.h * state.start_uncertainty(frame)
    }

    fn merged_pairs<const N: usize>(&self, state: &Path<S, N>) -> u32 {
        state.merged_pairs()
    }
}

/// −θ·g(θ): the column that e multiplies in law `masing`, rad.
pub fn single_valued_column(frame: &Frame<f64>, theta_rad: f64) -> f64 {
    -theta_rad * frame.gate(theta_rad)
}
