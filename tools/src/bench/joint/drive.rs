//! The drive: a standard cascade, position P over velocity PI over current, at 2 kHz on the motor's encoder. Encoder counts, feed-forward and servo are the
//! core's, in `f32`.

use std::f64::consts::TAU;

use gmhm::drive::{Cascade, CascadeState, EncoderPair, Gains, Mounting, Reading, Setup};
use gmhm::feedforward::{Controls, Demand, FeedForward, FeedForwardState, MotorEncoder, MotorSide};
use rand_chacha::ChaCha8Rng;

use super::super::{BenchError, sensors};
use super::compensator::{Compensation, Knowledge};
use super::plant::Masses;
use super::task::Reference;

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

/// The drive at work. It computes from the measurement of the period before, and its torque is applied in the period after.
pub(super) struct Drive {
    pair: EncoderPair<f32>,
    motor: MotorSide<f32>,
    feed_forward: FeedForward<f32>,
    feed_forward_state: FeedForwardState<f32>,
    controls: Controls<f32>,
    cascade: Cascade<f32>,
    cascade_state: CascadeState<f32>,
    noise: ChaCha8Rng,
    seen: Reading<f32>,
    position_before: i64,
    waiting_nm: f64,
    current_nm: f64,
}

impl Drive {
    /// At rest at zero.
    pub fn new(
        masses: &Masses,
        rated_torque_nm: f64,
        kind: Compensation,
        knowledge: &Knowledge,
        noise: ChaCha8Rng,
    ) -> Result<Self, BenchError> {
        let rated_deflection_rad = knowledge.params.rated_deflection_rad();
        let mounting = |counts_per_turn| Mounting { counts_per_turn, reversed: false };
        let setup = Setup {
            motor: mounting(MOTOR_COUNTS),
            output: mounting(LINK_COUNTS),
            ratio: (RATIO, 1),
            deflection_zero_rad: 0.0,
            rated_deflection_rad,
        };
        let encoder = MotorEncoder {
            counts_per_turn: MOTOR_COUNTS,
            ratio: (RATIO, 1),
            reference_counts_per_turn: REFERENCE_COUNTS,
            rated_deflection_rad,
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
        let pair = EncoderPair::new(&setup)?;
        let feed_forward = knowledge.feed_forward(kind, PLAY_RAD)?;
        Ok(Self {
            pair,
            motor: MotorSide::new(&encoder)?,
            feed_forward,
            feed_forward_state: feed_forward.start(0.0),
            controls: kind.controls(),
            cascade: Cascade::new(&gains),
            cascade_state: CascadeState::default(),
            noise,
            seen: pair.start(0, 0),
            position_before: 0,
            waiting_nm: 0.0,
            current_nm: 0.0,
        })
    }

    /// One control period: the torque to apply in it, N·m. Both angles are of the output side, rad.
    pub fn control(&mut self, reference: &Reference, masses: &Masses, motor_rad: f64, link_rad: f64) -> f64 {
        let demand = Demand { torque: reference.torque_nm as f32, deflection: self.seen.deflection };
        let offset = self.feed_forward.step(&mut self.feed_forward_state, &self.controls, &demand).offset;
        let counts = (reference.angle_rad / TAU * f64::from(REFERENCE_COUNTS)).round() as i64;
        // The measurement is a period old: it is held against the reference of its time.
        let position = std::mem::replace(&mut self.position_before, self.motor.position(counts, offset));
        let error = self.motor.error(position, &self.seen.motor);
        let feed_forward_nm = masses.motor_kgm2 * reference.acceleration
            + reference.torque_nm
            + KNOWN_FRICTION * masses.friction_nm(reference.velocity);
        let asked_nm = self.cascade.step(&mut self.cascade_state, error, feed_forward_nm as f32);
        let (motor, link) = (
            self.count(motor_rad * f64::from(RATIO), MOTOR_NOISE_RAD, MOTOR_COUNTS),
            self.count(link_rad, LINK_NOISE_RAD, LINK_COUNTS),
        );
        self.seen = self.pair.follow(&self.seen, motor, link);
        std::mem::replace(&mut self.waiting_nm, f64::from(asked_nm))
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
