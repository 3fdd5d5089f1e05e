//! A name withheld where its effect changes with a coordinate that its kind does not know: a kind similar to the true one stands in its place.

use rayon::prelude::*;

use crate::diagnose::DiagnoseError;
use crate::diagnose::decision::{STEPS_OF_LIKELIHOOD, TOO_LOUD_TO_REFINE};
use crate::diagnose::diagnosis::UNKNOWN;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::{DiagnosisVerdict, coordinates};
use crate::diagnose::nonparametric::Coordinates;
use crate::kinds;
use crate::numerics::extremes::largest;
use crate::numerics::vector::dot;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::heldout_rows::trimmed_sum;
use crate::signal::plausible::sd;

/// An effect changes with a coordinate where that lowers −2 ln L by so much, net of what as many columns gain from noise,
pub(super) const LEAST_NET_GAIN: f64 = 25.0;
/// and predicts blocks held out better by so many squares of the noise, the best and the worst block left out. With both, none of 125 synthetic effects that were named
/// right is beyond, of 27 named wrong 10.
pub(super) const LEAST_PREDICTED: f64 = 25.0;
/// A coordinate is limited to this many standard deviations about its mean.
const FARTHEST: f64 = 3.0;
/// The stiffness is computed where the deflection changes at more than this part of its highest rate.
const LEAST_RATE: f64 = 0.02;
/// A larger stiffness is limited to this many times the median.
const STIFFEST: f64 = 3.0;

impl Dataset<'_> {
    /// Withholds the only name of what a gear's model lacks where its effect changes with load, stiffness, speed, angle, temperature or time. Not applied
    /// to two names, each of which may describe part of the other's effect, nor where the base is far from the machine or the effect far above the noise: there all shapes are approximate, and fidelity decides.
    pub(super) fn withhold_similar_kind(
        &self,
        verdict: &mut DiagnosisVerdict,
        search: Search<'_>,
    ) -> Result<(), DiagnoseError> {
        let extended = &verdict.extended.model;
        if !extended.has_gear() || self.is_far_from(&verdict.base) {
            return Ok(());
        }
        let mut named = verdict.effects.iter_mut().filter(|e| e.name != UNKNOWN);
        let (Some(effect), None) = (named.next(), named.next()) else { return Ok(()) };
        let Some(term) = effect.term else { return Ok(()) };
        let acts_through = coordinates(&effect.name);
        // Slip elements fit the remainder of any effect. The acceleration is smoothed, so its effect is too small where the motion reverses.
        let is_of_elements = kinds::of(&effect.name).is_some_and(|kind| kind.is_of_slip_elements());
        if is_of_elements || acts_through.contains(&"acceleration") {
            return Ok(());
        }
        let fit = self.fit(extended, &self.parameters(extended, search), None, STEPS_OF_LIKELIHOOD)?;
        let evaluations = self.evaluate(&fit.model)?;
        let see = Coordinates::new(self, &evaluations);
        let added = self.added_by(&fit.model, &see.torque, term)?;
        if dot(&added, &added) > TOO_LOUD_TO_REFINE * dot(&fit.residual, &fit.residual) {
            return Ok(());
        }
        let units = self.unit_columns(&evaluations, &fit.model.terms[term])?;
        let units: Vec<Vec<f64>> = units.into_iter().map(|unit| of_rms_one(unit.values)).collect();
        // Where the motion reverses the velocity is inaccurate, too, and the stiffness is not known: an effect of the velocity would seem to change with the stiffness.
        let with_stiffness = !acts_through.contains(&"output_velocity");
        let others = others(&see, with_stiffness);
        if others.par_iter().any(|coordinate| self.change_with(&fit, &units, coordinate)) {
            effect.withhold();
        }
        Ok(())
    }

    /// Whether a fit is better, on blocks held out, too, where every number of an effect may have a factor 1 + a c + b c² of a coordinate c.
    fn change_with(&self, fit: &Fitted, units: &[Vec<f64>], coordinate: &[f64]) -> bool {
        let product = |unit: &Vec<f64>, power| unit.iter().zip(coordinate).map(|(u, c)| u * c.powi(power)).collect();
        let changes: Vec<Vec<f64>> = units.iter().flat_map(|unit| [product(unit, 1), product(unit, 2)]).collect();
        let mut columns = fit.parameter_columns();
        columns.extend(changes.iter().map(Vec::as_slice));
        let with = self.layout().best_profile(&columns, &fit.residual, &fit.noise);
        let gain = fit.minus_two_log_likelihood - with.minus_two_log_likelihood;
        gain - 2.0 * changes.len() as f64 > LEAST_NET_GAIN
            && trimmed_sum(&self.gain_of_columns(fit, &changes, &with.noise)) > LEAST_PREDICTED
    }
}

/// The coordinates that an effect may change with, of mean 0 and standard deviation 1.
fn others(see: &Coordinates, with_stiffness: bool) -> Vec<Vec<f64>> {
    let mut all = vec![see.torque.clone(), see.time.clone()];
    all.extend([&see.deflection, &see.output, &see.temperature].into_iter().flatten().cloned());
    all.extend(see.velocity.iter().map(|v| v.iter().map(|v| v.abs()).collect()));
    if with_stiffness {
        all.extend(see.rate.iter().map(|rate| stiffness(&see.torque_rate, rate)));
    }
    for coordinate in &mut all {
        standardise(coordinate);
    }
    all
}

/// dT/dθ along the path, N·m/rad: the quotient of the two rates, or its median where the deflection hardly changes.
fn stiffness(torque_rate: &[f64], rate: &[f64]) -> Vec<f64> {
    let least = LEAST_RATE * largest(rate);
    let told = |(torque, rate): (&f64, &f64)| (rate.abs() > least).then(|| torque / rate);
    let slopes: Vec<Option<f64>> = torque_rate.iter().zip(rate).map(told).collect();
    let mut sorted: Vec<f64> = slopes.iter().flatten().copied().collect();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or_default();
    slopes.iter().map(|slope| slope.map_or(median, |s| s.clamp(0.0, STIFFEST * median.max(0.0)))).collect()
}

/// A column scaled to a root mean square of one.
fn of_rms_one(mut column: Vec<f64>) -> Vec<f64> {
    let rms = (dot(&column, &column) / column.len().max(1) as f64).sqrt().max(f64::MIN_POSITIVE);
    column.iter_mut().for_each(|x| *x /= rms);
    column
}

fn standardise(x: &mut [f64]) {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    let deviation = sd(x).max(f64::MIN_POSITIVE);
    x.iter_mut().for_each(|x| *x = ((*x - mean) / deviation).clamp(-FARTHEST, FARTHEST));
}
