//! A dip of Coulomb friction in place of friction of the position that follows it.

use super::{Selected, Selection};
use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::Search;
use crate::kinds;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

/// The dip stands where it leaves less than this part of the rms error on held-out blocks.
const CLEARLY: f64 = 0.9;
/// Steps of a fit with a dip.
const STEPS: usize = 12;

impl Dataset<'_> {
    /// A selection, or one with a dip of the friction where friction of the position is smoothed over far higher velocities than the Coulomb friction, and a dip beside friction of one
    /// smoothing predicts clearly better. See [`kinds::with_dip`].
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn with_dip(
        &self,
        base: &Fitted,
        mut selection: Selection,
        search: Search<'_>,
    ) -> Result<Selection, DiagnoseError> {
        let (kind, models) = kinds::with_dip(&selection.fit.model, search.base_terms, self.fastest_rad_per_s);
        if !search.allows(kind) {
            return Ok(selection);
        }
        let mut least = CLEARLY * self.rms_of_blocks(&selection.fit);
        let mut best = None;
        for model in models {
            let fit = self.plain_fit(&model, &self.parameters(&model, search), STEPS)?;
            let (fit, lost) = self.without_unlawful(&base.model, fit, search)?;
            let left = self.rms_of_blocks(&fit);
            if lost.is_empty() && left < least && !kinds::is_smoothed_apart(&fit.model, search.base_terms) {
                (least, best) = (left, Some(fit));
            }
        }
        let Some(fit) = best else { return Ok(selection) };
        let before = selection.selected_squares;
        selection.refitted(self, base, fit);
        selection.free_squares = selection.free_squares.min(selection.selected_squares);
        let saved = before - selection.selected_squares;
        selection.selected.push(Selected {
            kind,
            share: (saved / selection.reference().scale()).clamp(0.0, 1.0),
            fidelity: None,
            equivalents: Vec::new(),
            gains: vec![saved],
            confidence: 1.0,
            tried: Vec::new(),
            in_remainder: true,
        });
        Ok(selection)
    }
}
