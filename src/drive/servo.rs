//! A compensated servo: encoders, feed-forward of the gear, and the cascade, put together as a drive runs them.
//!
//! Once a control period, from the reference of the output (position, torque) and the counts of both encoders to the torque of the motor. The measurement that a period
//! works on is that of the period before, and it is held against the reference of its time.

use core::fmt;

use super::pair::{FromCounts, Reading, Setup, SetupError};
use super::position_loop::{PositionLoop, PositionLoopState};
use super::{Gains, GainsError};
use crate::feedforward::{Contribution, Controls, Demand, FeedForward, FeedForwardError, FeedForwardState, Settings};
use crate::inverse::Invertible;
use crate::memory::{AnyLaw, MemoryLaw};
use crate::params::Params;
use crate::scalar::Float;

/// What a servo is set to.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ServoSetup {
    /// The encoders and the ratio between them.
    pub encoders: Setup,
    /// Counts of a turn of the output in which its reference is given: any, such as 2^30.
    pub reference_counts_per_turn: u32,
    /// The cascade, at the motor's angle.
    pub gains: Gains,
    /// The feed-forward; its period is that of the cascade.
    pub feed_forward: Settings,
}

/// Why there is no servo.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum ServoError {
    /// The encoders do not go together.
    Encoders(SetupError),
    /// The gear cannot be fed forward.
    FeedForward(FeedForwardError),
    /// A gain of the cascade is none.
    Gains(GainsError),
}

impl fmt::Display for ServoError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Encoders(error) => error.fmt(f),
            Self::FeedForward(error) => error.fmt(f),
            Self::Gains(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for ServoError {}

impl From<SetupError> for ServoError {
    fn from(error: SetupError) -> Self {
        Self::Encoders(error)
    }
}

impl From<GainsError> for ServoError {
    fn from(error: GainsError) -> Self {
        Self::Gains(error)
    }
}

impl From<FeedForwardError> for ServoError {
    fn from(error: FeedForwardError) -> Self {
        Self::FeedForward(error)
    }
}

/// What a period is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reference<S> {
    /// q_o* in reference counts over all turns.
    pub counts: i64,
    /// T*, the torque that the gear shall carry, N·m.
    pub torque: S,
    /// Torque to feed forward to the motor, N·m.
    pub feed_forward: S,
}

/// A servo; what it remembers is apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Servo<S: FromCounts, L = AnyLaw<S>> {
    feed_forward: FeedForward<S, L>,
    position: PositionLoop<S>,
}

/// What the servo of one joint remembers, with room for `N` turning points.
#[derive(Clone)]
pub struct ServoState<S: Float<Carry = S>, const N: usize = 16, L: MemoryLaw<S> = AnyLaw<S>> {
    feed_forward: FeedForwardState<S, N, L>,
    position: PositionLoopState<S>,
}

impl<S: Float<Carry = S> + FromCounts> Servo<S> {
    /// A servo for a gear.
    ///
    /// # Errors
    /// [`ServoError`].
    pub fn new(params: &Params, setup: &ServoSetup) -> Result<Self, ServoError> {
        let settings = Settings { period_s: setup.gains.period_s, ..setup.feed_forward };
        Self::of_feed_forward(FeedForward::new(params, &settings)?, setup)
    }
}

impl<S: Float<Carry = S> + FromCounts, L: Invertible<S>> Servo<S, L> {
    /// A servo on a feed-forward that is set up already, such as that of a stored block ([`FeedForward::of_inverse`], `Parameters::feed_forward`). Its control period is that of the
    /// gains, for which the feed-forward must be made, too: its limits count periods. [`ServoSetup::feed_forward`] is not read.
    ///
    /// # Errors
    /// [`ServoError`].
    pub fn of_feed_forward(feed_forward: FeedForward<S, L>, setup: &ServoSetup) -> Result<Self, ServoError> {
        let position = PositionLoop::new(setup, feed_forward.inverse().gear().frame().rated())?;
        Ok(Self { feed_forward, position })
    }

    /// The state at power-up, from the raw counts of motor and output, standing at a position of the output in reference counts.
    #[must_use]
    pub fn start<const N: usize>(&self, motor: u32, output: u32, counts: i64) -> ServoState<S, N, L> {
        let position = self.position.start(motor, output, counts);
        ServoState { feed_forward: self.feed_forward.start(position.seen.deflection), position }
    }

    /// Goes on with a state that the servo `before` had: other parameters, settings or gains with the loop running. The encoders are the same. The torque begins at
    /// the last one: what the feed-forward would change comes within [`Settings::ramp_s`] and its slew limits, what the gains would within
    /// [`FADE_S`](super::cascade::FADE_S).
    pub fn take_over<const N: usize>(&self, before: &Self, state: &mut ServoState<S, N, L>) {
        self.feed_forward.take_over(&before.feed_forward, &mut state.feed_forward);
        state.position.cascade.bridge();
    }

    /// Starts anew from raw counts with the loop running: the gear's past is unknown, the torque begins at the last one.
    pub fn restart<const N: usize>(&self, state: &mut ServoState<S, N, L>, motor: u32, output: u32, counts: i64) {
        let offset = state.contribution().offset;
        self.position.restart(&mut state.position, [motor, output], counts, offset);
        self.feed_forward.restart(&mut state.feed_forward, state.position.seen.deflection);
    }

    /// One period: the raw counts that motor and output have at its start, to the torque that is to act in the next one, N·m, always within the limit.
    ///
    /// Input that is none is refused: [`FeedForward`] and [`Cascade`](super::Cascade) say how each goes on. Counts that give a deflection beyond [`MISREAD_BEYOND`](super::pair::MISREAD_BEYOND) rated ones, in
    /// whatever turn the motor is, were misread: the period that would work on them is one without input.
    #[inline]
    #[must_use]
    pub fn period<const N: usize>(
        &self,
        state: &mut ServoState<S, N, L>,
        controls: &Controls<S>,
        reference: &Reference<S>,
        motor: u32,
        output: u32,
    ) -> S {
        let demand = Demand { torque: reference.torque, deflection: state.position.seen.deflection };
        let offset = self.feed_forward.step(&mut state.feed_forward, controls, &demand).offset;
        let asked = (self.position.position(reference.counts), offset, reference.feed_forward);
        self.position.period(&mut state.position, asked, [motor, output])
    }
}

impl<S: Float<Carry = S> + FromCounts, const N: usize, L: MemoryLaw<S>> ServoState<S, N, L> {
    /// What the encoders said last.
    #[must_use]
    pub fn seen(&self) -> &Reading<S> {
        &self.position.seen
    }

    /// Whether the last period had no input to work on: it was not finite, or the counts were misread.
    #[must_use]
    pub fn is_refused(&self) -> bool {
        self.position.cascade.is_refused()
    }

    /// What the gear's feed-forward adds.
    #[must_use]
    pub fn contribution(&self) -> &Contribution<S> {
        self.feed_forward.contribution()
    }
}
