//! Radii of the slip elements of a found memory, chosen anew: the torque is not convex in radii, but it is in the torques of many elements of given radii.

use gmhm::terms::Role;

use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::Search;
use crate::kinds;
use crate::model::{Term, TermValue};
use crate::numerics::bounded::{self, Bound};
use crate::regression::dataset::Dataset;
use crate::regression::error::EstimateError;
use crate::regression::fit::Fitted;
use crate::regression::parameters::{self, FreeParameter};

/// Radii to choose from.
const RADII: usize = 28;
/// The smallest and the largest, over the rated deflection: the largest slips over a fifth of the rated cycle.
const RANGE: [f64; 2] = [0.005, 0.8];
/// Elements of the start whose elements share the torque out alike.
const ALIKE: usize = 14;
/// Steps of a fit from other radii.
const STEPS: usize = 8;
/// Other radii are preferred where they leave less than this part of held-out blocks.
const CLEARLY: f64 = 0.97;

/// So many radii from the smallest to the largest, evenly on a logarithmic scale.
fn radii(count: usize, smallest: f64, largest: f64) -> impl Iterator<Item = f64> {
    (0..count).map(move |k| smallest * (largest / smallest).powf(k as f64 / (count - 1) as f64))
}

/// A memory like `term` of so many elements, from its smallest to the largest radius, that share its torque out alike.
fn alike(term: &Term, count: usize, largest: f64) -> Option<Term> {
    let list = |key: &str| match term.values.get(key) {
        Some(TermValue::List(list)) => Some(list),
        _ => None,
    };
    let smallest = list("radius_rad")?.iter().copied().fold(largest, f64::min);
    let torque = list("torque_nm")?.iter().sum::<f64>() / count as f64;
    let elements: Vec<(f64, f64)> = radii(count, smallest, largest).map(|radius| (radius, torque)).collect();
    kinds::with_slip_elements(term, &elements)
}

/// Elements (radius and torque, by radius) of which the two closest have become one until there are `most`.
fn united(mut elements: Vec<(f64, f64)>, most: usize) -> Vec<(f64, f64)> {
    while elements.len() > most.max(1) {
        let ratio = |at: &usize| elements[at + 1].0 / elements[*at].0;
        let Some(at) = (0..elements.len() - 1).min_by(|a, b| ratio(a).total_cmp(&ratio(b))) else { break };
        let ((r, t), (next_r, next_t)) = (elements[at], elements.remove(at + 1));
        elements[at] = ((r * t + next_r * next_t) / (t + next_t), t + next_t);
    }
    elements
}

impl Dataset<'_> {
    /// A fit, or one whose found memory started from other radii, where that predicts held-out blocks clearly better.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub(super) fn with_best_radii(&self, fit: Fitted, search: Search<'_>) -> Result<Fitted, DiagnoseError> {
        let mut found = search.base_terms..fit.model.terms.len();
        let memory = found.find(|at| kinds::is_of_slip_elements(&fit.model.terms[*at]));
        let (Some(at), Some(rated_rad)) = (memory, fit.model.gear.rated_deflection_rad) else { return Ok(fit) };
        let least_squares = self.least_squares_start(&fit, at, rated_rad)?;
        let alike = alike(&fit.model.terms[at], ALIKE, RANGE[1] * rated_rad);
        let mut least = CLEARLY * self.rms_of_blocks(&fit);
        let mut best = None;
        for start in least_squares.into_iter().chain(alike) {
            let mut model = fit.model.clone();
            model.terms[at] = start;
            let other = self.plain_fit(&model, &self.parameters(&model, search), STEPS)?;
            let other = self.with_positive_elements(other, search)?;
            let left = self.rms_of_blocks(&other);
            if left < least {
                (least, best) = (left, Some(other));
            }
        }
        Ok(best.unwrap_or(fit))
    }

    /// The memory at `at` with those of many elements of given radii whose torque is positive in the least squares with no torque below 0, beside all else that the fit has, linearised; `None`
    /// where no element has a torque.
    fn least_squares_start(&self, fit: &Fitted, at: usize, rated_rad: f64) -> Result<Option<Term>, EstimateError> {
        let memory = &fit.model.terms[at];
        let Some(most) = kinds::most_elements(memory) else { return Ok(None) };
        let radii: Vec<f64> = radii(RADII, RANGE[0] * rated_rad, RANGE[1] * rated_rad).collect();
        let mut others = fit.model.clone();
        others.terms.remove(at);
        let evaluations = self.evaluate(&others)?;
        let mut of_elements = Vec::new();
        for some in radii.chunks(most) {
            let unit: Vec<(f64, f64)> = some.iter().map(|radius| (*radius, 1.0)).collect();
            let Some(memory) = kinds::with_slip_elements(memory, &unit) else { return Ok(None) };
            let columns = self.unit_columns(&evaluations, &memory)?;
            of_elements.extend(columns.into_iter().map(|column| column.values));
        }
        if of_elements.len() != RADII {
            return Ok(None);
        }
        let mut target = fit.residual.clone();
        let mut columns: Vec<&[f64]> = Vec::new();
        for (parameter, column) in fit.parameters.iter().zip(&fit.columns) {
            match parameter {
                FreeParameter::Term { term, key, .. } if *term == at => {
                    if key.role == Role::Linear {
                        let torque = parameters::value(&fit.model, *parameter);
                        target.iter_mut().zip(column).for_each(|(t, x)| *t += torque * x);
                    }
                }
                _ => columns.push(column),
            }
        }
        columns.extend(fit.columns[fit.parameters.len()..].iter().map(Vec::as_slice));
        let mut bounds = vec![Bound::Free; columns.len()];
        columns.extend(of_elements.iter().map(Vec::as_slice));
        bounds.resize(columns.len(), Bound::NonNegative);
        columns.push(&target);
        let rows: Vec<usize> = (0..self.len()).filter(|row| self.counts(*row)).collect();
        let factor =
            bounded::factor_of_columns(rows.len(), columns.iter().map(|column| rows.iter().map(|row| column[*row])));
        let solution = bounded::solve(&factor, &bounds);
        let torques = solution.coefficients[bounds.len() - RADII..].iter().copied();
        let elements: Vec<(f64, f64)> = radii.into_iter().zip(torques).filter(|(_, torque)| *torque > 0.0).collect();
        Ok(kinds::with_slip_elements(memory, &united(elements, most)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_elements_become_one_of_their_torque() {
        let elements = vec![(1.0, 1.0), (2.0, 1.0), (2.2, 3.0), (8.0, 1.0)];
        let three = united(elements.clone(), 3);
        assert_eq!(three.len(), 3);
        assert!((three[1].0 - 2.15).abs() < 1e-12 && three[1].1 == 4.0);
        assert_eq!(united(elements.clone(), 4), elements);
        assert_eq!(united(Vec::new(), 0), []);
    }
}
