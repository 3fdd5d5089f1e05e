//! Which orders of a turn a residual holds, by its spectrum in the angle domain.

use std::f64::consts::TAU;

use realfft::RealFftPlanner;

use crate::numerics::extremes::range;
use crate::numerics::robust;

/// Bins of a turn.
const BINS: usize = 64;
/// The highest order looked for.
pub const HIGHEST: f64 = 24.0;
/// The spectrum is taken on a grid so many times finer than one over the turns.
const FINER: usize = 4;

/// A line of a spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Order of the turn.
    pub order: f64,
    /// Its power as a multiple of what noise has there on average.
    pub power: f64,
}

/// The power of the weights `u` (a residual filtered forth and back by its noise) over the orders of an angle. `gain` is what the noise
/// filter multiplies the power of a wave of a given order with.
pub fn spectrum(angle: &[f64], u: &[f64], gain: impl Fn(f64) -> f64) -> Vec<Line> {
    let (low, high) = range(angle);
    let turns = (high - low) / TAU;
    if !(0.5..=1e5).contains(&turns) {
        return Vec::new();
    }
    let bins = ((turns * BINS as f64).ceil() as usize + 1) * FINER;
    let bins = bins.next_power_of_two();
    let mut histogram = vec![0.0; bins];
    for (q, u) in angle.iter().zip(u) {
        histogram[((q - low) / TAU * BINS as f64) as usize] += u;
    }
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(bins);
    let mut transform = plan.make_output_vec();
    if plan.process(&mut histogram, &mut transform).is_err() {
        return Vec::new();
    }
    let per_order = bins as f64 / BINS as f64;
    let lowest = (0.7 / turns).max(0.15);
    let power = |(i, x): (usize, &realfft::num_complex::Complex<f64>)| {
        let order = i as f64 / per_order;
        Line { order, power: x.norm_sqr() / (0.5 * angle.len() as f64 * gain(order)) }
    };
    transform.iter().enumerate().map(power).filter(|l| l.order >= lowest && l.order <= HIGHEST).collect()
}

/// The strongest lines, one a lobe; orders that are a whole number within their resolution are made whole.
pub fn peaks(lines: &[Line], turns: f64, most: usize) -> Vec<f64> {
    let lobe = 1.0 / turns;
    let mut sorted: Vec<Line> = lines.to_vec();
    sorted.sort_by(|a, b| b.power.total_cmp(&a.power));
    let mut found: Vec<f64> = Vec::new();
    for line in sorted {
        if found.len() == most {
            break;
        }
        if found.iter().all(|o| (o - line.order).abs() > 1.5 * lobe) {
            found.push(line.order);
        }
    }
    for order in &mut found {
        if (*order - order.round()).abs() < 0.6 * lobe && order.round() >= 1.0 {
            *order = order.round();
        }
    }
    found.dedup();
    found
}

/// Orders of an angle up to a highest at which a residual stands out, whatever its noise: lines at least eight times their neighbourhood.
pub fn high_orders(angle: &[f64], residual: &[f64], highest: f64) -> Vec<f64> {
    let (low, high) = range(angle);
    let turns = (high - low) / TAU;
    let bins_of_turn = 2.5 * highest;
    if !(1e-2..=1e4).contains(&turns) {
        return Vec::new();
    }
    let bins = (((turns * bins_of_turn).ceil() as usize + 1) * FINER).next_power_of_two();
    let mut histogram = vec![0.0; bins];
    for (q, u) in angle.iter().zip(residual) {
        histogram[((q - low) / TAU * bins_of_turn) as usize] += u;
    }
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(bins);
    let mut transform = plan.make_output_vec();
    if plan.process(&mut histogram, &mut transform).is_err() {
        return Vec::new();
    }
    let per_order = bins as f64 / bins_of_turn;
    let power: Vec<f64> = transform.iter().map(|x| x.norm_sqr()).collect();
    let lobe = ((per_order / turns).ceil() as usize).max(1);
    let mut lines = Vec::new();
    for i in 1..power.len().saturating_sub(1) {
        let order = i as f64 / per_order;
        if order > highest || power[i] < power[i - 1] || power[i] < power[i + 1] || order * turns < 3.0 {
            continue;
        }
        let around = i.saturating_sub(12 * lobe)..(i + 12 * lobe + 1).min(power.len());
        let mut near: Vec<f64> = power[around].to_vec();
        if power[i] > 8.0 * robust::median(&mut near) {
            lines.push((power[i], order));
        }
    }
    lines.sort_by(|a, b| b.0.total_cmp(&a.0));
    lines.into_iter().take(12).map(|l| l.1).collect()
}
