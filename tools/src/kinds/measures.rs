//! The measures of a recording that hidden effects are scaled by.

use std::f64::consts::TAU;

use crate::physics::signals::rate;
use crate::recording::{Recording, Samples};

/// Measures of a noise-free recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measures {
    /// Its length, s.
    pub duration_s: f64,
    /// Rows a second.
    pub sample_rate_hz: f64,
    /// The largest deflection, rad.
    pub deflection_rad: f64,
    /// The largest torque, N·m.
    pub torque_nm: f64,
    /// The largest velocity, rad/s.
    pub velocity: f64,
    /// The largest acceleration, rad/s².
    pub acceleration: f64,
    /// The largest rate of the deflection, rad/s.
    pub deflection_rate: f64,
    /// The largest rate of the torque, N·m/s.
    pub torque_rate: f64,
    /// The largest speed of the motor, turns/s.
    pub motor_turns_per_s: f64,
    /// The lowest and highest motor angle, rad.
    pub motor_angle: (f64, f64),
    /// The lowest and highest output angle, rad.
    pub output_angle: (f64, f64),
    /// The lowest and highest temperature, °C.
    pub temperature_c: (f64, f64),
}

impl Measures {
    /// The measures of a recording.
    pub fn of(recording: &Recording) -> Self {
        let column = |values: &Option<Samples>| values.clone().unwrap_or_else(|| vec![0.0; recording.len()].into());
        let time = &recording.time_s;
        let theta = column(&recording.deflection_rad);
        let torque = column(&recording.torque);
        let velocity = column(&recording.velocity_out_rad_per_s);
        let motor = column(&recording.theta_in_rad);
        let duration_s = time[time.len() - 1] - time[0];
        Self {
            duration_s,
            sample_rate_hz: (time.len() - 1) as f64 / duration_s,
            deflection_rad: largest(&theta),
            torque_nm: largest(&torque),
            velocity: largest(&velocity),
            acceleration: largest(&rate(&velocity, time)),
            deflection_rate: largest(&rate(&theta, time)),
            torque_rate: largest(&rate(&torque, time)),
            motor_turns_per_s: largest(&rate(&motor, time)) / TAU,
            motor_angle: extremes(&motor),
            output_angle: extremes(&column(&recording.theta_out_rad)),
            temperature_c: extremes(&column(&recording.temperature_c)),
        }
    }

    /// How far the temperature rises, K.
    pub fn warming_k(&self) -> f64 {
        self.temperature_c.1 - self.temperature_c.0
    }

    /// Torque over deflection, N·m/rad.
    pub fn stiffness(&self) -> f64 {
        self.torque_nm / self.deflection_rad
    }

    /// The highest order of the motor turn that still has six samples a period.
    pub fn highest_order(&self) -> f64 {
        if self.motor_turns_per_s > 0.0 { self.sample_rate_hz / (6.0 * self.motor_turns_per_s) } else { f64::INFINITY }
    }
}

fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &x| (x.min(a), x.max(b)))
}

fn largest(values: &[f64]) -> f64 {
    let (low, high) = extremes(values);
    high.max(-low)
}
