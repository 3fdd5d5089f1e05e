//! What of a joint selection likelihood against coloured noise confirms: kinds, and elements of kinds.

use crate::diagnose::DiagnoseError;
use crate::diagnose::cancelling_waves::add_element;
use crate::diagnose::decision::LARGE;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::follows_slow_signal;
use crate::diagnose::search::MARGIN;
use crate::diagnose::selection::{Selected, Selection};
use crate::kinds;
use crate::model::{Model, Term};
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::parameters::FreeParameter;

/// A kind that almost every machine has needs no likelihood to be believed where it saves this part of what is left,
const CLEAR_GAIN_OF_COMMON: f64 = 0.25;
/// another where it saves this part,
const CLEAR_GAIN: f64 = 0.5;
/// or this part where no free function of its coordinates confirms it;
const CLEAR_GAIN_ALONE: f64 = 1.0;
/// of a kind that follows a slow signal, which slow noise follows by chance, so many times as much.
const CLEAR_GAIN_OF_SLOW: f64 = 4.0;
/// Steps of the fits that confirm.
const CONFIRMING_STEPS: usize = 3;
/// Steps of the refit without what is not confirmed.
const STEPS: usize = 5;

impl Dataset<'_> {
    /// The selection without kinds that save little and that likelihood does not see: against coloured noise a small gain on held-out blocks may be chance.
    /// `likeliest_base` is the base model fitted against coloured noise.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn confirmed(
        &self,
        base: &Fitted,
        mut selection: Selection,
        likeliest_base: &Fitted,
        search: Search<'_>,
    ) -> Result<Selection, DiagnoseError> {
        let far = self.is_far_from(base);
        let weak = |s: &Selected, left: f64| {
            let is_common = kinds::is_common(s.kind);
            let alone = match s.fidelity {
                None => CLEAR_GAIN_ALONE,
                Some(_) if is_common => CLEAR_GAIN_OF_COMMON,
                Some(_) => CLEAR_GAIN,
            };
            let clear = if follows_slow_signal(s.kind) { CLEAR_GAIN_OF_SLOW * alone } else { alone };
            let saved = s.gains.iter().sum::<f64>();
            // Noise is not that large a part of the torque. A few reversals in minutes are few blocks, and outliers to likelihood.
            let is_more_than_noise = is_common && far && saved >= LARGE * selection.base_squares;
            saved < clear * left && !is_more_than_noise
        };
        let doubtful: Vec<&'static str> =
            selection.selected.iter().filter(|s| weak(s, selection.selected_squares)).map(|s| s.kind).collect();
        let model = selection.fit.model.clone();
        if doubtful.is_empty() && !model.terms[search.base_terms..].iter().any(has_elements) {
            return Ok(selection);
        }
        let free = |model: &Model| self.parameters(model, search);
        let whole = self.fit(&model, &free(&model), None, CONFIRMING_STEPS)?;
        let mut kept = model.clone();
        for kind in doubtful {
            let mut without = model.clone();
            without.remove_terms(search.base_terms, |term| term.kind == kind);
            let rest = self.fit(&without, &free(&without), None, CONFIRMING_STEPS)?;
            // Without its only kind the model is the base, of which the likelihood is known better.
            let is_base = without.terms.len() == search.base_terms;
            let known = if is_base { likeliest_base.minus_two_log_likelihood } else { f64::INFINITY };
            let gain = rest.minus_two_log_likelihood.min(known) - whole.minus_two_log_likelihood;
            let numbers = free(&model).len() - free(&without).len();
            if gain < self.penalty(numbers) + MARGIN {
                kept.remove_terms(search.base_terms, |term| term.kind == kind);
                selection.selected.retain(|s| s.kind != kind);
            }
        }
        let refitted = |model: &Model| self.plain_fit(model, &free(model), STEPS);
        let fewer = self.with_confirmed_elements(kept.clone(), whole, search)?;
        let mut smaller = None;
        if fewer != kept {
            // Without other kinds and orders, orders close to each other may grow beyond the torque: then all stay.
            smaller = Some(refitted(&fewer)?).filter(|fit| self.cancelling_wave(fit, search).is_none());
        }
        if smaller.is_none() && kept != model {
            smaller = Some(refitted(&kept)?);
        }
        if let Some(fit) = smaller {
            let (fit, lost) = self.without_unlawful(&base.model, fit, search)?;
            self.left_without(base, &mut selection, &lost, fit, search)?;
        }
        Ok(selection)
    }

    /// A model without the elements, as orders of a ripple, that likelihood does not see beside the others: the spectrum of coloured noise has many lines. `whole` is a fit against coloured noise, of
    /// this model or of one with further terms.
    fn with_confirmed_elements(
        &self,
        mut model: Model,
        whole: Fitted,
        search: Search<'_>,
    ) -> Result<Model, DiagnoseError> {
        if !model.terms[search.base_terms..].iter().any(has_elements) {
            return Ok(model);
        }
        let whole = if whole.model.terms.len() == model.terms.len() {
            whole
        } else {
            self.fit(&model, &self.parameters(&model, search), None, CONFIRMING_STEPS)?
        };
        let mut beside = Elements::of(whole);
        for (at, term) in model.terms.iter_mut().enumerate().skip(search.base_terms) {
            if !has_elements(term) {
                continue;
            }
            let confirmed = beside.confirmed(self, at, kinds::elements(term));
            if let Some(fewer) = kinds::with_elements(term, |element| confirmed.contains(&element)) {
                *term = fewer;
            }
        }
        Ok(model)
    }
}

/// Whether a term has several elements that are effects each.
fn has_elements(term: &Term) -> bool {
    kinds::elements(term) > 1 && kinds::elements_are_effects(term)
}

/// Whether a number is one of an element of a term.
fn is_of_element(parameter: &FreeParameter, of: usize, element: usize) -> bool {
    matches!(parameter, FreeParameter::Term { term, index, .. } if *term == of && *index == Some(element))
}

/// A fit from which elements of terms are removed one after another.
struct Elements {
    fit: Fitted,
    /// The residual of the fit, and the torque of the elements removed so far.
    left: Vec<f64>,
    /// The places of the parameters of the fit that are still in use.
    kept: Vec<usize>,
    minus_two_log_likelihood: f64,
}

impl Elements {
    fn of(fit: Fitted) -> Self {
        Self {
            left: fit.residual.clone(),
            kept: (0..fit.parameters.len()).collect(),
            minus_two_log_likelihood: fit.minus_two_log_likelihood,
            fit,
        }
    }

    /// Removes elements of a term, at each step the one that gains least, until each gains more than its parameters cost. Returns those that remain, one at least.
    fn confirmed(&mut self, dataset: &Dataset<'_>, term: usize, elements: usize) -> Vec<usize> {
        let mut confirmed: Vec<usize> = (0..elements).collect();
        while confirmed.len() > 1 {
            let without = confirmed.iter().map(|element| (self.without(dataset, term, *element), *element));
            let least = without.min_by(|(a, _), (b, _)| a.0.total_cmp(&b.0));
            let Some(((_, fewer), element)) = least.filter(|((net, _), _)| *net < 0.0) else { break };
            (self.left, self.kept, self.minus_two_log_likelihood) = fewer;
            confirmed.retain(|kept| *kept != element);
        }
        confirmed
    }

    /// By how much an element lowers −2 ln L beyond what its parameters cost, and what is left without it; all other parameters are estimated again along their columns.
    fn without(&self, dataset: &Dataset<'_>, term: usize, element: usize) -> (f64, (Vec<f64>, Vec<usize>, f64)) {
        let (own, kept): (Vec<usize>, Vec<usize>) =
            self.kept.iter().partition(|at| is_of_element(&self.fit.parameters[**at], term, element));
        let mut left = self.left.clone();
        add_element(&self.fit, term, element, &mut left);
        let columns: Vec<&[f64]> = kept.iter().map(|at| self.fit.columns[*at].as_slice()).collect();
        let profile = dataset.layout().best_profile(&columns, &left, &self.fit.noise);
        let gain = profile.minus_two_log_likelihood - self.minus_two_log_likelihood;
        (gain - dataset.penalty(own.len()), (left, kept, profile.minus_two_log_likelihood))
    }
}
