//! A name withdrawn where the recordings cannot tell that its effect is there: its size is within its own uncertainty of zero.

use gmhm::terms::Role;

use crate::diagnose::DiagnoseError;
use crate::diagnose::diagnosis::UNKNOWN;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::DiagnosisVerdict;
use crate::kinds;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::parameters::{self, FreeParameter};

/// A size is established where it is at least so many standard deviations from zero.
const ESTABLISHED: f64 = 2.5;
/// An effect without which the fit leaves more than so many times the rms error of its own rows keeps its name: what trades with it is the shape of another.
const MOST_FITTED: f64 = 1.5;
/// Of the rest, one has no name where the fit without it leaves less than this part of the rms error on held-out blocks. Of a true effect of real machines it leaves more than 0.9.
const CLEARLY_BETTER: f64 = 0.8;
/// An effect whose size is less than its standard deviation may be a trade between effects of other kinds. It is one where those are established without it,
const TRADED: f64 = 1.0;
/// and leave at most so many times the rms error on held-out blocks.
const MOST_LEFT: f64 = 1.6;
/// Steps of the fit without an effect.
const STEPS: usize = 8;

impl Dataset<'_> {
    /// Withdraws the name of the effect of one number that is established least beside others, where held-out blocks are predicted clearly better without it, or where it only trades between the
    /// others. Its term stays in the model.
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
        let of_one_number =
            named.iter().filter(|(place, _)| !is_contained(&effects[*place].name)).filter_map(|(place, term)| {
                let [size] = sizes(extended, &sds, *term)[..] else { return None };
                (size < ESTABLISHED).then_some((size, *place, *term))
            });
        let mut open: Vec<(f64, usize, usize)> = of_one_number.collect();
        open.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (size, place, term) in open {
            let mut model = extended.model.clone();
            model.terms.remove(term);
            let free = self.parameters(&model, search);
            let without = if extended.plain {
                self.plain_fit(&model, &free, STEPS)?
            } else {
                self.fit(&model, &free, Some(&extended.noise), STEPS)?
            };
            if self.rms(&without.residual) > MOST_FITTED * self.rms(&extended.residual) {
                continue;
            }
            let times = self.rms_of_blocks(&without) / self.rms_of_blocks(extended).max(f64::MIN_POSITIVE);
            let sds = self.standard_deviations(&without);
            let others = named.iter().map(|(_, other)| *other).filter(|other| *other != term);
            let largest = others.filter_map(|other| {
                sizes(&without, &sds, other - usize::from(other > term)).into_iter().reduce(f64::max)
            });
            let is_traded = size < TRADED && times < MOST_LEFT && largest.fold(f64::INFINITY, f64::min) >= ESTABLISHED;
            if times < CLEARLY_BETTER || is_traded {
                return Ok(Some(place));
            }
        }
        Ok(None)
    }
}

/// By how many standard deviations each linear number of a term is from zero; none of a delay, which has no such number.
fn sizes(fit: &Fitted, sds: &[Option<f64>], term: usize) -> Vec<f64> {
    let is_own = |parameter: &FreeParameter| match parameter {
        FreeParameter::Term { term: of, key, .. } => *of == term && key.role == Role::Linear,
        _ => false,
    };
    let own = fit.parameters.iter().zip(sds).filter(|(parameter, _)| is_own(parameter));
    let size = |(parameter, sd): (&FreeParameter, &Option<f64>)| {
        sd.map_or(0.0, |sd| (parameters::value(&fit.model, *parameter) / sd.max(f64::MIN_POSITIVE)).abs())
    };
    own.map(size).collect()
}
