//! Plain least squares with textbook terms: what a diagnosis of a real recording is measured by.
//!
//! Shares nothing with the detector. Each kind is a few columns in one of several shapes (the smoothing of friction, the
//! filter of an acceleration); the shape is taken that predicts best. Errors are of eight contiguous blocks, each predicted by a
//! fit to the others without a twelfth of a block on either side.

use nalgebra::{DMatrix, DVector};

use crate::prove::generator::{Gear, Hysteresis};
use crate::recording::{Recording, Samples};

/// Blocks that the held-out error is made of.
const BLOCKS: usize = 8;
/// The gap on either side of a block, as a share of its length.
const GAP: f64 = 1.0 / 12.0;
/// Ridge on columns of unit mean square: keeps columns that are nearly the same apart.
const RIDGE: f64 = 1e-9;
/// Smoothing of a friction's sign, as shares of the 95th percentile of the speed.
const CORNERS: [f64; 4] = [0.003, 0.01, 0.03, 0.1];
/// Slip radii, as shares of the largest deflection.
const RADII: [f64; 6] = [0.01, 0.03, 0.08, 0.2, 0.5, 1.0];

/// What a textbook term may depend on.
#[derive(Debug, Clone, Default)]
pub struct Channels {
    rows: usize,
    period_s: f64,
    time_s: Samples,
    angle: Option<Samples>,
    velocity: Option<Samples>,
    deflection: Option<Samples>,
    simulated: Option<Samples>,
    fast: f64,
}

/// Columns of one term, in one shape.
pub type Columns = Vec<Vec<f64>>;

impl Channels {
    /// The channels of `recording`.
    pub fn of(recording: &Recording) -> Self {
        let rows = recording.len();
        let mut steps: Vec<f64> = recording.time_s.windows(2).map(|w| w[1] - w[0]).collect();
        steps.sort_by(f64::total_cmp);
        let period_s = steps.get(steps.len() / 2).copied().unwrap_or(1.0);
        let angle = recording.theta_out_rad.clone();
        let velocity = recording.velocity_out_rad_per_s.clone().or_else(|| {
            let path = angle.as_ref()?;
            Some(rate(&smoothed(path, (rows / 1500).max(3)), period_s).into())
        });
        let mut speeds: Vec<f64> = velocity.iter().flatten().map(|v| v.abs()).collect();
        speeds.sort_by(f64::total_cmp);
        let fast = speeds.get(speeds.len() * 95 / 100).copied().unwrap_or(1.0).max(1e-12);
        Self {
            rows,
            period_s,
            time_s: recording.time_s.clone(),
            angle,
            velocity,
            deflection: recording.deflection_rad.clone(),
            simulated: recording.torque_sim_nm.clone(),
            fast,
        }
    }

    /// The smoothing of Coulomb friction in its shape number `shape`, rad/s.
    pub fn smoothing(&self, shape: usize) -> f64 {
        CORNERS[shape.min(CORNERS.len() - 1)] * self.fast
    }

    /// Whether the joint moves in each direction for a tenth of the rows at least.
    pub fn turns_both_ways(&self) -> bool {
        let Some(velocity) = &self.velocity else { return false };
        let rows = |forth: bool| velocity.iter().filter(|v| if forth { **v > 0.0 } else { **v < 0.0 }).count();
        [true, false].into_iter().all(|forth| 10 * rows(forth) >= velocity.len())
    }

    fn of_velocity(&self, f: impl Fn(f64) -> f64) -> Option<Vec<f64>> {
        Some(self.velocity.as_ref()?.iter().map(|v| f(*v)).collect())
    }

    fn sign(&self, corner: f64) -> Option<Vec<f64>> {
        self.of_velocity(|v| (v / (corner * self.fast)).tanh())
    }

    fn of_angle(&self, f: impl Fn(f64) -> f64) -> Option<Vec<f64>> {
        Some(self.angle.as_ref()?.iter().map(|q| f(*q)).collect())
    }

    fn accelerations(&self) -> Option<Vec<Vec<f64>>> {
        let velocity = self.velocity.as_ref()?;
        let mut widths: Vec<usize> = [usize::MAX, 4000, 1500, 600, 250].iter().map(|k| (self.rows / k) | 1).collect();
        widths.dedup();
        let at = |w: &usize| rate(&smoothed(&smoothed(velocity, *w), *w), self.period_s);
        Some(widths.iter().map(at).collect())
    }

    /// Every shape of `kind` that this recording has the columns for; `orders` are those of ripples, in turns of the output.
    pub fn shapes(&self, kind: &str, orders: &[f64]) -> Vec<Columns> {
        self.tried(kind, orders).unwrap_or_default()
    }

    fn tried(&self, kind: &str, orders: &[f64]) -> Option<Vec<Columns>> {
        let corners = || CORNERS.iter().filter_map(|c| self.sign(*c));
        let times = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).collect::<Vec<f64>>();
        let wave = |k: f64| Some([self.of_angle(|q| (k * q).cos())?, self.of_angle(|q| (k * q).sin())?]);
        Some(match kind {
            "coulomb_friction" => corners().map(|c| vec![c]).collect(),
            "viscous_friction" => vec![vec![self.velocity.as_ref()?.to_vec()]],
            "stribeck_friction" => {
                let sign = self.sign(0.01)?;
                let dip = |w: f64| self.of_velocity(|v| (-(v / (w * self.fast)).abs()).exp());
                let shape =
                    |w: &f64| Some(vec![sign.clone(), times(&sign, &dip(*w)?), self.velocity.as_ref()?.to_vec()]);
                [0.02, 0.045, 0.1, 0.2, 0.4].iter().filter_map(shape).collect()
            }
            "inertia" => self.accelerations()?.into_iter().map(|a| vec![a]).collect(),
            "gravity_load" => vec![wave(1.0)?.to_vec()],
            "load_dependent_friction" => {
                let load: Vec<f64> = self.simulated.as_ref()?.iter().map(|t| t.abs()).collect();
                corners().map(|c| vec![times(&c, &load)]).collect()
            }
            "position_dependent_friction" => {
                let shape = |(k, c): (f64, f64)| {
                    let (sign, [cos, sin]) = (self.sign(c)?, wave(k)?);
                    Some(vec![times(&sign, &cos), times(&sign, &sin)])
                };
                [(1.0, 0.01), (2.0, 0.01), (1.0, 0.03), (2.0, 0.03)].into_iter().filter_map(shape).collect()
            }
            "presliding_friction" => {
                let path = self.angle.as_ref()?;
                let range = range(path);
                let dahl = |r: &f64| vec![dahl(path, r * range)];
                [3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1].iter().map(dahl).collect()
            }
            "torque_ripple" => {
                let pairs: Option<Vec<_>> = orders.iter().map(|k| wave(*k)).collect();
                vec![pairs?.into_iter().flatten().collect()]
            }
            "torque_scale" => vec![vec![self.simulated.as_ref()?.to_vec()]],
            "time_skew" => {
                let simulated = self.simulated.as_ref()?;
                [1, 5, 15].iter().map(|w| vec![rate(&smoothed(simulated, *w), self.period_s)]).collect()
            }
            "sensor_drift" => vec![vec![self.time_s.to_vec()]],
            "gear" => vec![self.gear()?.columns(&[], self.deflection.as_ref()?).to_vec()],
            "nonlocal_memory" => vec![self.sliders()?],
            "load_dependent_memory" => {
                let (sliders, rated) = (self.sliders()?, self.gear()?.rated);
                let load: Vec<f64> = self.deflection.as_ref()?.iter().map(|x| (x / rated).powi(2)).collect();
                let grown = sliders.iter().map(|s| times(s, &load)).collect::<Vec<_>>();
                vec![sliders.into_iter().chain(grown).collect()]
            }
            _ => return None,
        })
    }

    /// A gear of the genetic-memory model whose rated deflection is the largest recorded.
    pub fn gear(&self) -> Option<Gear> {
        let rated = self.deflection.as_ref()?.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
        Some(Gear { rated, elastic: [0.0; 3], hysteresis: Hysteresis::Uniform { h: 0.0, e: 0.0 } })
    }

    fn sliders(&self) -> Option<Columns> {
        let (path, rated) = (self.deflection.as_ref()?, self.gear()?.rated);
        Some(RADII.iter().map(|r| crate::prove::generator::stop(r * rated, &path[..1], path)).collect())
    }
}

/// Textbook terms fitted to a torque, one after the other, each in its best shape beside the others.
#[derive(Debug, Clone)]
pub struct Fit {
    torque: Vec<f64>,
    /// The shapes of each term, and the one chosen.
    terms: Vec<(Vec<Columns>, usize)>,
    /// The constant, then the chosen shapes.
    columns: Columns,
}

/// Rounds in which the shapes are chosen anew after a term was added.
const ROUNDS: usize = 2;

impl Fit {
    /// A constant, fitted to `torque`.
    pub fn new(torque: &[f64]) -> Self {
        Self { torque: torque.to_vec(), terms: Vec::new(), columns: vec![vec![1.0; torque.len()]] }
    }

    /// Adds a term in the shape of `shapes` that predicts best, and says which; nothing where there is none. The shapes of the terms before are then chosen anew.
    pub fn add(&mut self, shapes: &[Columns]) -> Option<usize> {
        if shapes.is_empty() {
            return None;
        }
        let added = self.terms.len();
        self.terms.push((shapes.to_vec(), 0));
        for _ in 0..ROUNDS {
            for term in (0..=added).rev() {
                self.terms[term].1 = (0..self.terms[term].0.len())
                    .map(|shape| (shape, held_out(&self.columns_with(term, shape), &self.torque)))
                    .min_by(|a, b| a.1.total_cmp(&b.1))?
                    .0;
            }
        }
        self.columns = self.columns_with(added, self.terms[added].1);
        Some(self.terms[added].1)
    }

    /// The constant and the chosen shapes, that of one term replaced.
    fn columns_with(&self, term: usize, shape: usize) -> Columns {
        let mut columns = vec![vec![1.0; self.torque.len()]];
        for (at, (shapes, chosen)) in self.terms.iter().enumerate() {
            columns.extend(shapes[if at == term { shape } else { *chosen }].iter().cloned());
        }
        columns
    }

    /// The held-out error, rms.
    pub fn error(&self) -> f64 {
        held_out(&self.columns, &self.torque)
    }

    /// The weight of each column, the constant's first.
    pub fn weights(&self) -> Vec<f64> {
        let gram = Gram::new(&self.columns, &self.torque, 0..self.torque.len());
        let scale = scales(&self.columns);
        solve(&gram, &scale, self.torque.len())
    }
}

/// Products of columns with each other and with the torque over some rows.
#[derive(Clone)]
struct Gram {
    inner: DMatrix<f64>,
    target: DVector<f64>,
}

impl Gram {
    fn new(columns: &[Vec<f64>], torque: &[f64], rows: std::ops::Range<usize>) -> Self {
        let dot = |a: &[f64], b: &[f64]| a[rows.clone()].iter().zip(&b[rows.clone()]).map(|(a, b)| a * b).sum::<f64>();
        let count = columns.len();
        let mut inner = DMatrix::zeros(count, count);
        for i in 0..count {
            for k in 0..=i {
                inner[(i, k)] = dot(&columns[i], &columns[k]);
                inner[(k, i)] = inner[(i, k)];
            }
        }
        Self { inner, target: DVector::from_iterator(count, columns.iter().map(|c| dot(c, torque))) }
    }
}

fn scales(columns: &[Vec<f64>]) -> Vec<f64> {
    let mean_square = |c: &Vec<f64>| c.iter().map(|x| x * x).sum::<f64>() / c.len() as f64;
    columns.iter().map(|c| mean_square(c).sqrt().max(1e-300)).collect()
}

fn solve(gram: &Gram, scale: &[f64], rows: usize) -> Vec<f64> {
    let count = scale.len();
    let mut inner = DMatrix::from_fn(count, count, |i, k| gram.inner[(i, k)] / (scale[i] * scale[k]));
    for i in 0..count {
        inner[(i, i)] += RIDGE * rows as f64;
    }
    let target = DVector::from_fn(count, |i, _| gram.target[i] / scale[i]);
    let solution = inner
        .clone()
        .cholesky()
        .map(|c| c.solve(&target))
        .unwrap_or_else(|| inner.svd(true, true).solve(&target, 1e-12).unwrap_or_else(|_| DVector::zeros(count)));
    solution.iter().zip(scale).map(|(x, s)| x / s).collect()
}

/// Rms of the error in blocks that took no part in the fit.
fn held_out(columns: &[Vec<f64>], torque: &[f64]) -> f64 {
    let rows = torque.len();
    let edge = |b: usize| b * rows / BLOCKS;
    let scale = scales(columns);
    let all = Gram::new(columns, torque, 0..rows);
    let squares: f64 = (0..BLOCKS)
        .map(|b| {
            let gap = ((edge(b + 1) - edge(b)) as f64 * GAP).ceil() as usize;
            let out = edge(b).saturating_sub(gap)..(edge(b + 1) + gap).min(rows);
            let kept = rows - out.len();
            let apart = Gram::new(columns, torque, out);
            let rest = Gram { inner: &all.inner - &apart.inner, target: &all.target - &apart.target };
            let weights = solve(&rest, &scale, kept);
            let left = |i: usize| torque[i] - columns.iter().zip(&weights).map(|(c, w)| w * c[i]).sum::<f64>();
            (edge(b)..edge(b + 1)).map(|i| left(i).powi(2)).sum::<f64>()
        })
        .sum();
    (squares / rows as f64).sqrt()
}

fn range(path: &[f64]) -> f64 {
    let (low, high) = path.iter().fold((f64::MAX, f64::MIN), |(a, b), q| (a.min(*q), b.max(*q)));
    (high - low).max(1e-12)
}

/// A moving mean of `width` rows, shorter at the ends.
fn smoothed(x: &[f64], width: usize) -> Vec<f64> {
    let half = width / 2;
    let mut sums = vec![0.0];
    x.iter().for_each(|x| sums.push(sums[sums.len() - 1] + x));
    (0..x.len())
        .map(|i| {
            let (a, b) = (i.saturating_sub(half), (i + half + 1).min(x.len()));
            (sums[b] - sums[a]) / (b - a) as f64
        })
        .collect()
}

/// Central differences.
fn rate(x: &[f64], period_s: f64) -> Vec<f64> {
    let last = x.len() - 1;
    (0..x.len())
        .map(|i| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
            (x[b] - x[a]) / ((b - a).max(1) as f64 * period_s)
        })
        .collect()
}

/// Dahl's friction of torque 1 that reverses over `radius`.
fn dahl(path: &[f64], radius: f64) -> Vec<f64> {
    let (mut state, mut before) = (0.0, path[0]);
    path.iter()
        .map(|q| {
            let step = q - before;
            before = *q;
            if step != 0.0 {
                state = step.signum() + (state - step.signum()) * (-step.abs() / radius).exp();
            }
            state
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint that swings, with friction and inertia and nothing else.
    fn joint() -> Recording {
        let time_s: Vec<f64> = (0..4000).map(|i| 0.005 * f64::from(i)).collect();
        let angle: Vec<f64> = time_s.iter().map(|t| (1.3 * t).sin()).collect();
        let velocity: Vec<f64> = time_s.iter().map(|t| 1.3 * (1.3 * t).cos()).collect();
        let torque = (velocity.iter().zip(&angle)).map(|(v, q)| 3.0 * (v / 0.013).tanh() + 2.0 * v - 0.5 * 1.69 * q);
        Recording {
            torque: Some(torque.collect()),
            theta_out_rad: Some(angle.into()),
            velocity_out_rad_per_s: Some(velocity.into()),
            time_s: time_s.into(),
            ..Recording::default()
        }
    }

    #[test]
    fn the_true_terms_leave_nothing_and_have_the_true_weights() {
        let recording = joint();
        let channels = Channels::of(&recording);
        let mut fit = Fit::new(recording.torque.as_ref().unwrap());
        let bare = fit.error();
        for kind in ["coulomb_friction", "viscous_friction", "inertia"] {
            fit.add(&channels.shapes(kind, &[]));
        }
        assert!(fit.error() < 1e-2 * bare, "{} of {bare}", fit.error());
        let weights = fit.weights();
        assert!((weights[1] - 3.0).abs() < 0.02 && (weights[2] - 2.0).abs() < 0.02, "{weights:?}");
    }

    #[test]
    fn what_predicts_nothing_gains_nothing() {
        let recording = joint();
        let mut fit = Fit::new(recording.torque.as_ref().unwrap());
        let bare = fit.error();
        // What is there in one block only predicts nothing.
        fit.add(&[vec![(0..4000).map(|i| if i < 400 { 1.0 } else { 0.0 }).collect()]]);
        assert!(fit.error() > 0.99 * bare);
        assert!(Channels::of(&recording).shapes("torque_scale", &[]).is_empty());
    }
}
