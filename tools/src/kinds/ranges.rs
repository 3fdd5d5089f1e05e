//! What the recordings span, and the orders that a residual holds.

use std::f64::consts::TAU;

use crate::numerics::spectrum;
use crate::physics::Evaluation;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

/// What the recordings span.
pub struct Ranges {
    /// The rated deflection, rad; 0 where there is none.
    pub rated_rad: f64,
    /// The largest velocity, rad/s.
    pub velocity_rad_per_s: f64,
    /// The largest torque, N·m.
    pub torque_nm: f64,
    /// The first time, s.
    pub start_s: f64,
    /// The last time, s.
    pub end_s: f64,
    /// The sample period, s.
    pub period_s: f64,
    /// The mean temperature, °C.
    pub temperature_c: Option<f64>,
    /// Orders of the motor angle that the residual holds.
    pub motor_orders: Vec<f64>,
    /// Orders of the motor angle that it holds times the sign of the velocity.
    pub friction_orders: Vec<f64>,
    /// Turns of the motor.
    pub motor_turns: f64,
    /// Turns of the output.
    pub output_turns: f64,
}

/// An angle that turns less than this says nothing of what turns with it, turns.
pub const FEWEST_MOTOR_TURNS: f64 = 0.16;
pub const FEWEST_OUTPUT_TURNS: f64 = 0.016;

impl Ranges {
    /// What the recordings span, and the orders that the residual of a fit holds.
    pub fn new(dataset: &Dataset<'_>, evaluations: &[Evaluation<'_>], fit: &Fitted) -> Self {
        let largest = |x: &[f64]| x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let travel = |angle: &Option<Vec<f64>>| {
            angle.as_deref().map_or(0.0, |q| {
                let spans = dataset.spans.iter().map(|span| {
                    let own = &q[span.clone()];
                    own.iter().copied().fold(f64::NEG_INFINITY, f64::max)
                        - own.iter().copied().fold(f64::INFINITY, f64::min)
                });
                spans.fold(0.0, f64::max) / TAU
            })
        };
        let motor = dataset.signal(evaluations, |s| s.motor_angle_rad.as_deref());
        let output = dataset.signal(evaluations, |s| s.output_angle_rad.as_deref());
        let velocity = dataset.signal(evaluations, |s| s.velocity_rad_per_s.as_deref());
        let temperature = dataset.signal(evaluations, |s| s.temperature_c);
        let time = dataset.time_s();
        let motor_turns = travel(&motor);
        let period_s = (time[dataset.spans[0].end - 1] - time[0]) / (dataset.spans[0].len() - 1) as f64;
        let mut ranges = Self {
            rated_rad: fit.model.gear.rated_deflection_rad.unwrap_or(0.0),
            velocity_rad_per_s: velocity.as_deref().map_or(0.0, largest),
            torque_nm: largest(&dataset.target),
            start_s: time.iter().copied().fold(f64::INFINITY, f64::min),
            end_s: time.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            period_s,
            temperature_c: temperature.map(|t| t.iter().sum::<f64>() / t.len() as f64),
            motor_orders: Vec::new(),
            friction_orders: Vec::new(),
            motor_turns,
            output_turns: travel(&output),
        };
        if let Some(motor) = motor.filter(|_| motor_turns > FEWEST_MOTOR_TURNS) {
            let u = dataset.filtered_twice(fit);
            let lines = dataset.order_spectrum(fit, &motor, &u);
            ranges.motor_orders = spectrum::peaks(&lines, motor_turns, 4);
            // What the noise takes for its own colour still stands out of the plain residual.
            let plain = spectrum::spectrum(&motor, &dataset.layout().masked(&fit.residual), |_| 1.0);
            for order in spectrum::peaks(&plain, motor_turns, 3) {
                if ranges.motor_orders.iter().all(|o| (o - order).abs() > 0.5 / motor_turns) {
                    ranges.motor_orders.push(order);
                }
            }
            if let Some(v) = velocity {
                let soft = 0.02 * ranges.velocity_rad_per_s;
                let signed: Vec<f64> = u.iter().zip(&v).map(|(u, v)| u * (v / soft).tanh()).collect();
                let lines = dataset.order_spectrum(fit, &motor, &signed);
                ranges.friction_orders = spectrum::peaks(&lines, motor_turns, 3);
            }
        }
        ranges
    }
}

impl Dataset<'_> {
    /// The residual of a fit, filtered by its noise forth and back: its product with a column is what least squares sees of that column.
    pub fn filtered_twice(&self, fit: &Fitted) -> Vec<f64> {
        let white = self.layout().whiten(&fit.noise, &fit.residual);
        let mut u = vec![0.0; white.len()];
        for ((span, marks), noise) in self.spans.iter().zip(&self.marks).zip(&fit.noise) {
            noise.whiten_transposed(marks, &white[span.clone()], &mut u[span.clone()]);
        }
        u
    }

    /// The spectrum over the orders of an angle, in multiples of the noise.
    pub fn order_spectrum(&self, fit: &Fitted, angle: &[f64], u: &[f64]) -> Vec<spectrum::Line> {
        let steps = angle.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>() / angle.len() as f64;
        spectrum::spectrum(angle, u, |order| self.noise_gain(fit, order * steps))
    }

    /// What the noise filter multiplies the power of a wave with that advances by `radians` a sample.
    pub fn noise_gain(&self, fit: &Fitted, radians: f64) -> f64 {
        let noise = &fit.noise[0];
        let w = radians.min(std::f64::consts::PI);
        let (mut re, mut im) = (1.0, 0.0);
        for (i, a) in noise.coefficients.iter().enumerate() {
            let phase = w * (i + 1) as f64;
            re -= a * phase.cos();
            im += a * phase.sin();
        }
        (re * re + im * im) / noise.innovation_sd.max(1e-12).powi(2)
    }
}
