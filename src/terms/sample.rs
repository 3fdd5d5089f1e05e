//! What a term may see of a moment.

use super::registry::Coordinate;
use crate::scalar::Float;

/// One sample of the joint. What no term of the stack needs may be left at 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sample<S> {
    /// t, s.
    pub time: S,
    /// Time since the last sample, s.
    pub period: S,
    /// q_m, rad. It may be reduced to one turn, which keeps the digits of `f32`, unless a term has orders that are no integers.
    pub motor_angle: S,
    /// q_o, rad. It may be reduced to one turn as well.
    pub output_angle: S,
    /// θ, rad: as measured, corrected before torque terms see it.
    pub deflection: S,
    /// θ̇, rad/s.
    pub deflection_rate: S,
    /// v of MODEL.md section 7, rad/s: q̇_m/N with the torque taken on the motor side where that angle is measured, else q̇_o.
    pub velocity: S,
    /// v̇, rad/s².
    pub acceleration: S,
    /// Θ, °C.
    pub temperature: S,
    /// T_base = f + z, N·m. A stack without gear sets gravity and inertia, or T_sim where a simulation is the base.
    pub base_torque: S,
    /// Its rate, N·m/s.
    pub base_torque_rate: S,
    /// q̇_m, rad/s.
    pub motor_velocity: S,
    /// q̇_o, rad/s, on whichever side the torque is taken.
    pub output_velocity: S,
    /// T_sim, another simulator's torque, N·m: recordings only.
    pub simulated_torque: S,
}

impl<S: Float> Sample<S> {
    /// Neither NaN nor infinite anywhere.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let Self { time, period, motor_angle, output_angle, deflection, deflection_rate, .. } = *self;
        let Self { velocity, acceleration, temperature, base_torque, base_torque_rate, .. } = *self;
        let Self { motor_velocity, output_velocity, simulated_torque, .. } = *self;
        let places = [time, period, motor_angle, output_angle, deflection, deflection_rate];
        let moves = [velocity, acceleration, temperature, base_torque, base_torque_rate];
        let others = [motor_velocity, output_velocity, simulated_torque];
        places.iter().chain(&moves).chain(&others).all(|x| x.is_finite())
    }

    /// The value of a coordinate; 0 for the travel since a reversal, which is no matter of one sample.
    #[must_use]
    pub fn coordinate(&self, coordinate: Coordinate) -> S {
        match coordinate {
            Coordinate::MotorAngle => self.motor_angle,
            Coordinate::OutputAngle => self.output_angle,
            Coordinate::OutputVelocity => self.velocity,
            Coordinate::Torque => self.base_torque,
            Coordinate::TorqueRate => self.base_torque_rate,
            Coordinate::DeflectionRate => self.deflection_rate,
            Coordinate::Acceleration => self.acceleration,
            Coordinate::Deflection => self.deflection,
            Coordinate::Reversal => S::ZERO,
            Coordinate::Temperature => self.temperature,
            Coordinate::Time => self.time,
        }
    }
}

/// The sign of x: −1, 0 or 1.
#[inline]
pub(super) fn sign<S: Float>(x: S) -> S {
    if x > S::ZERO {
        S::ONE
    } else if x < S::ZERO {
        -S::ONE
    } else {
        S::ZERO
    }
}

/// tanh(v/v_s), the smoothed sign of the velocity; the sign itself where v_s = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sense<S> {
    inverse_smoothing: S,
}

impl<S: Float> Sense<S> {
    /// With the smoothing velocity v_s ≥ 0, rad/s.
    pub fn new(smoothing: S) -> Self {
        let inverse = if smoothing > S::ZERO { smoothing.recip() } else { S::ZERO };
        // So small a smoothing that its inverse overflows is none.
        Self { inverse_smoothing: if inverse.is_finite() { inverse } else { S::ZERO } }
    }

    /// The sense of a velocity.
    #[inline]
    pub fn of(&self, velocity: S) -> S {
        if self.inverse_smoothing > S::ZERO { (velocity * self.inverse_smoothing).tanh() } else { sign(velocity) }
    }
}
