//! From torque to deflection: the θ at which the gear, moved there from its present state, transmits T* (MODEL.md section 5).
//!
//! | law | the equation |
//! |---|---|
//! | `masing` | T(θ) along the route that rises (or falls) from here, across wiping-outs, to the branch that holds T* |
//! | `phase` | T after a step to θ in the direction that T* asks for |
//! | `time` | T at the next sample, the memory going on in the meantime |
//!
//! All of them increase with θ within ±rA, the [invertible range](invertible_range) of the parameters; beyond it the solution is the edge of the range, and
//! says so. The search is Euler's iteration within a bracket, of at most [`MOST_STEPS`] steps.
//!
//! **Error.** Moving the gear to the solution gives T* back within 1e-14 (`f64`), 3e-6 (`f32`) or 1e-6 (fixed point) of the torque scale, plus what
//! the rounding of θ itself does where dz/dθ grows without bound: with δ the spacing of numbers next to 1, up to e·A·min(2δ/g, 2√δ) (laws `phase` and `time`
//! with gate `cycle`: the largest memory for e·A).
//!
//! **Fixed point** inverts laws `masing` and `time` through [`Inverse::of`]. Derivatives grow faster than torques: parameters whose torque bends too
//! sharply for the numbers that it has are refused ([`InverseError::Format`]).
//!
//! ```
//! use gmhm::{Elastic, Inverse, Memory, Params};
//!
//! let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
//! let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
//! let params = Params::new(1.168e-3, elastic, memory)?;
//!
//! let inverse = Inverse::<f32>::new(&params)?;
//! let mut state = inverse.gear().start::<16>(0.0);
//! inverse.commit(&mut state, 20.0);
//! inverse.commit(&mut state, 5.0); // unloads along another branch than it was loaded on
//! let solution = inverse.peek(&state, 12.0); // what 12 N·m would take; the state stays
//! let out = inverse.gear().step(&mut state, solution.theta);
//! assert!((out.torque - 12.0).abs() < 1e-4);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

mod any;
#[cfg(feature = "adapt")]
mod changed;
mod masing;
mod phase;
mod range;
mod solve;
mod time;
#[cfg(feature = "block")]
pub(crate) mod words;

pub(crate) use range::Monotony;
pub use range::{InverseError, invertible_range, least_rising_slope};
pub use solve::MOST_STEPS;

use crate::elastic::ElasticTorque;
use crate::gear::{Gear, Output, PeriodError, State};
use crate::memory::{AnyLaw, Frame, MemoryLaw, VaryingPeriod};
use crate::params::{Gate, Params};
use crate::scalar::{Float, Scalar};
use solve::{Bracket, Limits, Point, Root, Spring, Stretch, root};

/// Torques beyond this many rated torques are no torques.
const REFUSED_BEYOND: f64 = 1e18;

/// The inverse of a gear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inverse<S: Scalar, L = AnyLaw<S>> {
    gear: Gear<S, L>,
    solver: Solver<S>,
    inverse_torque_scale: S,
    limit: S,
    longest_period: S,
}

/// What a search goes by, whatever the law.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Solver<S> {
    spring: Spring<S>,
    limits: Limits<S>,
    /// The least that T/T_A rises with u = θ/A, within the range.
    least_slope: S,
    /// The edge of the range, over A.
    reach: S,
    /// Short of it by its rounding, and as t = tan(φ/2).
    inner_reach: S,
    inner_half_tangent: S,
}

/// The numbers that the search goes by, over A and T_A: what the same search in another language needs beside the coefficients of the gear.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SearchNumbers<S> {
    /// A residual that counts as none.
    pub tolerance: S,
    /// A step of t = tan(φ/2) after which the residual is below the tolerance.
    pub last_step: S,
    /// The largest (Δ² + abs(δ))·abs(δ) of a last chord δ after a step Δ.
    pub last_chord: S,
    /// A bracket of t within which the torque changes by less than the tolerance.
    pub last_width: S,
    /// The least slope of the torque within the range.
    pub least_slope: S,
    /// The edge of the range.
    pub reach: S,
    /// Short of it by its rounding.
    pub inner_reach: S,
    /// The same as t.
    pub inner_half_tangent: S,
    /// 3·k3 and 5·k5 of f′.
    pub slope: [S; 2],
    /// 6·k3 and 20·k5 of f″.
    pub bend: [S; 2],
    /// 1/T_A, 1/(N·m).
    pub inverse_torque_scale: S,
    /// The largest torque that is accepted, N·m.
    pub largest_torque: S,
}

/// A deflection for a torque.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Solution<S> {
    /// θ*, input units of the gear: rad for floats.
    pub theta: S,
    /// The torque lies beyond the invertible range: θ* is its edge.
    pub saturated: bool,
    /// The torque was NaN, infinite or absurd, or the period no time: θ* is the present deflection.
    pub refused: bool,
    /// The search ended within its bound. It always does for parameters that have an inverse.
    pub converged: bool,
    /// Steps that it took.
    pub steps: u8,
}

impl<S> Solution<S> {
    const fn held(theta: S) -> Self {
        Self { theta, saturated: false, refused: false, converged: true, steps: 0 }
    }

    const fn refused(theta: S) -> Self {
        Self { theta, saturated: false, refused: true, converged: true, steps: 0 }
    }
}

/// What a law is asked: everything of the gear but the law and its state, and the torque.
#[derive(Debug)]
pub struct Task<'a, S> {
    frame: &'a Frame<S>,
    elastic: &'a ElasticTorque<S>,
    solver: &'a Solver<S>,
    /// T*/T_A.
    torque: S,
}

/// A law that can be inverted.
pub trait Invertible<S: Scalar>: MemoryLaw<S> {
    /// The deflection one step ahead of `state`, which was last moved to `theta`.
    fn solve<const N: usize>(&self, task: &Task<S>, state: &Self::State<N>, theta: S) -> Solution<S>;

    /// The deflection of a start whose past is unknown: y = 0, m = 0.
    fn solve_start(&self, task: &Task<S>) -> Solution<S>;
}

/// A law that can be inverted with a sample period of its own. Laws `masing` and `phase` ignore it.
pub trait InvertibleAfter<S: Float>: Invertible<S> + VaryingPeriod<S> {
    /// The deflection `period_s` after the last sample.
    fn solve_after<const N: usize>(
        &self,
        task: &Task<S>,
        state: &Self::State<N>,
        theta: S,
        _period_s: S,
    ) -> Solution<S> {
        self.solve(task, state, theta)
    }
}

impl<S: Float> InvertibleAfter<S> for crate::memory::masing::Masing<S> {}
impl<S: Float> InvertibleAfter<S> for crate::memory::phase::Phase<S> {}

impl<S: Float> Inverse<S> {
    /// The inverse of the gear of these parameters, laws `masing` and `phase`: law `time` needs [`with_period`](Self::with_period).
    ///
    /// # Errors
    /// Parameters without an invertible range; law `time`.
    pub fn new(params: &Params) -> Result<Self, InverseError> {
        Self::with_period(params, 0.0)
    }

    /// The inverse of the gear at the sample period Δ, s, which is also the longest that [`peek_after`](Self::peek_after) accepts.
    ///
    /// # Errors
    /// Parameters without an invertible range, a period that is no time.
    pub fn with_period(params: &Params, period_s: f64) -> Result<Self, InverseError> {
        Self::of(params, AnyLaw::new(params, period_s), period_s)
    }
}

impl<S: Scalar, L: Invertible<S>> Inverse<S, L> {
    /// The inverse of the gear with a law of one's own choice that follows the same parameters; `longest_period_s` counts in law `time` alone.
    ///
    /// # Errors
    /// Parameters without an invertible range, a period that is no time, numbers beyond the format.
    pub fn of(params: &Params, law: L, longest_period_s: f64) -> Result<Self, InverseError> {
        PeriodError::check(params.memory().law, longest_period_s)?;
        let monotony = Monotony::of::<S>(params, longest_period_s)?;
        let gear = Gear::with_law(params, law);
        Ok(Self::with_monotony(gear, params.torque_scale_nm(), &monotony, longest_period_s))
    }

    /// The inverse of a gear whose torque is known to increase.
    pub(crate) fn with_monotony(
        gear: Gear<S, L>,
        torque_scale_nm: f64,
        monotony: &Monotony,
        longest_period_s: f64,
    ) -> Self {
        let Monotony { reach, least_slope, bounds: [first, second, third] } = *monotony;
        let scale = torque_scale_nm;
        let tolerance = S::TOLERANCE;
        // Short of the edge by its rounding, so that no solution lies beyond.
        let inner = if reach < 1.0 { reach * (1.0 - 4.0 * S::EPSILON) } else { reach };
        let solver = Solver {
            spring: Spring::new(gear.elastic().polynomial()),
            limits: Limits {
                tolerance: S::from_f64(tolerance),
                last_step: S::from_f64(libm::cbrt(6.0 * tolerance / third)),
                last_chord: S::from_f64(2.0 * tolerance / second.max(third)),
                last_width: S::from_f64(tolerance / first),
            },
            least_slope: S::from_f64(least_slope),
            reach: S::from_f64(reach),
            inner_reach: S::from_f64(inner),
            inner_half_tangent: S::from_f64(inner / (1.0 + libm::sqrt((1.0 - inner) * (1.0 + inner)))),
        };
        Self {
            gear,
            solver,
            inverse_torque_scale: S::from_f64(if S::SI { 1.0 / scale } else { 1.0 }),
            limit: S::from_f64(REFUSED_BEYOND * if S::SI { scale } else { 1.0 }),
            longest_period: S::from_f64(longest_period_s),
        }
    }

    /// The same inverse of the gear [with a largest step](Gear::with_largest_step): it bounds what [`gear`](Self::gear) takes as a sample, not what the inverse asks for.
    #[must_use]
    pub fn with_largest_step(self, largest_step: S) -> Self {
        Self { gear: self.gear.with_largest_step(largest_step), ..self }
    }

    /// The gear that is inverted.
    #[must_use]
    pub fn gear(&self) -> &Gear<S, L> {
        &self.gear
    }

    /// The edge rA of the invertible range ±rA, input units.
    #[must_use]
    pub fn range(&self) -> S {
        self.gear.frame().deflection(self.solver.reach)
    }

    /// What the search goes by.
    #[must_use]
    pub fn search_numbers(&self) -> SearchNumbers<S> {
        let Solver { spring, limits, least_slope, reach, inner_reach, inner_half_tangent } = self.solver;
        let Limits { tolerance, last_step, last_chord, last_width } = limits;
        let ([slope, bend], [inverse_torque_scale, largest_torque]) =
            (spring.derivatives(), [self.inverse_torque_scale, self.limit]);
        SearchNumbers {
            tolerance,
            last_step,
            last_chord,
            last_width,
            least_slope,
            reach,
            inner_reach,
            inner_half_tangent,
            slope,
            bend,
            inverse_torque_scale,
            largest_torque,
        }
    }

    /// The state of a gear whose past is unknown (y = 0, m = 0) under a torque, and how it was found.
    #[must_use]
    pub fn start<const N: usize>(&self, torque: S) -> (State<S, N, L>, Solution<S>) {
        let solution = if self.is_torque(torque) {
            self.gear.law().solve_start(&self.task(torque))
        } else {
            Solution::refused(S::ZERO)
        };
        (self.gear.start(solution.theta), solution)
    }

    /// The deflection at which the next sample gives a torque, output units. The state stays as it is.
    #[inline]
    #[must_use]
    pub fn peek<const N: usize>(&self, state: &State<S, N, L>, torque: S) -> Solution<S> {
        let theta = state.theta();
        if !self.is_torque(torque) {
            return Solution::refused(theta);
        }
        self.gear.law().solve(&self.task(torque), state.memory(), theta)
    }

    /// Moves the gear to the deflection at which it gives a torque, and returns both. A torque that is refused moves nothing.
    #[inline]
    pub fn commit<const N: usize>(&self, state: &mut State<S, N, L>, torque: S) -> (Solution<S>, Output<S>) {
        let solution = self.peek(state, torque);
        let output = if solution.refused {
            self.gear.output(state)
        } else {
            // What the inverse asks for is no measurement.
            self.gear.step_within(state, solution.theta, S::from_f64(S::LARGEST))
        };
        (solution, output)
    }

    #[inline]
    fn is_torque(&self, torque: S) -> bool {
        // A NaN compares false.
        torque.abs() <= self.limit
    }

    /// What the law is asked.
    #[inline]
    fn task(&self, torque: S) -> Task<'_, S> {
        let torque = torque.normalise(self.inverse_torque_scale);
        Task { frame: self.gear.frame(), elastic: self.gear.elastic(), solver: &self.solver, torque }
    }
}

impl<S: Float, L: InvertibleAfter<S>> Inverse<S, L> {
    /// [`peek`](Self::peek) for a sample `period_s` after the last. A period below zero, NaN or beyond the longest that the range was computed for
    /// is refused in law `time`.
    #[inline]
    #[must_use]
    pub fn peek_after<const N: usize>(&self, state: &State<S, N, L>, torque: S, period_s: S) -> Solution<S> {
        let theta = state.theta();
        if !self.is_period(period_s) || !self.is_torque(torque) {
            return Solution::refused(theta);
        }
        self.gear.law().solve_after(&self.task(torque), state.memory(), theta, period_s)
    }

    /// [`commit`](Self::commit) for a sample `period_s` after the last.
    #[inline]
    pub fn commit_after<const N: usize>(
        &self,
        state: &mut State<S, N, L>,
        torque: S,
        period_s: S,
    ) -> (Solution<S>, Output<S>) {
        let solution = self.peek_after(state, torque, period_s);
        let output = if solution.refused {
            self.gear.output(state)
        } else {
            self.gear.advance_after(state, solution.theta, period_s);
            self.gear.output(state)
        };
        (solution, output)
    }

    fn is_period(&self, period_s: S) -> bool {
        period_s >= S::ZERO && period_s <= self.longest_period
    }
}

impl<S: Scalar> Task<'_, S> {
    /// A root on a stretch that was mirrored by `sign`, the gear being at `here`. It never lies behind, whatever the rounding.
    #[inline]
    fn solution(&self, found: &Root<S>, sign: S, here: S) -> Solution<S> {
        let ahead = self.deflection(found.u);
        let theta = if ahead < here.signed(sign) { here } else { ahead.signed(sign) };
        self.found(found, sign, theta)
    }

    /// The deflection of a solution.
    #[inline]
    fn deflection(&self, u: S) -> S {
        // u = 2tq: floats round it within the range, a fixed grid by a unit beyond.
        self.frame.deflection(if S::SI { u } else { u.clamp(-self.solver.reach, self.solver.reach) })
    }

    #[inline]
    fn found(&self, found: &Root<S>, sign: S, theta: S) -> Solution<S> {
        if found.saturated {
            return Solution { steps: found.steps, ..self.edge(if found.u > S::ZERO { sign } else { -sign }) };
        }
        Solution { converged: found.converged, steps: found.steps, ..Solution::held(theta) }
    }

    /// The upper (1) or lower (−1) edge of the range.
    fn edge(&self, side: S) -> Solution<S> {
        Solution { saturated: true, ..Solution::held(self.frame.deflection(self.solver.reach).signed(side)) }
    }

    /// The root on a stretch that spans the range.
    fn solve_anywhere(&self, stretch: &impl Stretch<S>, start: Point<S>) -> Solution<S> {
        let edge = self.solver.inner_half_tangent;
        let bracket = Bracket { low: -edge, high: edge, edge };
        let start = if start.t.abs() <= edge { start } else { Point::ZERO };
        let (torque, work) = stretch.torque(start.u, start.u * start.u, start.g);
        let found = root(stretch, (self.torque, &self.solver.limits), bracket, (start, self.torque - torque, work));
        self.found(&found, S::ONE, self.deflection(found.u))
    }

    /// The root of the spring alone.
    fn solve_unloaded(&self) -> Solution<S> {
        self.solve_anywhere(&self.solver.spring, Point::ZERO)
    }
}

/// z and its first two derivatives by φ from those of m; u = sin φ, g = cos φ.
#[inline]
fn gated<S: Scalar>(gate: Gate, [m, slope, bend]: [S; 3], u: S, g: S) -> [S; 3] {
    if gate == Gate::None {
        return [m, slope, bend];
    }
    let twice = u * slope;
    [g * m, g * slope - u * m, g * (bend - m) - (twice + twice)]
}
