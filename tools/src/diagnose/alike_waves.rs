//! Two named waves, such as a kinematic error and a torque ripple, where the recordings cannot distinguish the kind of the smaller one: it becomes a further order of the larger one.

use crate::diagnose::DiagnoseError;
use crate::diagnose::candidates::has_room;
use crate::diagnose::diagnosis::UNKNOWN;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::{CLASS, DiagnosisVerdict, unite, without_term};
use crate::kinds;
use crate::model::{ORDERS, Term, TermValue};
use crate::regression::dataset::Dataset;

/// Steps of the fit of one wave.
const STEPS: usize = 4;

/// The places of two effects and of their terms: the one that keeps its name, and the one that joins it.
struct Waves {
    effects: [usize; 2],
    terms: [usize; 2],
}

impl Dataset<'_> {
    /// Unites the first two waves of different kinds if the smaller one may be of the larger one's kind, and one term with the orders of both explains as much.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub(super) fn unite_waves(&self, verdict: &mut DiagnosisVerdict, search: Search<'_>) -> Result<(), DiagnoseError> {
        let Some((Waves { effects: [first, second], terms: [kept, gone] }, united)) = waves(verdict, search) else {
            return Ok(());
        };
        let before = &verdict.extended;
        let both = self.fit(&before.model, &self.parameters(&before.model, search), Some(&before.noise), STEPS)?;
        let mut model = before.model.clone();
        model.terms[kept] = united;
        model.terms.remove(gone);
        let one = self.fit(&model, &self.parameters(&model, search), Some(&both.noise), STEPS)?;
        if one.minus_two_log_likelihood > both.minus_two_log_likelihood + CLASS {
            return Ok(());
        }
        verdict.extended = self.refitted_with(before, &one.model, &one, search)?;
        unite(&mut verdict.effects, first, second);
        without_term(&mut verdict.effects, gone);
        Ok(())
    }
}

/// The first two such waves, and the larger one's term with the orders of both.
fn waves(verdict: &DiagnosisVerdict, search: Search<'_>) -> Option<(Waves, Term)> {
    let terms = &verdict.extended.model.terms;
    let named = || {
        let named = verdict.effects.iter().enumerate().filter(|(_, effect)| effect.name != UNKNOWN);
        named.filter_map(|(at, effect)| Some((at, effect, effect.term.filter(|term| *term >= search.base_terms)?)))
    };
    named().flat_map(|first| named().map(move |second| (first, second))).find_map(
        |((i, first, kept), (j, second, gone))| {
            let may_join = i != j
                && first.name != second.name
                && first.share >= second.share
                && second.equivalents.contains(&first.name)
                && [kept, gone].iter().all(|at| kinds::elements_are_effects(&terms[*at]));
            let united = may_join.then(|| with_orders_of(&terms[kept], &terms[gone]))??;
            Some((Waves { effects: [i, j], terms: [kept, gone] }, united))
        },
    )
}

/// A wave with further orders, those of another over the same angle; `None` where its lists have no room for them.
fn with_orders_of(wave: &Term, other: &Term) -> Option<Term> {
    let orders = |term: &Term| match term.values.get(ORDERS) {
        Some(TermValue::List(orders)) => Some(orders.clone()),
        _ => None,
    };
    let added: Vec<f64> =
        orders(other)?.into_iter().filter(|order| !orders(wave).is_some_and(|own| own.contains(order))).collect();
    if wave.values.get("angle") != other.values.get("angle") || !has_room(wave, other) {
        return None;
    }
    let mut united = wave.clone();
    for (key, value) in &mut united.values {
        if let TermValue::List(list) = value {
            list.extend(added.iter().map(|order| if key == ORDERS { *order } else { 0.0 }));
        }
    }
    united.check().is_ok().then_some(united)
}
