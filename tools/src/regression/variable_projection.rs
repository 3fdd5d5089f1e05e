//! A model's way down to the recordings: what the torque is linear in is eliminated, the rest moves by the estimator's [descent](crate::numerics::levenberg_marquardt).
//!
//! Variable projection, as in the [polish](crate::regression::polish) of the base model: at any values of the numbers that move, the linear ones and the nuisances of
//! each recording are at their optimum by QR, and a step of the others is that of the columns with these taken out (Kaufman 1975). Linear together are the
//! amplitudes of all terms that add to the torque, and the elastic coefficients with e and h (law `masing`) or α (law `time`) of the gear. Not so:
//!
//! - what acts on the deflection (its zero, kinematic error, eccentricity, backlash), the delay, the temperature factor of friction, shapes, orders and time constants;
//! - ρ in law `phase`, which is e/h, and β in law `time`;
//! - the gear's own numbers beside a term that [follows](crate::model::Term::follows_base) them: friction in proportion to the torque, stiffness that falls with the
//!   temperature, a clearance, a curve over the torque. The amplitude of that term is eliminated, the gear moves.
//!
//! The whole chain of the core judges every step; nothing is linearised but the step. Columns stay in memory, for the noise is estimated anew before each step; the
//! [polish](crate::regression::polish) has the noise given, and keeps no rows.

use gmhm::terms::Domain;
use rayon::prelude::*;

use crate::model::{Model, Term};
use crate::numerics::autoregression::Noise;
use crate::numerics::bounded::damped_step;
use crate::numerics::levenberg_marquardt::{Descend, Linearisation, Schedule};
use crate::numerics::qr::Triangle;
use crate::physics::{Evaluation, PredictError};
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::parameters;
use crate::regression::parameters::{FreeParameter, domain, linear_together};
use crate::regression::polish::project;

/// A fit under way.
pub struct VariableProjection<'w, 's> {
    dataset: &'w Dataset<'s>,
    free: &'w [FreeParameter],
    beside: Option<&'w Fitted>,
    /// The noise that the rows are weighted by.
    pub noise: Vec<Noise>,
    white: bool,
    allowed: f64,
    /// Places that are eliminated, and those that steps move.
    linear: Vec<usize>,
    moving: Vec<usize>,
    /// Whether the columns of the linear parameters of other terms stay when something moves.
    others_stay: bool,
    most_steps: usize,
}

/// Where a fit stands.
#[derive(Clone, Default)]
pub struct Iterate {
    /// The model.
    pub model: Model,
    total: Vec<f64>,
    /// Target less total, without the nuisances.
    pub residual: Vec<f64>,
    /// The change of the torque with each parameter, as far as it is known here.
    columns: Vec<Option<Vec<f64>>>,
}

/// What is left when the linear numbers are out.
struct Projected {
    iterate: Iterate,
    /// The derivatives by what moves, then the residual.
    reduced: Triangle,
    /// Norms of the derivatives before anything was taken out.
    norms: Vec<f64>,
    /// The squares that the linear numbers took.
    gain: f64,
    /// The squares that are left.
    cost: f64,
}

/// What weighs the rows of a fit.
pub enum Weights {
    /// This noise at first, then that of what is left before each step.
    Coloured(Vec<Noise>),
    /// White noise to the end.
    White,
}

impl<'w, 's> VariableProjection<'w, 's> {
    /// A fit of some parameters of a model, starting where an iterate stands. Parameters that `beside` has fitted keep the columns of that fit. A step is rejected if it leaves
    /// more than 1.3 times the squares of the start, or of `beside` if those are larger.
    pub fn start(
        dataset: &'w Dataset<'s>,
        from: &Iterate,
        free: &'w [FreeParameter],
        weights: Weights,
        beside: Option<&'w Fitted>,
        most_steps: usize,
    ) -> Self {
        let Iterate { model, residual, .. } = from;
        // Structure must not pass for slow noise on the way, and the parameters drift with it.
        let squares = |residual: &[f64]| dataset.layout().squares(residual);
        let allowed = beside.map_or(0.0, |fit| squares(&fit.residual)).max(squares(residual));
        let (noise, white) = match weights {
            Weights::Coloured(noise) => (noise, false),
            Weights::White => (dataset.layout().white(), true),
        };
        let together = linear_together(model, free);
        let (linear, moving) = (0..free.len()).partition::<Vec<usize>, _>(|&k| together[k]);
        let adds = |&k: &usize| matches!(domain(model, free[k]), Some(Domain::Torque | Domain::Friction));
        let others_stay = moving.iter().all(adds) && !model.terms.iter().any(Term::follows_base);
        Self { dataset, free, beside, noise, white, allowed, linear, moving, others_stay, most_steps }
    }

    /// How far it goes.
    pub fn schedule(&self) -> Schedule {
        Schedule::strides(self.most_steps)
    }

    /// The change of the torque with each parameter.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn columns(&self, at: &mut Iterate) -> Result<Vec<Vec<f64>>, PredictError> {
        let all: Vec<usize> = (0..self.free.len()).collect();
        self.differentiate(at, &all)?;
        Ok(at.columns.iter().flatten().cloned().collect())
    }

    fn differentiate(&self, at: &mut Iterate, which: &[usize]) -> Result<(), PredictError> {
        at.differentiate(self.dataset, self.free, self.beside, which, None)
    }

    /// The linear numbers at their optimum, the others as they are, and what is then left beside the columns of `tangent`. Steps that drift are damped, or not
    /// taken at all.
    fn projected(&self, mut at: Iterate, tangent: &[usize]) -> Result<Projected, PredictError> {
        let layout = self.dataset.layout();
        self.differentiate(&mut at, &self.linear)?;
        let room = self.room(&at, &self.linear);
        let order: Vec<usize> = self.linear.iter().chain(tangent).copied().collect();
        let system = layout.system(&at.parts(&order), &at.residual, &self.noise);
        let count = self.linear.len();
        let own: Vec<usize> = (0..count).chain([order.len()]).collect();
        let linear = system.shared.select(&own);
        let parts = at.parts(&self.linear);
        let left = |step: &[f64]| {
            let mut left = at.residual.clone();
            for (part, step) in parts.iter().zip(step) {
                left.iter_mut().zip(*part).for_each(|(r, x)| *r -= step * x);
            }
            self.dataset.layout().less_nuisances(&system.linear(step), &mut left);
            left
        };
        let mut damped = self.schedule().damping.iter().map(|&damping| {
            let step =
                if count > 0 { damped_step(&linear, &system.norms[..count], damping, &room) } else { Vec::new() };
            let residual = left(&step);
            (step, residual)
        });
        let stay = || (vec![0.0; count], left(&vec![0.0; count]));
        let (step, residual) = damped.find(|(_, residual)| self.keeps(residual)).unwrap_or_else(stay);
        let held: Vec<bool> = step.iter().zip(&room).map(|(step, room)| *step <= room.0).collect();
        let model = self.stepped(&at.model, &self.linear, &step);
        let shared = system.shared.less(&step);
        let (total, residual, cost) = if self.beside.is_some() && !self.others_stay && count > 0 {
            // The columns are those of another deflection.
            let total = self.dataset.total(&model)?;
            let (residual, cost) = layout.without_nuisances(&self.noise, &self.dataset.centred(&total));
            (total, residual, cost)
        } else {
            let mut total = at.total.clone();
            for (part, step) in parts.iter().zip(&step) {
                total.iter_mut().zip(*part).for_each(|(t, x)| *t += step * x);
            }
            (total, residual, shared.norm(order.len()).powi(2))
        };
        Ok(Projected {
            reduced: project(&shared, &held, tangent.len()),
            norms: system.norms[count..].to_vec(),
            gain: system.shared.norm(order.len()).powi(2) - cost,
            cost,
            iterate: Iterate { model, total, residual, columns: at.columns },
        })
    }

    fn room(&self, at: &Iterate, which: &[usize]) -> Vec<(f64, f64)> {
        let own = |&k: &usize| {
            let parameter = self.free[k];
            let above = self.dataset.highest(parameter) - parameters::value(&at.model, parameter);
            (self.dataset.room(&at.model, parameter), above.max(0.0))
        };
        which.iter().map(own).collect()
    }

    fn stepped(&self, model: &Model, which: &[usize], step: &[f64]) -> Model {
        let mut model = model.clone();
        for (&k, step) in which.iter().zip(step) {
            let parameter = self.free[k];
            let step = step.max(self.dataset.room(&model, parameter));
            let value = (parameters::value(&model, parameter) + step).min(self.dataset.highest(parameter));
            parameters::put(&mut model, parameter, value);
        }
        model
    }

    /// Whether so much may be left.
    fn keeps(&self, residual: &[f64]) -> bool {
        self.white || self.dataset.layout().squares(residual) < DRIFTED * self.allowed
    }

    /// Whether a column stays what it was when something moved.
    fn stays(&self, k: usize) -> bool {
        let term = |k: usize| if let FreeParameter::Term { term, .. } = self.free[k] { Some(term) } else { None };
        self.others_stay && self.linear.contains(&k) && self.moving.iter().all(|&m| term(m) != term(k))
    }
}

impl Iterate {
    /// A model, with the change of the torque with each parameter where that is known already.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn at(dataset: &Dataset<'_>, model: &Model, columns: Vec<Option<Vec<f64>>>) -> Result<Self, PredictError> {
        Ok(Self::evaluated(dataset, model, columns, &dataset.evaluate(model)?))
    }

    /// [`at`](Self::at) a model that was evaluated.
    fn evaluated(
        dataset: &Dataset<'_>,
        model: &Model,
        columns: Vec<Option<Vec<f64>>>,
        evaluations: &[Evaluation<'_>],
    ) -> Self {
        let total: Vec<f64> = evaluations.iter().flat_map(|e| dataset.looked_at(e.total())).collect();
        let residual = dataset.centred(&total);
        Self { model: model.clone(), total, residual, columns }
    }

    /// A model and the change of the torque with all of its free numbers.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn with_columns(
        dataset: &Dataset<'_>,
        model: &Model,
        free: &[FreeParameter],
        beside: Option<&Fitted>,
    ) -> Result<Self, PredictError> {
        let evaluations = dataset.evaluate(model)?;
        let mut iterate = Self::evaluated(dataset, model, vec![None; free.len()], &evaluations);
        let all: Vec<usize> = (0..free.len()).collect();
        iterate.differentiate(dataset, free, beside, &all, Some(&evaluations))?;
        Ok(iterate)
    }

    /// Finds the change of the torque with some parameters where it is not known; where a parameter is one of the model fitted before, it is that of this model.
    /// `evaluations` are of the model here, where it was evaluated already.
    fn differentiate(
        &mut self,
        dataset: &Dataset<'_>,
        free: &[FreeParameter],
        beside: Option<&Fitted>,
        which: &[usize],
        evaluations: Option<&[Evaluation<'_>]>,
    ) -> Result<(), PredictError> {
        let mut open: Vec<usize> = which.iter().copied().filter(|&k| self.columns[k].is_none()).collect();
        if let Some(fit) = beside {
            open.retain(|&k| {
                let known = fit.parameters.iter().position(|parameter| *parameter == free[k]);
                self.columns[k] = known.map(|i| fit.columns[i].clone());
                known.is_none()
            });
        }
        if open.is_empty() {
            return Ok(());
        }
        let own;
        let evaluations = match evaluations {
            Some(evaluations) => evaluations,
            None => {
                own = dataset.evaluate(&self.model)?;
                &own
            }
        };
        let of = |&k: &usize| dataset.derivative(&self.model, free[k], evaluations);
        let found: Vec<Vec<f64>> = open.par_iter().map(of).collect::<Result<_, _>>()?;
        open.into_iter().zip(found).for_each(|(k, column)| self.columns[k] = Some(column));
        Ok(())
    }

    fn parts(&self, which: &[usize]) -> Vec<&[f64]> {
        which.iter().filter_map(|&k| self.columns[k].as_deref()).collect()
    }
}

impl Descend for VariableProjection<'_, '_> {
    type Point = Iterate;
    type Error = PredictError;

    fn linearise(&mut self, at: &mut Iterate) -> Result<Linearisation, PredictError> {
        let all: Vec<usize> = (0..self.free.len()).collect();
        // Where nothing moves, noise and linear numbers settle here in turn.
        let mut rounds = if self.moving.is_empty() { self.most_steps } else { 1 };
        loop {
            self.differentiate(at, &all)?;
            if !self.white {
                let layout = self.dataset.layout();
                self.noise = layout.profile(&at.parts(&all), &at.residual, &self.noise, 2).noise;
            }
            let Projected { iterate, reduced, norms, gain, cost } = self.projected(std::mem::take(at), &self.moving)?;
            *at = iterate;
            rounds -= 1;
            if rounds == 0 || self.white || gain < SETTLED {
                return Ok(Linearisation { reduced, norms, room: self.room(at, &self.moving), cost });
            }
        }
    }

    fn moved(&mut self, at: &Iterate, step: &[f64]) -> Option<(Iterate, f64)> {
        let model = self.stepped(&at.model, &self.moving, step);
        let keep = |(k, column): (usize, &Option<Vec<f64>>)| column.clone().filter(|_| self.stays(k));
        let columns = at.columns.iter().enumerate().map(keep).collect();
        let evaluations = self.dataset.evaluate(&model).ok()?;
        let mut moved = Iterate::evaluated(self.dataset, &model, columns, &evaluations);
        moved.differentiate(self.dataset, self.free, self.beside, &self.linear, Some(&evaluations)).ok()?;
        drop(evaluations);
        let Projected { iterate, cost, .. } = self.projected(moved, &[]).ok()?;
        self.keeps(&iterate.residual).then_some((iterate, cost))
    }

    fn is_converged(&self, gain: f64, _: f64) -> bool {
        gain < SETTLED
    }
}

/// A step against coloured noise may leave so many times the squares that it began with.
const DRIFTED: f64 = 1.3;

/// A step that gains less than this of the deviance is the last.
const SETTLED: f64 = 0.05;
