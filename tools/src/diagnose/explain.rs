//! What explains best what a fitted model leaves: every kind of the library, refitted together with the model, its shapes polished.

use gmhm::terms::Domain;
use rayon::prelude::*;

use crate::diagnose::DiagnoseError;
use crate::diagnose::candidates;
use crate::diagnose::candidates::Proposal;
use crate::model::{Model, Term, TermValue};
use crate::numerics::autoregression::Noise;
use crate::numerics::basis::Basis;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::likelihood::Profile;
use crate::regression::parameters::FreeParameter;

/// A kind that was tried, at its best.
pub struct Alternative {
    /// Its kind.
    pub kind: &'static str,
    /// The term of the model that it adds an element to.
    pub extends: Option<usize>,
    /// The model with it, refitted.
    pub fit: Fitted,
    /// By how much it lowers −2 ln L.
    pub gain: f64,
    /// How many numbers it adds.
    pub parameters: usize,
    /// Whether shapes and all were polished; else the gain is that of the grid.
    pub polished: bool,
}

/// How the search is done.
#[derive(Clone, Copy)]
pub struct Search<'r> {
    /// Kinds that may not be used.
    pub removed: &'r [String],
    /// The only kinds that may be used.
    pub only: Option<&'r [&'static str]>,
    /// Terms of the model handed in.
    pub base_terms: usize,
    /// Where the base stays as given, how many terms it has; `None` where its numbers are fitted.
    pub held_terms: Option<usize>,
    /// Whether the zero of the deflection is free.
    pub zero: bool,
    /// The seed of the swarm that searches shapes.
    pub seed: u64,
}

impl Search<'_> {
    /// Whether a kind may be used.
    pub fn allows(&self, kind: &str) -> bool {
        !self.removed.iter().any(|r| r == kind) && self.only.is_none_or(|only| only.contains(&kind))
    }
}

/// A proposal on the grid, with its own noise.
pub(super) struct Tried<'p> {
    pub(super) proposal: &'p Proposal,
    /// The linear numbers that explain most.
    pub(super) weights: Vec<f64>,
    noise: Vec<Noise>,
    /// By how much it lowers −2 ln L.
    pub(super) gain: f64,
}

/// A gain of the deviance that noise alone gives a kind on the grid.
const LEAST_GAIN: f64 = 6.0;
/// A kind that gains less than this part of what is asked on the grid gains too little polished as well.
const PART_OF_ASKED: f64 = 0.1;
/// Kinds whose gain on the grid is below this share of the best are not polished, unless they are near.
const WORTH_POLISHING: f64 = 0.35;
/// A term may raise the plain squared residual by this factor at most.
const DEARER: f64 = 1.3;
/// A shape of a kind that gains less than this share of the best shape's on the grid is not polished beside it, unless it is near.
const SHAPELY: f64 = 0.75;
/// One of which most numbers still move gains on the grid but a fraction of what it gains polished.
const RICH: f64 = 0.2;
/// A gain of the deviance that is always near.
const NEAR: f64 = 60.0;

/// Interpolation between rows smooths noise with delays of so many rows; with longer ones the mean of early and late turns ripples.
const SMOOTHS_WITHIN: f64 = 2.0;
/// A delay does not only smooth if the model without it leaves so many times the rms error.
const FAR_MORE: f64 = 2.0;
/// Steps of the fit without a delay.
const STEPS_WITHOUT_DELAY: usize = 4;

/// Whether a term shifts the torque in time.
pub fn is_delay(term: &Term) -> bool {
    term.info().is_some_and(|info| info.domain == Domain::Delay)
}

impl Dataset<'_> {
    /// The free numbers of a model in a search.
    pub fn parameters(&self, model: &Model, search: Search<'_>) -> Vec<FreeParameter> {
        let mut free = self.free_parameters(model, search.zero);
        if let Some(given) = search.held_terms {
            free.retain(|parameter| *parameter == FreeParameter::Zero || !parameter.is_of_base(given));
        }
        free
    }

    /// Every kind at its best beside a fitted model, the best first. `asked` is the gain from which a kind is of use: one that gains next to nothing of it on the grid is
    /// not polished.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn explain(&self, fit: &Fitted, search: Search<'_>, asked: f64) -> Result<Vec<Alternative>, DiagnoseError> {
        Ok(self.explain_by(fit, &self.proposals(fit, search)?, search, asked))
    }

    /// Every kind over its grid beside a fitted model.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub(super) fn proposals(&self, fit: &Fitted, search: Search<'_>) -> Result<Vec<Proposal>, DiagnoseError> {
        let evaluations = self.evaluate(&fit.model)?;
        Ok(candidates::proposals(self, &evaluations, fit, search))
    }

    /// [`explain`](Self::explain) by these proposals.
    pub(super) fn explain_by(
        &self,
        fit: &Fitted,
        proposals: &[Proposal],
        search: Search<'_>,
        asked: f64,
    ) -> Vec<Alternative> {
        let mut tried = self.screen(fit, proposals);
        tried.retain(|t| t.gain > LEAST_GAIN.max(PART_OF_ASKED * asked));
        let Some(best) = tried.iter().map(|t| t.gain).max_by(f64::total_cmp) else { return Vec::new() };
        let polish = |tried: &Tried<'_>| -> Option<Alternative> {
            let proposal = tried.proposal;
            let start = proposal.applied(&fit.model, &tried.weights);
            let near = tried.gain > WORTH_POLISHING * best || tried.gain > best - NEAR;
            let free = self.parameters(&start, search);
            let steps = if near { 6 } else { 1 };
            let polished = self.fit_beside(&start, &free, Some(&tried.noise), steps, Some(fit)).ok()?;
            // What only trades structure for slow noise explains nothing.
            let squares = |fit: &Fitted| self.layout().squares(&fit.residual);
            let worse = squares(&polished) > DEARER * squares(fit);
            let at = proposal.extends.unwrap_or(polished.model.terms.len() - 1);
            if worse || self.exceeds_torque(&polished, at) || !proposal.accepts_fitted(&polished.model) {
                return None;
            }
            let gain = self.gain_of(at, &polished, fit);
            Some(Alternative {
                kind: proposal.info.name,
                extends: proposal.extends,
                fit: polished,
                gain,
                parameters: proposal.parameters(),
                polished: near,
            })
        };
        let mut found: Vec<Alternative> = tried.par_iter().filter_map(polish).collect();
        found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        // Of each kind the shape that is worth its numbers most.
        let net = |a: &Alternative| a.gain - self.penalty(a.parameters);
        let mut best: Vec<(&str, Option<usize>, f64)> = Vec::new();
        for a in &found {
            match best.iter_mut().find(|(kind, extends, _)| (*kind, *extends) == (a.kind, a.extends)) {
                Some((.., most)) => *most = most.max(net(a)),
                None => best.push((a.kind, a.extends, net(a))),
            }
        }
        found.retain(|a| best.contains(&(a.kind, a.extends, net(a))));
        found
    }

    /// By how much a term of a fit lowers −2 ln L beside the fit without it; of a delay only what being late gains.
    pub(super) fn gain_of(&self, term: usize, with: &Fitted, without: &Fitted) -> f64 {
        let gain = without.minus_two_log_likelihood - with.minus_two_log_likelihood;
        let is_late = is_delay(&with.model.terms[term]);
        if is_late { gain - self.smoothing_gain(without, &with.model).max(0.0) } else { gain }
    }

    /// What a delay gains beside a fitted model by smoothing the model's own noise between samples, not by being late: the gain of the mean of both signs of it.
    fn smoothing_gain(&self, fit: &Fitted, delayed: &Model) -> f64 {
        let Some(term) = delayed.terms.iter().find(|t| is_delay(t)) else { return 0.0 };
        let mut model = fit.model.clone();
        model.terms.push(term.clone());
        let Some([now, late, early]) = self.about_delay(&model, model.terms.len() - 1) else { return 0.0 };
        let smoothed: Vec<f64> =
            (0..now.len()).map(|i| fit.residual[i] - 0.5 * (late[i] + early[i]) + now[i]).collect();
        let base = fit.parameter_columns();
        let profile = self.layout().best_profile(&base, &smoothed, &fit.noise);
        fit.minus_two_log_likelihood - profile.minus_two_log_likelihood
    }

    /// Whether a fit has a delay that saves as much by smoothing the model's own noise between samples as by being late. A ripple that keeps its amplitude is better smoothed, too, where the delay
    /// turns its phase by much: a delay without which the refitted model leaves far more does not only smooth.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn only_smooths(&self, fit: &Fitted, search: Search<'_>) -> Result<bool, DiagnoseError> {
        let Some(at) = fit.model.terms.iter().position(is_delay) else { return Ok(false) };
        let Some([now, late, early]) = self.about_delay(&fit.model, at) else { return Ok(false) };
        let squares = |torque: &dyn Fn(usize) -> f64| {
            let left: Vec<f64> = (0..late.len()).map(|i| fit.residual[i] + late[i] - torque(i)).collect();
            self.layout().squares(&left)
        };
        let without = squares(&|i| now[i]);
        let smoothed = without - squares(&|i| 0.5 * (late[i] + early[i]));
        if smoothed <= 0.5 * (without - squares(&|i| late[i])) {
            return Ok(false);
        }
        let mut model = fit.model.clone();
        model.terms.remove(at);
        let refitted = self.fit_as(fit, &model, &self.parameters(&model, search), STEPS_WITHOUT_DELAY)?;
        Ok(self.rms(&refitted.residual) < FAR_MORE * self.rms(&fit.residual))
    }

    /// The torque of a model without its delay, with it, and with its opposite; `None` where that is too long to smooth neighbouring rows.
    fn about_delay(&self, model: &Model, at: usize) -> Option<[Vec<f64>; 3]> {
        let TermValue::Number(delay) = *model.terms[at].values.get("delay_s")? else { return None };
        if delay.abs() > SMOOTHS_WITHIN * self.period_s() {
            return None;
        }
        let with = |delay: f64| {
            let mut model = model.clone();
            model.terms[at].values.insert("delay_s".to_owned(), TermValue::Number(delay));
            self.total(&model).ok()
        };
        Some([with(0.0)?, with(delay)?, with(-delay)?])
    }

    /// A proposal beside a fit, its linear numbers and those of the fit estimated together from the noise given on; `None` where they are none that the kind may have.
    pub(super) fn profiled<'p>(&self, fit: &Fitted, noise: &[Noise], proposal: &'p Proposal) -> Option<Tried<'p>> {
        let (profile, weights) = self.profile_beside(fit, noise, &proposal.columns);
        let gain = fit.minus_two_log_likelihood - profile.minus_two_log_likelihood;
        proposal.accepts(&weights).then_some(Tried { proposal, weights, noise: profile.noise, gain })
    }

    /// Columns beside a fit, estimated together with its numbers from the noise given on, and their coefficients.
    pub(super) fn profile_beside<'c>(
        &self,
        fit: &'c Fitted,
        noise: &[Noise],
        added: impl IntoIterator<Item = &'c Vec<f64>>,
    ) -> (Profile, Vec<f64>) {
        let own = fit.parameter_columns();
        let columns: Vec<&[f64]> = own.iter().copied().chain(added.into_iter().map(Vec::as_slice)).collect();
        let profile = self.layout().best_profile(&columns, &fit.residual, noise);
        let weights = profile.coefficients[own.len()..].to_vec();
        (profile, weights)
    }

    /// The numbers of a fit as a basis, whitened, and what is left beside them of its residual.
    pub(super) fn whitened(&self, fit: &Fitted, noise: &[Noise]) -> (Basis, Vec<f64>) {
        let layout = self.layout();
        let mut basis = Basis::default();
        for column in &fit.columns {
            basis.add(&layout.whiten(noise, column));
        }
        let mut left = layout.whiten(noise, &fit.residual);
        basis.reduce(&mut left);
        (basis, left)
    }

    /// The best of each kind on the grid.
    fn screen<'p>(&self, fit: &Fitted, proposals: &'p [Proposal]) -> Vec<Tried<'p>> {
        let layout = self.layout();
        let plain = layout.white();
        let mut chosen: Vec<usize> = Vec::new();
        for (noise, most) in [(&fit.noise, 2), (&plain, 1)] {
            let (basis, y) = self.whitened(fit, noise);
            let gain = |proposal: &Proposal| {
                let white: Vec<Vec<f64>> = proposal.columns.iter().map(|c| layout.whiten(noise, c)).collect();
                basis.gain(&white, &y).0
            };
            let gains: Vec<f64> = proposals.par_iter().map(gain).collect();
            let mut order: Vec<usize> = (0..proposals.len()).collect();
            order.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]));
            let mut taken: Vec<_> = Vec::new();
            for i in order {
                let key = proposals[i].form();
                if taken.iter().filter(|k| **k == key).count() < most {
                    taken.push(key);
                    if !chosen.contains(&i) {
                        chosen.push(i);
                    }
                }
            }
        }
        let profiled = |&i: &usize| self.profiled(fit, &fit.noise, &proposals[i]);
        let mut tried: Vec<Tried<'p>> = chosen.par_iter().filter_map(profiled).collect();
        tried.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        // Of each form the best; of a kind those that the polish may still turn.
        let mut kept: Vec<(_, f64)> = Vec::new();
        tried.retain(|t| {
            let (kind, extends, shape) = t.proposal.form();
            let best = kept.iter().find(|((k, e, _), _)| (*k, *e) == (kind, extends)).map_or(t.gain, |(_, gain)| *gain);
            let known = kept.iter().any(|(form, _)| *form == (kind, extends, shape));
            kept.push(((kind, extends, shape), t.gain));
            let share = if t.proposal.parameters() > t.proposal.keys.len() + 2 { RICH } else { SHAPELY };
            !known && t.gain > (share * best).min(best - NEAR)
        });
        tried
    }
}
