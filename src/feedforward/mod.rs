//! The feed-forward of a joint: from the torque that the gear shall carry to an offset of the motor's position, and to the hysteresis torque.
//!
//! A drive that makes its link follow a reference has to wind up the gear by θ*, the deflection under the reference torque T* (inertia, gravity and contact
//! of the link). Once a control period it asks [`FeedForward::step`] for
//!
//! | of the [`Contribution`] | for a controller that |
//! |---|---|
//! | `offset`, θ* of the [inverse](crate::inverse) | positions the motor: its reference becomes N·(q_o* + θ*), by [`MotorSide`] in integer counts |
//! | `hysteresis`, z | compensates the elastic torque f already |
//!
//! **Reference or measurement.** The memory follows the torque reference (without noise or delay: the default), or the measured deflection, from which T* is
//! then one step ahead. Along the measurement every flicker of the encoders is a reversal: give the parameters a `reversal_play_rad` of some times their noise.
//!
//! **Gain.** Both contributions are multiplied by a gain that moves towards the ratio (0 to 1; 0 while off) in no less than [`Settings::ramp_s`] from 0 to 1, so that
//! switching makes no step: a period adds at most Δ/ramp of the contribution. What another source would change comes as slowly. Then each is limited in its
//! change, whatever the cause. The memory goes on while the contribution is off.
//!
//! **Bad input.** Where the torque or the measured deflection is NaN, infinite or absurd, or [quarantined](crate::Gear::with_largest_step), the memory stays as it was and
//! the last good contribution fades with the gain; it comes back with the gain.
//!
//! **Other parameters, another start.** [`FeedForward::take_over`] and [`FeedForward::restart`] change them while the loop runs: the contribution goes on from where it is, what is
//! between the two fades within [`Settings::ramp_s`] and the slew limits. Reversals keep their deflections, their torques are computed anew.
//!
//! **Start.** After power-up the loop y (z without its single-valued part z_s) is known within ±U only ([`Gear::start_spread`](crate::Gear::start_spread)),
//! U_0 = hA for a gear at θ = 0. It enters with the weight
//!
//! ```text
//! w = 1 − (U/U_0)²        θ* → θ* + (1 − w)·y/f′(θ*)        z → z_s + w·y
//! ```
//!
//! the share of its variance that the strokes so far explain. w = 0 leaves the single-valued deflection (within a twentieth), which is never in doubt; w = 1 the
//! whole. Over all pasts the largest error of the first stroke is less than with w = 0 or w = 1 throughout.
//!
//! Any scalar will do: fixed point through [`FeedForward::of`] with a law of its own, as its inverse. It stays within 2e-7 of the `f64` contribution, `f32` within 1e-6 (of the rated
//! deflection and torque, as long as the torque is away from the tips).
//!
//! ```
//! use gmhm::feedforward::{Controls, Demand, FeedForward, Settings, Source};
//! use gmhm::{Elastic, Inverse, Memory, Params};
//!
//! let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
//! let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
//! let params = Params::new(1.168e-3, elastic, memory)?;
//!
//! let settings = Settings { period_s: 1e-3, ramp_s: 0.5, largest_rate_rad_per_s: 2.0, ..Settings::default() };
//! let feed_forward = FeedForward::<f32>::new(&params, &settings)?;
//! let mut state = feed_forward.start::<16>(0.0);
//! let controls = Controls { on: true, source: Source::Reference, ratio: 1.0 };
//! for k in 1..=2000 {
//!     let torque = 0.01 * k as f32; // N·m, up to 20
//!     let contribution = feed_forward.step(&mut state, &controls, &Demand { torque, deflection: 0.0 });
//!     assert!(contribution.gain <= 0.0021 * k as f32);
//! }
//! assert!((state.contribution().offset - 0.8e-3).abs() < 0.1e-3); // rad at the output: times N for the motor
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

mod bridge;
mod motor;
mod settings;

pub use motor::{MotorEncoder, MotorSide};
pub use settings::{FeedForwardError, Limits, Settings};

use crate::gear::State;
use crate::inverse::{Inverse, Invertible, Solution};
use crate::memory::{AnyLaw, Frame, MemoryLaw};
use crate::params::Params;
use crate::scalar::{Float, Scalar};
pub(crate) use bridge::Bridge;
use settings::Steps;

/// What the memory follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Source {
    /// The torque reference.
    #[default]
    Reference,
    /// The measured deflection.
    Measurement,
}

/// What may be changed from one period to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Controls<S> {
    /// Off, the contribution fades to nothing; the memory goes on.
    pub on: bool,
    /// What the memory follows.
    pub source: Source,
    /// Share of the contribution, 0 to 1. What lies outside counts as the nearer end, NaN as 0.
    pub ratio: S,
}

impl<S: Scalar> Default for Controls<S> {
    /// Off, from the reference, whole.
    fn default() -> Self {
        Self { on: false, source: Source::Reference, ratio: S::ONE }
    }
}

/// What a period brings.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Demand<S> {
    /// T*, the torque that the gear shall carry: N·m for floats, a fraction of the rated torque for fixed point.
    pub torque: S,
    /// θ as measured: rad for floats, a fraction of the rated deflection for fixed point. Counts only along the measurement.
    pub deflection: S,
}

/// What is fed forward in a period, and why that much.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Contribution<S> {
    /// The share of θ* to add to the output's reference: rad for floats, a fraction of the rated deflection for fixed point. [`MotorSide`] brings it to the motor.
    pub offset: S,
    /// How much more that is than in the period before: over Δ it is the velocity to feed forward.
    pub change: S,
    /// The share of z: N·m for floats, a fraction of the rated torque for fixed point.
    pub hysteresis: S,
    /// The gain in force, 0 to the ratio.
    pub gain: S,
    /// The weight w of the loop, 0 at a start without a past, 1 once the past is known.
    pub certainty: S,
    /// The torque lies beyond the invertible range: θ* is its edge.
    pub saturated: bool,
    /// Torque or measured deflection was NaN, infinite, absurd or quarantined: θ* and z are those of the period before, the gain fades.
    pub refused: bool,
    /// A slew limit holds the contribution back.
    pub slewing: bool,
    /// What the memory followed for θ* and z.
    pub source: Source,
}

/// The feed-forward of a gear; what it remembers is apart, so that one serves many joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedForward<S: Scalar, L = AnyLaw<S>> {
    inverse: Inverse<S, L>,
    steps: Steps<S>,
}

/// What the feed-forward of one joint remembers, with room for `N` turning points.
#[derive(Clone)]
pub struct FeedForwardState<S: Scalar, const N: usize = 16, L: MemoryLaw<S> = AnyLaw<S>> {
    gear: State<S, N, L>,
    /// θ* and z before gain and limits.
    wanted: [S; 2],
    /// From another source or memory.
    bridge: Bridge<S, [S; 2]>,
    contribution: Contribution<S>,
}

impl<S: Float> FeedForward<S> {
    /// The feed-forward of the gear of these parameters, its law chosen by them.
    ///
    /// # Errors
    /// [`FeedForwardError`]: settings that cannot be, parameters without an inverse.
    pub fn new(params: &Params, settings: &Settings) -> Result<Self, FeedForwardError> {
        Self::of(params, AnyLaw::new(params, settings.period_s), settings)
    }
}

impl<S: Scalar, L: Invertible<S>> FeedForward<S, L> {
    /// The same with a law of one's own choice that follows the same parameters.
    ///
    /// # Errors
    /// [`FeedForwardError`]: settings that cannot be, parameters without an inverse.
    pub fn of(params: &Params, law: L, settings: &Settings) -> Result<Self, FeedForwardError> {
        let steps = settings.steps(params, &Frame::new(params))?;
        Ok(Self::with_steps(&Inverse::of(params, law, settings.period_s)?, steps))
    }

    /// The feed-forward of an inverse that is set up already, such as that of a prepared block: computed in the scalar alone, in a few instructions.
    ///
    /// # Errors
    /// [`FeedForwardError::Limit`].
    pub fn of_inverse(inverse: &Inverse<S, L>, limits: &Limits<S>) -> Result<Self, FeedForwardError>
    where
        S: Float,
    {
        let frame = inverse.gear().frame();
        Ok(Self::with_steps(inverse, limits.steps(frame.rated(), frame.torque_scale())?))
    }

    /// The gate along the measurement is that of the gear.
    fn with_steps(inverse: &Inverse<S, L>, (steps, largest): (Steps<S>, S)) -> Self {
        Self { inverse: inverse.with_largest_step(largest), steps }
    }

    /// By how much the gain may change in a period.
    #[cfg(feature = "terms")]
    pub(crate) fn gain_step(&self) -> S {
        self.steps.gain
    }

    /// The inverse that it rests on.
    #[must_use]
    pub fn inverse(&self) -> &Inverse<S, L> {
        &self.inverse
    }

    /// The state at power-up: off, the gear at the measured deflection, its past unknown.
    #[must_use]
    pub fn start<const N: usize>(&self, deflection: S) -> FeedForwardState<S, N, L> {
        FeedForwardState {
            gear: self.inverse.gear().start(deflection),
            wanted: [S::ZERO; 2],
            bridge: Bridge::none(),
            contribution: Contribution::default(),
        }
    }

    /// Goes on with a state that the feed-forward `before` had: other parameters with the loop running. The contribution does not jump.
    pub fn take_over<const N: usize>(&self, before: &Self, state: &mut FeedForwardState<S, N, L>) {
        self.inverse.gear().take_over(before.inverse.gear(), &mut state.gear);
        state.bridge.begin(state.wanted);
    }

    /// Starts the memory anew at the measured deflection, its past unknown, with the loop running. The contribution does not jump.
    pub fn restart<const N: usize>(&self, state: &mut FeedForwardState<S, N, L>, deflection: S) {
        state.gear = self.inverse.gear().start(deflection);
        state.bridge.begin(state.wanted);
    }

    /// One control period.
    #[inline]
    #[must_use]
    pub fn step<const N: usize>(
        &self,
        state: &mut FeedForwardState<S, N, L>,
        controls: &Controls<S>,
        demand: &Demand<S>,
    ) -> Contribution<S> {
        let gear = self.inverse.gear();
        let (solution, now) = match controls.source {
            Source::Reference => self.inverse.commit(&mut state.gear, demand.torque),
            Source::Measurement => {
                let now = gear.step(&mut state.gear, demand.deflection);
                (self.inverse.peek(&state.gear, demand.torque), now)
            }
        };
        let certainty = self.certainty(&state.gear);
        let status = state.gear.status();
        let refused = solution.refused || status.refused || status.quarantined;
        let last = state.contribution;
        if status.restarted || !refused && controls.source != last.source {
            state.bridge.begin(state.wanted);
        }
        if !refused {
            let mut wanted = [solution.theta, now.hysteresis];
            if certainty < S::ONE {
                self.doubt(&mut wanted, &solution, demand.torque, state.gear.theta(), S::ONE - certainty);
            }
            // What is more is the demand's, which changed at the same time: it makes the step that it would make anyway, and no gap grows from switch to switch.
            let most = [self.inverse.range(), gear.frame().torque_scale()];
            state.wanted = state.bridge.follow(wanted, self.steps.gain, Some(most));
        }
        // A NaN compares false.
        let feeds = controls.on && !refused && controls.ratio > S::ZERO;
        let ratio = if feeds { controls.ratio.min(S::ONE) } else { S::ZERO };
        let gain = towards(last.gain, ratio, self.steps.gain);
        let [offset, hysteresis] = state.wanted.map(|wanted| gain * wanted);
        let contribution = Contribution {
            offset: towards(last.offset, offset, self.steps.offset),
            hysteresis: towards(last.hysteresis, hysteresis, self.steps.torque),
            gain,
            certainty,
            saturated: solution.saturated,
            refused,
            source: if refused { last.source } else { controls.source },
            ..last
        };
        state.contribution = Contribution {
            change: contribution.offset - last.offset,
            slewing: contribution.offset != offset || contribution.hysteresis != hysteresis,
            ..contribution
        };
        state.contribution
    }

    /// w.
    #[inline]
    fn certainty<const N: usize>(&self, state: &State<S, N, L>) -> S {
        let unknown = self.inverse.gear().start_spread(state);
        if unknown <= S::ZERO {
            return S::ONE;
        }
        let at_rest = self.inverse.gear().largest_spread();
        if unknown >= at_rest {
            return S::ZERO;
        }
        let share = unknown.over(at_rest);
        (S::ONE - share) * (S::ONE + share)
    }

    /// Takes a part of the loop off θ* and off z, which is that of the deflection `here`.
    fn doubt(&self, [offset, hysteresis]: &mut [S; 2], solution: &Solution<S>, torque: S, here: S, doubt: S) {
        let (gear, frame) = (self.inverse.gear(), self.inverse.gear().frame());
        let single_valued = |theta: S| frame.torque(gear.law().single_valued(frame, theta));
        *hysteresis = *hysteresis - doubt * (*hysteresis - single_valued(here));
        let u = frame.fraction(solution.theta);
        let stiffness = gear.elastic().stiffness(u);
        // A spring that is soft here, beside its mean stiffness of about one, cannot tell the rest.
        if !solution.saturated && stiffness >= S::HALF * S::HALF * S::HALF {
            let loop_torque = torque - frame.torque(gear.elastic().torque(u)) - single_valued(solution.theta);
            let range = self.inverse.range();
            // A over the torque scale, in input over output units.
            let compliance = if S::SI { frame.rated().over(frame.torque_scale()) } else { S::ONE };
            *offset = (*offset + doubt * (loop_torque * compliance).over(stiffness)).clamp(-range, range);
        }
    }
}

/// From `from` to `to` by no more than `step`.
#[inline]
pub(crate) fn towards<S: Scalar>(from: S, to: S, step: S) -> S {
    let way = to - from;
    if way.abs() <= step { to } else { from + way.clamp(-step, step) }
}

impl<S: Scalar, const N: usize, L: MemoryLaw<S>> FeedForwardState<S, N, L> {
    /// What was fed forward last.
    #[must_use]
    pub fn contribution(&self) -> &Contribution<S> {
        &self.contribution
    }

    /// The gear as the feed-forward believes it to be.
    #[must_use]
    pub fn gear(&self) -> &State<S, N, L> {
        &self.gear
    }
}
