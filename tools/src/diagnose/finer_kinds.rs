//! A finer kind in place of a named one that it contains: Stribeck friction where Coulomb friction was named.
//!
//! The searches fit each kind from the best candidates of a grid, and a dip of friction has several optima. Here every candidate of the finer kind is profiled in place of
//! the named kind, and the best of them are fitted with the swarm.

use rayon::prelude::*;

use crate::diagnose::DiagnoseError;
use crate::diagnose::candidates::{self, Proposal};
use crate::diagnose::decision::{STEPS_OF_LIKELIHOOD, TOO_LOUD_TO_REFINE};
use crate::diagnose::diagnosis::UNKNOWN;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::{DiagnosisVerdict, LEAST_GAIN_OF_RICHER};
use crate::kinds;
use crate::numerics::vector::dot;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::heldout_rows::trimmed_sum;
use crate::regression::parameters;

/// A finer kind takes the place of a named one where that lowers −2 ln L by so much, net of what its further numbers gain from noise,
const LEAST_NET_GAIN: f64 = 25.0;
/// and predicts blocks held out better by so many squares of the noise, the best and the worst block left out.
const LEAST_PREDICTED: f64 = 25.0;
/// Candidates of the grid that are fitted with the swarm until one is of its kind.
const MOST_TRIED: usize = 3;
/// Steps of a fit from a candidate of the grid.
const FIRST_STEPS: usize = 2;
/// Steps of a fit from one that is nearly right.
const LAST_STEPS: usize = 4;

/// A fit with a finer kind, its last term.
struct Finer {
    kind: &'static str,
    fit: Fitted,
    /// By how much it lowers −2 ln L, net of what its further numbers gain from noise.
    net: f64,
}

impl Dataset<'_> {
    /// Puts a finer kind in the place of the first named kind that another contains, or adds it to the class of that kind where it explains a little more. Not where the base is far
    /// from the machine or the effect far above the noise: there all shapes are approximate.
    pub(super) fn refine_name(&self, verdict: &mut DiagnosisVerdict, search: Search<'_>) -> Result<(), DiagnoseError> {
        let extended = &verdict.extended.model;
        let finer = |name: &str| -> Vec<&'static str> {
            let all = kinds::ALL.iter().map(|kind| kind.name());
            all.filter(|f| kinds::contains(f, name) && search.allows(f) && !extended.has_term(f)).collect()
        };
        let mut named = verdict.effects.iter().enumerate().filter(|(_, e)| e.name != UNKNOWN);
        let Some((at, only, term)) = named.find_map(|(at, e)| {
            let only = Some(finer(&e.name)).filter(|only| !only.is_empty())?;
            Some((at, only, e.term?))
        }) else {
            return Ok(());
        };
        if self.is_far_from(&verdict.base) {
            return Ok(());
        }
        let free = self.parameters(extended, search);
        let first = self.fit(extended, &free, None, STEPS_OF_LIKELIHOOD)?;
        let added = self.added_by(&first.model, &self.total(&first.model)?, term)?;
        if dot(&added, &added) > TOO_LOUD_TO_REFINE * dot(&first.residual, &first.residual) {
            return Ok(());
        }
        let mut without = first.model.clone();
        without.terms.remove(term);
        let rest = self.fit(&without, &self.parameters(&without, search), Some(&first.noise), LAST_STEPS)?;
        // Noise that was fitted beside a wrong shape may hold part of the effect.
        let again = self.fit(&first.model, &free, Some(&rest.noise), LAST_STEPS)?;
        let own = if again.minus_two_log_likelihood < first.minus_two_log_likelihood { again } else { first };
        let Some(best) = self.finest(&own, &rest, term, Search { only: Some(&only), ..search })? else { return Ok(()) };
        let effect = &mut verdict.effects[at];
        let predicted = || trimmed_sum(&self.gain_of_blocks(&best.fit, &own, &best.fit.noise));
        if best.net > LEAST_NET_GAIN && predicted() > LEAST_PREDICTED {
            let mut model = best.fit.model;
            let found = model.terms.pop();
            model.terms.splice(term..term, found);
            let free = self.parameters(&model, search);
            verdict.extended = if verdict.extended.plain {
                self.plain_fit(&model, &free, LAST_STEPS)?
            } else {
                self.or_plain(self.fit(&model, &free, Some(&best.fit.noise), LAST_STEPS)?)?
            };
            let plain = std::mem::replace(&mut effect.name, best.kind.to_owned());
            effect.tried.push((plain, effect.gain, parameters::of_term(&own.model, term).len()));
            effect.gain += best.net;
            effect.equivalents.clear();
        } else if best.net > LEAST_GAIN_OF_RICHER && !effect.equivalents.iter().any(|e| e == best.kind) {
            effect.equivalents.push(best.kind.to_owned());
        }
        Ok(())
    }

    /// The best of the kinds that a search allows in place of a term of a fit; `rest` is the fit without it.
    fn finest(
        &self,
        own: &Fitted,
        rest: &Fitted,
        term: usize,
        search: Search<'_>,
    ) -> Result<Option<Finer>, DiagnoseError> {
        let evaluations = self.evaluate(&rest.model)?;
        let proposals = candidates::proposals(self, &evaluations, rest, search);
        drop(evaluations);
        let base = rest.parameter_columns();
        let profiled = |proposal: &'_ Proposal| {
            let mut columns = base.clone();
            columns.extend(proposal.columns.iter().map(Vec::as_slice));
            let profile = self.layout().best_profile(&columns, &rest.residual, &own.noise);
            (profile.minus_two_log_likelihood, profile.coefficients[base.len()..].to_vec())
        };
        let tried = proposals.par_iter().map(|proposal| (proposal, profiled(proposal)));
        let mut tried: Vec<_> = tried.filter(|(proposal, (_, weights))| proposal.accepts(weights)).collect();
        tried.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
        let numbers = parameters::of_term(&own.model, term).len();
        let mut best: Option<Finer> = None;
        for kind in search.only.unwrap_or_default() {
            let of_kind = tried.iter().filter(|(proposal, _)| proposal.info.name == *kind);
            for (proposal, (_, weights)) in of_kind.take(MOST_TRIED) {
                let Some(fit) = self.polished(proposal, weights, rest, search)? else { continue };
                let further = proposal.parameters().saturating_sub(numbers) as f64;
                let net = own.minus_two_log_likelihood - fit.minus_two_log_likelihood - 2.0 * further;
                if best.as_ref().is_none_or(|best| net > best.net) {
                    best = Some(Finer { kind: proposal.info.name, fit, net });
                }
                break;
            }
        }
        Ok(best)
    }

    /// A candidate of the grid beside a fit, its shapes searched by the swarm; `None` where it ends as no term of its kind, or as one of the kinds that it contains.
    fn polished(
        &self,
        proposal: &Proposal,
        weights: &[f64],
        rest: &Fitted,
        search: Search<'_>,
    ) -> Result<Option<Fitted>, DiagnoseError> {
        let start = proposal.applied(&rest.model, weights);
        let last = start.terms.len() - 1;
        let free = self.parameters(&start, search);
        let mut fit = self.fit(&start, &free, Some(&rest.noise), FIRST_STEPS)?;
        if !proposal.accepts_fitted(&fit.model) {
            fit = self.fit(&start, &free, Some(&rest.noise), 0)?;
        }
        let shaped = self.reshaped(fit, last, search.seed)?;
        let shaped = self.fit(&shaped.model, &shaped.parameters, Some(&shaped.noise), LAST_STEPS)?;
        let exceeds = proposal.kind.exceeds_what_it_contains(&shaped.model.terms[last]);
        Ok((exceeds && proposal.accepts_fitted(&shaped.model)).then_some(shaped))
    }
}
