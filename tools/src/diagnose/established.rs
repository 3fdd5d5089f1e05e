//! A name withdrawn where the recordings cannot tell that its effect is there: its size is within its own uncertainty of zero.

use crate::diagnose::DiagnoseError;
use crate::diagnose::diagnosis::UNKNOWN;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::DiagnosisVerdict;
use crate::kinds;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::parameters::{self, FreeParameter};

/// An effect is certain if its size is at least so many standard deviations from zero.
const ESTABLISHED: f64 = 2.5;
/// An uncertain effect keeps its name if the fit without it has more than so many times the rms error, on the rows fitted: 2.0 and 4.1 for viscous friction that is there, 1.5 and less for wrong names.
const MOST_FITTED: f64 = 1.5;
/// Otherwise the name is withdrawn if the fit without the effect has less than this part of the rms error on held-out blocks,
const CLEARLY_BETTER: f64 = 0.8;
/// or if the size, the largest of several, is less than so many standard deviations, all other effects are certain in that fit,
const TRADED: f64 = 1.0;
/// and its rms error on held-out blocks is less than so many times as large,
const MOST_LEFT: f64 = 1.6;
/// for an effect of several numbers, as friction of the position that holds in one block only, less than so many times.
const MOST_LEFT_BY_SEVERAL: f64 = 1.02;
/// Steps of the fit without an effect.
const STEPS: usize = 8;

impl Dataset<'_> {
    /// Withdraws the name of the least certain effect with a single linear number, or with several that are all within [`TRADED`] of zero, if the model without it predicts held-out
    /// blocks clearly better, or if it only trades torque between other effects. Its term stays in the model.
    pub(super) fn withdraw_unestablished(
        &self,
        verdict: &mut DiagnosisVerdict,
        search: Search<'_>,
    ) -> Result<(), DiagnoseError> {
        if let Some(place) = self.least_established(verdict, search)? {
            let gone = verdict.effects.remove(place);
            verdict.rejected.push((gone.name, gone.gain, 1));
        }
        Ok(())
    }

    /// The place of the effect that is established least, of those whose name is to be withdrawn.
    fn least_established(
        &self,
        verdict: &DiagnosisVerdict,
        search: Search<'_>,
    ) -> Result<Option<usize>, DiagnoseError> {
        let (extended, effects) = (&verdict.extended, &verdict.effects);
        // Beside a curve over its own coordinate no kind is established.
        if effects.iter().any(|effect| effect.name == UNKNOWN && effect.term.is_some()) {
            return Ok(None);
        }
        let named = effects.iter().enumerate().filter(|(_, effect)| effect.name != UNKNOWN);
        let named: Vec<(usize, usize)> = named.filter_map(|(place, effect)| Some((place, effect.term?))).collect();
        if named.len() < 2 {
            return Ok(None);
        }
        let sds = self.standard_deviations(extended);
        let is_contained = |name: &str| effects.iter().any(|other| kinds::contains(&other.name, name));
        let uncertain =
            named.iter().filter(|(place, _)| !is_contained(&effects[*place].name)).filter_map(|(place, term)| {
                let sizes = sizes(extended, &sds, *term);
                let size = sizes.iter().copied().reduce(f64::max)?;
                let (least, most_left) =
                    if sizes.len() == 1 { (ESTABLISHED, MOST_LEFT) } else { (TRADED, MOST_LEFT_BY_SEVERAL) };
                (size < least).then_some((size, most_left, *place, *term))
            });
        let mut open: Vec<(f64, f64, usize, usize)> = uncertain.collect();
        open.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (size, most_left, place, term) in open {
            let mut model = extended.model.clone();
            model.terms.remove(term);
            let without = self.fit_as(extended, &model, &self.parameters(&model, search), STEPS)?;
            if self.rms(&without.residual) > MOST_FITTED * self.rms(&extended.residual) {
                continue;
            }
            let times = self.rms_of_blocks(&without) / self.rms_of_blocks(extended).max(f64::MIN_POSITIVE);
            let sds = self.standard_deviations(&without);
            let others = named.iter().map(|(_, other)| *other).filter(|other| *other != term);
            let largest = others.filter_map(|other| {
                sizes(&without, &sds, other - usize::from(other > term)).into_iter().reduce(f64::max)
            });
            let is_traded = size < TRADED && times < most_left && largest.fold(f64::INFINITY, f64::min) >= ESTABLISHED;
            if times < CLEARLY_BETTER || is_traded {
                return Ok(Some(place));
            }
        }
        Ok(None)
    }
}

/// By how many standard deviations each linear number of a term is from zero; none of a delay, which has no such number.
fn sizes(fit: &Fitted, sds: &[Option<f64>], term: usize) -> Vec<f64> {
    let own = fit.parameters.iter().zip(sds).filter(|(parameter, _)| parameter.is_linear_of(term));
    let size = |(parameter, sd): (&FreeParameter, &Option<f64>)| {
        sd.map_or(0.0, |sd| (parameters::value(&fit.model, *parameter) / sd.max(f64::MIN_POSITIVE)).abs())
    };
    own.map(size).collect()
}
