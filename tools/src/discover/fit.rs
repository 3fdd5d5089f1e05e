//! A model fitted to the subject: gear and terms together, by the estimator's [descent](crate::estimate::descent), against noise whose colour is fitted in turn.
//!
//! What the problem eliminates are the nuisances of each recording; the numbers of gear and terms move together. Which of them are linear depends on
//! the terms (friction that follows the torque, stiffness that follows the temperature and delays multiply the gear's own), and one evaluation of the whole chain
//! of the core (deflection terms, turning points, delays) judges a step, where eliminating them would ask for one a number. Nothing is linearised but the step.

use gmhm::Law;
use gmhm::terms::{Domain, Role};
use rayon::prelude::*;

use super::DiscoverError;
use super::explain::Search;
use super::parameters::{self, Place};
use super::subject::Subject;
use crate::estimate::descent::{Descend, Pace, Slope, descend};
use crate::estimate::factors::System;
use crate::estimate::noise::Noise;
use crate::estimate::profile::Layout;
use crate::estimate::triangle::dot;
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
    /// Fitted by plain least squares: what is left is physics more than noise, and does not weigh the rows.
    pub plain: bool,
    /// −2 ln L, without constants.
    pub minus_two_log_likelihood: f64,
}

impl Subject<'_> {
    /// The rows, and what of them is no property of the gear.
    pub fn layout(&self) -> Layout<'_> {
        let Self { recordings, spans, marks, nuisances, .. } = self;
        Layout { recordings, spans, marks, nuisances }
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
        // Either is a point of the same model, so the better likelihood is the model's.
        let least = direct.minus_two_log_likelihood.min(white.minus_two_log_likelihood);
        let chosen = if better || drifted { white } else { direct };
        Ok(Fitted { minus_two_log_likelihood: least, ..chosen })
    }

    /// A fit, or the one by plain least squares where that predicts held-out blocks clearly better: what is left is then physics more than noise.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn settled(&self, fit: Fitted) -> Result<Fitted, DiscoverError> {
        let plain = self.descend(&fit.model, &fit.places, None, PLAIN_STEPS, None)?;
        Ok(if self.rms_of_blocks(&plain) < CLEARLY * self.rms_of_blocks(&fit) { plain } else { fit })
    }

    /// Goes down against `noise`, fitted anew before each step; without it against white noise to the end.
    fn descend(
        &self,
        model: &Model,
        places: &[Place],
        noise: Option<&[Noise]>,
        most_steps: usize,
        beside: Option<&Fitted>,
    ) -> Result<Fitted, DiscoverError> {
        let layout = self.layout();
        let total = self.total(model)?;
        let residual = self.centred(&total);
        // Structure must not pass for slow noise on the way, and the parameters drift with it.
        let allowed = beside.map_or(0.0, |fit| dot(&fit.residual, &fit.residual)).max(dot(&residual, &residual));
        let white = noise.is_none();
        let noise = noise.map_or_else(|| layout.white(), <[Noise]>::to_vec);
        let mut walk = Walk { subject: self, places, beside, noise, white, allowed };
        let from = Stand { model: model.clone(), total, residual, columns: None };
        let (mut stand, _) = descend(&mut walk, from, Pace::strides(most_steps), &())?;
        let columns = stand.columns.take().map_or_else(|| walk.columns(&stand), Ok)?;
        let residual = self.without_offsets(&walk.noise, &stand.residual);
        let noise = layout.noise(&residual, 0);
        let minus_two_log_likelihood = layout.minus_two_log_likelihood(&noise, &residual);
        Ok(Fitted {
            model: stand.model,
            places: places.to_vec(),
            residual,
            columns,
            noise,
            plain: white,
            minus_two_log_likelihood,
        })
    }

    /// A line of rows with the nuisances of each recording taken out as the noise asks.
    pub fn without_offsets(&self, noise: &[Noise], residual: &[f64]) -> Vec<f64> {
        self.layout().without_nuisances(noise, residual).0
    }
}

/// A fit under way.
struct Walk<'w, 's> {
    subject: &'w Subject<'s>,
    places: &'w [Place],
    beside: Option<&'w Fitted>,
    noise: Vec<Noise>,
    /// Whether the noise stays white.
    white: bool,
    /// The squares that the steps began with.
    allowed: f64,
}

/// Where a fit stands.
struct Stand {
    model: Model,
    total: Vec<f64>,
    residual: Vec<f64>,
    columns: Option<Vec<Vec<f64>>>,
}

impl Walk<'_, '_> {
    fn columns(&self, stand: &Stand) -> Result<Vec<Vec<f64>>, PredictError> {
        self.subject.derivatives(&stand.model, self.places, &stand.total, self.beside)
    }
}

impl Descend for Walk<'_, '_> {
    type Point = Stand;
    type Error = PredictError;

    fn slope(&mut self, at: &mut Stand) -> Result<Slope, PredictError> {
        let layout = self.subject.layout();
        let columns = at.columns.take().map_or_else(|| self.columns(at), Ok)?;
        let parts: Vec<&[f64]> = columns[..self.places.len()].iter().map(Vec::as_slice).collect();
        if !self.white {
            self.noise = layout.profile(&parts, &at.residual, &self.noise, 2).noise;
        }
        let System { shared: reduced, norms, .. } = layout.system(&parts, &at.residual, &self.noise);
        let slope = Slope {
            room: self.places.iter().map(|&p| (parameters::room(&at.model, p), f64::INFINITY)).collect(),
            cost: reduced.norm(parts.len()).powi(2),
            norms,
            reduced,
        };
        at.columns = Some(columns);
        Ok(slope)
    }

    fn moved(&mut self, at: &Stand, step: &[f64]) -> Option<(Stand, f64)> {
        let mut model = at.model.clone();
        for (&place, step) in self.places.iter().zip(step) {
            let value = parameters::value(&at.model, place) + step;
            parameters::put(&mut model, place, value);
        }
        let total = self.subject.total(&model).ok()?;
        let (residual, cost) = self.subject.layout().without_nuisances(&self.noise, &self.subject.centred(&total));
        let kept = self.white || dot(&residual, &residual) < DRIFTED * self.allowed;
        kept.then_some((Stand { model, total, residual, columns: None }, cost))
    }

    fn settled(&self, gain: f64, _: f64) -> bool {
        gain < SETTLED
    }
}

/// A step against coloured noise may leave so many times the squares that it began with.
const DRIFTED: f64 = 1.3;

/// A fit that leaves so many times the squares of one that began with white noise has taken physics for noise.
const ASTRAY: f64 = 1.4;

/// Plain least squares are preferred where they leave less than this share of what is left of held-out blocks.
const CLEARLY: f64 = 0.8;

/// Steps of plain least squares.
const PLAIN_STEPS: usize = 8;

/// Steps taken as if the noise were white.
const WHITE_STEPS: usize = 4;

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
    /// The change of the torque with each free number, without the nuisances.
    pub fn of_places(&self) -> Vec<&[f64]> {
        self.columns[..self.places.len()].iter().map(Vec::as_slice).collect()
    }
}
