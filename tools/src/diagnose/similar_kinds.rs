//! Names withheld where their effects change with a coordinate that their kinds do not know: a kind similar to the true one stands in its place.

use rayon::prelude::*;

use crate::diagnose::DiagnoseError;
use crate::diagnose::decision::STEPS_OF_LIKELIHOOD;
use crate::diagnose::diagnosis::UNKNOWN;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::{DiagnosisVerdict, EffectVerdict, coordinates};
use crate::diagnose::nonparametric::Coordinates;
use crate::kinds;
use crate::numerics::extremes::largest;
use crate::numerics::vector::dot;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::heldout_rows::trimmed_sum;
use crate::signal::plausible::sd;

/// An effect changes with a coordinate where that lowers −2 ln L by so much, net of what as many columns gain from noise, and predicts blocks held out better by so many
/// squares of the noise, the best and the worst block left out: this if it is the only one named,
const LEAST_ALONE: f64 = 25.0;
/// this if several are named, each of which may describe a little of another,
const LEAST_BESIDE_OTHERS: f64 = 40.0;
/// and where the change is more than this part of the effect, rms: a smaller one is a shape that differs a little from that of the kind.
const LEAST_CHANGE: f64 = 0.02;
/// A named effect is a part of the one that a curve describes if it is less than this part of the curve, rms.
const LEAST_BESIDE_CURVE: f64 = 0.1;
/// A coordinate is limited to this many standard deviations about its mean.
const FARTHEST: f64 = 3.0;
/// A motor turns fast that turns by more than this from row to row, rad,
const FAST_TURN_RAD: f64 = 0.25;
/// in more than this part of the rows. The bench's kinematic errors of order 4 seem to change with the speed at 0.5 rad, and do not at 0.25.
const FAST_PART: f64 = 0.1;
/// The stiffness is computed where the deflection changes at more than this part of its highest rate.
const LEAST_RATE: f64 = 0.02;
/// A larger stiffness is limited to this many times the median.
const STIFFEST: f64 = 3.0;

impl Dataset<'_> {
    /// Withholds names of what a gear's model lacks: of effects that are small beside a curve, and of those that change with load, stiffness, speed, angle,
    /// temperature or time. Of the latter first the name of the effect that changes most, then that of the one that changes most beside this change, and so on, as each effect may describe part of
    /// another. Not applied where the base is far from the machine: there all shapes are approximate, and fidelity decides.
    pub(super) fn withhold_similar_kinds(
        &self,
        verdict: &mut DiagnosisVerdict,
        search: Search<'_>,
    ) -> Result<(), DiagnoseError> {
        let effects = &mut verdict.effects;
        let extended = &verdict.extended.model;
        let is_curve = |effect: &EffectVerdict| effect.name == UNKNOWN;
        let any_to_withhold =
            effects.iter().any(is_tested) || effects.iter().any(is_curve) && !effects.iter().all(is_curve);
        if !extended.has_gear() || self.is_far_from(&verdict.base) || !any_to_withhold {
            return Ok(());
        }
        let fit = self.fit(extended, &self.parameters(extended, search), None, STEPS_OF_LIKELIHOOD)?;
        let evaluations = self.evaluate(&fit.model)?;
        let see = Coordinates::new(self, &evaluations);
        let named = Named::of(effects);
        let squares_added_by = |term| -> Result<f64, DiagnoseError> {
            let added = self.added_by(&fit.model, &see.torque, term)?;
            Ok(self.layout().squares(&added))
        };
        let squares = effects.iter().map(|effect| effect.term.map_or(Ok(0.0), squares_added_by));
        let squares: Vec<f64> = squares.collect::<Result<_, DiagnoseError>>()?;
        withhold_small_beside_curves(effects, &squares);
        let mut tested = Vec::new();
        for (i, effect) in effects.iter().enumerate().filter(|(_, effect)| is_tested(effect)) {
            let Some(term) = effect.term else { continue };
            let units = self.unit_columns(&evaluations, &fit.model.terms[term])?;
            tested.push(TestedEffect {
                index: i,
                units: units.into_iter().map(|unit| of_rms_one(unit.values)).collect(),
                others: named.others(&see, &fit.model.terms[term].kind),
                squares: squares[i],
            });
        }
        let mut model = ModelWithChanges {
            dataset: self,
            changes: Vec::new(),
            minus_two_log_likelihood: fit.minus_two_log_likelihood,
            fit,
            least: named.least(),
        };
        while let Some((at, change)) = model.largest_change(&tested) {
            effects[tested.remove(at).index].withhold();
            model.changes.extend(change.columns);
            model.minus_two_log_likelihood = change.minus_two_log_likelihood;
        }
        Ok(())
    }
}

/// A curve follows an effect only approximately; a kind that is much smaller describes the rest of the same effect. `squares` is what each effect adds.
fn withhold_small_beside_curves(effects: &mut [EffectVerdict], squares: &[f64]) {
    let curves = effects.iter().zip(squares).filter(|(effect, _)| effect.name == UNKNOWN).map(|(_, squares)| *squares);
    let largest = curves.fold(0.0, f64::max);
    for (effect, squares) in effects.iter_mut().zip(squares) {
        if effect.name != UNKNOWN && effect.term.is_some() && *squares < LEAST_BESIDE_CURVE.powi(2) * largest {
            effect.withhold();
        }
    }
}

/// What is named, as far as it decides how an effect is tested.
struct Named {
    /// One effect alone.
    is_alone: bool,
    /// An effect of the acceleration, which is smoothed: beside it, any other effect would seem to change with what changes at reversals, the speed and the stiffness.
    with_acceleration: bool,
}

impl Named {
    fn of(effects: &[EffectVerdict]) -> Self {
        let named = || effects.iter().filter(|effect| effect.name != UNKNOWN);
        Self { is_alone: named().count() == 1, with_acceleration: named().any(|e| acts_through(e, "acceleration")) }
    }

    /// The least improvement that establishes a change.
    fn least(&self) -> f64 {
        if self.is_alone { LEAST_ALONE } else { LEAST_BESIDE_OTHERS }
    }

    /// The coordinates that an effect of a kind may change with, of mean 0 and standard deviation 1.
    fn others(&self, see: &Coordinates, kind: &str) -> Vec<Vec<f64>> {
        let mut all = vec![see.torque.clone(), see.time.clone()];
        all.extend([&see.deflection, &see.temperature].into_iter().flatten().cloned());
        // What smoothing and sampling take from several effects, or from a wave of a motor that turns fast, follows the motion.
        let with_motion = self.is_alone && !(coordinates(kind).contains(&"motor_angle") && turns_fast(see));
        if with_motion {
            all.extend(see.output.iter().cloned());
        }
        if with_motion && !self.with_acceleration {
            all.extend(see.velocity.iter().map(|v| v.iter().map(|v| v.abs()).collect()));
        }
        // Where the motion reverses the velocity is inaccurate, and the stiffness is not known: an effect of the velocity would seem to change with the stiffness.
        if !self.with_acceleration && !coordinates(kind).contains(&"output_velocity") {
            all.extend(see.rate.iter().map(|rate| stiffness(&see.torque_rate, rate)));
        }
        all.iter_mut().for_each(|coordinate| standardise(coordinate));
        all
    }
}

/// A named effect that may change with another coordinate.
struct TestedEffect {
    /// Its place among the effects.
    index: usize,
    /// What a unit of each of its linear numbers adds, rms 1.
    units: Vec<Vec<f64>>,
    /// The coordinates that it may change with.
    others: Vec<Vec<f64>>,
    /// What it adds to the torque, squared, (N·m)².
    squares: f64,
}

/// A fit, and changes of its effects with coordinates that have been found.
struct ModelWithChanges<'t, 'r> {
    dataset: &'t Dataset<'r>,
    fit: Fitted,
    changes: Vec<Vec<f64>>,
    minus_two_log_likelihood: f64,
    /// The least improvement that establishes a further change.
    least: f64,
}

/// A model is so much better where an effect changes with a coordinate.
struct Change {
    gain: f64,
    columns: Vec<Vec<f64>>,
    minus_two_log_likelihood: f64,
}

impl ModelWithChanges<'_, '_> {
    /// The change that improves the model most, and the place of its effect; `None` where none is established.
    fn largest_change(&self, effects: &[TestedEffect]) -> Option<(usize, Change)> {
        let changes = effects.iter().enumerate().filter_map(|(i, effect)| Some((i, self.change_of(effect)?)));
        changes.max_by(|(_, a), (_, b)| a.gain.total_cmp(&b.gain))
    }

    /// The same of one effect; `None` also where its changes are small beside it.
    fn change_of(&self, effect: &TestedEffect) -> Option<Change> {
        let changes = effect.others.par_iter().filter_map(|coordinate| self.change_with(&effect.units, coordinate));
        let noise = self.dataset.layout().squares(&self.fit.residual) / self.dataset.counted().max(1) as f64;
        let least = LEAST_CHANGE.powi(2) * effect.squares;
        changes.max_by(|a, b| a.gain.total_cmp(&b.gain)).filter(|change| change.gain * noise > least)
    }

    /// How much better the model is, on blocks held out, too, where every number of an effect may have a factor 1 + a c + b c² of a coordinate c.
    fn change_with(&self, units: &[Vec<f64>], coordinate: &[f64]) -> Option<Change> {
        let product = |unit: &Vec<f64>, power| unit.iter().zip(coordinate).map(|(u, c)| u * c.powi(power)).collect();
        let columns: Vec<Vec<f64>> = units.iter().flat_map(|unit| [product(unit, 1), product(unit, 2)]).collect();
        let mut all = self.fit.parameter_columns();
        all.extend(self.changes.iter().chain(&columns).map(Vec::as_slice));
        let with = self.dataset.layout().best_profile(&all, &self.fit.residual, &self.fit.noise);
        let net = self.minus_two_log_likelihood - with.minus_two_log_likelihood - 2.0 * columns.len() as f64;
        if net < self.least {
            return None;
        }
        let predicted = trimmed_sum(&self.dataset.gain_of_columns(&self.fit, &self.changes, &columns, &with.noise));
        let minus_two_log_likelihood = with.minus_two_log_likelihood;
        (predicted > self.least).then(|| Change { gain: net.min(predicted), columns, minus_two_log_likelihood })
    }
}

/// Whether a name can be wrong because its effect changes. Slip elements fit the remainder of any effect. The acceleration is smoothed, so its effect is too small where the motion reverses.
fn is_tested(effect: &EffectVerdict) -> bool {
    effect.name != UNKNOWN
        && !kinds::of(&effect.name).is_some_and(|kind| kind.is_of_slip_elements())
        && !acts_through(effect, "acceleration")
}

fn acts_through(effect: &EffectVerdict, coordinate: &str) -> bool {
    coordinates(&effect.name).contains(&coordinate)
}

/// Whether the motor turns by more than [`FAST_TURN_RAD`] from row to row in more than [`FAST_PART`] of the rows.
fn turns_fast(see: &Coordinates) -> bool {
    see.motor.as_ref().is_some_and(|motor| {
        let fast = motor.windows(2).filter(|pair| (pair[1] - pair[0]).abs() > FAST_TURN_RAD).count();
        fast as f64 > FAST_PART * motor.len().saturating_sub(1) as f64
    })
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
