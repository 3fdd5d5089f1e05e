//! Radii of the slip elements of a found memory, from other starts than the grid on which it was selected: the torque is not convex in them.

use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::Search;
use crate::kinds;
use crate::model::{Term, TermValue};
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

/// Numbers of elements to start from.
const COUNTS: [usize; 3] = [6, 9, 14];
/// The largest radius to start from, over the rated deflection: one that slips over a fifth of the rated cycle.
const LARGEST_RADIUS: f64 = 0.8;
/// Steps of a fit from other radii.
const RADII_STEPS: usize = 8;
/// Other radii are preferred where they leave less than this part of held-out blocks.
const CLEARLY: f64 = 0.97;

/// A memory of so many elements whose radii are spread evenly on a logarithmic scale from the smallest of a term's to the `largest`, rad, with the torque of that term shared out alike.
fn spread(term: &Term, count: usize, largest: f64) -> Option<Term> {
    let list = |key: &str| match term.values.get(key) {
        Some(TermValue::List(list)) => Some(list),
        _ => None,
    };
    let (radii, torques) = (list("radius_rad")?, list("torque_nm")?);
    let smallest = radii.iter().copied().fold(largest, f64::min);
    let last = (count - 1) as f64;
    let radius = |k: usize| smallest * (largest / smallest).powf(k as f64 / last);
    let torque = torques.iter().sum::<f64>() / count as f64;
    let mut other = term.clone();
    other.values.insert("radius_rad".to_owned(), TermValue::List((0..count).map(radius).collect()));
    other.values.insert("torque_nm".to_owned(), TermValue::List(vec![torque; count]));
    other.check().is_ok().then_some(other)
}

impl Dataset<'_> {
    /// A fit, or one whose found memory started from other radii, where that predicts held-out blocks clearly better.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub(super) fn with_best_radii(&self, fit: Fitted, search: Search<'_>) -> Result<Fitted, DiagnoseError> {
        let found = search.base_terms..fit.model.terms.len();
        let memory = found.into_iter().find(|at| kinds::is_of_slip_elements(&fit.model.terms[*at]));
        let (Some(at), Some(rated_rad)) = (memory, fit.model.gear.rated_deflection_rad) else { return Ok(fit) };
        let starts = COUNTS.iter().filter_map(|count| spread(&fit.model.terms[at], *count, LARGEST_RADIUS * rated_rad));
        let mut least = CLEARLY * self.rms_of_blocks(&fit);
        let mut best = None;
        for start in starts {
            let mut model = fit.model.clone();
            model.terms[at] = start;
            let mut other = self.plain_fit(&model, &self.parameters(&model, search), RADII_STEPS)?;
            while let Some(fewer) = self.without_negative_elements(&other, search)? {
                other = fewer;
            }
            let left = self.rms_of_blocks(&other);
            if left < least {
                (least, best) = (left, Some(other));
            }
        }
        Ok(best.unwrap_or(fit))
    }
}
