//! A servo that feeds its plant terms forward: friction, ripple, kinematic error, gravity, temperature, by [`CompensatedFeedForward`].
//!
//! It is a [`Servo`](super::Servo) otherwise. A period also takes a [`Sample`] with what the terms need of the reference's speeds and acceleration, the time and the temperature
//! ([`Stack::needs`](crate::terms::Stack::needs)). The servo itself sets the period, the deflection and both angles, within a turn: those of the reference, free of delay and noise,
//! or those of the encoders along the measurement. Orders that are no integers have no angle within a turn.
//!
//! What the motor has to give beside the reference's torques is σ·J, J the torque of the terms of the joint: with σ = +1 it lies between motor and gear, with σ = −1 the gear carries it, too
//! (then it is in the offset as well).
//!
//! **Bad input.** As in [`Servo`](super::Servo); a sample that is not finite is one without a torque reference: what is fed forward of gear and terms fades with the gain.
//!
//! ```
//! use gmhm::drive::{CompensatedServo, Gains, Mounting, Reference, ServoSetup, Setup, TorqueShaft};
//! use gmhm::feedforward::{Controls, FeedForward, Settings};
//! use gmhm::terms::feedforward::CompensatedFeedForward;
//! use gmhm::terms::{Form, KeyInfo, Sample, Setting, Source, Stack, Value};
//! use gmhm::{Elastic, Memory, Params};
//!
//! # let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
//! # let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
//! # let params = Params::new(1.168e-3, elastic, memory)?;
//! # let gains = Gains {
//! #     period_s: 1e-3, position_per_s: 40.0, velocity_nms_per_rad: 0.05, integral_rad_per_s: 30.0, filter_rad_per_s: 900.0, limit_nm: 2.0,
//! # };
//! // Coulomb friction of 3 N·m at the output; on a drive a stored block brings the terms: `Prepared::terms`.
//! struct Friction;
//! impl Source<f32> for Friction {
//!     fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, f32>> {
//!         Some(Value::Number(if key.name == "torque_nm" { 3.0 } else { 0.01 }))
//!     }
//! }
//! let mut terms = Stack::<f32, 8>::of_gear(Setting { sigma: 1.0, c1: 2.4737e4, rated_deflection: 1.168e-3 });
//! terms.add("coulomb_friction", &Friction)?;
//!
//! let settings = Settings { period_s: 1e-3, ramp_s: 0.1, ..Settings::default() };
//! let feed_forward = CompensatedFeedForward::new(FeedForward::<f32>::new(&params, &settings)?, &terms);
//! let encoder = Mounting { counts_per_turn: 1 << 20, reversed: false };
//! let encoders = Setup { motor: encoder, output: encoder, ratio: (100, 1), deflection_zero_rad: 0.0, rated_deflection_rad: 1.168e-3 };
//! let setup = ServoSetup { encoders, reference_counts_per_turn: 1 << 30, gains, feed_forward: settings };
//! // Gains and limit are torques of the motor's shaft: of the friction it has to give a hundredth.
//! let servo = CompensatedServo::new(feed_forward, &setup, TorqueShaft::Motor)?;
//!
//! let mut state = servo.start::<16>(0, 0, 0, &Sample::default());
//! let controls = Controls { on: true, ..Controls::default() };
//! let sample = Sample { velocity: 0.5, temperature: 25.0, ..Sample::default() }; // of the reference, each period
//! for _ in 0..200 {
//!     let torque = servo.period(&mut state, &controls, &Reference::default(), &sample, 0, 0);
//!     assert!(torque.abs() <= 2.0);
//! }
//! assert!((state.compensation().joint_torque - 3.0).abs() < 1e-3);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

use super::pair::{FromCounts, Reading};
use super::position_loop::{PositionLoop, PositionLoopState};
use super::servo::{Reference, ServoError, ServoSetup};
use crate::feedforward::{Controls, Demand, Source};
use crate::inverse::Invertible;
use crate::memory::{AnyLaw, MemoryLaw};
use crate::scalar::{Extended, Float};
use crate::terms::feedforward::{CompensatedFeedForward, CompensatedFeedForwardState, Compensation};
use crate::terms::{Need, Sample};

/// The shaft at which a servo counts its torques: gains, limit and [`Reference::feed_forward`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TorqueShaft {
    /// The motor's: a torque of the model is N times as large.
    Motor,
    /// The output's, as the model counts.
    Output,
}

/// A servo with plant terms; what it remembers is apart.
#[derive(Debug, Clone, PartialEq)]
pub struct CompensatedServo<S: FromCounts + Float, L = AnyLaw<S>, const K: usize = 8> {
    feed_forward: CompensatedFeedForward<S, L, K>,
    position: PositionLoop<S>,
    /// Torque of the motor for a torque of the terms of the joint: σ, over N at the motor's shaft.
    torque_share: S,
    period_s: S,
    /// Whether a term turns with an angle.
    turns: bool,
    motor: Turn<S>,
    output: Turn<S>,
}

/// Counts over all turns as an angle within one.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Turn<S: FromCounts> {
    counts: i64,
    angle: S::Factor,
}

impl<S: FromCounts> Turn<S> {
    fn of(counts_per_turn: u32) -> Self {
        let angle = Extended::TURN.over(Extended::of_whole(counts_per_turn.into()));
        Self { counts: i64::from(counts_per_turn), angle: S::factor_of(angle) }
    }

    /// rad.
    fn angle(&self, counts: i64) -> S {
        // No turn is without counts, which the compiler cannot know.
        S::from_counts(counts.checked_rem_euclid(self.counts).unwrap_or(0) as i32, self.angle)
    }
}

/// What the servo of one joint remembers, with room for `N` turning points.
#[derive(Clone)]
pub struct CompensatedServoState<
    S: Float<Carry = S>,
    const N: usize = 16,
    L: MemoryLaw<S> = AnyLaw<S>,
    const K: usize = 8,
> {
    feed_forward: CompensatedFeedForwardState<S, N, L, K>,
    position: PositionLoopState<S>,
}

impl<S: Float<Carry = S> + FromCounts, L: Invertible<S>, const K: usize> CompensatedServo<S, L, K> {
    /// A servo on a feed-forward with terms. Its control period is that of the gains, for which the feed-forward must be made, too: its limits count periods. [`ServoSetup::feed_forward`] is not read.
    ///
    /// # Errors
    /// [`ServoError`].
    pub fn new(
        feed_forward: CompensatedFeedForward<S, L, K>,
        setup: &ServoSetup,
        torques: TorqueShaft,
    ) -> Result<Self, ServoError> {
        let position = PositionLoop::new(setup, feed_forward.feed_forward.inverse().gear().frame().rated())?;
        let (numerator, denominator) = setup.encoders.ratio;
        let share = match torques {
            TorqueShaft::Motor => Extended::of_whole(denominator.into()).over(Extended::of_whole(numerator.into())),
            TorqueShaft::Output => Extended::ONE,
        };
        let torque_share = S::of_extended(share) * feed_forward.stack.setting().sigma;
        let turns = [Need::MotorAngle, Need::OutputAngle].iter().any(|need| feed_forward.stack.needs(*need));
        Ok(Self {
            feed_forward,
            position,
            torque_share,
            turns,
            period_s: Extended::of_double(setup.gains.period_s).map_or(S::ZERO, S::of_extended),
            motor: Turn::of(setup.encoders.motor.counts_per_turn),
            output: Turn::of(setup.reference_counts_per_turn),
        })
    }

    /// The state at power-up, from the raw counts of motor and output, standing at a position of the output in reference counts.
    #[must_use]
    pub fn start<const N: usize>(
        &self,
        motor: u32,
        output: u32,
        counts: i64,
        sample: &Sample<S>,
    ) -> CompensatedServoState<S, N, L, K> {
        let position = self.position.start(motor, output, counts);
        let sample = self.complete(sample, &position.seen, self.position.angles(&position.seen));
        CompensatedServoState { feed_forward: self.feed_forward.start(&sample), position }
    }

    /// Goes on with a state that the servo `before` had: other parameters, terms or gains with the loop running, as [`Servo::take_over`](super::Servo::take_over) and
    /// [`CompensatedFeedForward::take_over`].
    pub fn take_over<const N: usize>(&self, before: &Self, state: &mut CompensatedServoState<S, N, L, K>) {
        self.feed_forward.take_over(&before.feed_forward.feed_forward, &mut state.feed_forward);
        state.position.cascade.bridge();
    }

    /// Starts anew from raw counts with the loop running: the gear's past is unknown, the torque begins at the last one.
    pub fn restart<const N: usize>(
        &self,
        state: &mut CompensatedServoState<S, N, L, K>,
        motor: u32,
        output: u32,
        counts: i64,
    ) {
        let offset = state.compensation().offset;
        self.position.restart(&mut state.position, [motor, output], counts, offset);
        self.feed_forward.restart(&mut state.feed_forward, state.position.seen.deflection);
    }

    /// One period, as [`Servo::period`](super::Servo::period), with what the terms need in the sample.
    #[inline]
    #[must_use]
    pub fn period<const N: usize>(
        &self,
        state: &mut CompensatedServoState<S, N, L, K>,
        controls: &Controls<S>,
        reference: &Reference<S>,
        sample: &Sample<S>,
        motor: u32,
        output: u32,
    ) -> S {
        let (seen, position) = (&state.position.seen, self.position.position(reference.counts));
        let angles = match controls.source {
            _ if !self.turns => [S::ZERO; 2],
            Source::Reference => {
                let motor = self.position.motor_counts(position, state.compensation().offset);
                [self.motor.angle(motor), self.output.angle(reference.counts)]
            }
            Source::Measurement => self.position.angles(seen),
        };
        let sample = self.complete(sample, seen, angles);
        let demand = Demand { torque: reference.torque, deflection: sample.deflection };
        let now = self.feed_forward.step(&mut state.feed_forward, controls, &demand, &sample);
        let torque = reference.feed_forward + self.torque_share * now.joint_torque;
        self.position.period(&mut state.position, (position, now.offset, torque), [motor, output])
    }

    /// What the caller says of a moment, and what the servo knows of it.
    fn complete(&self, sample: &Sample<S>, seen: &Reading<S>, [motor_angle, output_angle]: [S; 2]) -> Sample<S> {
        Sample { period: self.period_s, deflection: seen.deflection, motor_angle, output_angle, ..*sample }
    }
}

impl<S: Float<Carry = S> + FromCounts, const N: usize, L: MemoryLaw<S>, const K: usize>
    CompensatedServoState<S, N, L, K>
{
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

    /// What is fed forward of gear and terms.
    #[must_use]
    pub fn compensation(&self) -> &Compensation<S> {
        self.feed_forward.last()
    }
}
