//! A model fitted to the subject: gear and terms together, by Gauss and Newton, against noise whose colour is fitted in turn.
//!
//! Every derivative is a difference of the whole chain of the core (deflection terms, turning points, delays), so nothing is linearised but the step.

use gmhm::Law;
use gmhm::terms::{Domain, Role};
use rayon::prelude::*;

use super::DiscoverError;
use super::explain::Search;
use super::least_squares::{Layout, bounded_steps, dot, normal_matrix, pseudo_inverse, solve};
use super::parameters::{self, Place};
use super::subject::Subject;
use crate::estimate::noise::Noise;
use crate::model::Model;
use crate::physics::PredictError;

/// A model fitted to the subject, and what the next step needs of it.
#[derive(Clone)]
pub struct Fitted {
    /// The model.
    pub model: Model,
    /// Its free numbers.
    pub places: Vec<Place>,
    /// Target less model less offset.
    pub residual: Vec<f64>,
    /// The change of the torque with each free number, then with the offset of each recording.
    pub columns: Vec<Vec<f64>>,
    /// The noise of each recording.
    pub noise: Vec<Noise>,
    /// −2 ln L, without constants.
    pub minus_two_log_likelihood: f64,
}

impl Subject<'_> {
    /// Marks and spans.
    pub fn layout(&self) -> Layout<'_> {
        Layout { spans: &self.spans, marks: &self.marks }
    }

    /// The free numbers of a model.
    pub fn places(&self, model: &Model, search: Search<'_>) -> Vec<Place> {
        let mut places = if self.free_base { parameters::of_gear(model) } else { Vec::new() };
        if search.zero {
            places.push(Place::Zero);
        }
        let first = if self.free_base { 0 } else { search.base_terms };
        places.extend((first..model.terms.len()).flat_map(|term| parameters::of_term(model, term)));
        places
    }

    /// The change of the torque with each place, then with the offset of each recording; of a place of `beside` that of `beside`.
    fn derivatives(
        &self,
        model: &Model,
        places: &[Place],
        total: &[f64],
        beside: Option<&Fitted>,
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        let one = |place: &Place| -> Result<Vec<f64>, PredictError> {
            let known = beside.and_then(|fit| fit.places.iter().position(|p| p == place).map(|i| &fit.columns[i]));
            if let Some(known) = known {
                return Ok(known.clone());
            }
            let at = |value: f64| {
                let mut moved = model.clone();
                parameters::put(&mut moved, *place, value);
                self.total(&moved)
            };
            let (low, high) = parameters::sides(model, *place);
            if is_linear(model, *place) {
                let span = high - parameters::value(model, *place);
                return Ok(at(high)?.iter().zip(total).map(|(a, b)| (a - b) / span).collect());
            }
            let (above, below) = (at(high)?, at(low)?);
            Ok(above.iter().zip(&below).map(|(a, b)| (a - b) / (high - low)).collect())
        };
        let mut columns: Vec<Vec<f64>> = places.par_iter().map(one).collect::<Result<_, _>>()?;
        columns.extend(self.nuisances.iter().cloned());
        Ok(columns)
    }

    /// Target less total, each recording about its own mean.
    fn centred(&self, total: &[f64]) -> Vec<f64> {
        let mut residual: Vec<f64> = self.target.iter().zip(total).map(|(t, m)| t - m).collect();
        for (span, marks) in self.spans.iter().zip(&self.marks) {
            let counts = |row: &usize| !matches!(marks[*row], crate::estimate::columns::Mark::Skipped);
            let own = &mut residual[span.clone()];
            let kept: Vec<f64> = (0..own.len()).filter(counts).map(|r| own[r]).collect();
            let mean = kept.iter().sum::<f64>() / kept.len().max(1) as f64;
            own.iter_mut().for_each(|r| *r -= mean);
        }
        residual
    }

    /// Fits the free numbers of a model. `noise` is a first guess of the noise; without one, the fit begins as if it were white, so that structure is not
    /// taken for noise before it was looked at.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn fit(
        &self,
        model: &Model,
        places: &[Place],
        noise: Option<&[Noise]>,
        most_steps: usize,
    ) -> Result<Fitted, DiscoverError> {
        self.fit_beside(model, places, noise, most_steps, None)
    }

    /// [`fit`](Self::fit), where the change of the torque with the numbers of a model fitted before stays what it was.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn fit_beside(
        &self,
        model: &Model,
        places: &[Place],
        noise: Option<&[Noise]>,
        most_steps: usize,
        beside: Option<&Fitted>,
    ) -> Result<Fitted, DiscoverError> {
        if noise.is_some() {
            return self.fit_from(model, places, noise, most_steps, beside);
        }
        let white = self.descend(model, places, None, WHITE_STEPS, beside)?;
        self.descend(&white.model, places, Some(&white.noise), most_steps, beside)
    }

    /// [`fit`](Self::fit) from a first guess of the noise, and from white noise where that ends better.
    fn fit_from(
        &self,
        model: &Model,
        places: &[Place],
        noise: Option<&[Noise]>,
        most_steps: usize,
        beside: Option<&Fitted>,
    ) -> Result<Fitted, DiscoverError> {
        let direct = self.descend(model, places, noise, most_steps, beside)?;
        if most_steps < WHITE_STEPS {
            return Ok(direct);
        }
        let white = self.fit_beside(model, places, None, most_steps, beside)?;
        let better = white.minus_two_log_likelihood < direct.minus_two_log_likelihood;
        let drifted = dot(&direct.residual, &direct.residual) > ASTRAY * dot(&white.residual, &white.residual);
        Ok(if better || drifted { white } else { direct })
    }

    /// Gauss-Newton steps against `noise`, fitted anew before each; without it against white noise to the end.
    fn descend(
        &self,
        model: &Model,
        places: &[Place],
        noise: Option<&[Noise]>,
        most_steps: usize,
        beside: Option<&Fitted>,
    ) -> Result<Fitted, DiscoverError> {
        let layout = self.layout();
        let white = noise.is_none();
        let mut model = model.clone();
        let mut total = self.total(&model)?;
        let mut residual = self.centred(&total);
        let mut noise = noise.map_or_else(|| self.spans.iter().map(|_| Noise::unit()).collect(), <[Noise]>::to_vec);
        let mut columns = self.derivatives(&model, places, &total, beside)?;
        let mut stale = false;
        // Structure must not pass for slow noise on the way, and the parameters drift with it.
        let allowed = beside.map_or(0.0, |fit| dot(&fit.residual, &fit.residual)).max(dot(&residual, &residual));
        for _ in 0..most_steps {
            if stale {
                columns = self.derivatives(&model, places, &total, beside)?;
            }
            let parts: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            if !white {
                noise = layout.profile(&parts, &residual, &noise, 2).noise;
            }
            let whitened: Vec<Vec<f64>> = columns.iter().map(|c| layout.whiten(&noise, c)).collect();
            let mut room: Vec<f64> = places.iter().map(|&p| parameters::room(&model, p)).collect();
            room.resize(columns.len(), f64::NEG_INFINITY);
            let steps = bounded_steps(&whitened, &layout.whiten(&noise, &residual), &room, &DAMPING);
            let size = |residual: &[f64]| {
                let white = layout.whiten(&noise, residual);
                white.iter().map(|x| x * x).sum::<f64>()
            };
            let before = size(&residual);
            let mut moved = None;
            for step in &steps {
                let mut candidate = model.clone();
                for (&place, step) in places.iter().zip(step) {
                    let value = parameters::value(&model, place) + step;
                    parameters::put(&mut candidate, place, value);
                }
                let Ok(total) = self.total(&candidate) else { continue };
                let mut left = self.centred(&total);
                // The offsets go with the step.
                left = self.without_offsets(&noise, &left);
                let after = size(&left);
                if after < before && (white || dot(&left, &left) < DRIFTED * allowed) {
                    moved = Some((candidate, total, left, after));
                    break;
                }
            }
            let Some((candidate, new_total, left, after)) = moved else { break };
            (model, total, residual) = (candidate, new_total, left);
            stale = true;
            if before - after < SETTLED {
                break;
            }
        }
        if stale {
            columns = self.derivatives(&model, places, &total, beside)?;
        }
        residual = self.without_offsets(&noise, &residual);
        noise = layout.noise(&residual, 0);
        let minus_two_log_likelihood = layout.minus_two_log_likelihood(&noise, &residual);
        Ok(Fitted { model, places: places.to_vec(), residual, columns, noise, minus_two_log_likelihood })
    }

    /// A line of rows with the nuisances of each recording taken out as the noise asks.
    pub fn without_offsets(&self, noise: &[Noise], residual: &[f64]) -> Vec<f64> {
        let layout = self.layout();
        let columns: Vec<Vec<f64>> = self.nuisances.iter().map(|c| layout.whiten(noise, c)).collect();
        let weights = solve(&columns, &layout.whiten(noise, residual));
        let mut left = residual.to_vec();
        for (column, weight) in self.nuisances.iter().zip(&weights) {
            left.iter_mut().zip(column).for_each(|(r, x)| *r -= weight * x);
        }
        left
    }
}

/// A step against coloured noise may leave so many times the squares that it began with.
const DRIFTED: f64 = 1.3;

/// A fit that leaves so many times the squares of one that began with white noise has taken physics for noise.
const ASTRAY: f64 = 2.0;

/// Steps taken as if the noise were white.
const WHITE_STEPS: usize = 4;

/// Damping of a step: the first that lowers the deviance is taken.
const DAMPING: [f64; 5] = [1e-10, 1e-6, 1e-4, 1e-2, 0.3];

/// A step that gains less than this of the deviance is the last.
const SETTLED: f64 = 0.05;

/// Whether the torque is linear in a place.
fn is_linear(model: &Model, place: Place) -> bool {
    match place {
        Place::Elastic(_) => true,
        Place::Memory(_) => model.memory.is_some_and(|m| m.law == Law::Masing),
        Place::Zero => false,
        Place::Term { term, key, .. } => {
            let domain = model.terms[term].info().map(|info| info.domain);
            key.role == Role::Linear && domain != Some(Domain::Deflection)
        }
    }
}

impl Fitted {
    /// Standard deviation of each free number, and of each offset, given all others free.
    pub fn standard_deviations(&self, layout: Layout<'_>) -> Vec<f64> {
        let used = self.columns.len();
        let noise = layout.noise(&self.residual, used);
        let whitened: Vec<Vec<f64>> = self.columns.iter().map(|c| layout.whiten(&noise, c)).collect();
        let (gram, scales) = normal_matrix(&whitened);
        let covariance = pseudo_inverse(&gram);
        (0..used).map(|i| covariance[(i, i)].max(0.0).sqrt() / scales[i]).collect()
    }
}
