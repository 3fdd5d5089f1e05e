//! A servo on the published gear, and the counts of a joint that follows.

use gmhm::Params;
use gmhm::drive::{Gains, Mounting, Servo, ServoSetup, Setup};
use gmhm::feedforward::Settings;

use super::A;

pub const COUNTS: u32 = 1 << 20;
pub const REFERENCE_COUNTS: u32 = 1 << 30;
pub const PERIOD_S: f64 = 1e-3;
pub const LIMIT_NM: f32 = 2.0;
pub const RAMP_S: f64 = 0.1;

pub fn gains() -> Gains {
    Gains {
        period_s: PERIOD_S,
        position_per_s: 40.0,
        velocity_nms_per_rad: 0.05,
        integral_rad_per_s: 30.0,
        filter_rad_per_s: 900.0,
        limit_nm: f64::from(LIMIT_NM),
    }
}

pub fn setup() -> ServoSetup {
    let mounting = Mounting { counts_per_turn: COUNTS, reversed: false };
    ServoSetup {
        encoders: Setup {
            motor: mounting,
            output: mounting,
            ratio: (100, 1),
            deflection_zero_rad: 0.0,
            rated_deflection_rad: A,
        },
        reference_counts_per_turn: REFERENCE_COUNTS,
        gains: gains(),
        feed_forward: Settings { period_s: PERIOD_S, ramp_s: RAMP_S, ..Settings::default() },
    }
}

pub fn servo(params: &Params) -> Servo<f32> {
    Servo::new(params, &setup()).expect("a servo")
}

/// Counts within a turn of motor and output at an output angle and a deflection, rad.
pub fn counts(output_rad: f64, deflection_rad: f64) -> (u32, u32) {
    let within = |angle: f64| {
        let turns = angle / std::f64::consts::TAU;
        ((turns - turns.floor()) * f64::from(COUNTS)) as u32 % COUNTS
    };
    (within(100.0 * (output_rad + deflection_rad)), within(output_rad))
}
