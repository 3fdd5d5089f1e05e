//! What the softness of an edge adds to the uncertainty of a term. Parts that touch before they carry the whole torque make a gap look smaller than it is; away from the edge it shows as it is,
//! and what the two estimates differ by belongs to the uncertainty.

use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::Search;
use crate::kinds;
use crate::model::Term;
use crate::numerics::extremes::largest;
use crate::numerics::mark::Mark;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::parameters::{self, FreeParameter};

/// Rows whose torque is less than this part of the largest are near the edge.
const NEAR: f64 = 0.1;
/// Steps of the fit away from the edge.
const STEPS: usize = 6;

impl Dataset<'_> {
    /// Adds to the variance of each number of a term with a soft edge the square of its difference to an estimate from the rows away from the edge.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub(super) fn add_soft_edges(
        &self,
        fit: &Fitted,
        search: Search<'_>,
        variances: &mut [f64],
    ) -> Result<(), DiagnoseError> {
        let has_edge = |term: &Term| kinds::of_term(term).is_some_and(|kind| kind.soft_edge().is_some());
        if !fit.model.terms[search.base_terms..].iter().any(has_edge) {
            return Ok(());
        }
        let away = self.away_from_zero(&self.total(&fit.model)?).fit_as(fit, &fit.model, &fit.parameters, STEPS)?;
        for (variance, parameter) in variances.iter_mut().zip(&fit.parameters) {
            let is_edge = matches!(parameter, FreeParameter::Term { term, .. } if has_edge(&fit.model.terms[*term]));
            if is_edge {
                let value = |fit: &Fitted| parameters::value(&fit.model, *parameter);
                *variance += (value(&away) - value(fit)).powi(2);
            }
        }
        Ok(())
    }

    /// The same without the rows at which a torque is near zero.
    fn away_from_zero(&self, torque: &[f64]) -> Self {
        let mut away = self.clone();
        let near = NEAR * largest(torque);
        for (marks, span) in away.marks.iter_mut().zip(&self.spans) {
            let rows = marks.iter_mut().zip(&torque[span.clone()]);
            rows.filter(|(_, torque)| torque.abs() < near).for_each(|(mark, _)| *mark = Mark::Skipped);
        }
        away
    }
}
