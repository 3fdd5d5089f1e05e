//! From a search to findings: classes of kinds that the recordings cannot distinguish, and names that are given only where they explain all there is.

use gmhm::terms::KINDS;

use crate::diagnose::DiagnoseError;
use crate::diagnose::curves_in_place::{CURVES, by_first, once, repeated_first};
use crate::diagnose::diagnosis::{Naming, UNKNOWN};
use crate::diagnose::explain::{Alternative, Search};
use crate::diagnose::nonparametric;
use crate::diagnose::nonparametric::{Coordinates, Explained as Curve, LEAST_PART};
use crate::diagnose::search::Outcome;
use crate::kinds;
use crate::model::Model;
use crate::numerics::vector::dot;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::heldout_rows::{improves_heldout, trimmed_sum};

/// One effect as it is reported.
pub struct EffectVerdict {
    /// Its kind, or `unknown`.
    pub name: String,
    /// Kinds that these recordings cannot distinguish from it.
    pub equivalents: Vec<String>,
    /// Posterior weight of the class.
    pub confidence: f64,
    /// Its term in the extended model; none where the curve was not worth a term.
    pub term: Option<usize>,
    /// By how much −2 ln L would be higher without it.
    pub gain: f64,
    /// Part of the structured residual power that it explains.
    pub share: f64,
    /// Where it sits, the best coordinate first.
    pub curves: Vec<Curve>,
    /// What else was tried in its place: kind, gain, numbers.
    pub tried: Vec<(String, f64, usize)>,
    /// What the best free curve gains in its place, net.
    pub free_gain: f64,
    /// The closest kind of the library, where the effect is unknown.
    pub closest: Option<String>,
    /// The part of a free function's prediction that the kind reaches; `None` where likelihood decides.
    pub fidelity: Option<f64>,
    /// Whether the kind's shape suffices.
    pub naming: Naming,
}

impl EffectVerdict {
    /// Structure over the coordinate of a curve that no kind resembles, without a term.
    pub(super) fn unnamed(gain: f64, curve: Curve) -> Self {
        Self {
            name: UNKNOWN.to_owned(),
            equivalents: Vec::new(),
            confidence: 1.0,
            term: None,
            gain,
            share: 0.0,
            curves: vec![curve],
            tried: Vec::new(),
            free_gain: gain,
            closest: None,
            fidelity: None,
            naming: Naming::Unknown,
        }
    }

    /// Makes it unknown; its kind is then the closest one.
    pub(super) fn withhold(&mut self) {
        self.closest = Some(std::mem::replace(&mut self.name, UNKNOWN.to_owned()));
        self.naming = Naming::Unknown;
        self.equivalents.clear();
    }
}

/// Makes one effect of two: `part` becomes a part of `whole`.
pub(super) fn unite(effects: &mut Vec<EffectVerdict>, whole: usize, part: usize) {
    let share = effects[part].share;
    let whole = &mut effects[whole];
    whole.share = (whole.share + share).min(1.0);
    effects.remove(part);
}

/// Renumbers the terms of effects after one of the model's terms was removed.
pub(super) fn without_term(effects: &mut [EffectVerdict], removed: usize) {
    for term in effects.iter_mut().filter_map(|effect| effect.term.as_mut()) {
        *term -= usize::from(*term > removed);
    }
}

/// What was found.
pub struct DiagnosisVerdict {
    /// Is there structure beyond noise?
    pub mismatch: bool,
    /// The base model refitted.
    pub base: Fitted,
    /// The base model with what was found.
    pub extended: Fitted,
    /// What was found, the largest first.
    pub effects: Vec<EffectVerdict>,
    /// What was tried beside the final model, and found wanting: kind, gain, numbers.
    pub rejected: Vec<(String, f64, usize)>,
    /// The part of the rms that the extended model leaves of which no curve predicts any: noise, as far as can be told.
    pub noise_part: f64,
}

impl DiagnosisVerdict {
    /// The same with nothing found: the refitted base alone.
    pub(super) fn without_effects(self) -> Self {
        Self { mismatch: false, extended: self.base.clone(), effects: Vec::new(), ..self }
    }
}

/// Kinds within this of the best's −2 ln L are one class: the wrong one of two looks better by more than this once in a thousand.
pub(super) const CLASS: f64 = 11.0;
/// A richer kind stays in the class of a simpler one that explains almost as much when noise alone would give it less than this (χ², 1 %).
const RICHER: f64 = 13.0;
/// One that holds the simpler as its special case stays from this on, if what it has beyond it is there to see: the recordings do not deny it.
pub(super) const LEAST_GAIN_OF_RICHER: f64 = 4.0;
/// A flexible curve has to gain this much, net of what its columns gain from noise, to be structure.
pub const STRUCTURE: f64 = 45.0;
/// A curve that shows the same as a term lessens the squared residual by at least this share of what the term does.
const LEAST_SHARED_PART: f64 = 0.3;
/// Unknown effects at most.
const MOST_UNKNOWN: usize = 2;
/// Structure without a name that is all there is has to gain this much: of 200 nulls of coloured noise 5 gained 82 to 106, and one 310; of 48 effects of no list the least 138.
const LEAST_GAIN_ALONE: f64 = 120.0;
/// A tone holds this part of the squared residual.
const LEAST_TONE_PART: f64 = 0.1;
/// What comes once has to gain this much.
const LEAST_GAIN_UNREPEATED: f64 = 80.0;
/// A name is withheld where a free curve beside the named term predicts this share of what the term explains.
const LEAST_PREDICTED_PART: f64 = 0.085;
/// Or where the curve gains more than the named term by this share of its gain, and predicts at all.
const LEAST_EXCESS_PART: f64 = 0.2;
/// A named term may leave this part of what a flexible curve of the same coordinates explains.
const MOST_UNEXPLAINED_PART: f64 = 0.04;

impl Dataset<'_> {
    /// Searches for what was left out of a model and judges what was found, from the model fitted against coloured noise or, where that predicts held-out blocks
    /// clearly better, by plain least squares.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn found<'r>(
        &self,
        model: &Model,
        search: Search<'r>,
    ) -> Result<(DiagnosisVerdict, Search<'r>), DiagnoseError> {
        let base = self.or_plain(self.fit(model, &self.parameters(model, search), None, 12)?)?;
        let outcome = self.search(base, search)?;
        let search = Search { zero: outcome.free_zero, ..search };
        let mut verdict = self.verdict(outcome, search)?;
        verdict.base = self.or_plain(verdict.base)?;
        verdict.extended = self.or_plain(verdict.extended)?;
        Ok((verdict, search))
    }

    /// Judges what a search found.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn verdict(&self, outcome: Outcome, search: Search<'_>) -> Result<DiagnosisVerdict, DiagnoseError> {
        let Outcome { base, mut extended, effects, rejected, .. } = outcome;
        let power = |residual: &[f64]| self.layout().squares(residual);
        let (base_power, left_power) = (power(&base.residual), power(&extended.residual));
        let structured = (base_power - left_power).max(1e-12 * base_power);
        let mut verdicts = Vec::new();
        let mut saved_in_place = Vec::new();
        for effect in effects {
            let kind = extended.model.terms[effect.term].kind.clone();
            let rest = effect.rest;
            let own_part = self.part(&extended, &rest);
            saved_in_place.push(((power(&rest.residual) - left_power) / structured).clamp(0.0, 1.0));
            let curves = self.curves_beside(&rest, LEAST_SHARED_PART * own_part)?;
            let mut tried = effect.alternatives;
            let elements = kinds::elements(&extended.model.terms[effect.term]);
            self.grow(&rest, &mut tried, elements, search)?;
            let own = tried.iter().filter(|a| a.kind == kind).map(|a| a.gain).fold(effect.gain, f64::max);
            let (own_parameters, n) = (effect.parameters, (self.counted() as f64).ln());
            let equivalent = |a: &&Alternative| {
                let shows = self.part(&a.fit, &rest) > LEAST_SHARED_PART * own_part;
                let extra = a.parameters as f64 - own_parameters as f64;
                let richer = extra > 1.0;
                let more = a.gain - own;
                let maybe = kinds::contains(a.kind, &kind)
                    && more > LEAST_GAIN_OF_RICHER
                    && a.fit.model.terms.last().is_some_and(|term| {
                        kinds::of_term(term).is_some_and(|kind| kind.exceeds_what_it_contains(term))
                    });
                let richer = richer && !kinds::imitates(a.kind, &kind);
                a.kind != kind && a.polished && shows && if richer { maybe || more > RICHER } else { -more < CLASS }
            };
            let mut equivalents: Vec<String> = tried.iter().filter(equivalent).map(|a| a.kind.to_owned()).collect();
            equivalents.dedup();
            let weight = |gain: f64, parameters: usize| {
                (0.5 * (gain - own - (parameters as f64 - own_parameters as f64) * n)).min(0.0).exp()
            };
            let others: f64 = tried
                .iter()
                .filter(|a| a.kind != kind)
                .map(|a| (a.kind, weight(a.gain, a.parameters)))
                .map(|(k, w)| if equivalents.iter().any(|e| e == k) { 0.0 } else { w })
                .sum();
            // A curve that lessens the residual much less follows the noise of an angle, not the effect.
            let soft_edge = kinds::of(&kind).and_then(|kind| kind.soft_edge());
            let mut alike: Vec<&Curve> = curves
                .iter()
                .filter(|c| !c.coherent && c.part > LEAST_SHARED_PART * own_part && soft_edge != Some(c.coordinate))
                .collect();
            alike.sort_by(|a, b| b.net().total_cmp(&a.net()));
            let free_gain = alike.first().map_or(0.0, |c| c.net());
            let follows = |curve: &&Curve| {
                let unexplained = curve.net() - effect.gain + 2.0 * own_parameters as f64;
                unexplained > STRUCTURE.max(MOST_UNEXPLAINED_PART * curve.gain) && {
                    let left = self.gain_of_columns(&extended, &[], &curve.basis, &extended.noise);
                    trimmed_sum(&left) > LEAST_PREDICTED_PART * effect.gain
                        || (unexplained > LEAST_EXCESS_PART * curve.gain && improves_heldout(&left))
                }
            };
            let followed = alike.iter().take(CURVES).any(follows);
            let named = !followed && self.is_marked(&extended, &rest, effect.term, effect.gain, search)?;
            verdicts.push(EffectVerdict {
                name: if named { kind.clone() } else { UNKNOWN.to_owned() },
                equivalents: if named { equivalents } else { Vec::new() },
                confidence: 1.0 / (1.0 + others),
                term: Some(effect.term),
                gain: effect.gain,
                // Told once all effects are known.
                share: 0.0,
                curves,
                tried: tried.iter().map(|a| (a.kind.to_owned(), a.gain, a.parameters)).collect(),
                free_gain,
                closest: (!named).then_some(kind),
                fidelity: None,
                naming: if named { Naming::Named } else { Naming::Unknown },
            });
        }
        extended = self.with_curves_in_place(extended, &mut verdicts, search)?;
        // What an approximation leaves is no further unexplained structure.
        let known = |e: &EffectVerdict| e.name != UNKNOWN || (e.closest.is_none() && e.term.is_some());
        let mut left = self.curves_beside(&extended, LEAST_PART)?;
        while verdicts.iter().all(known) && verdicts.iter().filter(|e| e.name == UNKNOWN).count() < MOST_UNKNOWN {
            let total = base.minus_two_log_likelihood - extended.minus_two_log_likelihood;
            let Some(unexplained) = self.unexplained(&extended, &left, STRUCTURE.max(MOST_UNEXPLAINED_PART * total))
            else {
                break;
            };
            left = by_first(left, unexplained);
            let further = verdicts.iter().any(|e| e.name == UNKNOWN);
            let gain = left[0].gain;
            if verdicts.is_empty() && !left[0].coherent && gain < LEAST_GAIN_ALONE {
                break;
            }
            let end = extended.model.terms.len();
            let curve = self.with_curve(&extended, &extended.model, end, &left, search)?;
            if further && curve.is_none() {
                break;
            }
            let term = curve.is_some().then_some(end);
            extended = curve.unwrap_or(extended);
            let explained = dot(&left[0].contribution, &left[0].contribution);
            verdicts.push(EffectVerdict {
                name: UNKNOWN.to_owned(),
                equivalents: Vec::new(),
                confidence: 1.0,
                curves: match term {
                    Some(at) => repeated_first(left, &extended.model.terms[at]),
                    None => left,
                },
                term,
                gain,
                share: explained / structured.max(explained),
                tried: rejected.iter().map(|a| (a.kind.to_owned(), a.gain, a.parameters)).collect(),
                free_gain: 0.0,
                closest: None,
                fidelity: None,
                naming: Naming::Unknown,
            });
            left = self.curves_beside(&extended, LEAST_PART)?;
        }
        // What a curve still shows in a kind's own coordinate the kind has not explained.
        let strange = verdicts.iter().filter(|e| e.name == UNKNOWN && e.closest.is_none());
        let strange: Vec<(&str, f64)> = strange.map(|e| (e.curves[0].coordinate, e.gain)).collect();
        for effect in verdicts.iter_mut().filter(|e| e.name != UNKNOWN) {
            let own = coordinates(&effect.name);
            if strange.iter().any(|(at, gain)| own.contains(at) && *gain > LEAST_EXCESS_PART * effect.gain) {
                effect.withhold();
            }
        }
        self.share_out(&base, &extended, &mut verdicts)?;
        // Of two that cancel each other almost one has no part of what both explain together: what it saves in its place counts.
        for (effect, saved) in verdicts.iter_mut().zip(saved_in_place).filter(|(effect, _)| effect.share == 0.0) {
            effect.share = saved;
        }
        verdicts.sort_by(|a, b| b.share.total_cmp(&a.share));
        // Two terms of a kind are one effect, told by the larger.
        let mut effects: Vec<EffectVerdict> = Vec::new();
        for effect in verdicts {
            match effects.iter_mut().find(|e| e.name != UNKNOWN && e.name == effect.name) {
                Some(first) => first.share = (first.share + effect.share).min(1.0),
                None => effects.push(effect),
            }
        }
        let foreseen = left.iter().filter(|c| !c.coherent && c.is_structure(STRUCTURE) && self.predicts(&extended, c));
        let noise_part = (1.0 - foreseen.map(|c| c.part).fold(0.0, f64::max)).sqrt();
        let rejected = rejected.into_iter().map(|a| (a.kind.to_owned(), a.gain, a.parameters)).collect();
        Ok(DiagnosisVerdict { mismatch: !effects.is_empty(), base, extended, effects, rejected, noise_part })
    }

    /// Whether what makes a term its kind is there: whether it explains more than special cases of it do.
    fn is_marked(
        &self,
        extended: &Fitted,
        rest: &Fitted,
        term: usize,
        gain: f64,
        search: Search<'_>,
    ) -> Result<bool, DiagnoseError> {
        let own = &extended.model.terms[term];
        let special_cases = kinds::of_term(own).map(|kind| kind.special_cases(own)).unwrap_or_default();
        for special in special_cases {
            let mut model = extended.model.clone();
            let own = term..term + special.len();
            model.terms.splice(term..=term, special);
            let free = self.parameters(&model, search);
            let fitted = self.fit(&model, &free, Some(&extended.noise), 6)?;
            let special_gain = rest.minus_two_log_likelihood - fitted.minus_two_log_likelihood;
            let sound = fitted.model.terms[own].iter().all(|t| t.check().is_ok() && kinds::positive_where_needed(t));
            if sound && special_gain > gain - CLASS {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The coordinate of what a fit leaves: the curve that gains most, but not one over time where another predicts half as much.
    fn unexplained(&self, fit: &Fitted, left: &[Curve], least: f64) -> Option<&'static str> {
        let tone = || {
            left.iter()
                .find(|c| c.coherent && c.is_structure(STRUCTURE) && c.part > LEAST_TONE_PART)
                .map(|c| c.coordinate)
        };
        let mut unexplained = left.iter().filter(|c| !c.coherent && c.is_structure(least) && self.predicts(fit, c));
        let Some(first) = unexplained.next() else { return tone() };
        let mut other = || unexplained.find(|c| !once(c) && c.net() > 0.5 * first.net());
        Some(if once(first) { other().unwrap_or(first).coordinate } else { first.coordinate })
    }

    /// Whether a curve predicts what it was not fitted to. What comes once, in time, cannot be predicted and has to gain more instead.
    fn predicts(&self, fit: &Fitted, curve: &Curve) -> bool {
        if once(curve) {
            curve.net() > LEAST_GAIN_UNREPEATED
        } else {
            improves_heldout(&self.gain_of_columns(fit, &[], &curve.basis, &curve.noise))
        }
    }

    /// Curves over every coordinate beside a fitted model, the best first, exact for those that take `least_part` of the squared residual.
    pub fn curves_beside(&self, fit: &Fitted, least_part: f64) -> Result<Vec<Curve>, DiagnoseError> {
        let evaluations = self.evaluate(&fit.model)?;
        let see = Coordinates::new(self, &evaluations);
        let curves = nonparametric::curves(self, &see, fit);
        Ok(self.locate(fit, &curves, least_part))
    }

    /// Lets kinds of several elements have as many as the one that was found.
    fn grow(
        &self,
        rest: &Fitted,
        tried: &mut [Alternative],
        elements: usize,
        search: Search<'_>,
    ) -> Result<(), DiagnoseError> {
        for alternative in tried.iter_mut().filter(|a| a.polished && a.extends.is_none()) {
            let term = alternative.fit.model.terms.len() - 1;
            while elements_of(&alternative.fit.model, term) < elements {
                let own = [alternative.kind];
                let only = Search { only: Some(&own), ..search };
                let further = self.explain(&alternative.fit, only, 0.0)?;
                let Some(best) = further.into_iter().find(|a| a.extends == Some(term)) else { break };
                alternative.parameters += best.parameters;
                alternative.gain = rest.minus_two_log_likelihood - best.fit.minus_two_log_likelihood;
                alternative.fit = best.fit;
            }
        }
        Ok(())
    }
}

fn elements_of(model: &Model, term: usize) -> usize {
    model.terms.get(term).map_or(1, kinds::elements)
}

/// The coordinates in which a kind shows, by name.
pub fn coordinates(kind: &str) -> Vec<&'static str> {
    let info = KINDS.iter().find(|i| i.name == kind);
    info.map_or_else(Vec::new, |i| i.coordinates.iter().map(|c| c.name()).collect())
}

/// Whether a kind follows the temperature or the time.
pub fn follows_slow_signal(kind: &str) -> bool {
    coordinates(kind).iter().any(|coordinate| matches!(*coordinate, "temperature" | "time"))
}
