//! Friction seen at one speed only, which may rise with the speed or not: the extended model takes the one that does not, lest it run away on faster motions.

use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::{DiagnosisVerdict, EffectVerdict};
use crate::kinds;
use crate::model::Term;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::signal::plausible::correlation;

/// Two frictions are one if their torques correlate this much: they differ by a seventh of it, rms.
const SAME: f64 = 0.99;
/// Without the rise the error on held-out blocks grows by at most this part of the friction, rms.
const MOST_FURTHER: f64 = 0.1;
/// Steps of the fit with it.
const STEPS: usize = 12;

impl Dataset<'_> {
    /// Where a friction that rises with the speed has an equivalent that does not, and both have nearly the same torque along the recordings: the equivalent takes its place.
    pub(super) fn with_friction_of_one_speed(
        &self,
        verdict: &mut DiagnosisVerdict,
        search: Search<'_>,
    ) -> Result<(), DiagnoseError> {
        for at in 0..verdict.effects.len() {
            let Some(term) = verdict.effects[at].term else { continue };
            let Some(fit) = self.with_bounded(verdict, &verdict.effects[at], term, search)? else { continue };
            let effect = &mut verdict.effects[at];
            let bounded = fit.model.terms[term].kind.clone();
            effect.equivalents.retain(|other| *other != bounded);
            effect.equivalents.push(std::mem::replace(&mut effect.name, bounded));
            effect.equivalents.sort();
            verdict.extended = fit;
        }
        Ok(())
    }

    /// The extended model with an equivalent friction that does not rise in place of the term of an effect; `None` where there is none, where its torque is another, or where it leaves more.
    fn with_bounded(
        &self,
        verdict: &DiagnosisVerdict,
        effect: &EffectVerdict,
        term: usize,
        search: Search<'_>,
    ) -> Result<Option<Fitted>, DiagnoseError> {
        let extended = &verdict.extended;
        let added = |fit: &Fitted| -> Result<Vec<f64>, DiagnoseError> {
            Ok(self.layout().masked(&self.added_by(&fit.model, &self.total(&fit.model)?, term)?))
        };
        let is_equivalent = |other: &Term| {
            effect.equivalents.contains(&other.kind)
                && !extended.model.has_term(&other.kind)
                && search.allows(&other.kind)
        };
        let bounded =
            |torque| kinds::of(&effect.name)?.at_one_speed(torque, self.fastest_rad_per_s).filter(is_equivalent);
        if bounded(1.0).is_none() {
            return Ok(None);
        }
        let rising = added(extended)?;
        let torque = self.rms(&rising);
        let Some(bounded) = bounded(torque) else { return Ok(None) };
        let mut model = extended.model.clone();
        model.terms[term] = bounded;
        let fit = self.fit_as(extended, &model, &self.parameters(&model, search), STEPS)?;
        let (fit, lost) = self.without_unlawful(&verdict.base.model, fit, search)?;
        let is_bounded = |term: &Term| {
            kinds::of(&term.kind).is_some_and(|kind| kind.degenerates_to(term, self.speeds(&fit.model)).is_none())
        };
        let further = self.mean_square_of_blocks(&fit) - self.mean_square_of_blocks(extended);
        let stands = lost.is_empty()
            && is_bounded(&fit.model.terms[term])
            && further <= (MOST_FURTHER * torque).powi(2)
            && correlation(&rising, &added(&fit)?) >= SAME;
        Ok(stands.then_some(fit))
    }
}
