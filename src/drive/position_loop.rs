//! Encoders and cascade of a servo, whatever is fed forward.

use super::pair::{EncoderPair, FromCounts, MISREAD_BEYOND, Reading, signed};
use super::servo::{ServoError, ServoSetup};
use super::{Cascade, CascadeState};
use crate::feedforward::{MotorEncoder, MotorSide};
use crate::scalar::{Extended, Float};

/// From where the motor should be to its torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PositionLoop<S: FromCounts> {
    pair: EncoderPair<S>,
    motor: MotorSide<S>,
    /// N·θ_zero in parts of a count: what the motor's encoder shows beside N·(q_o + θ).
    zero: i64,
    cascade: Cascade<S>,
    largest_deflection: S,
}

/// What it remembers.
#[derive(Clone)]
pub(super) struct PositionLoopState<S> {
    pub(super) cascade: CascadeState<S>,
    pub(super) seen: Reading<S>,
    /// Where the motor should be, of the period before.
    position: i64,
    /// The last counts were misread: `seen` is older.
    misread: bool,
}

impl<S: Float + FromCounts> PositionLoop<S> {
    /// Of a gear with this rated deflection.
    pub fn new(setup: &ServoSetup, rated: S) -> Result<Self, ServoError> {
        let ServoSetup { encoders, reference_counts_per_turn, gains, .. } = setup;
        let encoder = MotorEncoder {
            counts_per_turn: encoders.motor.counts_per_turn,
            ratio: encoders.ratio,
            reference_counts_per_turn: *reference_counts_per_turn,
            rated_deflection_rad: encoders.rated_deflection_rad,
        };
        let pair = EncoderPair::new(encoders)?;
        let whole = |x: u32| Extended::of_whole(x.into());
        let parts_per_turn =
            Extended::of_whole(MotorSide::<S>::PARTS.unsigned_abs() * u64::from(encoders.motor.counts_per_turn));
        // Below half a turn, which the pair has seen to.
        let zero = Extended::of_double(encoders.deflection_zero_rad).unwrap_or(Extended::ZERO).over(Extended::TURN);
        let zero = zero.times(whole(encoders.ratio.0)).over(whole(encoders.ratio.1)).times(parts_per_turn);
        Ok(Self {
            pair,
            motor: MotorSide::new(&encoder)?,
            zero: signed(encoders.deflection_zero_rad, zero),
            cascade: Cascade::new(gains)?,
            largest_deflection: S::from_f64(MISREAD_BEYOND) * rated,
        })
    }

    /// At power-up, from raw counts, standing at a position of the output.
    pub fn start(&self, motor: u32, output: u32, counts: i64) -> PositionLoopState<S> {
        PositionLoopState {
            cascade: CascadeState::default(),
            seen: self.pair.start(motor, output),
            position: self.position(counts),
            misread: false,
        }
    }

    /// Anew from raw counts; the torque begins at the last one.
    pub fn restart(&self, state: &mut PositionLoopState<S>, [motor, output]: [u32; 2], counts: i64, offset: S) {
        *state = PositionLoopState {
            cascade: state.cascade.restarted(),
            seen: self.pair.start(motor, output),
            position: self.position(counts).wrapping_add(self.motor.offset(offset)),
            misread: false,
        };
    }

    /// One period: a [position](Self::position), the offset to it and the torque to feed forward, to the torque of the motor.
    #[inline]
    pub fn period(
        &self,
        state: &mut PositionLoopState<S>,
        (position, offset, feed_forward): (i64, S, S),
        [motor, output]: [u32; 2],
    ) -> S {
        let position = core::mem::replace(&mut state.position, position.wrapping_add(self.motor.offset(offset)));
        let error = self.motor.error(position, &state.seen.motor);
        let misread = state.misread;
        let seen = self.pair.follow(&state.seen, motor, output);
        state.misread = !self.is_plausible(&seen);
        if !state.misread {
            state.seen = seen;
        }
        if misread {
            return self.cascade.refuse(&mut state.cascade);
        }
        self.cascade.step(&mut state.cascade, error, feed_forward)
    }

    /// q_m and q_o as the encoders say, within a turn.
    #[cfg(feature = "terms")]
    pub fn angles(&self, seen: &Reading<S>) -> [S; 2] {
        [self.pair.motor_angle(seen), self.pair.output_angle(seen)]
    }

    /// N·(q_o* + θ_zero) in [parts](MotorSide::PARTS).
    #[inline]
    pub fn position(&self, counts: i64) -> i64 {
        self.motor.position(counts, S::ZERO).wrapping_add(self.zero)
    }

    /// The motor's counts, over all turns, at a position with an offset.
    #[cfg(feature = "terms")]
    pub fn motor_counts(&self, position: i64, offset: S) -> i64 {
        position.wrapping_add(self.motor.offset(offset)).div_euclid(MotorSide::<S>::PARTS)
    }

    fn is_plausible(&self, seen: &Reading<S>) -> bool {
        seen.deflection.abs() <= self.largest_deflection
    }
}
