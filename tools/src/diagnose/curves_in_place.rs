//! Curves without physics in the place of kinds that only come close.

use crate::diagnose::DiagnoseError;
use crate::diagnose::curve_term::curve_term;
use crate::diagnose::diagnosis::UNKNOWN;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::{EffectVerdict, follows_slow_signal};
use crate::diagnose::nonparametric::{Coordinates, Explained as Curve};
use crate::model::{Model, Term, TermValue};
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

/// Coordinates that a curve is tried over.
pub(super) const CURVES: usize = 3;
/// The part of the best one's gain that they need.
const WORTH_A_CURVE: f64 = 0.3;

impl Dataset<'_> {
    /// An extended fit with the curve of each effect without a name where it does better than the closest kind; without a kind that only stands in for it.
    pub(super) fn with_curves_in_place(
        &self,
        mut extended: Fitted,
        verdicts: &mut [EffectVerdict],
        search: Search<'_>,
    ) -> Result<Fitted, DiagnoseError> {
        for effect in 0..verdicts.len() {
            let unknown = &verdicts[effect];
            let (UNKNOWN, Some(at), Some(kind)) = (&unknown.name[..], unknown.term, &unknown.closest) else { continue };
            let mut without = extended.model.clone();
            without.terms.remove(at);
            let rest = is_slow_stand_in(kind, &unknown.curves)
                .then(|| self.fit(&without, &self.parameters(&without, search), None, 4))
                .transpose()?;
            let curve = self.with_curve(rest.as_ref().unwrap_or(&extended), &without, at, &unknown.curves, search)?;
            let unknown = &mut verdicts[effect];
            if let Some(fitted) = curve {
                extended = fitted;
                unknown.closest = None;
                unknown.curves = repeated_first(std::mem::take(&mut unknown.curves), &extended.model.terms[at]);
            } else if let Some(rest) = rest {
                extended = rest;
                (unknown.closest, unknown.term) = (None, None);
                verdicts
                    .iter_mut()
                    .filter_map(|e| e.term.as_mut())
                    .filter(|term| **term > at)
                    .for_each(|term| *term -= 1);
            }
        }
        Ok(extended)
    }

    /// A model with a term `unknown` put in at `at`, over the coordinate where that predicts blocks held out best; none where `beside` predicts them better.
    pub(super) fn with_curve(
        &self,
        beside: &Fitted,
        model: &Model,
        at: usize,
        curves: &[Curve],
        search: Search<'_>,
    ) -> Result<Option<Fitted>, DiagnoseError> {
        let evaluations = self.evaluate(model)?;
        let see = Coordinates::new(self, &evaluations);
        let mut best: Option<Fitted> = None;
        let mut least = self.rms_of_blocks(&self.or_plain(beside.clone())?);
        let likely = curves.iter().filter(|p| p.net() > WORTH_A_CURVE * curves[0].net()).take(CURVES);
        for curve in likely.filter_map(|place| curve_term(&see, place.coordinate)) {
            let mut with = model.clone();
            with.terms.insert(at, curve);
            let fitted = self.or_plain(self.fit(&with, &self.parameters(&with, search), None, 4)?)?;
            let left = self.rms_of_blocks(&fitted);
            if left < least {
                (least, best) = (left, Some(fitted));
            }
        }
        Ok(best)
    }
}

/// Whether a kind follows a slow signal where the effect is seen over a coordinate of the motion. On another motion the signal is another.
fn is_slow_stand_in(kind: &str, curves: &[Curve]) -> bool {
    let of_motion = curves.first().is_some_and(|c| !matches!(c.coordinate, "time" | "temperature" | "frequency"));
    of_motion && follows_slow_signal(kind)
}

/// Whether what a curve shows comes once.
pub(super) fn once(curve: &Curve) -> bool {
    matches!(curve.coordinate, "time" | "frequency")
}

/// The coordinates with that of a curve first where the best is seen once only: what repeats is better evidence.
pub(super) fn repeated_first(curves: Vec<Curve>, curve: &Term) -> Vec<Curve> {
    match curve.values.get("coordinate") {
        Some(TermValue::Text(own)) if once(&curves[0]) => by_first(curves, own),
        _ => curves,
    }
}

/// The curves with the named one first.
pub(super) fn by_first(mut curves: Vec<Curve>, coordinate: &str) -> Vec<Curve> {
    if let Some(at) = curves.iter().position(|p| p.coordinate == coordinate) {
        curves[..=at].rotate_right(1);
    }
    curves
}
