//! What recordings span, and the orders that the residual of a fit holds.

use std::f64::consts::TAU;
use std::ops::Range;

use crate::kinds::ranges::Ranges;
use crate::numerics::extremes::{largest, range, width};
use crate::numerics::spectrum;
use crate::physics::Evaluation;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

impl Dataset<'_> {
    /// What the recordings span, and the orders that the residual of a fit holds.
    pub fn ranges(&self, evaluations: &[Evaluation<'_>], fit: &Fitted) -> Ranges {
        let travel = |angle: &Option<Vec<f64>>| angle.as_deref().map_or(0.0, |q| self.turns(q));
        let motor = self.signal(evaluations, |s| s.motor_angle_rad.as_deref());
        let output = self.signal(evaluations, |s| s.output_angle_rad.as_deref());
        let velocity = self.signal(evaluations, |s| s.velocity_rad_per_s.as_deref());
        let temperature = self.signal(evaluations, |s| s.temperature_c);
        let time = self.time_s();
        let motor_turns = travel(&motor);
        let period_s = |span: &Range<usize>| (time[span.end - 1] - time[span.start]) / (span.len() - 1) as f64;
        let period_s = self.spans.iter().map(period_s).fold(f64::INFINITY, f64::min);
        let (start_s, end_s) = range(&time);
        let mut ranges = Ranges {
            rated_rad: fit.model.gear.rated_deflection_rad.unwrap_or(0.0),
            velocity_rad_per_s: velocity.as_deref().map_or(0.0, largest),
            torque_nm: largest(&self.target),
            start_s,
            end_s,
            period_s,
            temperature_c: temperature.map(|t| t.iter().sum::<f64>() / t.len() as f64),
            motor_orders: Vec::new(),
            friction_orders: Vec::new(),
            output_orders: Vec::new(),
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
            // Less than this is a slope, and a wave made of it is anything elsewhere.
            for orders in [&mut ranges.motor_orders, &mut ranges.friction_orders] {
                orders.retain(|order| order * motor_turns >= FEWEST_PERIODS);
            }
        }
        ranges
    }

    /// The turns that an angle makes in the recording in which it makes most.
    pub fn turns(&self, angle: &[f64]) -> f64 {
        self.spans.iter().map(|span| width(&angle[span.clone()])).fold(0.0, f64::max) / TAU
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
        let advance = |span: &Range<usize>| {
            let own = &angle[span.clone()];
            own.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>() / own.len() as f64
        };
        let advances: Vec<f64> = self.spans.iter().map(advance).collect();
        // The mean over the rows of all recordings, each by its own noise.
        spectrum::spectrum(angle, u, |order| {
            let of = |(recording, span): (usize, &Range<usize>)| {
                span.len() as f64 * Self::noise_gain(fit, recording, order * advances[recording])
            };
            self.spans.iter().enumerate().map(of).sum::<f64>() / self.len() as f64
        })
    }

    /// What the noise filter of a recording multiplies the power of a wave with that advances by `radians` a sample.
    pub fn noise_gain(fit: &Fitted, recording: usize, radians: f64) -> f64 {
        let noise = &fit.noise[recording];
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

/// A wave over an angle is looked at over at least so many of its periods.
pub(super) const FEWEST_PERIODS: f64 = 2.5;

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    use super::*;
    use crate::model::parse;
    use crate::recording::Recording;

    /// A joint log of nothing but noise.
    fn noise(sd: f64, period_s: f64, seed: u64) -> Recording {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let normal = Normal::new(0.0, sd).unwrap();
        let time_s: Vec<f64> = (0..4000).map(|k| f64::from(k) * period_s).collect();
        Recording {
            name: format!("{sd}.csv"),
            theta_out_rad: Some(time_s.iter().map(|t| (0.5 * t).sin()).collect()),
            torque: Some(time_s.iter().map(|_| normal.sample(&mut random)).collect()),
            time_s: time_s.into(),
            ..Recording::default()
        }
    }

    #[test]
    fn noise_has_the_same_power_over_the_orders_whichever_of_two_unequal_recordings_is_first() {
        let text = "format = 1\n[gear]\n[[term]]\nkind = \"gravity_load\"\ncos_nm = 0.0\nsin_nm = 0.0\n";
        let model = parse("joint.toml", text).unwrap();
        let (quiet, loud) = (noise(0.1, 0.01, 1), noise(2.0, 0.02, 2));
        for recordings in [[quiet.clone(), loud.clone()], [loud, quiet]] {
            let dataset = Dataset::new(&recordings, &model).unwrap();
            let fit = dataset.fit(&model, &dataset.free_parameters(&model, false), None, 4).unwrap();
            let motor: Vec<f64> = (0..dataset.len()).map(|row| 0.05 * row as f64).collect();
            let lines = dataset.order_spectrum(&fit, &motor, &dataset.filtered_twice(&fit));
            let mean = lines.iter().map(|line| line.power).sum::<f64>() / lines.len() as f64;
            // A line of unit power has twice the power of noise at one frequency.
            assert!((1.6..2.4).contains(&mean), "{}: {mean}", recordings[0].name);
            let ranges = dataset.ranges(&dataset.evaluate(&fit.model).unwrap(), &fit);
            assert!((ranges.period_s - 0.01).abs() < 1e-9, "{}", ranges.period_s);
        }
    }

    #[test]
    fn an_angle_that_stands_still_in_each_recording_makes_no_turns() {
        let text = "format = 1\n[gear]\n[[term]]\nkind = \"gravity_load\"\ncos_nm = 0.0\nsin_nm = 0.0\n";
        let model = parse("joint.toml", text).unwrap();
        let recordings = [noise(0.1, 0.01, 1), noise(0.1, 0.01, 2)];
        let dataset = Dataset::new(&recordings, &model).unwrap();
        let locked: Vec<f64> =
            (0..dataset.len()).map(|row| if dataset.spans[0].contains(&row) { 0.2 } else { 4.1 }).collect();
        assert_eq!(dataset.turns(&locked), 0.0);
    }
}
