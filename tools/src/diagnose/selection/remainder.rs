//! A second selection, for effects that are small beside a memory that the base model lacks. Its prices are shares of the first selection's residual.
//!
//! Slip elements follow any hysteresis closely, so an effect of a tenth of its torque is visible once they are fitted. After other kinds no second selection is
//! made: their residual is mostly the error of their approximate shapes.

use super::{Selected, Selection};
use crate::diagnose::DiagnoseError;
use crate::diagnose::diagnosis::Naming;
use crate::diagnose::explain::Search;
use crate::kinds::{self, Family};
use crate::regression::dataset::Dataset;
use crate::regression::error::EstimateError;
use crate::regression::fit::Fitted;

/// Beside a memory a kind has to save this part of the squared error of held-out blocks, against the memory refitted without it; less may be the error of an approximate shape.
const LEAST_PART: f64 = 0.3;
/// Prices of the second selection over those of the first: without it small kinds would absorb the error of the memory's shape.
const PRICES: f64 = 10.0;
/// A kind saves at most so many times what all kinds save together.
const MOST_OF_SAVED: f64 = 1.2;
/// Rounds at most.
const ROUNDS: usize = 3;
/// Steps of the refit.
const STEPS: usize = 8;

impl Dataset<'_> {
    /// A selection with the kinds that further selections find beside it, until none is found, without waves that cancel each other.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn with_remainder(
        &self,
        base: &Fitted,
        mut selection: Selection,
        search: Search<'_>,
    ) -> Result<Selection, DiagnoseError> {
        let memory = |s: &Selected| kinds::of(s.kind).is_some_and(|k| k.family() == Family::Memory);
        for _ in 0..ROUNDS {
            if !selection.selected.iter().any(memory) || !self.look_behind(base, &mut selection, search)? {
                break;
            }
        }
        let (fit, lost) = self.without_cancelling_waves(selection.fit.clone(), search, STEPS)?;
        if fit.model != selection.fit.model {
            self.left_without(base, &mut selection, &lost, fit, search)?;
        }
        Ok(selection)
    }

    /// Adds what a further selection finds, and returns whether it found anything.
    fn look_behind(&self, base: &Fitted, first: &mut Selection, search: Search<'_>) -> Result<bool, DiagnoseError> {
        let found = first.fit.model.terms.len();
        let second = self.select(&first.fit, Search { base_terms: found, ..search }, PRICES)?;
        let before = self.mean_square_of_blocks(&first.fit);
        let mut kept = second.selected;
        let model = &second.fit.model;
        let mut fit = self.plain_fit(model, &self.parameters(model, search), STEPS)?;
        // The weakest goes first, and the others are judged without it.
        let mut after = self.mean_square_of_blocks(&fit);
        loop {
            let mut weakest: Option<(f64, usize, Fitted)> = None;
            for (place, own) in kept.iter().enumerate() {
                let without = self.fitted_without(&fit, found, own.kind, search)?;
                let left = self.mean_square_of_blocks(&without);
                let saved = left - after;
                // Kinds that together save less than each alone cancel each other.
                let trades = saved > MOST_OF_SAVED * (before - after);
                let stands = !trades && saved >= LEAST_PART * left && Naming::of(own.fidelity) == Naming::Named;
                if !stands && weakest.as_ref().is_none_or(|(least, ..)| left < *least) {
                    weakest = Some((left, place, without));
                }
            }
            let Some((left, place, without)) = weakest else { break };
            kept.remove(place);
            (fit, after) = (without, left);
        }
        if after > (1.0 - LEAST_PART) * before {
            return Ok(false);
        }
        let scale = (first.base_squares - first.free_squares).max(f64::MIN_POSITIVE);
        let of_second = (second.base_squares - second.free_squares) / scale;
        first.unexplained = second.unexplained.into_iter().map(|(over, share)| (over, share * of_second)).collect();
        // A kind that was found already is the same effect in more detail.
        let known: Vec<&'static str> = first.selected.iter().map(|s| s.kind).collect();
        first.selected.extend(kept.into_iter().filter(|s| !known.contains(&s.kind)).map(|mut s| {
            s.share = (s.gains.iter().sum::<f64>() / scale).clamp(0.0, 1.0);
            s.in_remainder = true;
            s
        }));
        first.described_by(self, base, fit);
        Ok(true)
    }

    /// A fit without the terms of a kind among those from `found` on.
    fn fitted_without(
        &self,
        fit: &Fitted,
        found: usize,
        kind: &str,
        search: Search<'_>,
    ) -> Result<Fitted, EstimateError> {
        let mut model = fit.model.clone();
        model.remove_terms(found, |term| term.kind == kind);
        self.plain_fit(&model, &self.parameters(&model, search), STEPS)
    }
}
