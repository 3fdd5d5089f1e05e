//! A kind and another that includes it, both in one model: whether one of them is enough.
//!
//! Friction over one angle can be described by Coulomb friction and a remainder over another; the dip of a Stribeck curve by Coulomb friction and static friction alone.

use crate::diagnose::DiagnoseError;
use crate::diagnose::diagnosis::UNKNOWN;
use crate::diagnose::equivalents::Place;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::DiagnosisVerdict;
use crate::diagnose::search::MARGIN;
use crate::kinds;
use crate::model::Term;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::parameters;

/// Steps of a fit without one of the two.
const STEPS: usize = 4;

/// A named effect, and a term of a kind that includes its kind.
struct Pair {
    /// The effect's place among the effects.
    effect: usize,
    /// Its term.
    plain: usize,
    /// The other term.
    rich: usize,
}

impl Dataset<'_> {
    /// Leaves of a named effect and a term of a kind that includes it the one that explains as much alone, by likelihood against coloured noise. `fit` is the extended model against coloured noise.
    pub(super) fn one_of_two(
        &self,
        verdict: &mut DiagnosisVerdict,
        fit: &Fitted,
        search: Search<'_>,
    ) -> Result<bool, DiagnoseError> {
        let Some(pair) = pair(verdict, search) else { return Ok(false) };
        let terms = &verdict.extended.model.terms;
        let name = terms[pair.rich].kind.clone();
        let Some(kind) = kinds::of(&name) else { return Ok(false) };
        let Some((both, without_plain)) = self.with_and_without(fit, pair.plain, search)? else { return Ok(false) };
        let mut model = without_plain.model.clone();
        model.terms.remove(pair.rich - usize::from(pair.rich > pair.plain));
        let rest = self.fit(&model, &self.parameters(&model, search), Some(&both.noise), STEPS)?;
        let place = Place { kind: &verdict.effects[pair.effect].name, term: pair.plain, own: &both, rest: &rest };
        let (found, _) = self.rivals(&place, search, &[kind.name()])?;
        let Some(rich) = found.into_iter().next() else { return Ok(false) };
        let count = |fit: &Fitted, term: usize| parameters::of_term(&fit.model, term).len();
        let numbers = count(&both, pair.plain) + count(&both, pair.rich);
        let of_rich = count(&rich.fit, rich.fit.model.terms.len() - 1);
        let lost = rich.fit.minus_two_log_likelihood - both.minus_two_log_likelihood;
        if lost > self.penalty(numbers.saturating_sub(of_rich)) + MARGIN {
            return Ok(false);
        }
        let mut model = verdict.extended.model.clone();
        model.terms[pair.rich] = rich.fit.model.terms[rich.fit.model.terms.len() - 1].clone();
        model.terms.remove(pair.plain);
        let free = self.parameters(&model, search);
        verdict.extended = if verdict.extended.plain {
            self.plain_fit(&model, &free, STEPS)?
        } else {
            self.or_plain(self.fit(&model, &free, Some(&rich.fit.noise), STEPS)?)?
        };
        self.keep_rich(verdict, &pair, &name);
        Ok(true)
    }

    /// The effects where the term of the plain kind is gone.
    fn keep_rich(&self, verdict: &mut DiagnosisVerdict, pair: &Pair, name: &str) {
        let share = verdict.effects[pair.effect].share;
        match verdict.effects.iter_mut().find(|effect| effect.term == Some(pair.rich)) {
            Some(rich) => {
                rich.share = (rich.share + share).min(1.0);
                verdict.effects.remove(pair.effect);
            }
            None => {
                let effect = &mut verdict.effects[pair.effect];
                effect.name = name.to_owned();
                effect.term = Some(pair.rich);
                effect.equivalents.retain(|kind| kind != name);
            }
        }
        for term in verdict.effects.iter_mut().filter_map(|effect| effect.term.as_mut()) {
            *term -= usize::from(*term > pair.plain);
        }
    }
}

/// The first pair of a verdict, of single terms that are found.
fn pair(verdict: &DiagnosisVerdict, search: Search<'_>) -> Option<Pair> {
    let terms = &verdict.extended.model.terms;
    let is_single =
        |term: &&Term| kinds::elements(term) == 1 && terms.iter().filter(|t| t.kind == term.kind).count() == 1;
    let named = verdict.effects.iter().enumerate().filter(|(_, effect)| effect.name != UNKNOWN);
    let mut pairs = named.filter_map(|(effect, found)| {
        let plain = found.term?;
        let includes = |at: &usize| {
            kinds::includes(&terms[*at].kind, &found.name) && is_single(&&terms[*at]) && search.allows(&terms[*at].kind)
        };
        let rich = (search.base_terms..terms.len()).find(includes)?;
        Some(Pair { effect, plain, rich })
    });
    pairs.next()
}
