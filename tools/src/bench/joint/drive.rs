//! The drive: a standard cascade, position P over velocity PI over current, at 2 kHz on the motor's encoder. Encoder counts, feed-forward and servo are the
//! core's, in `f32`, here or on a drive at the end of a line.

use std::f64::consts::TAU;

use gmhm::drive::lockstep::{self, Period, Start};
use gmhm::drive::{Gains, Mounting, ServoSetup, Setup};
use gmhm::feedforward::Settings;
use rand_chacha::ChaCha8Rng;

use super::super::error::BenchError;
use super::super::sensors;
use super::compensator::{Compensation, Knowledge};
use super::plant::Masses;
use super::task::Reference;
use crate::device::Lockstep;

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
/// Share of the motor's friction that the drive knows and feeds forward.
const KNOWN_FRICTION: f64 = 0.8;

/// Encoders, counts a turn, and their noise, rad rms at their own shafts.
const MOTOR_COUNTS: u32 = 1 << 20;
const MOTOR_NOISE_RAD: f64 = 5e-6;
const LINK_COUNTS: u32 = 1 << 24;
const LINK_NOISE_RAD: f64 = 0.5e-6;
/// N. Everything else in the joint is counted on the output side.
const RATIO: u32 = 100;
/// Counts of the output's reference.
const REFERENCE_COUNTS: u32 = 1 << 30;
/// Input play along the measurement, rad: eight times the noise of the deflection.
const PLAY_RAD: f64 = 8.0 * LINK_NOISE_RAD;

/// Who computes what the drive computes.
pub(super) enum Servo<'a> {
    /// This host.
    Here(Box<lockstep::Drive>),
    /// A drive at the end of a line.
    There(&'a mut Lockstep),
}

impl Servo<'_> {
    /// This host's own.
    pub fn here() -> Self {
        Self::Here(Box::default())
    }

    fn torque_nm(&mut self, request: &[u8]) -> Result<f32, BenchError> {
        let answer = match self {
            Self::Here(drive) => drive.answer(request),
            Self::There(line) => Some(line.ask(request)?),
        };
        answer.and_then(|answer| lockstep::torque(&answer)).ok_or(BenchError::DriveRefused)
    }
}

/// The drive at work. It computes from the measurement of the period before, and its torque is applied in the period after.
pub(super) struct Drive<'a> {
    servo: Servo<'a>,
    noise: ChaCha8Rng,
    waiting_nm: f64,
    current_nm: f64,
}

impl<'a> Drive<'a> {
    /// At rest at zero.
    pub fn new(
        masses: &Masses,
        rated_torque_nm: f64,
        kind: Compensation,
        knowledge: &Knowledge,
        noise: ChaCha8Rng,
        mut servo: Servo<'a>,
    ) -> Result<Self, BenchError> {
        let params = knowledge.known(kind, PLAY_RAD)?;
        let mounting = |counts_per_turn| Mounting { counts_per_turn, reversed: false };
        let encoders = Setup {
            motor: mounting(MOTOR_COUNTS),
            output: mounting(LINK_COUNTS),
            ratio: (RATIO, 1),
            deflection_zero_rad: 0.0,
            rated_deflection_rad: params.rated_deflection_rad(),
        };
        // Torques of the output side over angles of the motor.
        let gains = Gains {
            period_s: PERIOD_S,
            position_per_s: POSITION_GAIN_PER_S,
            velocity_nms_per_rad: VELOCITY_BANDWIDTH * masses.motor_kgm2 / f64::from(RATIO),
            integral_rad_per_s: INTEGRAL_CORNER,
            filter_rad_per_s: FILTER_CORNER,
            limit_nm: 3.0 * rated_torque_nm,
        };
        let feed_forward = Settings { period_s: PERIOD_S, ramp_s: 0.5, ..Settings::default() };
        let setup = ServoSetup { encoders, reference_counts_per_turn: REFERENCE_COUNTS, gains, feed_forward };
        let start = Start { params, setup, controls: kind.controls() };
        // A drive far away could not say why.
        start.servo()?;
        servo.torque_nm(&start.encode())?;
        Ok(Self { servo, noise, waiting_nm: 0.0, current_nm: 0.0 })
    }

    /// One control period: the torque to apply in it, N·m. Both angles are of the output side, rad.
    pub fn control(
        &mut self,
        reference: &Reference,
        masses: &Masses,
        motor_rad: f64,
        link_rad: f64,
    ) -> Result<f64, BenchError> {
        let feed_forward_nm = masses.motor_kgm2 * reference.acceleration
            + reference.torque_nm
            + KNOWN_FRICTION * masses.friction_nm(reference.velocity);
        let motor = self.count(motor_rad * f64::from(RATIO), MOTOR_NOISE_RAD, MOTOR_COUNTS);
        let output = self.count(link_rad, LINK_NOISE_RAD, LINK_COUNTS);
        let reference = gmhm::drive::Reference {
            counts: (reference.angle_rad / TAU * f64::from(REFERENCE_COUNTS)).round() as i64,
            torque: reference.torque_nm as f32,
            feed_forward: feed_forward_nm as f32,
        };
        let asked_nm = self.servo.torque_nm(&Period { reference, motor, output }.encode())?;
        Ok(std::mem::replace(&mut self.waiting_nm, f64::from(asked_nm)))
    }

    /// An angle with noise, in counts of one turn.
    fn count(&mut self, angle_rad: f64, noise_rad: f64, counts: u32) -> u32 {
        let mut angle = [angle_rad];
        sensors::white(noise_rad, &mut angle, &mut self.noise);
        (angle[0] / TAU * f64::from(counts)).round().rem_euclid(f64::from(counts)) as u32
    }

    /// The motor torque `step_s` on: the current follows with its lag. N·m.
    pub fn torque_nm(&mut self, asked_nm: f64, step_s: f64) -> f64 {
        self.current_nm += step_s / CURRENT_LAG_S * (asked_nm - self.current_nm);
        self.current_nm
    }
}
