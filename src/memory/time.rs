//! Law `time`: the memory integral in real time, θ linear between samples (MODEL.md section 4).
//!
//! ```text
//! kernel rate:        m ← E·m + α·φ1·(θ_k − θ_{k−1})                                x = βΔ, E = e^(−x)
//! kernel deflection:  m ← E·m − α·Δ·[φ1·θ_{k−1} + φ2·(θ_k − θ_{k−1})]               φ1 = (1 − E)/x, φ2 = (1 − φ1)/x
//! ```
//!
//! Exact for a deflection that is linear between samples, at any and at varying Δ. A sample beyond 10 A counts as one there: a gear does not come so far, and one bad sample must not fill the memory for long.
//! 1 − E is kept instead of E, and what a sum rounds off is carried to the next sample: a slow memory (small βΔ) stays exact to a few units
//! in the last place in `f32`.

use super::{Frame, MemoryLaw, UNKNOWN, VaryingPeriod};
use crate::gear::PeriodError;
use crate::params::{Gate, Kernel, Law, Params};
use crate::scalar::{Float, Scalar};

/// The coefficients of law `time` at one sample period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Time<S: Scalar> {
    /// [`Rates`], the kernel beside other small fields.
    gain: S,
    beta_per_s: S,
    step: TimeStep<S::Gain>,
    /// The largest m/T_A that a past within ±A can leave; kernel `rate` as much again for abs(θ)/A.
    bound: S,
    kernel: Kernel,
    gate: Gate,
    has_period: bool,
}

/// What does not depend on the sample period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rates<S> {
    pub(crate) kernel: Kernel,
    /// αA/T_A: 1/s for kernel `deflection`, 1 for kernel `rate`.
    pub(crate) gain: S,
    pub(crate) beta_per_s: S,
}

/// One step of the recursion.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TimeStep<G> {
    /// 1 − E.
    forgotten: G,
    /// What the last deflection adds, per θ/A.
    level: G,
    /// What the increment of the deflection adds, per θ/A.
    increment: G,
}

/// The memory of law `time`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeState<S: Scalar> {
    theta: S,
    memory: S,
    carry: S::Carry,
    uncertainty: S,
}

/// m(u)/T_A one step ahead: memory + growth·(u − from).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ahead<S> {
    pub(crate) from: S,
    pub(crate) memory: S,
    pub(crate) growth: S,
}

impl<S: Scalar> TimeState<S> {
    /// m/T_A.
    #[must_use]
    pub fn memory(&self) -> S {
        self.memory
    }
}

/// 1 − e^(−x), φ1 and φ2 for x ≥ 0, within 20 units in the last place.
fn decay<S: Float>(x: S) -> (S, S, S) {
    let forgotten = -(-x).exp_m1();
    if x < S::from_f64(0.125) {
        // φ2 = 1/2 − x/6 + x²/24 − …: the quotient below would lose the digits.
        let mut term = S::HALF;
        let mut phi2 = term;
        for inverse in [1.0 / 3.0, 1.0 / 4.0, 1.0 / 5.0, 1.0 / 6.0, 1.0 / 7.0, 1.0 / 8.0, 1.0 / 9.0, 1.0 / 10.0] {
            term = -(term * x * S::from_f64(inverse));
            phi2 = phi2 + term;
        }
        (forgotten, S::ONE - x * phi2, phi2)
    } else {
        let phi1 = forgotten.over(x);
        (forgotten, phi1, (S::ONE - phi1).over(x))
    }
}

impl<G: Copy> TimeStep<G> {
    /// The increment's gain as a scalar: what it adds to an empty memory.
    fn growth<S: Scalar<Gain = G>>(&self) -> S {
        let (mut growth, mut carry) = (S::ZERO, S::Carry::default());
        S::leak(&mut growth, &mut carry, self.forgotten, [(self.level, S::ZERO), (self.increment, S::ONE)]);
        growth
    }
}

impl Rates<f64> {
    /// Those of parameters.
    pub(crate) fn new(params: &Params) -> Self {
        let memory = params.memory();
        let gain = memory.alpha * params.rated_deflection_rad() / params.torque_scale_nm();
        Self { kernel: memory.kernel, gain, beta_per_s: memory.beta_per_s }
    }

    fn cast<S: Scalar>(self) -> Rates<S> {
        let Self { kernel, gain, beta_per_s } = self;
        Rates { kernel, gain: S::from_f64(gain), beta_per_s: S::from_f64(beta_per_s) }
    }
}

impl<S: Float> Rates<S> {
    fn over(&self, period_s: S) -> TimeStep<S> {
        let (forgotten, phi1, phi2) = decay(self.beta_per_s * period_s);
        match self.kernel {
            Kernel::Rate => TimeStep { forgotten, level: S::ZERO, increment: self.gain * phi1 },
            Kernel::Deflection => {
                let gain = -(self.gain * period_s);
                TimeStep { forgotten, level: gain * phi1, increment: gain * phi2 }
            }
        }
    }
}

impl<S: Scalar> Time<S> {
    /// The coefficients of a gear at the sample period Δ (s), whatever the law that its parameters name. With a period that [`PeriodError::check`]
    /// refuses, the law has none: a gear then refuses every sample that does not bring its own.
    #[must_use]
    pub fn new(params: &Params, period_s: f64) -> Self {
        let rates = Rates::new(params);
        let has_period = PeriodError::check(Law::Time, period_s).is_ok();
        let period_s = if has_period { period_s } else { 0.0 };
        let TimeStep { forgotten, level, increment } = rates.over(period_s);
        let bound = match rates.kernel {
            // Without forgetting there is no bound: as good as unknown.
            Kernel::Deflection => (rates.gain / rates.beta_per_s).min(UNKNOWN),
            Kernel::Rate => rates.gain,
        };
        let step = [forgotten, level, increment].map(S::gain_from_f64);
        Self { has_period, ..Self::of(rates, params.memory().gate, step, S::from_f64(bound)) }
    }

    /// The law of its rates and of coefficients that are rounded already, at a period: what a step forgets, adds per level and per increment; the largest m.
    pub(crate) fn of(rates: Rates<f64>, gate: Gate, step: [S::Gain; 3], bound: S) -> Self {
        Self::of_rates(rates.cast(), gate, step, bound)
    }

    /// [`of`](Self::of) with rates that are rounded already, too.
    pub(crate) fn of_rates(rates: Rates<S>, gate: Gate, step: [S::Gain; 3], bound: S) -> Self {
        let [forgotten, level, increment] = step;
        let Rates { kernel, gain, beta_per_s } = rates;
        Self { gain, beta_per_s, step: TimeStep { forgotten, level, increment }, bound, kernel, gate, has_period: true }
    }

    /// The largest m/T_A that a past within ±A can leave, its part without and its part with abs(θ)/A.
    fn bounds(&self) -> [S; 2] {
        [self.bound, if self.kernel == Kernel::Rate { self.bound } else { S::ZERO }]
    }

    fn rates(&self) -> Rates<S> {
        Rates { kernel: self.kernel, gain: self.gain, beta_per_s: self.beta_per_s }
    }

    /// The law without a sample period: a gear then refuses every sample that does not bring its own.
    #[cfg(feature = "block")]
    pub(crate) fn without_period(self) -> Self {
        Self { has_period: false, ..self }
    }

    /// The coefficients of a step and the largest m, as [`of`](Self::of) takes them.
    #[cfg(feature = "block")]
    pub(crate) fn coefficients(&self) -> ([S::Gain; 3], [S; 2]) {
        let TimeStep { forgotten, level, increment } = self.step;
        ([forgotten, level, increment], self.bounds())
    }

    /// The next memory as a function of the next deflection.
    #[inline]
    pub(crate) fn ahead(&self, frame: &Frame<S>, state: &TimeState<S>) -> Ahead<S> {
        Self::ahead_by(frame, state, &self.step)
    }

    fn ahead_by(frame: &Frame<S>, state: &TimeState<S>, step: &TimeStep<S::Gain>) -> Ahead<S> {
        let from = frame.fraction(state.theta);
        let (mut memory, mut carry) = (state.memory, state.carry);
        S::leak(&mut memory, &mut carry, step.forgotten, [(step.level, from), (step.increment, S::ZERO)]);
        Ahead { from, memory, growth: step.growth() }
    }

    /// dm/du of one step, over T_A.
    pub(crate) fn growth(&self) -> S {
        self.step.growth()
    }

    /// αA/T_A: 1/s for kernel `deflection`, 1 for kernel `rate`.
    #[must_use]
    pub fn gain(&self) -> S {
        self.gain
    }

    /// β, 1/s.
    #[must_use]
    pub fn beta_per_s(&self) -> S {
        self.beta_per_s
    }

    /// The factor between memory and torque.
    pub(crate) fn gate(&self) -> Gate {
        self.gate
    }

    #[inline]
    fn advance(frame: &Frame<S>, state: &mut TimeState<S>, theta: S, step: &TimeStep<S::Gain>) {
        let level = frame.fraction(state.theta);
        let increment = frame.fraction(theta - state.theta);
        S::leak(
            &mut state.memory,
            &mut state.carry,
            step.forgotten,
            [(step.level, level), (step.increment, increment)],
        );
        state.uncertainty = state.uncertainty.fade(step.forgotten);
        state.theta = theta;
    }

    /// A bound of the error of m at a sample before which nothing is known. That of a doubtful sample includes the stroke back from it, over what the next step keeps: that step
    /// reduces the bound by what it forgets.
    #[cold]
    #[inline(never)]
    fn unsure(&self, frame: &Frame<S>, memory: S, theta: S) -> S {
        let [fixed, per_fraction] = self.bounds();
        let u = frame.fraction(theta).abs();
        let unsure = memory.abs() + fixed + per_fraction * u.min(S::ONE);
        if !frame.is_doubtful(theta) {
            return unsure;
        }
        let TimeStep { forgotten, .. } = self.step;
        let kept = S::ONE.fade(forgotten);
        let stroke = if self.kernel == Kernel::Rate { self.bound } else { self.bound - self.bound.fade(forgotten) };
        unsure + ((u + S::ONE) * stroke).over(kept.max(S::from_f64(LEAST_KEPT)))
    }

    /// Steps to a sample that may be doubtful, or from one.
    fn advance_in_doubt(&self, frame: &Frame<S>, state: &mut TimeState<S>, theta: S, step: &TimeStep<S::Gain>) {
        let doubts = frame.is_doubtful(theta.abs().max(state.theta.abs()));
        let theta = frame.counted(theta);
        Self::advance(frame, state, theta, step);
        if doubts {
            state.uncertainty = self.unsure(frame, state.memory, theta);
        }
    }

    fn gated(&self, frame: &Frame<S>, memory: S, theta: S) -> S {
        if self.gate == Gate::Cycle { frame.gate(theta) * memory } else { memory }
    }
}

/// A memory that keeps less over a sample period is none.
const LEAST_KEPT: f64 = 1e-4;

impl<S: Float> Time<S> {
    /// [`ahead`](Self::ahead), `period_s` after the last sample.
    pub(crate) fn ahead_after(&self, frame: &Frame<S>, state: &TimeState<S>, period_s: S) -> Ahead<S> {
        Self::ahead_by(frame, state, &self.rates().over(period_s))
    }
}

impl<S: Float> VaryingPeriod<S> for Time<S> {
    #[inline]
    fn step_after<const N: usize>(&self, frame: &Frame<S>, state: &mut TimeState<S>, theta: S, period_s: S) {
        self.advance_in_doubt(frame, state, theta, &self.rates().over(period_s));
    }
}

impl<S: Scalar> MemoryLaw<S> for Time<S> {
    type State<const N: usize> = TimeState<S>;

    fn start<const N: usize>(&self, frame: &Frame<S>, theta: S) -> TimeState<S> {
        let theta = frame.counted(theta);
        let uncertainty = self.unsure(frame, S::ZERO, theta);
        TimeState { theta, memory: S::ZERO, carry: S::Carry::default(), uncertainty }
    }

    #[inline]
    fn step<const N: usize>(&self, frame: &Frame<S>, state: &mut TimeState<S>, theta: S) {
        self.advance_in_doubt(frame, state, theta, &self.step);
    }

    #[inline]
    fn fast_path<const N: usize>(&self, frame: &Frame<S>, state: &mut TimeState<S>, theta: S) -> bool {
        let within = frame.in_range(theta);
        if within {
            Self::advance(frame, state, theta, &self.step);
        }
        within
    }

    #[inline]
    fn torque<const N: usize>(&self, frame: &Frame<S>, state: &TimeState<S>, theta: S) -> S {
        self.gated(frame, state.memory, theta)
    }

    fn take_over<const N: usize>(
        &self,
        frame: &Frame<S>,
        (law, old_frame): (&Self, &Frame<S>),
        state: &TimeState<S>,
        theta: S,
    ) -> TimeState<S> {
        let (old, new) = (law.gain, self.gain);
        // A memory that was none tells nothing of a strong one.
        if law.kernel != self.kernel || old <= S::HALF * S::HALF * S::HALF * new {
            return MemoryLaw::<S>::start::<N>(self, frame, theta);
        }
        // m is proportional to α.
        let scale = new.over(old) * old_frame.rated().over(frame.rated());
        let [memory, uncertainty] = [state.memory, state.uncertainty].map(|part| part * scale);
        TimeState { memory, uncertainty, carry: S::Carry::default(), ..*state }
    }

    fn knows_time(&self) -> bool {
        true
    }

    fn has_period(&self) -> bool {
        self.has_period
    }

    fn start_spread<const N: usize>(&self, frame: &Frame<S>, state: &TimeState<S>, theta: S) -> S {
        self.gated(frame, state.uncertainty, theta)
    }

    fn start_uncertainty<const N: usize>(&self, frame: &Frame<S>, state: &TimeState<S>, theta: S) -> S {
        let [fixed, per_fraction] = self.bounds();
        let most = state.memory.abs() + fixed + per_fraction * frame.clamped_fraction(theta).abs();
        self.gated(frame, state.uncertainty.min(most), theta)
    }

    fn largest_spread(&self, frame: &Frame<S>) -> S {
        self.gated(frame, self.bound, S::ZERO)
    }
}
