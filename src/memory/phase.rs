//! Law `phase`: the memory integral in the paper's pseudo-time φ = asin(θ/A) (MODEL.md section 4).
//!
//! The memory is its steady state plus a transient n that only ever shrinks:
//!
//! ```text
//! m = q·d·g + s·u + n        q = hA, s = −eA (kernel deflection)     q = Aωe, s = Aωh (kernel rate)
//! n ← n·e^(−ρ·abs(Δφ))       and n ← n + q·g·(d_old − d_new) where the direction d turns
//! ```
//!
//! Rate-independent, transient included: the paper's model for any sampled path within ±A. Outside, m stands still.
//! Known limits: small loops about a bias drift before they close (no return-point memory), and the law can be inverted on a part of
//! the range only.
//!
//! Storing n instead of m keeps rounding relative to the transient: errors do not accumulate over samples.

use super::{Frame, MemoryLaw, UNKNOWN, VaryingPeriod};
use crate::params::{Gate, Kernel, Params};
use crate::scalar::{Float, Scalar};

/// The coefficients of law `phase`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Phase<S> {
    /// What d·g is multiplied by in the steady state, over T_A.
    pub quadrature: S,
    /// What u is multiplied by in the steady state, over T_A.
    pub in_phase: S,
    /// Decay per radian of pseudo-time, ρ = β/ω.
    pub rho: S,
    /// The factor between memory and torque.
    pub gate: Gate,
}

/// The memory of law `phase`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseState<S> {
    theta: S,
    /// sin φ and cos φ of the last sample.
    u: S,
    g: S,
    /// d: −1, 0 before the first movement, 1.
    direction: S,
    transient: S,
    uncertainty: S,
}

impl<S: Scalar> PhaseState<S> {
    fn memory(&self, law: &Phase<S>) -> S {
        law.quadrature * self.direction * self.g + law.in_phase * self.u + self.transient
    }

    /// sin φ and cos φ of the last sample.
    pub(crate) fn point(&self) -> (S, S) {
        (self.u, self.g)
    }

    /// The transient that a movement in a direction (±1) starts from: another one where the movement turns.
    pub(crate) fn transient_towards(&self, law: &Phase<S>, direction: S) -> S {
        self.transient + law.quadrature * self.g * (self.direction - direction)
    }
}

impl<S: Scalar> Phase<S> {
    /// The coefficients of a gear, whatever the law that its parameters name. ω = 0 has no pseudo-time decay to speak of:
    /// the memory then forgets at once.
    #[must_use]
    pub fn new(params: &Params) -> Self {
        let memory = params.memory();
        let a = params.rated_deflection_rad() / params.torque_scale_nm();
        let (e, h) = (memory.e() * a, memory.h() * a);
        let (quadrature, in_phase) = match memory.kernel {
            Kernel::Deflection => (h, -e),
            Kernel::Rate => (memory.omega_per_s * e, memory.omega_per_s * h),
        };
        Self {
            quadrature: S::from_f64(quadrature),
            in_phase: S::from_f64(in_phase),
            rho: S::from_f64(memory.rho().min(f64::from(f32::MAX))),
            gate: memory.gate,
        }
    }
}

impl<S: Float> Phase<S> {
    /// The largest m/T_A that a past within ±A can leave: α·A/β for kernel `deflection`, 2·α·A for kernel `rate`; with little decay as good as unknown.
    #[cold]
    #[inline(never)]
    fn largest_memory(&self) -> S {
        let (s, q) = (self.in_phase, self.quadrature);
        let largest = (s * s + q * q).over(s.abs());
        // s is below zero for kernel `deflection`. Infinite or NaN without decay.
        (if s > S::ZERO { largest + largest } else { largest }).min(S::from_f64(UNKNOWN))
    }

    /// Nothing of the past is known.
    #[cold]
    #[inline(never)]
    fn doubt(&self, state: &mut PhaseState<S>) {
        state.uncertainty = state.memory(self).abs() + self.largest_memory();
    }

    /// Moves to a deflection, of which u = sin φ and g = cos φ are given.
    #[inline]
    fn advance(&self, state: &mut PhaseState<S>, theta: S, u: S, g: S) {
        let direction = if theta > state.theta {
            S::ONE
        } else if theta < state.theta {
            -S::ONE
        } else {
            return;
        };
        if direction != state.direction {
            state.transient = state.transient_towards(self, direction);
            state.direction = direction;
        }
        let kept = (-(self.rho * phase_step(state.u, state.g, u, g))).exp();
        state.transient = state.transient * kept;
        state.uncertainty = state.uncertainty * kept;
        state.theta = theta;
        state.u = u;
        state.g = g;
    }
}

/// The angle from (u_0, g_0) to (u, g) on the unit circle, in [0, π].
#[inline]
pub(crate) fn phase_step<S: Float>(u0: S, g0: S, u: S, g: S) -> S {
    let sine = (u * g0 - u0 * g).abs();
    let cosine = u * u0 + g * g0;
    // Near 1 the arcsine loses digits, and past a right angle it is the wrong branch.
    if sine < S::HALF && cosine > S::ZERO { sine.asin_of_small() } else { sine.atan2(cosine) }
}

impl<S: Float> VaryingPeriod<S> for Phase<S> {}

impl<S: Float> MemoryLaw<S> for Phase<S> {
    type State<const N: usize> = PhaseState<S>;

    #[inline(always)]
    fn start<const N: usize>(&self, frame: &Frame<S>, theta: S) -> PhaseState<S> {
        let (u, g) = (frame.clamped_fraction(theta), frame.gate(theta));
        let transient = -(self.in_phase * u);
        PhaseState { theta, u, g, direction: S::ZERO, transient, uncertainty: self.largest_memory() }
    }

    #[inline]
    fn step<const N: usize>(&self, frame: &Frame<S>, state: &mut PhaseState<S>, theta: S) {
        let doubts = frame.is_doubtful(theta.abs().max(state.theta.abs()));
        self.advance(state, theta, frame.clamped_fraction(theta), frame.gate(theta));
        if doubts {
            self.doubt(state);
        }
    }

    #[inline]
    fn fast_path<const N: usize>(&self, frame: &Frame<S>, state: &mut PhaseState<S>, theta: S) -> bool {
        // Beyond the tips the gate was closed.
        let within = frame.in_range(theta) && state.g > S::ZERO;
        if within {
            self.advance(state, theta, frame.fraction(theta), frame.gate(theta));
        }
        within
    }

    #[inline]
    fn torque<const N: usize>(&self, _frame: &Frame<S>, state: &PhaseState<S>, _theta: S) -> S {
        let memory = state.memory(self);
        if self.gate == Gate::Cycle { state.g * memory } else { memory }
    }

    fn take_over<const N: usize>(
        &self,
        frame: &Frame<S>,
        (law, _): (&Self, &Frame<S>),
        state: &PhaseState<S>,
        theta: S,
    ) -> PhaseState<S> {
        let size = |law: &Self| law.in_phase.abs() + law.quadrature.abs();
        let (old, new) = (size(law), size(self));
        // A memory that was none tells nothing of a strong one.
        if old <= S::HALF * S::HALF * new {
            return MemoryLaw::<S>::start::<N>(self, frame, theta);
        }
        // The transient is as large beside the steady state as it was.
        let scale = new.over(old);
        let (u, g) = (frame.clamped_fraction(theta), frame.gate(theta));
        let [transient, uncertainty] = [state.transient, state.uncertainty].map(|part| part * scale);
        PhaseState { u, g, transient, uncertainty, ..*state }
    }

    fn start_uncertainty<const N: usize>(&self, frame: &Frame<S>, state: &PhaseState<S>, theta: S) -> S {
        self.start_spread::<N>(frame, state, theta)
    }

    fn start_spread<const N: usize>(&self, _frame: &Frame<S>, state: &PhaseState<S>, _theta: S) -> S {
        if self.gate == Gate::Cycle { state.g * state.uncertainty } else { state.uncertainty }
    }

    fn largest_spread(&self, frame: &Frame<S>) -> S {
        // The gate as rounding leaves it; it is 1.
        frame.gate(S::ZERO) * self.largest_memory()
    }
}
