//! Functions without physics over every recorded coordinate: what they predict of rows that took no part is what any model could predict.

use std::f64::consts::PI;
use std::ops::Range;

use crate::diagnose::nonparametric::{Coordinates, knots, linear_splines, stop_operator};
use crate::kinds::free_coordinate::FreeCoordinate;
use crate::numerics::extremes::{largest, range, width};

/// A free function of one coordinate (or of one together with the direction of motion), as columns.
pub struct FreeFunction {
    /// What it is a function of.
    pub over: FreeCoordinate,
    /// Its columns.
    pub columns: Vec<Vec<f64>>,
}

/// Radii of the elements that any rate-independent memory of the deflection is built from, shares of the largest deflection.
pub const RADII: [f64; 8] = [0.01, 0.02, 0.045, 0.09, 0.18, 0.35, 0.6, 1.0];

/// Distances over which friction may turn round, shares of the travel.
const TRAVELS: [f64; 5] = [3e-4, 1e-3, 3e-3, 1e-2, 3e-2];

/// The free functions that recordings allow, all but those over orders.
pub fn free_functions(see: &Coordinates, spans: &[Range<usize>]) -> Vec<FreeFunction> {
    let mut free = Vec::new();
    let mut add = |over: FreeCoordinate, columns: Vec<Vec<f64>>| {
        if !columns.is_empty() {
            free.push(FreeFunction { over, columns });
        }
    };
    let moving = see.velocity.as_deref().filter(|v| largest(v) > 0.0);
    let direction = moving.map(|v| [0.003, 0.03].map(|w| direction(v, w)));
    if let (Some(v), Some(signs)) = (moving, &direction) {
        let mut columns = linear_splines(v, &knots(v, 24));
        columns.extend(signs.iter().cloned());
        add(FreeCoordinate::Velocity, columns);
    }
    if let Some(a) = see.acceleration.as_deref().filter(|a| largest(a) > 0.0) {
        let mut columns = linear_splines(a, &knots(a, 9));
        columns.push(a.to_vec());
        add(FreeCoordinate::Acceleration, columns);
    }
    if largest(&see.load) > 0.0 {
        let mut columns = linear_splines(&see.load, &knots(&see.load, 11));
        columns.push(see.load.clone());
        if let Some([_, soft]) = &direction {
            let mut both = times(linear_splines(&see.load, &knots(&see.load, 6)), soft);
            both.push(see.load.iter().zip(soft).map(|(l, s)| l.abs() * s).collect());
            add(FreeCoordinate::LoadAndDirection, both);
        }
        add(FreeCoordinate::Load, columns);
        let mut columns = linear_splines(&see.load_rate, &knots(&see.load_rate, 6));
        columns.push(see.load_rate.clone());
        add(FreeCoordinate::LoadRate, columns);
    }
    if let Some(q) = see.output.as_deref().filter(|q| width(q) > 0.0) {
        let (low, span) = (range(q).0, width(q));
        let u: Vec<f64> = q.iter().map(|q| (q - low) / span).collect();
        let waves = |count: usize| -> Vec<Vec<f64>> {
            (1..=count).map(|k| u.iter().map(|u| (PI * k as f64 * u).cos()).collect()).collect()
        };
        let mut columns = waves(12);
        if span > 0.05 {
            columns.extend(wave_pair(q, 1.0));
        }
        add(FreeCoordinate::OutputAngle, columns);
        if let Some([_, soft]) = &direction {
            add(FreeCoordinate::AngleAndDirection, times(waves(9), soft));
            add(FreeCoordinate::OutputReversal, TRAVELS.iter().map(|r| dahl(q, spans, r * span)).collect());
        }
    }
    if let Some(theta) = see.deflection.as_deref().filter(|x| width(x) > 0.0) {
        let a = largest(theta);
        let mut columns = linear_splines(theta, &knots(theta, 24));
        columns.extend([1, 2, 3, 5].map(|p| theta.iter().map(|x| (x / a).powi(p)).collect::<Vec<f64>>()));
        add(FreeCoordinate::Deflection, columns);
        let plain: Vec<Vec<f64>> = RADII.iter().map(|r| stop_operator(theta, spans, r * a)).collect();
        let loaded = plain.iter().map(|s| s.iter().zip(theta).map(|(s, x)| s * (x / a).powi(2)).collect());
        let loaded: Vec<Vec<f64>> = loaded.collect();
        add(FreeCoordinate::DeflectionReversal, plain.into_iter().chain(loaded).collect());
    }
    if let Some(rate) = see.rate.as_deref().filter(|r| largest(r) > 0.0) {
        let mut columns = linear_splines(rate, &knots(rate, 9));
        columns.push(rate.to_vec());
        add(FreeCoordinate::DeflectionRate, columns);
    }
    if let Some(temperature) = see.temperature.as_deref().filter(|t| width(t) > 0.1) {
        let plain = linear_splines(temperature, &knots(temperature, 4));
        let mut columns = times(plain.clone(), &see.load);
        if let Some([_, soft]) = &direction {
            columns.extend(times(plain.clone(), soft));
        }
        columns.extend(plain);
        add(FreeCoordinate::Temperature, columns);
    }
    let (start, duration) = (range(&see.time).0, width(&see.time).max(f64::MIN_POSITIVE));
    let t: Vec<f64> = see.time.iter().map(|t| (t - start) / duration).collect();
    let mut columns: Vec<Vec<f64>> =
        (1..=4).map(|k| t.iter().map(|t| (PI * f64::from(k) * t).cos()).collect()).collect();
    columns.push(t.iter().map(|t| t - 0.5).collect());
    add(FreeCoordinate::Time, columns);
    free
}

/// sin and cos of an order of an angle.
pub fn wave_pair(q: &[f64], order: f64) -> [Vec<f64>; 2] {
    [q.iter().map(|q| (order * q).sin()).collect(), q.iter().map(|q| (order * q).cos()).collect()]
}

/// The direction of motion, smooth over a share of the largest velocity.
pub fn direction(v: &[f64], width: f64) -> Vec<f64> {
    let soft = width * percentile_95(v).max(f64::MIN_POSITIVE);
    v.iter().map(|v| (v / soft).tanh()).collect()
}

fn percentile_95(v: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = v.iter().map(|v| v.abs()).collect();
    let at = sizes.len() * 95 / 100;
    if sizes.is_empty() { 0.0 } else { *sizes.select_nth_unstable_by(at.min(v.len() - 1), f64::total_cmp).1 }
}

/// Friction that reverses over a distance of travel (Dahl): dD/dq = (1 − D sgn dq)/r.
fn dahl(q: &[f64], spans: &[Range<usize>], radius: f64) -> Vec<f64> {
    let mut column = vec![0.0; q.len()];
    for span in spans {
        let mut d = 0.0;
        for row in span.start + 1..span.end {
            let step = q[row] - q[row - 1];
            if step != 0.0 {
                let end = step.signum();
                d = end + (d - end) * (-step.abs() / radius).exp();
            }
            column[row] = d;
        }
    }
    column
}

fn times(columns: Vec<Vec<f64>>, factor: &[f64]) -> Vec<Vec<f64>> {
    let product = |c: Vec<f64>| c.iter().zip(factor).map(|(c, f)| c * f).collect();
    columns.into_iter().map(product).collect()
}
