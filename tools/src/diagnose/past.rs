//! Pasts of recordings beyond the polynomial one.

use crate::diagnose::nonparametric;
use crate::diagnose::search::MARGIN;
use crate::regression::dataset::{Dataset, untouched};
use crate::regression::error::EstimateError;
use crate::regression::fit::Fitted;

/// Pieces of which what any past adds is made.
const PAST_HATS: usize = 8;

impl Dataset<'_> {
    /// Lets each recording remember any past whatever, where that explains more than the polynomial past does: reversals of old leave kinks. Highest and lowest
    /// deflection so far move one way only, so what the past adds is a function of how far they have come together. Tells whether any does.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn allow_any_past(&mut self, fit: &Fitted) -> Result<bool, EstimateError> {
        let mut admitted = Vec::new();
        for (recording, span) in self.recordings.iter().zip(&self.spans) {
            let Some(room) = untouched(recording, &fit.model)? else { continue };
            let come: Vec<f64> = room.iter().map(|(above, below)| -(above + below)).collect();
            let (from, to) = (come[0], come[come.len() - 1]);
            let knots: Vec<f64> = (0..=PAST_HATS).map(|k| from + (to - from) * k as f64 / PAST_HATS as f64).collect();
            if knots.windows(2).any(|w| w[1] <= w[0]) {
                continue;
            }
            let mut columns = nonparametric::linear_splines(&come, &knots);
            columns.pop();
            let mut own = vec![vec![0.0; self.len()]; columns.len()];
            own.iter_mut().zip(&columns).for_each(|(line, column)| line[span.clone()].copy_from_slice(column));
            let mut columns = fit.parameter_columns();
            columns.extend(own.iter().map(Vec::as_slice));
            let with = self.layout().best_profile(&columns, &fit.residual, &fit.noise);
            let gain = fit.minus_two_log_likelihood - with.minus_two_log_likelihood;
            if gain > self.penalty(own.len()) + MARGIN {
                admitted.extend(own);
            }
        }
        let any = !admitted.is_empty();
        self.nuisances.extend(admitted);
        Ok(any)
    }
}
