//! A model fitted to the dataset: gear and terms together, by the estimator's [descent](crate::numerics::levenberg_marquardt), against noise whose colour is fitted in turn.
//!
//! How it descends is described in [`projection`](crate::regression::variable_projection).

use crate::model::Model;
use crate::numerics::autoregression::Noise;
use crate::numerics::levenberg_marquardt::descend;
use crate::physics::PredictError;
use crate::physics::columns::Evaluation;
use crate::regression::dataset::Dataset;
use crate::regression::error::EstimateError;
use crate::regression::likelihood::Layout;
use crate::regression::parameters;
use crate::regression::parameters::FreeParameter;
use crate::regression::variable_projection::{Iterate, VariableProjection, Weights};

/// A model fitted to the dataset, and what the next step needs of it.
#[derive(Clone)]
pub struct Fitted {
    /// The model.
    pub model: Model,
    /// Its free numbers.
    pub parameters: Vec<FreeParameter>,
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

impl Dataset<'_> {
    /// The rows, and what of them is no property of the gear.
    pub fn layout(&self) -> Layout<'_> {
        let Self { recordings, spans, marks, nuisances, .. } = self;
        Layout { recordings, spans, marks, nuisances }
    }

    /// The free numbers of a model. `zero` frees the zero of the deflection.
    pub fn free_parameters(&self, model: &Model, zero: bool) -> Vec<FreeParameter> {
        parameters::free(model, zero)
    }

    /// The change of the torque with a parameter of a model that was evaluated.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn derivative(
        &self,
        model: &Model,
        parameter: FreeParameter,
        evaluations: &[Evaluation<'_>],
    ) -> Result<Vec<f64>, PredictError> {
        let mut line = Vec::with_capacity(self.len());
        for (index, evaluation) in evaluations.iter().enumerate() {
            let total = |moved: &Model| Ok(self.evaluate_one(moved, index)?.total().to_vec());
            line.extend(self.looked_at(&parameters::derivative(model, parameter, evaluation, total)?));
        }
        Ok(line)
    }

    /// Target less total, each recording about its own mean.
    pub fn centred(&self, total: &[f64]) -> Vec<f64> {
        let mut residual: Vec<f64> = self.target.iter().zip(total).map(|(t, m)| t - m).collect();
        for (span, marks) in self.spans.iter().zip(&self.marks) {
            let counts = |row: &usize| !matches!(marks[*row], crate::numerics::mark::Mark::Skipped);
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
        free: &[FreeParameter],
        noise: Option<&[Noise]>,
        most_steps: usize,
    ) -> Result<Fitted, EstimateError> {
        self.fit_beside(model, free, noise, most_steps, None)
    }

    /// [`fit`](Self::fit), where the change of the torque with the numbers of a model fitted before stays what it was.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn fit_beside(
        &self,
        model: &Model,
        free: &[FreeParameter],
        noise: Option<&[Noise]>,
        most_steps: usize,
        beside: Option<&Fitted>,
    ) -> Result<Fitted, EstimateError> {
        let from = Iterate::with_columns(self, model, free, beside)?;
        match noise {
            Some(noise) => self.fit_from(from, free, noise, most_steps, beside),
            None => self.fit_from_white(from, free, most_steps, beside),
        }
    }

    /// Fits numbers of another model, or along other rows, as those of a fit were fitted: by plain least squares, or against its coloured noise.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn fit_as(
        &self,
        before: &Fitted,
        model: &Model,
        free: &[FreeParameter],
        most_steps: usize,
    ) -> Result<Fitted, EstimateError> {
        if before.plain {
            self.plain_fit(model, free, most_steps)
        } else {
            self.fit(model, free, Some(&before.noise), most_steps)
        }
    }

    /// [`fit`](Self::fit) from white noise.
    fn fit_from_white(
        &self,
        from: Iterate,
        free: &[FreeParameter],
        most_steps: usize,
        beside: Option<&Fitted>,
    ) -> Result<Fitted, EstimateError> {
        let Fitted { model, mut columns, noise, .. } = self.descend(from, free, None, WHITE_STEPS, beside)?;
        columns.truncate(free.len());
        let from = Iterate::at(self, &model, columns.into_iter().map(Some).collect())?;
        self.descend(from, free, Some(&noise), most_steps, beside)
    }

    /// [`fit`](Self::fit) from a first guess of the noise, and from white noise where that ends better.
    fn fit_from(
        &self,
        from: Iterate,
        free: &[FreeParameter],
        noise: &[Noise],
        most_steps: usize,
        beside: Option<&Fitted>,
    ) -> Result<Fitted, EstimateError> {
        if most_steps < WHITE_STEPS {
            return self.descend(from, free, Some(noise), most_steps, beside);
        }
        let direct = self.descend(from.clone(), free, Some(noise), most_steps, beside)?;
        let white = self.fit_from_white(from, free, most_steps, beside)?;
        let better = white.minus_two_log_likelihood < direct.minus_two_log_likelihood;
        let squares = |fit: &Fitted| self.layout().squares(&fit.residual);
        let drifted = squares(&direct) > ASTRAY * squares(&white);
        // Either is a point of the same model, so the better likelihood is the model's.
        let least = direct.minus_two_log_likelihood.min(white.minus_two_log_likelihood);
        let chosen = if better || drifted { white } else { direct };
        Ok(Fitted { minus_two_log_likelihood: least, ..chosen })
    }

    /// A fit, or the one by plain least squares where that predicts held-out blocks clearly better: what is left is then physics more than noise.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn or_plain(&self, fit: Fitted) -> Result<Fitted, EstimateError> {
        let plain = self.plain_fit(&fit.model, &fit.parameters, PLAIN_STEPS)?;
        Ok(if self.rms_of_blocks(&plain) < CLEARLY * self.rms_of_blocks(&fit) { plain } else { fit })
    }

    /// Fits the free numbers of a model by plain least squares.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn plain_fit(&self, model: &Model, free: &[FreeParameter], most_steps: usize) -> Result<Fitted, EstimateError> {
        self.descend(Iterate::with_columns(self, model, free, None)?, free, None, most_steps, None)
    }

    /// Goes down against `noise`, fitted anew before each step; without it against white noise to the end.
    fn descend(
        &self,
        from: Iterate,
        free: &[FreeParameter],
        noise: Option<&[Noise]>,
        most_steps: usize,
        beside: Option<&Fitted>,
    ) -> Result<Fitted, EstimateError> {
        let layout = self.layout();
        let plain = noise.is_none();
        let weights = noise.map_or(Weights::White, |noise| Weights::Coloured(noise.to_vec()));
        let mut projection = VariableProjection::start(self, &from, free, weights, beside, most_steps);
        let schedule = projection.schedule();
        let (mut iterate, _) = descend(&mut projection, from, schedule, &())?;
        let mut columns = projection.columns(&mut iterate)?;
        // What is held is not free to help on other blocks, or beside other columns.
        for (column, parameter) in columns.iter_mut().zip(free) {
            if self.is_held(&iterate.model, *parameter) {
                column.fill(0.0);
            }
        }
        columns.extend(self.nuisances.iter().cloned());
        let residual = self.without_offsets(&projection.noise, &iterate.residual);
        let noise = layout.noise(&residual, 0);
        let minus_two_log_likelihood = layout.minus_two_log_likelihood(&noise, &residual);
        Ok(Fitted {
            model: iterate.model,
            parameters: free.to_vec(),
            residual,
            columns,
            noise,
            plain,
            minus_two_log_likelihood,
        })
    }

    /// A line of rows with the nuisances of each recording taken out as the noise asks.
    pub fn without_offsets(&self, noise: &[Noise], residual: &[f64]) -> Vec<f64> {
        self.layout().without_nuisances(noise, residual).0
    }
}

/// A fit that leaves so many times the squares of one that began with white noise has taken physics for noise.
const ASTRAY: f64 = 1.4;

/// Plain least squares are preferred where they leave less than this share of what is left of held-out blocks.
const CLEARLY: f64 = 0.9;

/// Steps of plain least squares.
const PLAIN_STEPS: usize = 8;

/// Steps taken as if the noise were white.
const WHITE_STEPS: usize = 4;

impl Fitted {
    /// The change of the torque with each free number, without the nuisances.
    pub fn parameter_columns(&self) -> Vec<&[f64]> {
        self.columns[..self.parameters.len()].iter().map(Vec::as_slice).collect()
    }
}
