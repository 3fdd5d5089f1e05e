//! What the terms may see of a recording, derived once.

use std::borrow::Cow;

use gmhm::terms::{Need, Sample};

use crate::model::{Model, TorqueSide};
use crate::recording::Recording;

/// The signals of MODEL.md section 7 for every row; `None` where the recording does not tell.
///
/// | signal | from |
/// |---|---|
/// | deflection | `deflection_rad`, else both angles and the ratio; less the model's `deflection_zero_rad` |
/// | motor angle | `theta_in_rad`, else N·(q_o + θ), else N·q_o |
/// | output angle | `theta_out_rad`, else q_m/N − θ, else q_m/N (N = 1 where it is not given) |
/// | velocity | torque on the motor side, `theta_in_rad` recorded and the ratio known: the rate of q_m/N; else `velocity_out_rad_per_s`, else the rate of q_o |
/// | motor velocity | the rate of the motor angle |
/// | output velocity | `velocity_out_rad_per_s`, else the rate of the output angle |
/// | simulated torque | `torque_sim_nm` |
/// | acceleration | the [curvature] of the angle that the velocity comes from; of a recorded velocity its rate |
///
/// Rates are [`rate`]s.
#[derive(Debug, Clone, Default)]
pub struct Signals<'a> {
    /// t, s.
    pub time_s: &'a [f64],
    /// q_m, rad.
    pub motor_angle_rad: Option<Cow<'a, [f64]>>,
    /// q_o, rad.
    pub output_angle_rad: Option<Cow<'a, [f64]>>,
    /// θ_measured, rad.
    pub deflection_rad: Option<Cow<'a, [f64]>>,
    /// v, rad/s.
    pub velocity_rad_per_s: Option<Cow<'a, [f64]>>,
    /// v̇, rad/s².
    pub acceleration_rad_per_s2: Option<Vec<f64>>,
    /// Θ, °C.
    pub temperature_c: Option<&'a [f64]>,
    /// q̇_m, rad/s.
    pub motor_velocity_rad_per_s: Option<Vec<f64>>,
    /// q̇_o, rad/s.
    pub output_velocity_rad_per_s: Option<Cow<'a, [f64]>>,
    /// T_sim, N·m.
    pub torque_sim_nm: Option<&'a [f64]>,
    /// The path before the first row, without rates.
    pub past: Vec<Sample<f64>>,
}

impl<'a> Signals<'a> {
    /// The signals of a recording as a model sees it. A machine without a gear that records no angle, as a damper or a slide, moves by its deflection: that is its q_o.
    pub fn new(recording: &'a Recording, model: &Model) -> Self {
        let gear = &model.gear;
        let time_s = &*recording.time_s;
        let (input, output) = (recording.theta_in_rad.as_deref(), recording.theta_out_rad.as_deref());
        let recorded = recording.deflection_rad.as_deref();
        let ratio = gear.ratio;

        let raw: Option<Cow<'a, [f64]>> = match (recorded, input, output, ratio) {
            (Some(theta), ..) => Some(Cow::Borrowed(theta)),
            (None, Some(q_m), Some(q_o), Some(n)) => Some(combine(q_m, q_o, |q_m, q_o| q_m / n - q_o)),
            _ => None,
        };
        let motor_angle_rad = match (input, output, &raw, ratio) {
            (Some(q_m), ..) => Some(Cow::Borrowed(q_m)),
            (None, Some(q_o), Some(theta), Some(n)) => Some(combine(q_o, theta, |q_o, theta| n * (q_o + theta))),
            (None, Some(q_o), None, Some(n)) => Some(q_o.iter().map(|q| n * q).collect()),
            _ => None,
        };
        let output_angle_rad = match (output, input, &raw, ratio) {
            (Some(q_o), ..) => Some(Cow::Borrowed(q_o)),
            (None, Some(q_m), Some(theta), Some(n)) => Some(combine(q_m, theta, |q_m, theta| q_m / n - theta)),
            // Without an output encoder and a deflection the gear is taken as stiff.
            (None, Some(q_m), None, n) => Some(q_m.iter().map(|q| q / n.unwrap_or(1.0)).collect()),
            (None, None, Some(theta), _) if model.has_terms_alone() => Some(theta.clone()),
            _ => None,
        };
        let of_angle = |q: &[f64]| (Cow::Owned(rate(q, time_s)), curvature(q, time_s));
        let motion = match (gear.torque_side, input, ratio) {
            (TorqueSide::Motor, Some(q_m), Some(n)) => Some(of_angle(&q_m.iter().map(|q| q / n).collect::<Vec<f64>>())),
            _ => match &recording.velocity_out_rad_per_s {
                Some(v) => Some((Cow::Borrowed(&**v), rate(v, time_s))),
                None => output_angle_rad.as_deref().map(of_angle),
            },
        };
        let (velocity_rad_per_s, acceleration_rad_per_s2) = motion.unzip();
        let output_velocity_rad_per_s = match &recording.velocity_out_rad_per_s {
            Some(v) => Some(Cow::Borrowed(&**v)),
            None => output_angle_rad.as_deref().map(|q| Cow::Owned(rate(q, time_s))),
        };
        let zero = gear.deflection_zero_rad;
        let deflection_rad = raw.map(|theta| match zero {
            0.0 => theta,
            _ => theta.iter().map(|x| x - zero).collect(),
        });
        Self {
            time_s,
            acceleration_rad_per_s2,
            motor_velocity_rad_per_s: motor_angle_rad.as_deref().map(|q| rate(q, time_s)),
            output_velocity_rad_per_s,
            torque_sim_nm: recording.torque_sim_nm.as_deref(),
            motor_angle_rad,
            output_angle_rad,
            deflection_rad,
            velocity_rad_per_s,
            temperature_c: recording.temperature_c.as_deref(),
            past: recording.past.as_deref().map(|past| path(&Signals::new(past, model))).unwrap_or_default(),
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// True without rows.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Whether the recording tells a signal. The gear is no matter of the recording.
    pub fn tell(&self, need: Need) -> bool {
        match need {
            Need::MotorAngle => self.motor_angle_rad.is_some(),
            Need::OutputAngle => self.output_angle_rad.is_some(),
            Need::Velocity | Need::Acceleration => self.velocity_rad_per_s.is_some(),
            Need::Deflection | Need::DeflectionRate => self.deflection_rad.is_some(),
            Need::Temperature => self.temperature_c.is_some(),
            Need::MotorVelocity => self.motor_velocity_rad_per_s.is_some(),
            Need::OutputVelocity => self.output_velocity_rad_per_s.is_some(),
            Need::SimulatedTorque => self.torque_sim_nm.is_some(),
            Need::Gear => true,
        }
    }

    /// A row with the measured deflection, its rate and the base torque left at 0. What the recording does not tell is 0.
    #[inline]
    pub fn sample(&self, row: usize) -> Sample<f64> {
        let at = |signal: Option<&[f64]>| signal.map_or(0.0, |s| s[row]);
        let time = self.time_s[row];
        Sample {
            time,
            period: match row {
                0 => self.past.last().map_or(0.0, |before| time - before.time),
                _ => time - self.time_s[row - 1],
            },
            motor_angle: at(self.motor_angle_rad.as_deref()),
            output_angle: at(self.output_angle_rad.as_deref()),
            deflection: at(self.deflection_rad.as_deref()),
            velocity: at(self.velocity_rad_per_s.as_deref()),
            acceleration: at(self.acceleration_rad_per_s2.as_deref()),
            temperature: at(self.temperature_c),
            motor_velocity: at(self.motor_velocity_rad_per_s.as_deref()),
            output_velocity: at(self.output_velocity_rad_per_s.as_deref()),
            simulated_torque: at(self.torque_sim_nm),
            ..Sample::default()
        }
    }
}

/// All samples, without the rates, which rows far apart do not tell.
fn path(signals: &Signals<'_>) -> Vec<Sample<f64>> {
    let still = |sample: Sample<f64>| Sample {
        velocity: 0.0,
        acceleration: 0.0,
        motor_velocity: 0.0,
        output_velocity: 0.0,
        ..sample
    };
    (0..signals.len()).map(|row| still(signals.sample(row))).collect()
}

fn combine<'a>(a: &[f64], b: &[f64], f: impl Fn(f64, f64) -> f64) -> Cow<'a, [f64]> {
    a.iter().zip(b).map(|(a, b)| f(*a, *b)).collect()
}

/// The derivative of samples by time, of second order on uneven time too: the slope of the parabola through three samples at the middle one, and the plain
/// difference at both ends. 0 for a single sample.
pub fn rate(values: &[f64], time_s: &[f64]) -> Vec<f64> {
    let slope = |k: usize| (values[k + 1] - values[k]) / (time_s[k + 1] - time_s[k]);
    let last = values.len().saturating_sub(1);
    let at = |k: usize| match k {
        _ if last == 0 => 0.0,
        0 => slope(0),
        _ if k == last => slope(k - 1),
        _ => {
            let (before, after) = (time_s[k] - time_s[k - 1], time_s[k + 1] - time_s[k]);
            (after * slope(k - 1) + before * slope(k)) / (before + after)
        }
    };
    (0..values.len()).map(at).collect()
}

/// The second derivative of samples by time: that of the parabola through three samples, and that of their neighbours at both ends. 0 for fewer than three samples. Of a wave of ω a
/// sample it loses ω²/12; the rate of the rate would lose ω²/3.
pub fn curvature(values: &[f64], time_s: &[f64]) -> Vec<f64> {
    let count = values.len();
    if count < 3 {
        return vec![0.0; count];
    }
    let slope = |k: usize| (values[k + 1] - values[k]) / (time_s[k + 1] - time_s[k]);
    let at = |k: usize| 2.0 * (slope(k) - slope(k - 1)) / (time_s[k + 1] - time_s[k - 1]);
    (0..count).map(|k| at(k.clamp(1, count - 2))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_of_a_parabola_is_exact_on_uneven_time() {
        let time = [0.0, 0.5, 0.75, 2.0, 3.0];
        let parabola = time.map(|t| 3.0 * t * t - t);
        let rate = rate(&parabola, &time);
        for (t, r) in time[1..4].iter().zip(&rate[1..4]) {
            assert!((r - (6.0 * t - 1.0)).abs() < 1e-12);
        }
        assert_eq!((rate[0], rate[4]), (0.5, 14.0));
        assert!(curvature(&parabola, &time).iter().all(|a| (a - 6.0).abs() < 1e-12));
        assert_eq!(curvature(&[1.0, 2.0], &[0.0, 1.0]), [0.0; 2]);
        assert_eq!(super::rate(&[1.0], &[0.0]), [0.0]);
    }
}
