//! Models without physics: curves over every coordinate, flexible enough for whatever depends on it. They tell where structure sits, whether there is any, and
//! what a named term would have to explain.

use rayon::prelude::*;

use crate::diagnose::jumps;
use crate::diagnose::tones::tones;
use crate::numerics::autoregression::Noise;
use crate::numerics::extremes::{largest, width};
use crate::numerics::spectrum;
use crate::physics::Evaluation;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::likelihood::Profile;

/// What can be seen of a recording, row by row.
pub struct Coordinates {
    /// The motor angle, rad.
    pub motor: Option<Vec<f64>>,
    /// The output angle, rad.
    pub output: Option<Vec<f64>>,
    /// v, rad/s.
    pub velocity: Option<Vec<f64>>,
    /// v̇, rad/s².
    pub acceleration: Option<Vec<f64>>,
    /// θ, rad.
    pub deflection: Option<Vec<f64>>,
    /// θ̇, rad/s.
    pub rate: Option<Vec<f64>>,
    /// The torque of the model, N·m.
    pub torque: Vec<f64>,
    /// Its rate, N·m/s.
    pub torque_rate: Vec<f64>,
    /// The load: another simulation's torque where that stands in for the base model, else the torque of the model, N·m.
    pub load: Vec<f64>,
    /// Its rate, N·m/s.
    pub load_rate: Vec<f64>,
    /// °C.
    pub temperature: Option<Vec<f64>>,
    /// s.
    pub time: Vec<f64>,
}

/// Columns over one coordinate.
pub struct Curve {
    /// The coordinate, in the words of MODEL.md section 7.
    pub coordinate: &'static str,
    /// Its columns.
    pub columns: Vec<Vec<f64>>,
    /// How many of its waves were picked out of a spectrum.
    pub picked: usize,
    /// A tone, which no noise keeps up: see `tones`.
    pub coherent: bool,
}

/// A curve fitted beside a model.
pub struct Explained {
    /// The coordinate.
    pub coordinate: &'static str,
    /// By how much it lowers −2 ln L.
    pub gain: f64,
    /// How many columns it has.
    pub columns: usize,
    /// How many of its waves were picked out of a spectrum.
    pub picked: usize,
    /// What it adds to the torque, row by row, N·m.
    pub contribution: Vec<f64>,
    /// Part of the squared residual that the fit with it no longer has.
    pub part: f64,
    /// Its columns.
    pub basis: Vec<Vec<f64>>,
    /// The noise that is left.
    pub noise: Vec<Noise>,
    /// A tone, which no noise keeps up; its gain is in squares of the noise that is left, since the noise before has taken the tone for its own.
    pub coherent: bool,
}

/// Structure is at least this part of the squared residual.
pub const LEAST_PART: f64 = 0.05;

/// What the strongest of some hundred lines gains from noise, beyond a line that was not picked: 2 ln 400.
const PICKED: f64 = 12.0;

impl Explained {
    /// Whether it is structure beyond doubt: more than noise gains, and enough of the residual that it is no leftover of a noisy angle.
    pub fn is_structure(&self, least: f64) -> bool {
        self.net() > least && self.part > LEAST_PART
    }

    /// The gain less what as many columns gain from noise alone, on average twice.
    pub fn net(&self) -> f64 {
        self.gain - 2.0 * self.columns as f64 - PICKED * self.picked as f64
    }
}

impl Coordinates {
    /// The coordinates of a fitted model's recordings.
    pub fn new(dataset: &Dataset<'_>, evaluations: &[Evaluation<'_>]) -> Self {
        let signal = |of: &dyn Fn(&Evaluation<'_>) -> Option<Vec<f64>>| -> Option<Vec<f64>> {
            let mut line = Vec::with_capacity(dataset.len());
            for evaluation in evaluations {
                line.extend(dataset.looked_at(&of(evaluation)?));
            }
            Some(line)
        };
        let some = |x: &[f64]| (!x.is_empty()).then(|| x.to_vec());
        let mut torque = Vec::with_capacity(dataset.len());
        let mut torque_rate = Vec::with_capacity(dataset.len());
        for evaluation in evaluations {
            torque.extend(dataset.looked_at(evaluation.total()));
            let rate = crate::physics::signals::rate(evaluation.total(), evaluation.context().signals.time_s);
            torque_rate.extend(dataset.looked_at(&rate));
        }
        let simulated: Vec<f64> = dataset
            .recordings
            .iter()
            .filter_map(|r| r.torque_sim_nm.as_deref())
            .flat_map(|s| dataset.looked_at(s))
            .collect();
        let (load, load_rate) = if simulated.len() == torque.len() {
            let rates = dataset
                .recordings
                .iter()
                .filter_map(|r| Some(crate::physics::signals::rate(r.torque_sim_nm.as_deref()?, &r.time_s)));
            let rate: Vec<f64> = rates.flat_map(|r| dataset.looked_at(&r).collect::<Vec<f64>>()).collect();
            (simulated, rate)
        } else {
            (torque.clone(), torque_rate.clone())
        };
        Self {
            load,
            load_rate,
            motor: signal(&|e| e.context().signals.motor_angle_rad.as_deref().map(<[f64]>::to_vec)),
            output: signal(&|e| e.context().signals.output_angle_rad.as_deref().map(<[f64]>::to_vec)),
            velocity: signal(&|e| e.context().signals.velocity_rad_per_s.as_deref().map(<[f64]>::to_vec)),
            acceleration: signal(&|e| e.context().signals.acceleration_rad_per_s2.clone()),
            deflection: signal(&|e| some(&e.followed().deflection_rad)),
            rate: signal(&|e| some(&e.followed().rate_rad_per_s)),
            torque,
            torque_rate,
            temperature: signal(&|e| e.context().signals.temperature_c.map(<[f64]>::to_vec)),
            time: dataset.time_s(),
        }
    }
}

/// Knots at even shares of the sorted values.
pub fn knots(x: &[f64], count: usize) -> Vec<f64> {
    let mut sorted: Vec<f64> = x.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len() - 1;
    let mut knots: Vec<f64> = (0..count).map(|i| sorted[i * last / (count - 1)]).collect();
    let span = sorted[last] - sorted[0];
    knots.dedup_by(|a, b| (*a - *b).abs() <= 1e-6 * span);
    knots
}

/// Linear splines on knots, the outer ones constant beyond.
pub fn linear_splines(x: &[f64], knots: &[f64]) -> Vec<Vec<f64>> {
    let count = knots.len();
    let mut columns = vec![vec![0.0; x.len()]; count];
    if count < 2 {
        return Vec::new();
    }
    for (row, &x) in x.iter().enumerate() {
        let right = knots.partition_point(|k| *k <= x).clamp(1, count - 1);
        let share = ((x - knots[right - 1]) / (knots[right] - knots[right - 1])).clamp(0.0, 1.0);
        columns[right - 1][row] = 1.0 - share;
        columns[right][row] = share;
    }
    columns
}

fn times(columns: Vec<Vec<f64>>, factor: &[f64]) -> Vec<Vec<f64>> {
    let product = |mut c: Vec<f64>| {
        c.iter_mut().zip(factor).for_each(|(c, f)| *c *= f);
        c
    };
    columns.into_iter().map(product).collect()
}

/// What an error of the deflection is multiplied by where the gear stiffens.
fn squared(load: &[f64]) -> Vec<f64> {
    load.iter().map(|x| x * x).collect()
}

fn waves(angle: &[f64], orders: &[f64]) -> Vec<Vec<f64>> {
    let wave = |&order: &f64| {
        let pair = angle.iter().map(|q| (order * q).sin_cos());
        let (sin, cos): (Vec<f64>, Vec<f64>) = pair.unzip();
        [cos, sin]
    };
    orders.iter().flat_map(wave).collect()
}

/// An element that follows a motion until it slips at a radius: what any memory of reversals can be built from.
pub fn stop_operator(x: &[f64], spans: &[std::ops::Range<usize>], radius: f64) -> Vec<f64> {
    let mut column = vec![0.0; x.len()];
    for span in spans {
        let mut force = 0.0_f64;
        for row in span.start + 1..span.end {
            force = (force + x[row] - x[row - 1]).clamp(-radius, radius);
            column[row] = force;
        }
    }
    column
}

/// An exponential memory of the rate: what any creep can be built from.
fn exponential_memory(x: &[f64], time: &[f64], spans: &[std::ops::Range<usize>], tau: f64) -> Vec<f64> {
    let mut column = vec![0.0; x.len()];
    for span in spans {
        let mut level = 0.0;
        for row in span.start + 1..span.end {
            level = level * (-(time[row] - time[row - 1]) / tau).exp() + x[row] - x[row - 1];
            column[row] = level;
        }
    }
    column
}

/// Curves over every coordinate that the recordings tell.
pub fn curves(dataset: &Dataset<'_>, see: &Coordinates, fit: &Fitted) -> Vec<Curve> {
    let mut curves = Vec::new();
    let unit = |x: &[f64]| {
        let scale = largest(x).max(f64::MIN_POSITIVE);
        x.iter().map(|x| x / scale).collect::<Vec<f64>>()
    };
    let turns = |x: &[f64]| dataset.turns(x);
    let sign: Option<Vec<f64>> = see.velocity.as_deref().filter(|v| largest(v) > 0.0).map(|v| {
        let soft = 0.015 * largest(v);
        v.iter().map(|v| (v / soft).tanh()).collect()
    });
    let load = see.deflection.as_deref().map(unit);
    let mut picked = 0;
    let mut add = |coordinate: &'static str, columns: Vec<Vec<f64>>, picked: usize| {
        curves.push(Curve { coordinate, columns, picked, coherent: false });
    };
    if let Some(motor) = see.motor.as_deref().filter(|q| turns(q) > 0.16) {
        let white = dataset.filtered_twice(fit);
        let plain = dataset.layout().masked(&fit.residual);
        let mut orders: Vec<f64> = if turns(motor) > 0.8 { (1..=6).map(f64::from).collect() } else { vec![1.0] };
        let lines = [
            spectrum::peaks(&dataset.order_spectrum(fit, motor, &white), turns(motor), 3),
            spectrum::peaks(&spectrum::spectrum(motor, &plain, |_| 1.0), turns(motor), 3),
        ];
        for order in lines.into_iter().flatten() {
            if orders.iter().all(|o| (o - order).abs() > 0.3 / turns(motor)) {
                orders.push(order);
                picked += 1;
            }
        }
        add("motor_angle", waves(motor, &orders), picked);
        if let Some(sign) = &sign {
            add("motor_angle", times(waves(motor, &orders), sign), picked);
        }
        if let Some(load) = &load {
            let mut columns = waves(motor, &orders);
            columns.extend(times(waves(motor, &orders), load));
            columns.extend(times(waves(motor, &orders), &squared(load)));
            add("motor_angle", columns, picked);
        }
        if let Some(velocity) = see.velocity.as_deref().filter(|v| largest(v) > 0.0) {
            let speed: Vec<f64> = velocity.iter().map(|v| v.abs() / largest(velocity)).collect();
            for order in orders.iter().take(3) {
                let pair = waves(motor, &[*order]);
                let columns = linear_splines(&speed, &[0.1, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0]).into_iter();
                let columns = columns.flat_map(|hat| times(pair.clone(), &hat)).collect();
                add("motor_angle", columns, 1);
            }
        }
    }
    if let Some(output) = see.output.as_deref().filter(|q| turns(q) > 0.016) {
        let around = if turns(output) > 0.7 {
            waves(output, &[1.0, 2.0, 3.0, 4.0])
        } else {
            linear_splines(output, &knots(output, 10))
        };
        add("output_angle", around.clone(), 0);
        if let Some(sign) = &sign {
            add("output_angle", times(linear_splines(output, &knots(output, 8)), sign), 0);
        }
        if let Some(load) = &load {
            add("output_angle", times(linear_splines(output, &knots(output, 12)), load), 0);
            let turn = waves(output, &[1.0]);
            let mut columns = around.clone();
            columns.extend(times(turn.clone(), load));
            columns.extend(times(turn, &squared(load)));
            add("output_angle", columns, 0);
        }
    }
    if let Some(velocity) = see.velocity.as_deref().filter(|v| largest(v) > 0.0) {
        let scale = largest(velocity);
        let positive = [0.0, 0.004, 0.012, 0.03, 0.07, 0.15, 0.3, 0.55, 1.0].map(|x| x * scale);
        let mut all: Vec<f64> = positive.iter().skip(1).rev().map(|x| -x).collect();
        all.extend(positive);
        add("output_velocity", linear_splines(velocity, &all), 0);
    }
    if let Some(theta) = see.deflection.as_deref() {
        add("deflection", linear_splines(theta, &knots(theta, 24)), 0);
        let rated = fit.model.gear.rated_deflection_rad.unwrap_or_else(|| largest(theta));
        let radii = [0.02, 0.04, 0.08, 0.14, 0.25, 0.4, 0.65];
        let mut columns: Vec<Vec<f64>> =
            radii.iter().map(|r| stop_operator(theta, &dataset.spans, r * rated)).collect();
        let duration = width(&see.time);
        let mut tau = 0.5;
        while tau < 0.6 * duration {
            columns.push(exponential_memory(theta, &see.time, &dataset.spans, tau));
            tau *= 3.0;
        }
        if let (Some(rate), Some(load)) = (see.rate.as_deref(), &load) {
            let soft = 0.05 * largest(rate);
            let direction: Vec<f64> = rate.iter().map(|r| (r / soft).tanh()).collect();
            columns.extend(times(linear_splines(theta, &knots(theta, 7)), &direction));
            let slip = stop_operator(theta, &dataset.spans, 0.1 * rated);
            columns.push(slip.iter().zip(load).map(|(s, l)| s * l).collect());
        }
        add("reversal", columns, 0);
    }
    if let Some(rate) = see.rate.as_deref().filter(|r| largest(r) > 0.0) {
        add("deflection_rate", linear_splines(rate, &knots(rate, 9)), 0);
    }
    if let Some(acceleration) = see.acceleration.as_deref().filter(|a| largest(a) > 0.0) {
        let mut columns = linear_splines(acceleration, &knots(acceleration, 9));
        if let Some(sign) = &sign {
            let soft = 0.1 * largest(acceleration);
            let direction: Vec<f64> = acceleration.iter().map(|a| (a / soft).tanh()).collect();
            columns.push(sign.iter().zip(&direction).map(|(s, d)| s * d).collect());
        }
        add("acceleration", columns, 0);
    }
    if let Some(sign) = &sign {
        add("torque", times(linear_splines(&see.torque, &knots(&see.torque, 9)), sign), 0);
    }
    let scale = largest(&see.torque);
    let positive = [0.0, 0.01, 0.03, 0.08, 0.2, 0.45, 1.0].map(|x| x * scale);
    let both: Vec<f64> = positive.iter().skip(1).rev().map(|x| -x).chain(positive).collect();
    add("torque", linear_splines(&see.torque, &both), 0);
    add("torque_rate", linear_splines(&see.torque_rate, &knots(&see.torque_rate, 8)), 0);
    let mut along = |coordinate: &'static str, x: &[f64], count: usize| {
        add(coordinate, linear_splines(x, &knots(x, count + 3)), 0);
        if let Some(load) = &load {
            add(coordinate, times(linear_splines(x, &knots(x, count)), load), 0);
        }
        if let Some(sign) = &sign {
            add(coordinate, times(linear_splines(x, &knots(x, count)), sign), 0);
        }
    };
    if let Some(temperature) = see.temperature.as_deref().filter(|t| width(t) > 0.1) {
        along("temperature", temperature, 4);
    }
    along("time", &see.time, 9);
    let steps = jumps::steps(dataset, fit);
    if !steps.is_empty() {
        let picked = steps.len();
        curves.push(Curve { coordinate: "time", columns: steps, picked, coherent: false });
    }
    curves.extend(tones(dataset, see, fit));
    curves
}

impl Dataset<'_> {
    /// Every curve beside a fitted model, refitted with it, the best first. Those that take less than `least_part` of the squared residual even by plain least squares are
    /// fitted by these.
    pub fn locate(&self, fit: &Fitted, curves: &[Curve], least_part: f64) -> Vec<Explained> {
        let layout = self.layout();
        let base = fit.parameter_columns();
        let power = layout.squares(&fit.residual);
        let columns: Vec<Vec<&[f64]>> = curves
            .iter()
            .map(|curve| base.iter().copied().chain(curve.columns.iter().map(Vec::as_slice)).collect())
            .collect();
        let plain: Vec<Profile> =
            columns.par_iter().map(|columns| layout.plain_profile(columns, &fit.residual)).collect();
        let part = |profile: &Profile| 1.0 - layout.squares(&profile.residual) / power;
        let explain = |((curve, columns), plain): ((&Curve, &Vec<&[f64]>), Profile)| {
            let profile = if curve.coherent || part(&plain) < least_part {
                plain
            } else {
                layout.better_profile(plain, columns, &fit.residual, &fit.noise)
            };
            let mut contribution = vec![0.0; self.len()];
            for (column, weight) in curve.columns.iter().zip(&profile.coefficients[base.len()..]) {
                contribution.iter_mut().zip(column).for_each(|(c, x)| *c += weight * x);
            }
            let part = part(&profile);
            Explained {
                coordinate: curve.coordinate,
                // An autoregression of what a tone leaves where it begins and ends holds the tone itself: the gain is that in white noise.
                gain: if curve.coherent {
                    -(self.counted() as f64) * (-part).ln_1p()
                } else {
                    fit.minus_two_log_likelihood - profile.minus_two_log_likelihood
                },
                columns: curve.columns.len(),
                picked: curve.picked,
                part,
                contribution,
                basis: curve.columns.clone(),
                noise: profile.noise,
                coherent: curve.coherent,
            }
        };
        let mut found: Vec<Explained> = curves.par_iter().zip(&columns).zip(plain).map(explain).collect();
        found.retain(|c| c.gain.is_finite());
        found.sort_by(|a, b| b.net().total_cmp(&a.net()));
        let mut seen: Vec<&str> = Vec::new();
        found.retain(|c| {
            let first = !seen.contains(&c.coordinate);
            seen.push(c.coordinate);
            first
        });
        found
    }
}
