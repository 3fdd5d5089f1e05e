//! Names and their classes by likelihood: a small further effect that it does not see loses its name; kinds that explain clearly less in the place of a named one leave the class,
//! and one that explains clearly more takes the place.
//!
//! Held-out error alone distinguishes similar kinds poorly. The searches fit each kind from the best candidates of a grid, and a dip of friction has several optima: a kind that
//! contains the named one, as Stribeck friction contains Coulomb friction, is fitted with the swarm here.

use rayon::prelude::*;

use crate::diagnose::DiagnoseError;
use crate::diagnose::decision::{STEPS_OF_LIKELIHOOD, TOO_LOUD_TO_REFINE};
use crate::diagnose::diagnosis::UNKNOWN;
use crate::diagnose::explain::{Search, Tried};
use crate::diagnose::naming::{CLASS, DiagnosisVerdict, LEAST_GAIN_OF_RICHER};
use crate::diagnose::search::MARGIN;
use crate::kinds;
use crate::model::Model;
use crate::numerics::autoregression::Noise;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::heldout_rows::trimmed_sum;
use crate::regression::parameters;

/// A further name of a smaller share needs a likelihood that believes it; less may be a trace of the shapes of the others.
const LARGEST_TRACE: f64 = 0.05;
/// One kind explains clearly more than another where it lowers −2 ln L by so much more, net,
const LEAST_NET_GAIN: f64 = 25.0;
/// and predicts blocks held out better by so many squares of the noise of either fit, the best and the worst block left out.
const LEAST_PREDICTED: f64 = 25.0;
/// Candidates of the grid that are fitted until one ends as a term of its kind.
const MOST_TRIED: usize = 3;
/// Steps of a fit from a candidate of the grid.
const FIRST_STEPS: usize = 2;
/// Steps of a fit from one that is nearly right.
const LAST_STEPS: usize = 4;

/// A named kind, and the fit without it.
pub(super) struct Place<'f> {
    pub(super) kind: &'f str,
    pub(super) term: usize,
    pub(super) own: &'f Fitted,
    pub(super) rest: &'f Fitted,
}

/// A fit with another kind in the place of a named one, its last term.
pub(super) struct Rival {
    kind: &'static str,
    pub(super) fit: Fitted,
    /// By how much it lowers −2 ln L, net of what its further numbers gain from noise.
    net: f64,
}

impl Dataset<'_> {
    /// Settles the class of each named effect by likelihood. Not where the base is far from the machine or the effect far above the noise: there all shapes are approximate.
    pub(super) fn settle_classes(
        &self,
        verdict: &mut DiagnosisVerdict,
        search: Search<'_>,
    ) -> Result<(), DiagnoseError> {
        if self.is_far_from(&verdict.base) {
            return Ok(());
        }
        // Made where it is first needed, and again for a model in which a name was replaced.
        let mut fitted = None;
        self.drop_traces(verdict, &mut fitted, search)?;
        self.drop_included(verdict, &mut fitted, search)?;
        for at in 0..verdict.effects.len() {
            let (effect, model) = (&verdict.effects[at], &verdict.extended.model);
            let Some(term) = effect.term.filter(|_| effect.name != UNKNOWN) else { continue };
            let is_single = kinds::elements(&model.terms[term]) == 1;
            let is_rival = |kind: &&str| {
                let is_listed = || effect.equivalents.iter().any(|e| e == kind);
                // One element of several explains less than all of them.
                let is_whole =
                    kinds::of(kind).is_some_and(|kind| !kind.extends() || is_single && kind.elements_are_effects());
                let is_new = search.allows(kind) && !model.has_term(kind);
                is_whole && is_new && (kinds::includes(kind, &effect.name) || is_listed())
            };
            let rivals: Vec<&'static str> = kinds::ALL.iter().map(|kind| kind.name()).filter(is_rival).collect();
            if rivals.is_empty() {
                continue;
            }
            let fit = self.against_coloured_noise(&mut fitted, model, search)?;
            let Some((mut own, rest)) = self.with_and_without(fit, term, search)? else { continue };
            let (mut found, lost) =
                self.rivals(&Place { kind: &effect.name, term, own: &own, rest: &rest }, search, &rivals)?;
            let contested = self.winner(&found, &own).is_some_and(|at| kinds::contains(found[at].kind, &effect.name));
            if contested {
                // The swarm searches the shapes of the finer kind; those of the plainer one, too.
                let before = own.minus_two_log_likelihood;
                own = self.reshaped(own, term, search.seed)?;
                let gained = (before - own.minus_two_log_likelihood).max(0.0);
                found.iter_mut().for_each(|rival| rival.net -= gained);
            }
            let best = self.winner(&found, &own).map(|at| &found[at]);
            let (most, winner) = best.map_or((0.0, &own), |best| (best.net, &best.fit));
            let is_out = |kind: &str| {
                let rival = found.iter().find(|rival| rival.kind == kind);
                let is_worse =
                    |rival: &Rival| most - rival.net > LEAST_NET_GAIN && self.predicts_clearly(winner, &rival.fit);
                rival.map_or(lost.contains(&kind), is_worse)
            };
            let mut class: Vec<String> = effect.equivalents.iter().filter(|e| !is_out(e)).cloned().collect();
            let is_as_good = |rival: &&Rival| {
                let least = if kinds::imitates(rival.kind, &effect.name) { -CLASS } else { LEAST_GAIN_OF_RICHER };
                kinds::includes(rival.kind, &effect.name) && rival.net > least
            };
            class.extend(found.iter().filter(|_| best.is_none()).filter(is_as_good).map(|rival| rival.kind.to_owned()));
            class.retain(|kind| best.is_none_or(|best| best.kind != kind));
            class.sort();
            class.dedup();
            if let Some(best) = best {
                let mut model = best.fit.model.clone();
                let other = model.terms.pop();
                model.terms.splice(term..term, other);
                verdict.extended = self.refitted_with(&verdict.extended, &model, &best.fit, search)?;
                fitted = None;
            }
            let effect = &mut verdict.effects[at];
            effect.equivalents = class;
            if let Some(best) = best {
                let plain = std::mem::replace(&mut effect.name, best.kind.to_owned());
                effect.tried.push((plain, effect.gain, parameters::of_term(&own.model, term).len()));
                effect.gain += best.net;
            }
        }
        self.unite_waves(verdict, search)
    }

    /// An extended model in which terms were replaced by those of another fit: fitted by plain least squares if it was so before, else against coloured noise, which starts from the noise of that fit.
    pub(super) fn refitted_with(
        &self,
        before: &Fitted,
        model: &Model,
        of_terms: &Fitted,
        search: Search<'_>,
    ) -> Result<Fitted, DiagnoseError> {
        let free = self.parameters(model, search);
        Ok(if before.plain {
            self.plain_fit(model, &free, LAST_STEPS)?
        } else {
            self.or_plain(self.fit(model, &free, Some(&of_terms.noise), LAST_STEPS)?)?
        })
    }

    /// Takes out the names of small further effects that likelihood does not see beside the others; their terms stay in the model.
    fn drop_traces(
        &self,
        verdict: &mut DiagnosisVerdict,
        fitted: &mut Option<Fitted>,
        search: Search<'_>,
    ) -> Result<(), DiagnoseError> {
        let mut at = verdict.effects.len();
        while at > 0 {
            at -= 1;
            let (effect, model) = (&verdict.effects[at], &verdict.extended.model);
            let is_further = verdict.effects.iter().filter(|e| e.name != UNKNOWN).count() > 1;
            let is_small = effect.name != UNKNOWN && effect.share < LARGEST_TRACE;
            let Some(term) = effect.term.filter(|_| is_further && is_small) else { continue };
            let fit = self.against_coloured_noise(fitted, model, search)?;
            let Some((with, without)) = self.with_and_without(fit, term, search)? else { continue };
            let numbers = parameters::of_term(&with.model, term).len();
            let gain = without.minus_two_log_likelihood - with.minus_two_log_likelihood;
            let predicted = trimmed_sum(&self.gain_of_blocks(&with, &without, &with.noise));
            if gain - self.penalty(numbers) < MARGIN && predicted < LEAST_PREDICTED {
                let effect = verdict.effects.remove(at);
                verdict.rejected.push((effect.name, gain, numbers));
            }
        }
        Ok(())
    }

    /// The fit of a model against coloured noise, made once.
    pub(super) fn against_coloured_noise<'f>(
        &self,
        fitted: &'f mut Option<Fitted>,
        model: &Model,
        search: Search<'_>,
    ) -> Result<&'f Fitted, DiagnoseError> {
        if fitted.is_none() {
            *fitted = Some(self.fit(model, &self.parameters(model, search), None, STEPS_OF_LIKELIHOOD)?);
        }
        Ok(fitted.as_ref().expect("made above"))
    }

    /// A fit against coloured noise with and without a term; `None` where the term is far above the noise.
    pub(super) fn with_and_without(
        &self,
        with: &Fitted,
        term: usize,
        search: Search<'_>,
    ) -> Result<Option<(Fitted, Fitted)>, DiagnoseError> {
        let added = self.added_by(&with.model, &self.total(&with.model)?, term)?;
        if self.layout().squares(&added) > TOO_LOUD_TO_REFINE * self.layout().squares(&with.residual) {
            return Ok(None);
        }
        let mut without = with.model.clone();
        without.terms.remove(term);
        let without = self.fit(&without, &self.parameters(&without, search), Some(&with.noise), LAST_STEPS)?;
        // Noise that was fitted beside a wrong shape may hold part of the effect.
        let again = self.fit(&with.model, &with.parameters, Some(&without.noise), LAST_STEPS)?;
        let is_better = again.minus_two_log_likelihood < with.minus_two_log_likelihood;
        Ok(Some((if is_better { again } else { with.clone() }, without)))
    }

    /// Which of some rivals explains clearly more than the named kind, and most.
    fn winner(&self, rivals: &[Rival], own: &Fitted) -> Option<usize> {
        let is_clear = |rival: &Rival| rival.net > LEAST_NET_GAIN && self.predicts_clearly(&rival.fit, own);
        let clear = (0..rivals.len()).filter(|at| is_clear(&rivals[*at]));
        clear.max_by(|a, b| rivals[*a].net.total_cmp(&rivals[*b].net))
    }

    /// Whether one fit predicts blocks held out clearly better than another, in the noise of either.
    fn predicts_clearly(&self, better: &Fitted, worse: &Fitted) -> bool {
        let gain = |noise: &[Noise]| trimmed_sum(&self.gain_of_blocks(better, worse, noise));
        [better, worse].iter().all(|fit| gain(&fit.noise) > LEAST_PREDICTED)
    }

    /// The best fit of each of some kinds in a place, and the kinds of which no fit ends as a term of its kind.
    pub(super) fn rivals(
        &self,
        place: &Place<'_>,
        search: Search<'_>,
        kinds: &[&'static str],
    ) -> Result<(Vec<Rival>, Vec<&'static str>), DiagnoseError> {
        let Place { own, rest, .. } = place;
        let proposals = self.proposals(rest, Search { only: Some(kinds), ..search })?;
        let profiled = proposals.par_iter().filter_map(|proposal| self.profiled(rest, &own.noise, proposal));
        let mut tried: Vec<Tried<'_>> = profiled.collect();
        tried.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let of_own = self.gain_of(place.term, own, rest);
        let numbers = parameters::of_term(&own.model, place.term).len() as f64;
        let (mut found, mut lost) = (Vec::new(), Vec::new());
        for kind in kinds {
            let mut is_lost = false;
            for tried in tried.iter().filter(|tried| tried.proposal.info.name == *kind).take(MOST_TRIED) {
                let fit = self.polished(tried, place, search)?;
                is_lost = fit.is_none();
                if let Some(fit) = fit {
                    let further = tried.proposal.parameters() as f64 - numbers;
                    let net = self.gain_of(fit.model.terms.len() - 1, &fit, rest) - of_own - 2.0 * further;
                    found.push(Rival { kind: tried.proposal.info.name, fit, net });
                    break;
                }
            }
            if is_lost {
                lost.push(*kind);
            }
        }
        Ok((found, lost))
    }

    /// A candidate of the grid in a place, its shapes searched by the swarm where it contains the named kind; `None` where it ends as no term of its kind, or as one of the kinds
    /// that it contains.
    fn polished(
        &self,
        tried: &Tried<'_>,
        place: &Place<'_>,
        search: Search<'_>,
    ) -> Result<Option<Fitted>, DiagnoseError> {
        let proposal = tried.proposal;
        let start = proposal.applied(&place.rest.model, &tried.weights);
        let (last, noise) = (start.terms.len() - 1, Some(&place.rest.noise[..]));
        let free = self.parameters(&start, search);
        let mut fit = self.fit(&start, &free, noise, FIRST_STEPS)?;
        if !proposal.accepts_fitted(&fit.model) {
            fit = self.fit(&start, &free, noise, 0)?;
        }
        if kinds::contains(proposal.info.name, place.kind) {
            fit = self.reshaped(fit, last, search.seed)?;
        }
        let fit = self.fit(&fit.model, &fit.parameters, Some(&fit.noise), LAST_STEPS)?;
        let exceeds = proposal.kind.exceeds_what_it_contains(&fit.model.terms[last]);
        Ok((exceeds && proposal.accepts_fitted(&fit.model)).then_some(fit))
    }
}
