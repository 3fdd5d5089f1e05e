//! What the joint is asked to do.

use std::f64::consts::{PI, TAU};

use super::plant::{Masses, Output};

/// A task, its length and what is judged of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Task {
    /// The link swings under gravity: judged by its angle.
    Track,
    /// The link is held and the gear shall carry a torque: judged by the torque.
    Press,
}

/// Length of both tasks, s.
pub(super) const DURATION_S: f64 = 24.0;
/// Judged from here on: one slow period lies behind, the memory is settled.
pub(super) const SETTLED_S: f64 = 8.0;

/// Reference at one time, output side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reference {
    pub angle_rad: f64,
    pub velocity: f64,
    pub acceleration: f64,
    pub torque_nm: f64,
}

/// Sum of two sines, the quicker one making nested reversals, faded in over one second: value and its first two derivatives.
fn two_sines(amplitudes: [f64; 2], rates_hz: [f64; 2], t: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (a, hz) in amplitudes.into_iter().zip(rates_hz) {
        let w = TAU * hz;
        let (sin, cos) = (w * t).sin_cos();
        sum[0] += a * sin;
        sum[1] += a * w * cos;
        sum[2] -= a * w * w * sin;
    }
    if t >= 1.0 {
        return sum;
    }
    let (sin, cos) = (PI * t).sin_cos();
    let fade = [0.5 * (1.0 - cos), 0.5 * PI * sin, 0.5 * PI * PI * cos];
    [
        fade[0] * sum[0],
        fade[0] * sum[1] + fade[1] * sum[0],
        fade[0] * sum[2] + 2.0 * fade[1] * sum[1] + fade[2] * sum[0],
    ]
}

impl Task {
    pub fn output(self) -> Output {
        match self {
            Self::Track => Output::Free,
            Self::Press => Output::Blocked,
        }
    }

    pub fn reference(self, masses: &Masses, rated_torque_nm: f64, t: f64) -> Reference {
        match self {
            Self::Track => {
                let [angle_rad, velocity, acceleration] = two_sines([1.0, 0.25], [0.125, 0.55], t);
                let torque_nm = masses.load_nm(angle_rad, acceleration);
                Reference { angle_rad, velocity, acceleration, torque_nm }
            }
            Self::Press => {
                let [share, ..] = two_sines([0.6, 0.25], [0.125, 0.55], t);
                Reference { angle_rad: 0.0, velocity: 0.0, acceleration: 0.0, torque_nm: share * rated_torque_nm }
            }
        }
    }
}
