//! A number of the base does not move far from the value given unless the recordings ask for it: what they do not determine, and what only makes up for a shape that no kind has, would
//! fail on another motion.

use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::Search;
use crate::model::Model;
use crate::numerics::block_gram::{BLOCKS, BlockGram, Chosen, t_of_blocks};
use crate::numerics::vector::axpy;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::parameters::{self, FreeParameter};

/// All numbers that stay as given leave together at most so many times the squares of blocks held out,
const AS_WELL: f64 = 1.02;
/// and the losses of the blocks add up to at most so many of their scatters.
const ASKED: f64 = 2.0;
/// and the model fitted so leaves at most so many times the squares of the rows fitted.
const LEFT_AS_WELL: f64 = 1.3;
/// A number moves far by more than this part of its size; by less it was only known less exactly.
const FAR: f64 = 0.3;
/// Steps of the fit of what remains free.
const STEPS: usize = 5;

impl Dataset<'_> {
    /// An extended fit in which the numbers of the base that moved far from those of `model`, and whose blocks held out do not ask for it, are those of `model` again. Its uncertainty is
    /// still that with the base free.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub(super) fn with_base_unchanged(
        &self,
        model: &Model,
        extended: Fitted,
        search: Search<'_>,
    ) -> Result<Fitted, DiagnoseError> {
        let change = |parameter: &FreeParameter| {
            parameters::value(&extended.model, *parameter) - parameters::value(model, *parameter)
        };
        let is_far = |parameter: &FreeParameter| {
            parameter.is_of_base(search.base_terms) && change(parameter).abs() > FAR * size(model, *parameter)
        };
        let moved_far: Vec<usize> =
            (0..extended.parameters.len()).filter(|i| is_far(&extended.parameters[*i])).collect();
        if extended.model.gear.torque_side != model.gear.torque_side || moved_far.is_empty() {
            return Ok(extended);
        }
        let counts = self.rows_that_count();
        let gram = BlockGram::new(&extended.columns, &self.spans, &counts);
        let blocks = |kept: &[usize]| -> [f64; BLOCKS] {
            let mut left = extended.residual.clone();
            for at in kept {
                axpy(change(&extended.parameters[*at]), &extended.columns[*at], &mut left);
            }
            let free: Vec<usize> = (0..extended.columns.len()).filter(|i| !kept.contains(i)).collect();
            gram.error(&gram.targets(&extended.columns, &[left], &counts), &Chosen::plain(&free))
        };
        let all_free = blocks(&[]);
        let whole: f64 = all_free.iter().sum();
        let cost = |kept: &[usize]| {
            let losses: Vec<f64> = blocks(kept).iter().zip(&all_free).map(|(with, without)| with - without).collect();
            (losses.iter().sum::<f64>() / whole, t_of_blocks(&losses))
        };
        let mut by_cost: Vec<(f64, usize)> = moved_far.iter().map(|at| (cost(&[*at]).0, *at)).collect();
        by_cost.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut kept = Vec::new();
        for (_, at) in by_cost {
            kept.push(at);
            let (part, t) = cost(&kept);
            if part > AS_WELL - 1.0 || (part > 0.0 && t > ASKED) {
                kept.pop();
            }
        }
        if kept.is_empty() {
            return Ok(extended);
        }
        let mut start = extended.model.clone();
        for at in &kept {
            let parameter = extended.parameters[*at];
            parameters::put(&mut start, parameter, parameters::value(model, parameter));
        }
        let stays_free = |at: &usize| !kept.contains(at);
        let free: Vec<FreeParameter> =
            (0..extended.parameters.len()).filter(stays_free).map(|at| extended.parameters[at]).collect();
        let unchanged = if extended.plain {
            self.plain_fit(&start, &free, STEPS)?
        } else {
            self.fit(&start, &free, Some(&extended.noise), STEPS)?
        };
        // Blocks are refitted with every free number; the model itself may be left far off by a likelihood that takes the difference for slow noise.
        let squares = |fit: &Fitted| self.layout().squares(&fit.residual);
        let worse = squares(&unchanged) > LEFT_AS_WELL * squares(&extended);
        if worse || self.mean_square_of_blocks(&unchanged) > AS_WELL * self.mean_square_of_blocks(&extended) {
            return Ok(extended);
        }
        let Fitted { parameters, columns, noise, plain, .. } = extended;
        Ok(Fitted { parameters, columns, noise, plain, ..unchanged })
    }
}

/// What a number of a model is measured by: an elastic coefficient by what carries the torque of c1 at the rated deflection, others by all numbers of one unit beside it.
fn size(model: &Model, parameter: FreeParameter) -> f64 {
    match parameter {
        FreeParameter::Elastic(i) => {
            let rated = model.gear.rated_deflection_rad.unwrap_or(1.0);
            parameters::value(model, FreeParameter::Elastic(0)).abs() / rated.powi(2 * i as i32)
        }
        FreeParameter::Term { term, key, .. } => {
            let alike = parameters::of_term(model, term).into_iter().filter(
                |other| matches!(other, FreeParameter::Term { key: of, .. } if of.unit == key.unit && of.role == key.role),
            );
            alike.map(|other| parameters::value(model, other).powi(2)).sum::<f64>().sqrt()
        }
        FreeParameter::Memory(_) | FreeParameter::Zero => parameters::value(model, parameter).abs(),
    }
}
