//! The drive: a standard cascade, position P over velocity PI over current, at 2 kHz on the motor's encoder.

use std::f64::consts::TAU;

use super::plant::Masses;

/// Control period, s.
pub(super) const PERIOD_S: f64 = 5e-4;

/// Position gain, 1/s.
const POSITION_GAIN_PER_S: f64 = 60.0;
/// Bandwidth of the velocity loop, rad/s.
const VELOCITY_BANDWIDTH: f64 = 400.0;
/// Corner of its integral part, rad/s.
const INTEGRAL_CORNER: f64 = 60.0;
/// Corner of the velocity filter, rad/s.
const FILTER_CORNER: f64 = TAU * 300.0;
/// Time constant of the current loop, s.
const CURRENT_LAG_S: f64 = 3e-4;
/// Encoders, counts a turn: on the motor, of which one turn is 1/100 of the output's, and on the link.
const MOTOR_COUNTS: f64 = (1u64 << 20) as f64 * 100.0;
const LINK_COUNTS: f64 = (1u64 << 24) as f64;
/// Resolution of the deflection that the drive sees, rad.
pub(super) const DEFLECTION_RESOLUTION_RAD: f64 = TAU / LINK_COUNTS;

/// What the drive is asked for, on the output side.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Command {
    pub motor_rad: f64,
    /// Feed-forward torque, N·m.
    pub torque_nm: f64,
}

/// What the drive measures.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Measured {
    pub motor_rad: f64,
    pub link_rad: f64,
}

impl Measured {
    /// The encoders' counts, in rad.
    pub fn of(motor_rad: f64, link_rad: f64) -> Self {
        let count = |angle: f64, counts: f64| (angle / TAU * counts).round() / counts * TAU;
        Self { motor_rad: count(motor_rad, MOTOR_COUNTS), link_rad: count(link_rad, LINK_COUNTS) }
    }
}

/// The cascade with its delays: it computes from the measurement of the period before, and its torque is applied in the period after.
#[derive(Debug, Clone)]
pub(super) struct Cascade {
    gain_nms: f64,
    limit_nm: f64,
    command_before: Command,
    error_before: f64,
    velocity_error: f64,
    integral_nm: f64,
    waiting_nm: f64,
    current_nm: f64,
}

impl Cascade {
    pub fn new(masses: &Masses, rated_torque_nm: f64) -> Self {
        Self {
            gain_nms: VELOCITY_BANDWIDTH * masses.motor_kgm2,
            limit_nm: 3.0 * rated_torque_nm,
            command_before: Command::default(),
            error_before: 0.0,
            velocity_error: 0.0,
            integral_nm: 0.0,
            waiting_nm: 0.0,
            current_nm: 0.0,
        }
    }

    /// One control period.
    pub fn control(&mut self, command: &Command, measured: &Measured) {
        // The measurement is a period old: it is held against the command of its time, and both go through the same difference and filter.
        let late = std::mem::replace(&mut self.command_before, *command);
        let position_error = late.motor_rad - measured.motor_rad;
        let raw = (position_error - self.error_before) / PERIOD_S;
        self.error_before = position_error;
        self.velocity_error += (1.0 - (-FILTER_CORNER * PERIOD_S).exp()) * (raw - self.velocity_error);
        let error = self.velocity_error + POSITION_GAIN_PER_S * position_error;
        let asked = command.torque_nm + self.gain_nms * error + self.integral_nm;
        self.waiting_nm = asked.clamp(-self.limit_nm, self.limit_nm);
        if asked == self.waiting_nm {
            self.integral_nm += self.gain_nms * INTEGRAL_CORNER * PERIOD_S * error;
        }
    }

    /// The motor torque `step_s` on: the current follows with its lag.
    pub fn torque_nm(&mut self, asked_nm: f64, step_s: f64) -> f64 {
        self.current_nm += step_s / CURRENT_LAG_S * (asked_nm - self.current_nm);
        self.current_nm
    }

    /// What the last period asked for, to be applied in the next.
    pub fn asked_nm(&self) -> f64 {
        self.waiting_nm
    }
}
