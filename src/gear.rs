//! The gear: elastic torque and hysteresis torque of one deflection path.

use crate::elastic::Polynomial;
use crate::memory::{AnyLaw, Frame, MemoryLaw, VaryingPeriod};
use crate::params::Params;
use crate::scalar::{Float, Scalar};

/// Longer sample periods are refused, s: no drive waits thirty years, and their products would overflow `f32`.
pub const LONGEST_PERIOD_S: f64 = 1e9;

/// Torques at one sample: N·m for floats, fractions of the rated torque for fixed point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Output<S> {
    /// T = f + z.
    pub torque: S,
    /// f(θ).
    pub elastic: S,
    /// z.
    pub hysteresis: S,
}

/// What the last sample was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Status {
    /// The deflection lies outside ±A, where the model is not calibrated: the gate is closed, the rest extrapolates.
    pub out_of_range: bool,
    /// The sample was NaN, infinite or beyond [`REFUSED_BEYOND`](Scalar::REFUSED_BEYOND) rated deflections, or its period was not
    /// a time: the state was left as it was, and the output is that of the last good sample.
    pub refused: bool,
}

/// Coefficients of one gear, computed once from [`Params`]; they serve any number of states.
///
/// `L` is the law: by default the one that the parameters name, chosen at run time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gear<S: Scalar, L = AnyLaw<S>> {
    frame: Frame<S>,
    elastic: Polynomial<S>,
    law: L,
}

/// The path of one gear so far, with room for `N` turning points (an even number of 4 or more; 16 on a microcontroller, 256 on a host).
#[derive(Debug, Clone)]
pub struct State<S: Scalar, const N: usize = 16, L: MemoryLaw<S> = AnyLaw<S>> {
    theta: S,
    memory: L::State<N>,
    status: Status,
}

impl<S: Float> Gear<S> {
    /// The gear of these parameters. In law `time` every sample then counts as simultaneous with the last (Δ = 0) unless
    /// [`step_after`](Self::step_after) says otherwise.
    pub fn new(params: &Params) -> Self {
        Self::with_period(params, 0.0)
    }

    /// The gear of these parameters at the constant sample period Δ ≥ 0 in s. Other periods count as 0.
    pub fn with_period(params: &Params, period_s: f64) -> Self {
        let period_s = if (0.0..=LONGEST_PERIOD_S).contains(&period_s) { period_s } else { 0.0 };
        Self::with_law(params, AnyLaw::new(params, period_s))
    }
}

impl<S: Scalar, L: MemoryLaw<S>> Gear<S, L> {
    /// The gear of these parameters with a law of one's own choice, such as [`Masing::new(&params)`](crate::memory::masing::Masing::new).
    pub fn with_law(params: &Params, law: L) -> Self {
        let elastic = params.elastic().normalised(params.rated_deflection_rad(), params.torque_scale_nm()).cast();
        Self { frame: Frame::new(params), elastic, law }
    }

    /// The gear of coefficients that are rounded already.
    pub(crate) fn of(frame: Frame<S>, elastic: Polynomial<S>, law: L) -> Self {
        Self { frame, elastic, law }
    }

    /// The state of a gear whose past is unknown, at the deflection θ_0: y = 0 and m = 0 (MODEL.md sections 3 and 4). A θ_0 that is no deflection
    /// counts as 0 and is flagged.
    pub fn start<const N: usize>(&self, theta_0: S) -> State<S, N, L> {
        let refused = !self.frame.accepts(theta_0);
        let theta = if refused { S::ZERO } else { theta_0 };
        let status = Status { out_of_range: !self.frame.in_range(theta), refused };
        State { theta, memory: self.law.start(&self.frame, theta), status }
    }

    /// Moves to the next deflection and returns the torques there.
    ///
    /// Floats take radians and return N·m. Away from the tips (abs(θ) ≤ 0.999 A) the result is within 1e-9 (`f64`) or 2e-6 (`f32`) of the
    /// rated torque; at the tips see [`Frame::gate`]. These hold for a rated deflection that the scalar represents exactly. One that `f32` has to
    /// round moves the tips by δ ≤ 6e-8: up to e·A·√(2δ) there, 6e-5 of the published gear's torque, and law `phase` keeps up to 9e-5 after a
    /// turn at a tip, fading as e^(−ρ·abs(Δφ)).
    #[inline]
    pub fn step<const N: usize>(&self, state: &mut State<S, N, L>, theta: S) -> Output<S> {
        let (gear, state) = if self.law.glide(&self.frame, &mut state.memory, theta) {
            state.theta = theta;
            state.status = Status::default();
            (self, state)
        } else if L::GLIDES_IN_RANGE {
            let mut output = Output::default();
            self.output_with_care(state, theta, &mut output);
            return output;
        } else {
            self.step_with_care(state, theta)
        };
        gear.output(state)
    }

    /// A step to a sample beyond ±A, or to none, or one that the law does not take lightly. It hands back what it was given: then no register has to be
    /// kept across the call where there is none.
    #[cold]
    #[inline(never)]
    fn step_with_care<'a, const N: usize>(
        &'a self,
        state: &'a mut State<S, N, L>,
        theta: S,
    ) -> (&'a Self, &'a mut State<S, N, L>) {
        if self.frame.accepts(theta) {
            self.law.step(&self.frame, &mut state.memory, theta);
            state.theta = theta;
            state.status = Status { out_of_range: !self.frame.in_range(theta), refused: false };
        } else {
            state.status.refused = true;
        }
        (self, state)
    }

    /// The same and the torques there.
    #[cold]
    #[inline(never)]
    fn output_with_care<const N: usize>(&self, state: &mut State<S, N, L>, theta: S, output: &mut Output<S>) {
        let (gear, state) = self.step_with_care(state, theta);
        *output = gear.output(state);
    }

    /// The torques at the state's last good sample.
    #[inline]
    pub fn output<const N: usize>(&self, state: &State<S, N, L>) -> Output<S> {
        let elastic = self.elastic.torque(self.frame.fraction(state.theta));
        let hysteresis = self.law.torque(&self.frame, &state.memory, state.theta);
        Output {
            torque: self.frame.torque(elastic + hysteresis),
            elastic: self.frame.torque(elastic),
            hysteresis: self.frame.torque(hysteresis),
        }
    }

    /// The most that the hysteresis torque may be off because the path before the start is unknown, in output units. It shrinks as the
    /// gear moves: in law `masing` it is zero once a tip of the rated cycle was reached, in the others it decays with the memory.
    pub fn start_uncertainty<const N: usize>(&self, state: &State<S, N, L>) -> S {
        self.frame.torque(self.law.start_uncertainty(&self.frame, &state.memory, state.theta))
    }

    /// Pairs of turning points given up so far because the stack was full; law `masing`.
    pub fn merged_pairs<const N: usize>(&self, state: &State<S, N, L>) -> u32 {
        self.law.merged_pairs(&state.memory)
    }

    /// The elastic part.
    pub fn elastic(&self) -> &Polynomial<S> {
        &self.elastic
    }

    /// The memory law.
    pub fn law(&self) -> &L {
        &self.law
    }

    /// Rated deflection and torque scale.
    pub fn frame(&self) -> &Frame<S> {
        &self.frame
    }
}

impl<S: Float, L: VaryingPeriod<S>> Gear<S, L> {
    /// [`step`](Self::step), `period_s` after the last sample. Laws `masing` and `phase` know no time. A period below zero, NaN or beyond
    /// [`LONGEST_PERIOD_S`] is refused.
    #[inline]
    pub fn step_after<const N: usize>(&self, state: &mut State<S, N, L>, theta: S, period_s: S) -> Output<S> {
        if self.accepts_after(theta, period_s) {
            self.law.step_after(&self.frame, &mut state.memory, theta, period_s);
            state.theta = theta;
            state.status = Status { out_of_range: !self.frame.in_range(theta), refused: false };
        } else {
            state.status.refused = true;
        }
        self.output(state)
    }

    /// The torque that [`step_after`](Self::step_after) would return; the state stays as it is.
    pub fn peek_after<const N: usize>(&self, state: &State<S, N, L>, theta: S, period_s: S) -> S {
        if !self.accepts_after(theta, period_s) {
            return self.output(state).torque;
        }
        let elastic = self.elastic.torque(self.frame.fraction(theta));
        self.frame.torque(elastic + self.law.peek_after(&self.frame, &state.memory, theta, period_s))
    }

    #[inline]
    fn accepts_after(&self, theta: S, period_s: S) -> bool {
        // A NaN compares false.
        period_s >= S::ZERO && period_s <= S::from_f64(LONGEST_PERIOD_S) && self.frame.accepts(theta)
    }
}

impl<S: Scalar, const N: usize, L: MemoryLaw<S>> State<S, N, L> {
    /// The last good deflection, input units.
    pub fn theta(&self) -> S {
        self.theta
    }

    /// What the last sample was.
    pub fn status(&self) -> Status {
        self.status
    }

    /// What the law remembers.
    pub fn memory(&self) -> &L::State<N> {
        &self.memory
    }
}
