//! A named effect beside a term of a kind that includes its kind: where that explains as much alone, the two are one effect of the richer kind.
//!
//! Coulomb friction and a remainder over one angle can describe friction over another; Coulomb friction and static friction alone the dip of a Stribeck curve.

use crate::diagnose::DiagnoseError;
use crate::diagnose::diagnosis::UNKNOWN;
use crate::diagnose::equivalents::Place;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::{DiagnosisVerdict, EffectVerdict, unite, without_term};
use crate::diagnose::search::MARGIN;
use crate::kinds;
use crate::model::Term;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::parameters;

/// Steps of the fit without either.
const STEPS: usize = 4;

/// A named effect, and a term of a kind that includes its kind.
struct Pair {
    /// The effect's place among the effects.
    effect: usize,
    /// Its term.
    plain: usize,
    /// The term of the richer kind,
    rich: usize,
    /// and the name of that.
    name: &'static str,
}

impl Dataset<'_> {
    /// Removes the first named effect beside a term of a kind that includes its kind, if that kind explains as much alone, by likelihood against coloured noise. Both are then one effect of the richer
    /// kind. `fitted` is the extended model against coloured noise, once that is made.
    pub(super) fn drop_included(
        &self,
        verdict: &mut DiagnosisVerdict,
        fitted: &mut Option<Fitted>,
        search: Search<'_>,
    ) -> Result<(), DiagnoseError> {
        let Some(pair) = pair(verdict, search) else { return Ok(()) };
        let fit = self.against_coloured_noise(fitted, &verdict.extended.model, search)?;
        let Some((both, without)) = self.with_and_without(fit, pair.plain, search)? else { return Ok(()) };
        let mut model = without.model.clone();
        model.terms.remove(pair.rich - usize::from(pair.rich > pair.plain));
        let rest = self.fit(&model, &self.parameters(&model, search), Some(&both.noise), STEPS)?;
        let place = Place { kind: &verdict.effects[pair.effect].name, term: pair.plain, own: &both, rest: &rest };
        let (found, _) = self.rivals(&place, search, &[pair.name])?;
        let Some(alone) = found.into_iter().next().map(|rival| rival.fit) else { return Ok(()) };
        let numbers = |fit: &Fitted, term: usize| parameters::of_term(&fit.model, term).len();
        let last = alone.model.terms.len() - 1;
        let of_both = numbers(&both, pair.plain) + numbers(&both, pair.rich);
        let lost = alone.minus_two_log_likelihood - both.minus_two_log_likelihood;
        if lost > self.penalty(of_both.saturating_sub(numbers(&alone, last))) + MARGIN {
            return Ok(());
        }
        let mut model = verdict.extended.model.clone();
        model.terms[pair.rich] = alone.model.terms[last].clone();
        model.terms.remove(pair.plain);
        verdict.extended = self.refitted_with(&verdict.extended, &model, &alone, search)?;
        unite_pair(&mut verdict.effects, &pair);
        *fitted = None;
        Ok(())
    }
}

/// Makes one effect of a pair whose plain term is gone.
fn unite_pair(effects: &mut Vec<EffectVerdict>, pair: &Pair) {
    match effects.iter().position(|effect| effect.term == Some(pair.rich)) {
        Some(rich) => unite(effects, rich, pair.effect),
        None => {
            let effect = &mut effects[pair.effect];
            effect.name = pair.name.to_owned();
            effect.term = Some(pair.rich);
            effect.equivalents.retain(|kind| kind != pair.name);
        }
    }
    without_term(effects, pair.plain);
}

/// The first pair among the terms found, the richer kind with one term of one element.
fn pair(verdict: &DiagnosisVerdict, search: Search<'_>) -> Option<Pair> {
    let terms = &verdict.extended.model.terms;
    let is_only = |term: &Term| kinds::elements(term) == 1 && terms.iter().filter(|t| t.kind == term.kind).count() == 1;
    let mut named = verdict.effects.iter().enumerate().filter(|(_, effect)| effect.name != UNKNOWN);
    named.find_map(|(effect, found)| {
        let plain = found.term.filter(|term| *term >= search.base_terms)?;
        let includes =
            |term: &Term| kinds::includes(&term.kind, &found.name) && is_only(term) && search.allows(&term.kind);
        let rich = (search.base_terms..terms.len()).find(|at| includes(&terms[*at]))?;
        Some(Pair { effect, plain, rich, name: kinds::of(&terms[rich].kind)?.name() })
    })
}
