//! Frictions whose refitted shape is that of another friction, see [`crate::kinds::with_dip`] and [`crate::kinds::without_coulomb`].

use super::{Selected, Selection};
use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::Search;
use crate::kinds;
use crate::model::Model;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

/// The dip stands where it leaves less than this part of the rms error on held-out blocks.
const CLEARLY: f64 = 0.9;
/// Viscous friction alone stands where it leaves at most so many times the rms error on held-out blocks,
const AS_GOOD: f64 = 1.025;
/// or so many times where the Coulomb friction does not come near its torque within the speeds recorded, which is no Coulomb friction.
const IN_PLACE_OF_NONE: f64 = 2.0;
/// With an exponent at a limit of its range, which may be another friction's, it stands where it leaves less than this part,
const AT_LIMIT: f64 = 0.95;
/// and where it was not found beside the Coulomb friction, less than this.
const IN_PLACE: f64 = 0.8;
/// In place of Coulomb friction that is small beside it, it stands up to so many times the rms error on the rows fitted. Without Coulomb friction that was there 35 synthetic joints
/// had 1.16 times the error and more, most over 1.4; 14 of 15 that had viscous friction of an exponent between 0.65 and 1.2 alone had 1.151 at most.
const AS_FITTED: f64 = 1.155;
/// Steps of a fit with other shapes.
const STEPS: usize = 12;

impl Dataset<'_> {
    /// A selection whose frictions have the shapes of their kinds.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn with_friction_shapes(
        &self,
        base: &Fitted,
        selection: Selection,
        search: Search<'_>,
    ) -> Result<Selection, DiagnoseError> {
        let selection = self.without_coulomb(base, selection, search)?;
        self.with_dip(base, selection, search)
    }

    /// A selection, or one without Coulomb friction that changes its sign over much of the speed or is small beside viscous friction, where viscous friction alone predicts or fits as well.
    fn without_coulomb(
        &self,
        base: &Fitted,
        mut selection: Selection,
        search: Search<'_>,
    ) -> Result<Selection, DiagnoseError> {
        let model = &selection.fit.model;
        let without = kinds::without_coulomb(model, search.base_terms, self.fastest_rad_per_s);
        let Some(without) = without.filter(|w| w.instead.is_none_or(|kind| search.allows(kind))) else {
            return Ok(selection);
        };
        let Some(fit) = self.lawful_fit(base, &without.model, search)? else { return Ok(selection) };
        let allowed = match (kinds::has_inner_exponent(&fit.model), without.saturated) {
            _ if without.instead.is_some() => IN_PLACE,
            (false, _) => AT_LIMIT,
            (true, true) => AS_GOOD,
            (true, false) => IN_PLACE_OF_NONE,
        };
        let predicts = || without.wide && self.rms_of_blocks(&fit) <= allowed * self.rms_of_blocks(&selection.fit);
        let fits = without.small
            && kinds::has_inner_exponent(&fit.model)
            && self.rms(&fit.residual) <= AS_FITTED * self.rms(&selection.fit.residual);
        if !fits && !predicts() {
            return Ok(selection);
        }
        match without.instead {
            Some(kind) => {
                selection.selected.iter_mut().filter(|s| s.kind == without.kind).for_each(|s| s.rename(kind));
                selection.refitted(self, base, fit);
            }
            None => self.left_without(base, &mut selection, &[without.kind.to_owned()], fit, search)?,
        }
        selection.bounds_free();
        Ok(selection)
    }

    /// A selection, or one with a dip of the friction where friction of the position is smoothed over far higher velocities than the Coulomb friction, and a dip beside friction of one
    /// smoothing predicts clearly better.
    fn with_dip(
        &self,
        base: &Fitted,
        mut selection: Selection,
        search: Search<'_>,
    ) -> Result<Selection, DiagnoseError> {
        let (kind, models) = kinds::with_dip(&selection.fit.model, search.base_terms, self.fastest_rad_per_s);
        if models.is_empty() || !search.allows(kind) {
            return Ok(selection);
        }
        let mut least = CLEARLY * self.rms_of_blocks(&selection.fit);
        let mut best = None;
        for model in models {
            let Some(fit) = self.lawful_fit(base, &model, search)? else { continue };
            let left = self.rms_of_blocks(&fit);
            if left < least && !kinds::is_smoothed_apart(&fit.model, search.base_terms) {
                (least, best) = (left, Some(fit));
            }
        }
        let Some(fit) = best else { return Ok(selection) };
        let before = selection.selected_squares;
        selection.described_by(self, base, fit);
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

    /// A model fitted; `None` where a found term of the fit is no term of its kind.
    fn lawful_fit(&self, base: &Fitted, model: &Model, search: Search<'_>) -> Result<Option<Fitted>, DiagnoseError> {
        let fit = self.plain_fit(model, &self.parameters(model, search), STEPS)?;
        let (fit, lost) = self.without_unlawful(&base.model, fit, search)?;
        Ok(lost.is_empty().then_some(fit))
    }
}
