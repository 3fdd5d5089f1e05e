//! What recordings span, and the orders that the residual of a fit holds.

use std::f64::consts::TAU;

use crate::kinds::ranges::Ranges;
use crate::numerics::spectrum;
use crate::physics::Evaluation;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

impl Dataset<'_> {
    /// What the recordings span, and the orders that the residual of a fit holds.
    pub fn ranges(&self, evaluations: &[Evaluation<'_>], fit: &Fitted) -> Ranges {
        let largest = |x: &[f64]| x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let travel = |angle: &Option<Vec<f64>>| {
            angle.as_deref().map_or(0.0, |q| {
                let spans = self.spans.iter().map(|span| {
                    let own = &q[span.clone()];
                    own.iter().copied().fold(f64::NEG_INFINITY, f64::max)
                        - own.iter().copied().fold(f64::INFINITY, f64::min)
                });
                spans.fold(0.0, f64::max) / TAU
            })
        };
        let motor = self.signal(evaluations, |s| s.motor_angle_rad.as_deref());
        let output = self.signal(evaluations, |s| s.output_angle_rad.as_deref());
        let velocity = self.signal(evaluations, |s| s.velocity_rad_per_s.as_deref());
        let temperature = self.signal(evaluations, |s| s.temperature_c);
        let time = self.time_s();
        let motor_turns = travel(&motor);
        let period_s = (time[self.spans[0].end - 1] - time[0]) / (self.spans[0].len() - 1) as f64;
        let mut ranges = Ranges {
            rated_rad: fit.model.gear.rated_deflection_rad.unwrap_or(0.0),
            velocity_rad_per_s: velocity.as_deref().map_or(0.0, largest),
            torque_nm: largest(&self.target),
            start_s: time.iter().copied().fold(f64::INFINITY, f64::min),
            end_s: time.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            period_s,
            temperature_c: temperature.map(|t| t.iter().sum::<f64>() / t.len() as f64),
            motor_orders: Vec::new(),
            friction_orders: Vec::new(),
            motor_turns,
            output_turns: travel(&output),
        };
        if let Some(motor) = motor.filter(|_| ranges.motor_turns_enough()) {
            let u = self.filtered_twice(fit);
            let lines = self.order_spectrum(fit, &motor, &u);
            ranges.motor_orders = spectrum::peaks(&lines, motor_turns, 4);
            // What the noise takes for its own colour still stands out of the plain residual.
            let plain = spectrum::spectrum(&motor, &self.layout().masked(&fit.residual), |_| 1.0);
            for order in spectrum::peaks(&plain, motor_turns, 3) {
                if ranges.motor_orders.iter().all(|o| (o - order).abs() > 0.5 / motor_turns) {
                    ranges.motor_orders.push(order);
                }
            }
            if let Some(v) = velocity {
                let soft = 0.02 * ranges.velocity_rad_per_s;
                let signed: Vec<f64> = u.iter().zip(&v).map(|(u, v)| u * (v / soft).tanh()).collect();
                let lines = self.order_spectrum(fit, &motor, &signed);
                ranges.friction_orders = spectrum::peaks(&lines, motor_turns, 3);
            }
        }
        ranges
    }

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
