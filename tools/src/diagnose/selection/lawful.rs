//! Found terms whose refitted numbers make them no term of their kind.

use super::STEPS;
use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::{Search, is_delay};
use crate::kinds;
use crate::model::Term;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

/// A kind that a term was of, and the kind that it became a term of its own of.
pub(super) type Renamed = (&'static str, Option<&'static str>);

impl Dataset<'_> {
    /// A fit in which the found terms that are of another kind within the recordings are of that kind, or part of a term of it that is there; with the kind that
    /// each was and, where it became a term of its own, the kind that it is.
    pub(super) fn without_degenerate(
        &self,
        fit: Fitted,
        search: Search<'_>,
    ) -> Result<(Fitted, Vec<Renamed>), DiagnoseError> {
        let mut model = fit.model.clone();
        let mut renamed = Vec::new();
        for at in (search.base_terms..model.terms.len()).rev() {
            let term = &model.terms[at];
            let Some(kind) = kinds::of_term(term) else { continue };
            let Some(other) = kind.degenerates_to(term, self.fastest_rad_per_s) else { continue };
            let Some(is) = kinds::of_term(&other) else { continue };
            if search.removed.iter().any(|removed| removed == is.name()) {
                continue;
            }
            let is_there = model.terms.iter().any(|t| t.kind == other.kind);
            renamed.push((kind.name(), (!is_there).then(|| is.name())));
            if is_there {
                model.terms.remove(at);
            } else {
                model.terms[at] = other;
            }
        }
        if renamed.is_empty() {
            return Ok((fit, renamed));
        }
        Ok((self.plain_fit(&model, &self.places(&model, search), STEPS)?, renamed))
    }

    /// A fit without the found terms whose refitted numbers are not of their kind, and those kinds. What refines such a term goes before the term itself.
    pub(super) fn without_unlawful(
        &self,
        mut fit: Fitted,
        search: Search<'_>,
    ) -> Result<(Fitted, Vec<String>), DiagnoseError> {
        let mut lost = Vec::new();
        loop {
            let found = &fit.model.terms[search.base_terms..];
            let may_be_reversed = |term: &Term| {
                kinds::of_term(term).is_some_and(|k| kinds::may_be_reversed(k, fit.model.is_simulation()))
            };
            let smooths = self.only_smooths(&fit);
            let unlawful =
                found.iter().find(|t| (!may_be_reversed(t) && kinds::is_reversed(t)) || (smooths && is_delay(t)));
            let Some(unlawful) = unlawful else { return Ok((fit, lost)) };
            if let Some(fewer) = kinds::without_negative_elements(unlawful) {
                let mut model = fit.model.clone();
                let own = model.terms.iter_mut().skip(search.base_terms).find(|t| t.kind == fewer.kind);
                own.into_iter().for_each(|term| *term = fewer.clone());
                fit = self.plain_fit(&model, &self.places(&model, search), STEPS)?;
                continue;
            }
            let refines = |t: &Term| kinds::of_term(t).is_some_and(|k| k.refines().contains(&unlawful.kind.as_str()));
            let refined = found.iter().any(refines);
            let gone = |t: &Term| if refined { refines(t) } else { t.kind == unlawful.kind };
            let mut model = fit.model.clone();
            let mut at = 0..model.terms.len();
            model.terms.retain(|t| at.next().is_some_and(|at| at < search.base_terms) || !gone(t));
            lost.extend(found.iter().filter(|t| gone(t)).map(|t| t.kind.clone()));
            fit = self.plain_fit(&model, &self.places(&model, search), STEPS)?;
        }
    }
}
