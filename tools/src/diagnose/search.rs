//! The search for what was left out: forward, with swaps, and backward.

use gmhm::terms::KINDS;

use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::{Alternative, Search};
use crate::kinds;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::heldout_rows::{PREDICTS, improves_heldout_by};

/// An effect that was found, and what else could stand in its place.
pub struct Explained {
    /// Its term in the model.
    pub term: usize,
    /// By how much −2 ln L would be higher without it.
    pub gain: f64,
    /// How many numbers it has.
    pub parameters: usize,
    /// The model without it, refitted.
    pub rest: Fitted,
    /// Everything tried in its place, itself among it, the best first.
    pub alternatives: Vec<Alternative>,
}

/// A term that a model needs, before anything else is tried in its place.
struct Needed {
    /// Its place in the model.
    term: usize,
    /// By how much −2 ln L would be higher without it.
    gain: f64,
    /// How many numbers it has.
    parameters: usize,
    /// The model without it, refitted.
    rest: Fitted,
    /// Its gain beyond what its numbers cost.
    net: f64,
    /// What it gains in each block held out, in squares of the noise.
    held_out: Vec<f64>,
}

/// What the search ends with.
pub struct Outcome {
    /// The base model refitted.
    pub base: Fitted,
    /// The base model with what was found.
    pub extended: Fitted,
    /// What was found.
    pub effects: Vec<Explained>,
    /// How the search was done.
    pub free_zero: bool,
    /// What was tried beside the final model, and found wanting.
    pub rejected: Vec<Alternative>,
}

/// Swaps at most.
const MOST_SWAPS: usize = 4;
/// The most effects looked for.
const MOST_EFFECTS: usize = 4;

/// What a kind must gain beyond what its numbers cost. Set by proof on nulls; see `docs/discovery.md`.
pub const MARGIN: f64 = 12.0;

/// What a kind must gain to be believed.
struct Least {
    /// Of −2 ln L, beyond what its numbers cost.
    net: f64,
    /// Of the squares of blocks held out, in squares of the noise, the best and the worst block left out.
    predicted: f64,
}

impl Least {
    /// Of the first effect, which must explain [`LEAST_PART`] of the squares, too: no kind that gains and predicts so much did in 300 nulls. A further effect may be what a shape of the first does not follow.
    fn of_effect(count: usize) -> Self {
        if count > 1 { Self { net: MARGIN, predicted: PREDICTS } } else { Self { net: 7.0, predicted: 25.0 } }
    }
}

impl Dataset<'_> {
    /// What `parameters` further numbers have to gain of −2 ln L before they are believed: the Bayesian information criterion, and the
    /// choice among the kinds twice (extended criterion; Chen, Chen 2008).
    pub fn penalty(&self, parameters: usize) -> f64 {
        parameters as f64 * (self.counted() as f64).ln() + 2.0 * (KINDS.len() as f64).ln()
    }

    /// The base model with the zero of the deflection free, where that explains more than any kind does: encoder zeros are arbitrary.
    fn with_zero<'r>(&self, base: Fitted, search: Search<'r>) -> Result<(Fitted, Search<'r>), DiagnoseError> {
        if !base.model.has_gear() {
            return Ok((base, search));
        }
        let free = Search { zero: true, ..search };
        let zeroed = self.fit(&base.model, &self.parameters(&base.model, free), Some(&base.noise), 12)?;
        let gain = base.minus_two_log_likelihood - zeroed.minus_two_log_likelihood;
        if gain < self.penalty(1) + MARGIN {
            return Ok((base, search));
        }
        let best = self.explain(&base, search, gain)?.iter().map(|a| a.gain).fold(0.0, f64::max);
        Ok(if gain > best + SWAP { (zeroed, free) } else { (base, search) })
    }

    /// Which part of the squares that one fit leaves another does not.
    pub(super) fn part(&self, better: &Fitted, worse: &Fitted) -> f64 {
        1.0 - self.layout().squares(&better.residual) / self.layout().squares(&worse.residual)
    }

    /// Whether a fit that gains so much lessens the squared residual enough to be believed.
    fn lessens(&self, better: &Fitted, worse: &Fitted, net: f64) -> bool {
        self.part(better, worse) > if net > CLEAR_GAIN_A_ROW * self.counted() as f64 { 0.0 } else { LEAST_PART }
    }

    /// An alternative, all its numbers refitted together and its shapes searched by the swarm.
    fn adopted(&self, tried: &Alternative, search: Search<'_>) -> Result<Fitted, DiagnoseError> {
        let Alternative { fit: Fitted { model, parameters, noise, .. }, extends, .. } = tried;
        let fit = self.fit(model, parameters, Some(noise), 6)?;
        self.reshaped(fit, extends.unwrap_or(model.terms.len() - 1), search.seed)
    }

    /// Searches for what was left out of a fitted model.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn search(&self, base: Fitted, search: Search<'_>) -> Result<Outcome, DiagnoseError> {
        let (base, search) = self.with_zero(base, search)?;
        let mut extended = base.clone();
        let rejected;
        loop {
            let found = extended.model.terms.len() - search.base_terms;
            let so_far = base.minus_two_log_likelihood - extended.minus_two_log_likelihood;
            let least = Least::of_effect(found + 1);
            let asked = least.net.max(LEAST_SHARE * so_far);
            let proposals = self.proposals(&extended, search)?;
            let tried = self.explain_by(&extended, &proposals, search, asked + self.penalty(1));
            let net = |a: &Alternative| a.gain - self.penalty(a.parameters);
            let believed = |a: &Alternative| {
                let predicted = self.gain_of_blocks(&a.fit, &extended, &a.fit.noise);
                (a.extends.is_some() || self.lessens(&a.fit, &extended, net(a)))
                    && self.cancelling_wave(&a.fit, search).is_none()
                    && (net(a) < least.net || improves_heldout_by(least.predicted, &predicted))
            };
            let able: Vec<(usize, &Alternative)> = tried.iter().enumerate().filter(|(_, a)| believed(a)).collect();
            let able = || able.iter().copied();
            let best = able().max_by(|a, b| net(a.1).total_cmp(&net(b.1)));
            let best = best.and_then(|(_, best)| {
                let predicted =
                    |a: &Alternative| self.gain_of_blocks(&a.fit, &extended, &best.fit.noise).iter().sum::<f64>();
                let close = able().filter(|(_, a)| net(a) >= LEAST_OF_BEST * net(best));
                close.map(|(i, a)| (i, a, predicted(a))).max_by(|a, b| a.2.total_cmp(&b.2)).map(|(i, a, _)| (i, a))
            });
            let simplest = best.and_then(|(_, best)| {
                let as_much = |a: &Alternative| net(a) >= net(best) - SHAPE * best.gain;
                able().find(|(_, a)| kinds::includes(best.kind, a.kind) && as_much(a))
            });
            let is_enough = |(_, alternative): &(usize, &Alternative)| {
                let grows = alternative.extends.is_some();
                let asked = if self.part(&alternative.fit, &extended) > LARGE_PART { least.net } else { asked };
                net(alternative) >= asked && (found < MOST_EFFECTS || grows)
            };
            if let Some((best, _)) = simplest.or(best).filter(is_enough) {
                let adopted = self.adopted(&tried[best], search)?;
                if self.cancelling_wave(&adopted, search).is_some() {
                    rejected = tried;
                    break;
                }
                extended = adopted;
                continue;
            }
            let pair = if found == 0 { self.with_hidden_pair(&extended, &proposals, search)? } else { None };
            let pair = pair.filter(|pair| self.part(pair, &extended) > LEAST_PART);
            match pair {
                Some(pair) => extended = pair,
                None => {
                    rejected = tried;
                    break;
                }
            }
        }
        let mut swaps = 0;
        let effects = loop {
            let needed;
            (extended, needed) = self.without_superfluous(extended, search)?;
            let mut effects = Vec::new();
            let mut swap = None;
            for needed in needed {
                let Needed { term, gain, parameters, ref rest, net, ref held_out } = needed;
                let kind = &extended.model.terms[term].kind;
                let mut alternatives = self.explain(rest, search, gain)?;
                let better = alternatives.iter().position(|a| {
                    let shape = if kinds::includes(a.kind, kind) { SHAPE * gain } else { 0.0 };
                    let other = a.gain - self.penalty(a.parameters);
                    let sum = |gains: &[f64]| gains.iter().sum::<f64>();
                    let predicted = || self.gain_of_blocks(&a.fit, rest, &extended.noise);
                    a.extends.is_none()
                        && other > net + SWAP + shape
                        && self.lessens(&a.fit, rest, other)
                        && (net < LEAST_OF_BEST * other || sum(&predicted()) > sum(held_out))
                        && (a.kind != kind || a.parameters >= parameters)
                });
                if let Some(better) = better.filter(|_| swaps < MOST_SWAPS) {
                    swap = Some(self.adopted(&alternatives[better], search)?);
                    break;
                }
                if extended.model.terms.len() > search.base_terms + 1 {
                    self.refit_beside_others(&mut alternatives, &extended, &needed, search)?;
                }
                effects.push(Explained { term, gain, parameters, rest: needed.rest, alternatives });
            }
            let Some(swapped) = swap else { break effects };
            swaps += 1;
            extended = swapped;
        };
        Ok(Outcome { base, extended, effects, free_zero: search.zero, rejected })
    }

    /// Refits alternatives of no more numbers in the place of a term that fall short of its gain, with the numbers of all other terms as they are beside it: without the term these are often far off, as those of a
    /// delay are that hides damping.
    fn refit_beside_others(
        &self,
        alternatives: &mut [Alternative],
        extended: &Fitted,
        needed: &Needed,
        search: Search<'_>,
    ) -> Result<(), DiagnoseError> {
        let falls_short = LEAST_OF_REFITTED * needed.gain..needed.gain - SWAP;
        let is_refitted = |a: &&mut Alternative| {
            falls_short.contains(&a.gain) && a.parameters <= needed.parameters && a.polished && a.extends.is_none()
        };
        for alternative in alternatives.iter_mut().filter(is_refitted) {
            let Some(other) = alternative.fit.model.terms.last() else { continue };
            let mut model = extended.model.clone();
            model.terms.remove(needed.term);
            model.terms.push(other.clone());
            let last = model.terms.len() - 1;
            let fit = self.fit(&model, &self.parameters(&model, search), Some(&extended.noise), 6)?;
            let gain = self.gain_of(last, &fit, &needed.rest);
            let refitted = &fit.model.terms[last];
            let is_of_kind = kinds::of_term(refitted).is_some_and(|kind| kinds::is_within_limits(kind, refitted));
            let is_sound = refitted.check().is_ok() && kinds::positive_where_needed(refitted) && is_of_kind;
            if gain > alternative.gain && is_sound {
                (alternative.fit, alternative.gain) = (fit, gain);
            }
        }
        alternatives.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        Ok(())
    }

    /// A fit without the terms that it does not need, and what is known of those that it does.
    fn without_superfluous(
        &self,
        mut extended: Fitted,
        search: Search<'_>,
    ) -> Result<(Fitted, Vec<Needed>), DiagnoseError> {
        let mut needed = Vec::new();
        let mut term = search.base_terms;
        while term < extended.model.terms.len() {
            let mut without = extended.model.clone();
            without.terms.remove(term);
            let free = self.parameters(&without, search);
            let rest = self.fit(&without, &free, Some(&extended.noise), 6)?;
            let gain = self.gain_of(term, &extended, &rest);
            let parameters = crate::regression::parameters::of_term(&extended.model, term).len();
            let net = gain - self.penalty(parameters);
            let held_out = self.gain_of_blocks(&extended, &rest, &extended.noise);
            let least = Least::of_effect(extended.model.terms.len() - search.base_terms);
            let enough = net > least.net && self.lessens(&extended, &rest, net);
            let last = extended.model.terms.len() == search.base_terms + 1;
            if improves_heldout_by(least.predicted, &held_out) && (enough || last) {
                needed.push(Needed { term, gain, parameters, rest, net, held_out });
                term += 1;
            } else {
                extended = rest;
                needed.clear();
                term = search.base_terms;
            }
        }
        Ok((extended, needed))
    }
}

/// A further effect has to gain at least this share of what those before it gained: what a shape of theirs does not follow to the last is no effect of
/// its own,
const LEAST_SHARE: f64 = 0.04;

/// unless it explains this part of the squared residual that they leave.
const LARGE_PART: f64 = 0.4;

/// A kind explains at least this part of the squared residual: the noise of an angle looks like inertia, damping or slip, and explains less. This is not asked of a further element of a kind that was
/// found, as another order of a ripple.
const LEAST_PART: f64 = 0.05;

/// Or it gains so much a row, which takes two fifths of the variance of what the noise brings anew.
const CLEAR_GAIN_A_ROW: f64 = 0.5;

/// Of kinds whose gains differ by less than this factor the one that predicts held-out blocks best is taken: noise of an angle favours what follows it.
const LEAST_OF_BEST: f64 = 0.75;

/// A kind has to explain at least this share more than the special case of it: following a shape to the last makes no other physics.
const SHAPE: f64 = 0.02;

/// An alternative that gains less than this part of what the term gains in whose place it stands is not refitted.
const LEAST_OF_REFITTED: f64 = 0.3;

/// A swap has to gain this much.
const SWAP: f64 = 4.0;
