//! From a joint selection to findings: which kinds are named, which only come close, and where structure without a name sits.

use crate::diagnose::DiagnoseError;
use crate::diagnose::curve_term::curve_term;
use crate::diagnose::decision::LARGE;
use crate::diagnose::diagnosis::{Naming, UNKNOWN};
use crate::diagnose::explain::Search;
use crate::diagnose::naming::{DiagnosisVerdict, EffectVerdict, coordinates};
use crate::diagnose::nonparametric::{Coordinates, Explained as Curve};
use crate::diagnose::selection::{Selected, Selection};
use crate::kinds;
use crate::numerics::autoregression::Noise;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

/// A kind is reported from this share of what is predictable, saved in its place; less is a trace of its neighbours' shapes. It stays in the model.
const LEAST_NAMED_SHARE: f64 = 0.006;
/// The same of a kind that almost every machine has, unless slip elements stand beside it: what those miss of a hysteresis resembles friction and inertia.
const LEAST_COMMON_SHARE: f64 = 0.004;
/// A kind below the fidelity of a name is reported as an effect only from this share of what is predictable; less is a trace of its neighbours.
const LEAST_UNNAMED_SHARE: f64 = 0.05;
/// A free function has to predict this share of what is predictable, beyond the selected kinds, to be an effect of its own,
const LEAST_CURVE_SHARE: f64 = 0.04;
/// and to lessen the held-out squares by this part.
const LEAST_CURVE_PART: f64 = 0.05;
/// Curves at most.
const MOST_CURVES: usize = 2;
/// Steps of the refit with a curve.
const STEPS: usize = 5;

/// The effects; the share of one that another takes in is added to that one. Its term stays in the model.
fn taken_in(effects: Vec<EffectVerdict>) -> Vec<EffectVerdict> {
    let takes_in = |whole: &EffectVerdict, part: &EffectVerdict| {
        kinds::of(&whole.name).is_some_and(|kind| kind.takes_in().contains(&part.name.as_str()))
    };
    let is_part: Vec<bool> = effects.iter().map(|part| effects.iter().any(|whole| takes_in(whole, part))).collect();
    let mut is_part = is_part.into_iter();
    let (parts, mut wholes): (Vec<_>, Vec<_>) = effects.into_iter().partition(|_| is_part.next() == Some(true));
    for whole in &mut wholes {
        let taken: f64 = parts.iter().filter(|part| takes_in(whole, part)).map(|part| part.share).sum();
        whole.share = (whole.share + taken).min(1.0);
    }
    wholes
}

/// Whether a selected kind saves so little in its place that it is a trace of the shapes of its neighbours.
fn is_trace(found: &Selected, selection: &Selection) -> bool {
    let is_common = kinds::is_common(found.kind);
    let of_elements = |kind: &str| kinds::of(kind).is_some_and(|k| k.is_of_slip_elements());
    let beside_elements = selection.selected.iter().any(|s| of_elements(s.kind));
    let least = match Naming::of(found.fidelity) {
        Naming::Unknown | Naming::Approximate => LEAST_UNNAMED_SHARE,
        _ if is_common && !beside_elements => LEAST_COMMON_SHARE,
        _ => LEAST_NAMED_SHARE,
    };
    let saved = found.gains.iter().sum::<f64>();
    // Little beside the rest may still be most of what would be left.
    found.share < least && saved <= selection.selected_squares && !found.in_remainder
}

impl Dataset<'_> {
    /// The verdict of a joint selection beside the refitted base model.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn joint_verdict(
        &self,
        base: &Fitted,
        selection: &Selection,
        search: Search<'_>,
    ) -> Result<DiagnosisVerdict, DiagnoseError> {
        let mut extended = selection.fit.clone();
        let total = self.total(&extended.model)?;
        let mut effects = Vec::new();
        let mut rejected = Vec::new();
        // Kinds that overlap save little each in their place, however much they save together.
        let overlap = selection.named() >= LARGE && selection.selected.iter().all(|found| is_trace(found, selection));
        for found in &selection.selected {
            let naming = Naming::of(found.fidelity);
            let term =
                (search.base_terms..extended.model.terms.len()).find(|t| extended.model.terms[*t].kind == found.kind);
            if !overlap && is_trace(found, selection) {
                rejected.push((found.kind.to_owned(), self.in_noise(found.gains.iter().sum(), selection), 1));
                continue;
            }
            let contribution = match term {
                Some(at) => self.added_by(&extended.model, &total, at)?,
                None => vec![0.0; self.len()],
            };
            effects.push(self.effect(found, naming, term, contribution, selection));
        }
        let curves: Vec<&'static str> = selection
            .unexplained
            .iter()
            .filter(|(_, share)| *share > LEAST_CURVE_SHARE)
            .filter(|(_, share)| {
                let scale = selection.base_squares - selection.free_squares;
                share * scale > LEAST_CURVE_PART * selection.selected_squares
            })
            .map(|(over, _)| over.name())
            .collect();
        let mut used: Vec<&str> = Vec::new();
        let mut least = self.rms_of_blocks(&extended);
        for coordinate in curves {
            if used.contains(&coordinate) || used.len() >= MOST_CURVES {
                continue;
            }
            let evaluations = self.evaluate(&extended.model)?;
            let see = Coordinates::new(self, &evaluations);
            let Some(curve) = curve_term(&see, coordinate) else { continue };
            drop(evaluations);
            let mut with = extended.model.clone();
            with.terms.push(curve);
            let fitted = self.plain_fit(&with, &self.parameters(&with, search), STEPS)?;
            let left = self.rms_of_blocks(&fitted);
            if left.powi(2) > (1.0 - LEAST_CURVE_PART) * least.powi(2) {
                continue;
            }
            used.push(coordinate);
            let gain = (least.powi(2) - left.powi(2)) * selection.rows as f64;
            let contribution: Vec<f64> = extended.residual.iter().zip(&fitted.residual).map(|(a, b)| a - b).collect();
            least = left;
            extended = fitted;
            let gain = self.in_noise(gain, selection);
            effects.push(EffectVerdict {
                term: Some(extended.model.terms.len() - 1),
                ..EffectVerdict::unnamed(gain, self.curve(coordinate, gain, contribution))
            });
        }
        self.share_out(base, &extended, &mut effects)?;
        effects = taken_in(effects);
        effects.sort_by(|a, b| b.share.total_cmp(&a.share));
        let mismatch = !effects.is_empty();
        Ok(DiagnosisVerdict {
            mismatch,
            base: base.clone(),
            extended,
            effects,
            rejected,
            noise_part: (selection.free_squares / selection.selected_squares.max(f64::MIN_POSITIVE)).sqrt().min(1.0),
        })
    }

    /// Squares in units of what the selection leaves a row.
    fn in_noise(&self, squares: f64, selection: &Selection) -> f64 {
        squares * selection.rows as f64 / selection.selected_squares.max(f64::MIN_POSITIVE)
    }

    fn effect(
        &self,
        found: &Selected,
        naming: Naming,
        term: Option<usize>,
        contribution: Vec<f64>,
        selection: &Selection,
    ) -> EffectVerdict {
        let gain = self.in_noise(found.gains.iter().sum(), selection);
        let unknown = naming == Naming::Unknown;
        let equivalents = if unknown { &[][..] } else { &found.equivalents };
        let curves =
            coordinates(found.kind).into_iter().take(2).map(|c| self.curve(c, gain, contribution.clone())).collect();
        EffectVerdict {
            name: if unknown { UNKNOWN.to_owned() } else { found.kind.to_owned() },
            equivalents: equivalents.iter().map(|e| (*e).to_owned()).collect(),
            confidence: found.confidence,
            term,
            gain,
            share: found.share,
            curves,
            tried: found.tried.iter().map(|(k, s)| ((*k).to_owned(), self.in_noise(*s, selection), 1)).collect(),
            free_gain: gain / found.fidelity.unwrap_or(1.0).max(0.01),
            closest: unknown.then(|| found.kind.to_owned()),
            fidelity: found.fidelity,
            naming,
        }
    }

    /// What structure over a coordinate adds to the torque, where no curve was fitted against coloured noise.
    pub(super) fn curve(&self, coordinate: &'static str, gain: f64, contribution: Vec<f64>) -> Curve {
        Curve {
            coordinate,
            gain,
            columns: 0,
            picked: 0,
            contribution,
            part: 1.0,
            basis: Vec::new(),
            noise: self.spans.iter().map(|_| Noise::unit()).collect(),
            coherent: false,
        }
    }
}
