//! The shapes of a term that was found, searched by the estimator's seeded swarm.
//!
//! The grid finds the kind, the polish its nearest optimum. A shape may have others: a second slipping element at three times the radius of the first, a dip of
//! friction that is wide instead of deep. So all shapes of the term are searched together, a decade on both sides; at each position its amplitudes are
//! eliminated, and everything else that is free by its columns about the fit. What is better is polished in turn.

use gmhm::terms::{KeyInfo, Range, Role};

use crate::diagnose::DiagnoseError;
use crate::kinds;
use crate::model::Term;
use crate::numerics::autoregression::Noise;
use crate::numerics::basis::Basis;
use crate::numerics::extremes::largest;
use crate::numerics::particle_swarm::{SwarmOptions, minimise};
use crate::numerics::vector::dot;
use crate::physics::columns::{get, set};
use crate::physics::{Evaluation, PredictError};
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::parameters;
use crate::regression::parameters::FreeParameter;

/// A number is searched from itself divided by this to itself times it.
const DECADE: f64 = 10.0;

/// The deviance by which a position has to beat the fit to be polished.
const BETTER: f64 = 2.0;

/// A number of a term that is searched, by ratios where it has a scale.
struct Shape {
    key: &'static KeyInfo,
    index: Option<usize>,
    low: f64,
    high: f64,
    scales: bool,
}

/// A term beside everything else that a fit holds.
struct Beside<'b, 's> {
    dataset: &'b Dataset<'s>,
    fit: &'b Fitted,
    /// The model without the term.
    evaluations: &'b [Evaluation<'s>],
    /// What the term and what is left explain together.
    explained: Vec<f64>,
    /// All else that is free.
    others: Basis,
    /// Whether the term has amplitudes.
    adds: bool,
}

impl Dataset<'_> {
    /// A fitted model with the shapes of one of its terms where the swarm finds them, if that is better. `seed` draws its random numbers.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn reshaped(&self, fit: Fitted, term: usize, seed: u64) -> Result<Fitted, DiagnoseError> {
        let mut without = fit.model.clone();
        let own = without.terms.remove(term);
        // What is better is polished on all rows.
        let coarse = (self.stride > 1).then(|| self.with_mean_signals());
        let rows_searched = coarse.as_ref().unwrap_or(self);
        let evaluations = rows_searched.evaluate(&without)?;
        let evaluations: Vec<Evaluation<'_>> = evaluations.into_iter().map(Evaluation::without_parts).collect();
        let shapes = rows_searched.shapes(&fit, term, &evaluations);
        if shapes.is_empty() {
            return Ok(fit);
        }
        let shaped = |position: &[f64]| {
            let moved = |term: Term, (shape, x): (&Shape, &f64)| set(&term, shape.key, shape.index, shape.at(*x));
            shapes.iter().zip(position).fold(own.clone(), moved)
        };
        let white = Fitted { noise: self.spans.iter().map(|_| Noise::unit()).collect(), ..fit.clone() };
        // Coloured noise that was fitted beside a wrong shape may hold what the right one explains.
        for (against, rows) in [(&fit, None), (&white, Some(self.counted() as f64))] {
            let beside = Beside::new(rows_searched, against, term, &evaluations)?;
            let Some(now) = beside.left(&own) else { break };
            let options = SwarmOptions::for_unknowns(shapes.len(), seed, 0.1 * BETTER / rows.unwrap_or(now));
            let objective = |position: &[f64]| beside.left(&shaped(position)).unwrap_or(f64::INFINITY);
            let best = minimise(&vec![(0.0, 1.0); shapes.len()], &options, objective);
            let gain = rows.map_or(now - best.value, |rows| rows * (now / best.value).ln());
            if gain < BETTER {
                continue;
            }
            let mut model = fit.model.clone();
            model.terms[term] = shaped(&best.position);
            let other = self.fit(&model, &fit.parameters, Some(&fit.noise), 6)?;
            let better = other.minus_two_log_likelihood < fit.minus_two_log_likelihood;
            if better && kinds::positive_where_needed(&other.model.terms[term]) {
                return Ok(other);
            }
        }
        Ok(fit)
    }

    /// What of a term is searched: whatever its torque is not linear in. Its orders are those that the spectrum shows.
    fn shapes(&self, fit: &Fitted, term: usize, evaluations: &[Evaluation<'_>]) -> Vec<Shape> {
        let fastest =
            self.signal(evaluations, |s| s.velocity_rad_per_s.as_deref()).map_or(f64::INFINITY, |v| largest(&v));
        let time = self.time_s();
        let shape = |parameter: FreeParameter| {
            let FreeParameter::Term { key, index, .. } = parameter else { return None };
            let value = get(&fit.model.terms[term], key, index);
            if key.role != Role::Nonlinear || value == 0.0 {
                return None;
            }
            if key.name == "start_s" {
                return Some(Shape { key, index, low: time[0], high: time[time.len() - 1], scales: false });
            }
            let size = value.abs();
            let (least, most) = (key.plausible.0.abs().min(size), key.plausible.1.abs().max(size));
            let least = if key.range == Range::Positive { least } else { 0.0 };
            let most = if key.name == kinds::SMOOTHING { size.max(kinds::LARGEST_SMOOTHING * fastest) } else { most };
            let (low, high) = ((size / DECADE).max(least), (size * DECADE).min(most));
            Some(Shape { key, index, low: low.copysign(value), high: high.copysign(value), scales: true })
        };
        parameters::of_term(&fit.model, term).into_iter().filter_map(shape).collect()
    }
}

impl Shape {
    /// The number at a position between 0 and 1.
    fn at(&self, position: f64) -> f64 {
        if self.scales {
            self.low * (self.high / self.low).powf(position)
        } else {
            self.low + (self.high - self.low) * position
        }
    }
}

impl<'b, 's> Beside<'b, 's> {
    fn new(
        dataset: &'b Dataset<'s>,
        fit: &'b Fitted,
        term: usize,
        evaluations: &'b [Evaluation<'s>],
    ) -> Result<Self, PredictError> {
        let own = &fit.model.terms[term];
        let of_term =
            |parameter: &FreeParameter| matches!(parameter, FreeParameter::Term { term: t, .. } if *t == term);
        let mut others = Basis::default();
        for (k, column) in fit.columns.iter().enumerate() {
            if !fit.parameters.get(k).is_some_and(of_term) {
                others.add(&dataset.layout().whiten(&fit.noise, column));
            }
        }
        let amplitude = |key: &KeyInfo| key.role == Role::Linear && own.values.contains_key(key.name);
        let adds = own.info().is_some_and(|info| info.keys.iter().any(amplitude));
        let mut explained = dataset.change(evaluations, own)?;
        explained.iter_mut().zip(&fit.residual).for_each(|(x, left)| *x += left);
        Ok(Self { dataset, fit, evaluations, explained, others, adds })
    }

    /// The squares that are left with the term shaped like this, whitened; `None` where it is none of its kind.
    fn left(&self, term: &Term) -> Option<f64> {
        term.check().ok()?;
        let white = |line: &[f64]| self.dataset.layout().whiten(&self.fit.noise, line);
        if self.adds {
            let mut y = white(&self.explained);
            self.others.reduce(&mut y);
            let units = self.dataset.unit_columns(self.evaluations, term).ok()?;
            let units: Vec<Vec<f64>> = units.iter().map(|unit| white(&unit.values)).collect();
            return Some(dot(&y, &y) - self.others.gain(&units, &y).0);
        }
        let change = self.dataset.change(self.evaluations, term).ok()?;
        let mut y = white(&self.explained.iter().zip(&change).map(|(x, change)| x - change).collect::<Vec<_>>());
        self.others.reduce(&mut y);
        Some(dot(&y, &y))
    }
}
