//! The gear: elastic torque and hysteresis torque of one deflection path.

use core::fmt;

use crate::elastic::ElasticTorque;
use crate::memory::{AnyLaw, Frame, MemoryLaw, VaryingPeriod};
use crate::params::{Law, Params};
use crate::scalar::{Float, Scalar};

/// Longer sample periods are refused, s: no drive waits thirty years, and their products would overflow `f32`.
pub const LONGEST_PERIOD_S: f64 = 1e9;
/// Shorter constant periods of law `time` are refused, s: no control loop runs at a gigahertz, and far below it `f32` cannot tell its memory from none.
pub const SHORTEST_PERIOD_S: f64 = 1e-9;

/// Torques at one sample: N·m for floats, fractions of the rated torque for fixed point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Output<S> {
    /// T = f + z.
    pub torque: S,
    /// f(θ).
    pub elastic: S,
    /// z.
    pub hysteresis: S,
    /// The last sample was refused ([`Status::refused`]): these are the torques of the last good one.
    pub refused: bool,
}

/// What the last sample was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Status {
    /// The deflection lies outside ±A, where the model is not calibrated: the gate is closed, the rest extrapolates.
    pub out_of_range: bool,
    /// The sample was NaN, infinite or beyond [`REFUSED_BEYOND`](Scalar::REFUSED_BEYOND) rated deflections, or its period was not
    /// a time: the state was left as it was, and the output is that of the last good sample.
    pub refused: bool,
    /// The sample lies further from the last one than [`Gear::with_largest_step`] allows: the state was left as it was, and the output is that of the
    /// last good sample.
    pub quarantined: bool,
    /// Quarantined samples agreed with one another: the gear was started anew at this one, its past unknown.
    pub restarted: bool,
}

/// Quarantined samples in a row that agree with one another before the gear is started anew where they are.
pub const AGREEING_SAMPLES: u32 = 3;

/// A sample period that is no time.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct PeriodError {
    /// What it was, s.
    pub period_s: f64,
}

impl PeriodError {
    /// Whether a constant sample period will do: from 0 to [`LONGEST_PERIOD_S`], in law `time` from [`SHORTEST_PERIOD_S`].
    ///
    /// # Errors
    /// It will not.
    pub const fn check(law: Law, period_s: f64) -> Result<(), Self> {
        // A NaN compares false.
        let least = if matches!(law, Law::Time) { SHORTEST_PERIOD_S } else { 0.0 };
        if period_s >= least && period_s <= LONGEST_PERIOD_S { Ok(()) } else { Err(Self { period_s }) }
    }
}

impl fmt::Display for PeriodError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the sample period {:e} s must lie between 0 and {LONGEST_PERIOD_S:e} s, in law time from {SHORTEST_PERIOD_S:e} s",
            self.period_s
        )
    }
}

impl core::error::Error for PeriodError {}

/// Coefficients of one gear, computed once from [`Params`]; they serve any number of states.
///
/// `L` is the law: by default the one that the parameters name, chosen at run time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gear<S: Scalar, L = AnyLaw<S>> {
    frame: Frame<S>,
    elastic: ElasticTorque<S>,
    law: L,
    /// The largest step between two samples; below zero where the law lacks a sample period, so that no sample passes.
    largest_step: S,
}

/// The path of one gear so far, with room for `N` turning points (an even number of 4 or more; 16 on a microcontroller, 256 on a host).
#[derive(Debug, Clone)]
pub struct State<S: Scalar, const N: usize = 16, L: MemoryLaw<S> = AnyLaw<S>> {
    theta: S,
    memory: L::State<N>,
    status: Status,
    suspicion: Suspicion<S>,
}

/// Samples that were not taken; counts only while the last one was refused or quarantined.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Suspicion<S> {
    /// The last quarantined sample, and how many before it agree.
    theta: S,
    agreeing: u32,
    /// How far the gear may have come in the meantime.
    reach: S,
}

impl<S: Float> Gear<S> {
    /// The gear of these parameters, for samples whose period is known one by one: in law `time` take [`step_after`](Self::step_after), as
    /// [`step`](Self::step) refuses every sample. The other laws know no time.
    #[must_use]
    pub fn new(params: &Params) -> Self {
        Self::with_law(params, AnyLaw::new(params, 0.0))
    }

    /// The gear of these parameters at the constant sample period Δ in s.
    ///
    /// # Errors
    /// [`PeriodError`]: NaN, below zero, beyond [`LONGEST_PERIOD_S`], or below [`SHORTEST_PERIOD_S`] in law `time`.
    pub fn with_period(params: &Params, period_s: f64) -> Result<Self, PeriodError> {
        PeriodError::check(params.memory().law, period_s)?;
        Ok(Self::with_law(params, AnyLaw::new(params, period_s)))
    }
}

impl<S: Scalar, L: MemoryLaw<S>> Gear<S, L> {
    /// The gear of these parameters with a law of one's own choice, such as [`Masing::new(&params)`](crate::memory::masing::Masing::new).
    #[must_use]
    pub fn with_law(params: &Params, law: L) -> Self {
        let elastic = params.elastic().normalised(params.rated_deflection_rad(), params.torque_scale_nm()).cast();
        Self::of(Frame::new(params), ElasticTorque::new(elastic), law)
    }

    /// The gear of coefficients that are rounded already.
    pub(crate) fn of(frame: Frame<S>, elastic: ElasticTorque<S>, law: L) -> Self {
        let largest_step = if law.has_period() { S::from_f64(S::LARGEST) } else { -S::ONE };
        Self { frame, elastic, law, largest_step }
    }

    /// The largest step between two samples, as [`with_largest_step`](Self::with_largest_step) or the record `largest_step` of a block has set it; the largest number where neither has.
    #[must_use]
    pub fn largest_step(&self) -> S {
        self.largest_step
    }

    /// The same gear that takes no sample further than `largest_step` ≥ 0 (input units) from the last one: the product of sample period and the top speed of the
    /// deflection. What is further is quarantined ([`Status::quarantined`]): it changes nothing, the output stays that of the last good sample, and the next one may lie
    /// a step further away for each sample that was not taken, up to four. [`AGREEING_SAMPLES`] in a row that lie within a step of one another are no outliers: there
    /// the gear is started anew ([`Status::restarted`]), with the uncertainty of a start. NaN, or below zero, means no limit.
    #[must_use]
    pub fn with_largest_step(self, largest_step: S) -> Self {
        let set = self.law.has_period() && largest_step >= S::ZERO;
        Self { largest_step: if set { largest_step } else { self.largest_step }, ..self }
    }

    /// The state of a gear whose past is unknown, at the deflection θ_0: y = 0 and m = 0 (MODEL.md sections 3 and 4). A θ_0 that is no deflection
    /// counts as 0 and is flagged.
    #[must_use]
    pub fn start<const N: usize>(&self, theta_0: S) -> State<S, N, L> {
        let refused = !self.frame.accepts(theta_0);
        let theta = if refused { S::ZERO } else { theta_0 };
        let status = Status { out_of_range: !self.frame.in_range(theta), refused, ..Status::default() };
        State { theta, memory: self.law.start(&self.frame, theta), status, suspicion: Suspicion::default() }
    }

    /// Moves to the next deflection and returns the torques there.
    ///
    /// Floats take radians and return N·m. Away from the tips (abs(θ) ≤ 0.999 A) the result is within 1e-9 (`f64`) or 2e-6 (`f32`) of the
    /// rated torque; at the tips see [`Frame::gate`]. These hold for a rated deflection that the scalar represents exactly. One that `f32` has to
    /// round moves the tips by δ ≤ 6e-8: up to e·A·√(2δ) there, 6e-5 of the published gear's torque, and law `phase` keeps up to 9e-5 after a
    /// turn at a tip, fading as e^(−ρ·abs(Δφ)).
    #[inline]
    pub fn step<const N: usize>(&self, state: &mut State<S, N, L>, theta: S) -> Output<S> {
        self.step_within(state, theta, self.largest_step)
    }

    /// [`step`](Self::step) with another largest step.
    #[inline]
    pub(crate) fn step_within<const N: usize>(
        &self,
        state: &mut State<S, N, L>,
        theta: S,
        largest_step: S,
    ) -> Output<S> {
        // A NaN compares false.
        let near = (theta - state.theta).abs() <= largest_step;
        let (gear, state) = if near && self.law.fast_path(&self.frame, &mut state.memory, theta) {
            state.theta = theta;
            state.status = Status::default();
            (self, state)
        } else {
            self.step_with_care(state, theta, largest_step)
        };
        gear.output(state)
    }

    /// A step to a sample beyond ±A, or to none, or one that the law or the gate does not take lightly. It hands back what it was given: then no register has to be
    /// kept across the call where there is none.
    #[cold]
    #[inline(never)]
    fn step_with_care<'a, const N: usize>(
        &'a self,
        state: &'a mut State<S, N, L>,
        theta: S,
        largest_step: S,
    ) -> (&'a Self, &'a mut State<S, N, L>) {
        let is_deflection = self.frame.accepts(theta) && self.law.has_period();
        if self.admits(state, theta, is_deflection, largest_step) {
            self.law.step(&self.frame, &mut state.memory, theta);
            self.arrive(state, theta);
        }
        (self, state)
    }

    /// Whether a sample that is none or further than a step is to be stepped to; else says in the state what became of it.
    #[inline(always)]
    fn admits<const N: usize>(
        &self,
        state: &mut State<S, N, L>,
        theta: S,
        is_deflection: bool,
        largest_step: S,
    ) -> bool {
        let step = (theta - state.theta).abs();
        let near = is_deflection && step <= largest_step;
        near || self.admits_far(state, theta, is_deflection, largest_step)
    }

    /// [`admits`](Self::admits) of a sample further than a step.
    fn admits_far<const N: usize>(
        &self,
        state: &mut State<S, N, L>,
        theta: S,
        is_deflection: bool,
        largest_step: S,
    ) -> bool {
        let Suspicion { theta: last, agreeing, reach } = state.suspicion;
        let Status { refused, quarantined, .. } = state.status;
        let reach = if refused | quarantined { reach } else { largest_step };
        let agrees = quarantined && (theta - last).abs() <= largest_step;
        let agreeing = if agrees { agreeing + 1 } else { 1 };
        if is_deflection {
            if (theta - state.theta).abs() <= reach {
                return true;
            }
            if agreeing >= AGREEING_SAMPLES {
                self.law.restart(&self.frame, &mut state.memory, theta);
                self.arrive(state, theta);
                state.status.restarted = true;
                return false;
            }
        }
        let most = (largest_step + largest_step) + (largest_step + largest_step);
        state.suspicion = Suspicion { theta, agreeing, reach: (reach + largest_step).min(most) };
        state.status = Status { refused: !is_deflection, quarantined: is_deflection, restarted: false, ..state.status };
        false
    }

    /// Makes a state of this gear of one that another gear had: reversals keep their deflections (in fixed point as fractions of the rated one), their torques are
    /// computed anew; the memory of laws `phase` and `time` grows with α. Another law starts anew, its past unknown.
    pub fn take_over<const N: usize>(&self, before: &Self, state: &mut State<S, N, L>) {
        let parts = (&before.law, &before.frame);
        state.memory = self.law.take_over(&self.frame, parts, &state.memory, state.theta);
    }

    /// Says what the sample is that the law was moved to.
    fn arrive<const N: usize>(&self, state: &mut State<S, N, L>, theta: S) {
        state.theta = theta;
        state.status = Status { out_of_range: !self.frame.in_range(theta), ..Status::default() };
    }

    /// The torques at the state's last good sample.
    #[inline]
    #[must_use]
    pub fn output<const N: usize>(&self, state: &State<S, N, L>) -> Output<S> {
        let elastic = self.elastic.torque(self.frame.fraction(state.theta));
        let hysteresis = self.law.torque(&self.frame, &state.memory, state.theta);
        Output {
            torque: self.frame.torque(elastic + hysteresis),
            elastic: self.frame.torque(elastic),
            hysteresis: self.frame.torque(hysteresis),
            refused: state.status.refused,
        }
    }

    /// The most that the hysteresis torque may be off, in output units, because the path before the start is unknown, or the path during an outlier (a sample beyond
    /// [`DOUBTED_BEYOND`](crate::memory::frame::DOUBTED_BEYOND)). It shrinks as the gear moves within ±A: in law `masing` it is zero once both tips of the rated cycle were reached, in the
    /// others it decays with the memory. Law `time` at a constant period is to keep a ten-thousandth of its memory over a period.
    #[must_use]
    pub fn start_uncertainty<const N: usize>(&self, state: &State<S, N, L>) -> S {
        self.frame.torque(self.law.start_uncertainty(&self.frame, &state.memory, state.theta))
    }

    /// Half of what the hysteresis torque may be apart after two pasts, in output units: what the strokes since the start have not explained. In law `masing` it is zero once a tip of the
    /// rated cycle was reached; the torque of the model need not lie between the pasts ([`start_uncertainty`](Self::start_uncertainty) counts that).
    #[must_use]
    pub fn start_spread<const N: usize>(&self, state: &State<S, N, L>) -> S {
        self.frame.torque(self.law.start_spread(&self.frame, &state.memory, state.theta))
    }

    /// [`start_spread`](Self::start_spread) of a start at θ = 0, the largest.
    pub(crate) fn largest_spread(&self) -> S {
        self.frame.torque(self.law.largest_spread(&self.frame))
    }

    /// Pairs of turning points given up so far because the stack was full; law `masing`.
    #[must_use]
    pub fn merged_pairs<const N: usize>(&self, state: &State<S, N, L>) -> u32 {
        self.law.merged_pairs(&state.memory)
    }

    /// The elastic part.
    #[must_use]
    pub fn elastic(&self) -> &ElasticTorque<S> {
        &self.elastic
    }

    /// The memory law.
    #[must_use]
    pub fn law(&self) -> &L {
        &self.law
    }

    /// Rated deflection and torque scale.
    #[must_use]
    pub fn frame(&self) -> &Frame<S> {
        &self.frame
    }
}

impl<S: Float, L: VaryingPeriod<S>> Gear<S, L> {
    /// [`step`](Self::step), `period_s` after the last sample. Laws `masing` and `phase` know no time. A period below zero, NaN or beyond
    /// [`LONGEST_PERIOD_S`] is refused.
    #[inline]
    pub fn step_after<const N: usize>(&self, state: &mut State<S, N, L>, theta: S, period_s: S) -> Output<S> {
        if self.admits_after(state, theta, period_s) {
            self.advance_after(state, theta, period_s);
        }
        self.output(state)
    }

    /// Whether a sample is to be stepped to; else says in the state what became of it.
    #[inline]
    pub(crate) fn admits_after<const N: usize>(&self, state: &mut State<S, N, L>, theta: S, period_s: S) -> bool {
        // Only a constant period may be missing.
        let any = S::from_f64(S::LARGEST);
        let largest_step = if self.largest_step >= S::ZERO { self.largest_step } else { any };
        self.admits(state, theta, self.accepts_after(theta, period_s), largest_step)
    }

    /// A step to a sample that was admitted.
    #[inline]
    pub(crate) fn advance_after<const N: usize>(&self, state: &mut State<S, N, L>, theta: S, period_s: S) {
        self.law.step_after(&self.frame, &mut state.memory, theta, period_s);
        self.arrive(state, theta);
    }

    /// The torque that [`step_after`](Self::step_after) would return; the state stays as it is.
    #[must_use]
    pub fn peek_after<const N: usize>(&self, state: &State<S, N, L>, theta: S, period_s: S) -> S {
        if !self.accepts_after(theta, period_s) {
            return self.output(state).torque;
        }
        let elastic = self.elastic.torque(self.frame.fraction(theta));
        self.frame.torque(elastic + self.law.peek_after(&self.frame, &state.memory, theta, period_s))
    }

    #[inline]
    fn accepts_after(&self, theta: S, period_s: S) -> bool {
        is_period(period_s) && self.frame.accepts(theta)
    }
}

#[inline]
fn is_period<S: Float>(period_s: S) -> bool {
    // A NaN compares false.
    period_s >= S::ZERO && period_s <= S::from_f64(LONGEST_PERIOD_S)
}

impl<S: Scalar, const N: usize, L: MemoryLaw<S>> State<S, N, L> {
    /// The last good deflection, input units.
    #[must_use]
    pub fn theta(&self) -> S {
        self.theta
    }

    /// What the last sample was.
    #[must_use]
    pub fn status(&self) -> Status {
        self.status
    }

    /// What the law remembers.
    #[must_use]
    pub fn memory(&self) -> &L::State<N> {
        &self.memory
    }
}
