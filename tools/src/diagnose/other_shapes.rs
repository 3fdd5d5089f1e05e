//! Other shapes of the kinds that were found: the likeliest shape stands, and what the others say of each number is part of its uncertainty.
//!
//! A windup that follows a tanh and one that follows a rational law differ by less than the noise in many recordings, and their widths by half. The numbers of a model averaged over
//! its shapes scatter by their own variance and by Σ w (p − p_best)² with w ∝ e^(−½ Δ(−2 ln L)) (Hoeting, Madigan, Raftery, Volinsky, *Statistical Science* 14, 1999).

use gmhm::terms::Form;

use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::Search;
use crate::model::{Term, TermValue};
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::parameters;

/// The key of a term's shape.
const SHAPE: &str = "shape";
/// Steps of the fit with another shape.
const STEPS: usize = 6;

/// A term in each other shape that has the same numbers.
fn other_shapes(term: &Term) -> Vec<Term> {
    let keys = term.info().map_or(&[][..], |info| info.keys);
    let words = keys.iter().find_map(|key| match key.form {
        Form::Choice(words) if key.name == SHAPE => Some(words),
        _ => None,
    });
    let shaped = |word: &&str| {
        let mut other = term.clone();
        other.values.insert(SHAPE.to_owned(), TermValue::Text((*word).to_owned()));
        other
    };
    let others = words.into_iter().flatten().map(shaped).filter(|other| other != term && other.check().is_ok());
    if term.values.contains_key(SHAPE) { others.collect() } else { Vec::new() }
}

impl Dataset<'_> {
    /// A fit with the likeliest shape of each found term, and the variance that the other shapes add to each of its free numbers.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub(super) fn among_shapes(&self, fit: Fitted, search: Search<'_>) -> Result<(Fitted, Vec<f64>), DiagnoseError> {
        let mut best = fit;
        let mut variances = vec![0.0; best.parameters.len()];
        for at in search.base_terms..best.model.terms.len() {
            let mut fits = Vec::new();
            for other in other_shapes(&best.model.terms[at]) {
                let mut model = best.model.clone();
                model.terms[at] = other;
                let fit = self.fit_as(&best, &model, &best.parameters, STEPS)?;
                // A gap of 0, with a windup in its place, is no other shape of it.
                if self.added_by(&fit.model, &self.total(&fit.model)?, at)?.iter().any(|torque| *torque != 0.0) {
                    fits.push(fit);
                }
            }
            fits.push(best);
            let deviance = |fit: &Fitted| fit.minus_two_log_likelihood;
            fits.sort_by(|a, b| deviance(a).total_cmp(&deviance(b)));
            best = fits.remove(0);
            let weights: Vec<f64> = fits.iter().map(|fit| (0.5 * (deviance(&best) - deviance(fit))).exp()).collect();
            let sum = 1.0 + weights.iter().sum::<f64>();
            for (variance, parameter) in variances.iter_mut().zip(&best.parameters) {
                let own = parameters::value(&best.model, *parameter);
                let off = fits.iter().map(|fit| parameters::value(&fit.model, *parameter) - own);
                *variance += weights.iter().zip(off).map(|(weight, off)| weight * off * off).sum::<f64>() / sum;
            }
        }
        Ok((best, variances))
    }
}
