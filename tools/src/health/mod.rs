//! The condition of a gear over a series of recordings or fits: what moved, by how much, against its uncertainty.
//!
//! | file | what |
//! |---|---|
//! | [`catalogue`] | K1, K2, K3, hysteresis loss and lost motion of a model, as catalogues quote them |
//! | [`condition`] | one state of the gear: parameters and catalogue figures with their standard deviations |
//! | [`change`] | which of them moved, at a stated false-alarm rate |
//! | [`against`] | how they go with temperature, hours, size |
//!
//! All recordings are fitted with one law, kernel, gate, play and rated deflection, so that their parameters compare. A recording may hold more than the model
//! says, and its standard deviations are then too small: each recording is also fitted in halves, and what its halves differ by beyond their standard
//! deviations widens all of them.

pub mod against;
pub mod catalogue;
pub mod change;
pub mod condition;
mod error;

use std::path::PathBuf;

pub use error::HealthError;

use crate::fit;
use crate::fit::Fit;
use crate::fit::FitOptions;
use crate::model::{Model, TorqueSide};
use crate::progress::Progress;
use crate::recording::{Recording, TorqueUnit};
use crate::regression::error::EstimateError;
use crate::signal::plausible;
use against::{Property, Regression};
use catalogue::{Asked, Rating};
use change::Change;
use condition::{Condition, Gear};

/// The probability at which anything at all is said to have moved where nothing has.
pub const FALSE_ALARM_RATE: f64 = 0.01;

/// What is asked.
#[derive(Debug, Clone, Default)]
pub struct HealthOptions {
    /// Seed of every random choice.
    pub seed: u64,
    /// A model whose structure and rated deflection are kept; else all recordings together choose.
    pub start: Option<Model>,
    /// Rated deflection, rad.
    pub rated_deflection_rad: Option<f64>,
    /// The ratio; else the model's.
    pub ratio: Option<f64>,
    /// Where the torque is taken; else where the model says.
    pub torque_side: Option<TorqueSide>,
    /// Whether the zero of each recording is always estimated; else only where it is seen to differ from none.
    pub own_zeros: bool,
    /// Rated torque and breakpoints.
    pub rating: Asked,
    /// A property to regress on.
    pub against: Option<String>,
}

/// The finding.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Health {
    /// Probability that anything is said to have moved where nothing has.
    pub false_alarm_rate: f64,
    /// Unit of the torque: `nm`, or `a` where current stands in.
    #[serde(serialize_with = "unit_word")]
    pub unit: TorqueUnit,
    /// Seed used.
    pub seed: u64,
    /// Rated torque and breakpoints of the catalogue figures.
    pub rating: Rating,
    /// Law, kernel and gate.
    pub structure: String,
    /// What the standard deviations were multiplied by, because the halves of a recording differ by more.
    pub widened: f64,
    /// The states in the order given.
    pub conditions: Vec<Condition>,
    /// Each quantity over the series; empty for a single state.
    pub changes: Vec<Change>,
    /// How the quantities go with the property asked for.
    pub against: Option<Against>,
}

/// Quantities beside a property.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Against {
    /// The property.
    #[serde(flatten)]
    pub property: Property,
    /// A line for each quantity.
    pub regressions: Vec<Regression>,
}

fn unit_word<S: serde::Serializer>(unit: &TorqueUnit, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(unit.suffix())
}

/// Follows a gear over recordings.
///
/// # Errors
/// [`HealthError`].
pub fn of_recordings(
    recordings: &[Recording],
    options: &HealthOptions,
    progress: &dyn Progress,
) -> Result<Health, HealthError> {
    if recordings.is_empty() {
        return Err(HealthError::Nothing);
    }
    if let Some(joint) = recordings.iter().find(|recording| recording.is_joint_log()) {
        return Err(EstimateError::JointLog { recording: joint.name.clone() }.into());
    }
    let common = FitOptions { start: Some(structure(recordings, options, progress)?), ..fit_options(options) };
    let mut gears = Vec::new();
    let mut halves = Vec::new();
    for (index, recording) in recordings.iter().enumerate() {
        progress.report("fitting", 0.5 + 0.5 * index as f64 / recordings.len() as f64);
        if progress.cancelled() {
            return Err(EstimateError::Cancelled.into());
        }
        let fit = fit::fit(std::slice::from_ref(recording), &common, &())?;
        gears.push(Gear::of_fit(recording, &fit));
        let middle = recording.len() / 2;
        // A half that cannot be fitted tells nothing about repeatability.
        let half = |rows| {
            let part = recording.part(rows);
            fit::fit(std::slice::from_ref(&part), &common, &()).ok().map(|fit| Gear::of_fit(&part, &fit))
        };
        halves.extend(half(0..middle).zip(half(middle..recording.len())));
    }
    let widened = condition::widening(&halves);
    gears.iter_mut().for_each(|gear| gear.widen(widened));
    let property = options.against.as_deref().map(|asked| against::property(asked, recordings)).transpose()?;
    finding(gears, options, widened, property)
}

/// What catalogues quote of a gear that was fitted: K1, K2, K3, hysteresis loss and lost motion, with its parameters. `None` where the fit is no loaded gear.
pub fn catalogue_figures(recordings: &[Recording], fit: &Fit) -> Option<Condition> {
    let gears = [Gear::of_fit(recordings.first()?, fit)];
    fit.model.elastic?;
    let rating = Rating::settle(&Asked::default(), &gears).ok()?;
    gears[0].condition(&rating).ok()
}

fn fit_options(options: &HealthOptions) -> FitOptions {
    FitOptions {
        seed: options.seed,
        rated_deflection_rad: options.rated_deflection_rad,
        ratio: options.ratio,
        torque_side: options.torque_side,
        own_zeros: options.own_zeros,
        ..FitOptions::default()
    }
}

/// Refuses recordings that are in other units than the first, or of another sign.
fn one_unit(recordings: &[Recording], options: &HealthOptions) -> Result<(), HealthError> {
    let (first, others) = recordings.split_at(1);
    let alone = fit::fit(first, &fit_options(options), &())?;
    let same = others.iter().try_for_each(|other| plausible::units(other, &alone.model));
    Ok(same.map_err(EstimateError::from)?)
}

/// A model of the structure and rated deflection that all recordings are fitted with.
///
/// Without one given, each recording is asked by itself, since a gear that changed follows no law over all of them: the structure is the one
/// with the least mean square of errors held out, each beside the best of its recording; of those within a percent the simplest.
fn structure(recordings: &[Recording], options: &HealthOptions, progress: &dyn Progress) -> Result<Model, HealthError> {
    if let Some(model) = &options.start {
        return Ok(model.clone());
    }
    let rated = match options.rated_deflection_rad {
        Some(rated) => rated,
        None => {
            let seen = recordings.iter().map(fit::largest_deflection_rad).collect::<Result<Vec<_>, _>>()?;
            let largest = seen.iter().copied().fold(0.0, f64::max);
            if fit::differ_in_size(&seen) {
                one_unit(recordings, options)?;
            }
            largest
        }
    };
    let mut fits = Vec::new();
    for (index, recording) in recordings.iter().enumerate() {
        progress.report("choosing the law", 0.5 * index as f64 / recordings.len() as f64);
        let own = FitOptions { rated_deflection_rad: Some(rated), ..fit_options(options) };
        fits.push(fit::fit(std::slice::from_ref(recording), &own, &())?);
    }
    let error = |candidate: usize| -> f64 {
        let relative = |fit: &Fit| {
            let best = fit.selection.iter().map(|c| c.heldout_rms).fold(f64::INFINITY, f64::min);
            (fit.selection[candidate].heldout_rms / best.max(f64::MIN_POSITIVE)).powi(2)
        };
        fits.iter().map(relative).sum::<f64>() / fits.len() as f64
    };
    let candidates = &fits[0].selection;
    let least = (0..candidates.len()).map(error).fold(f64::INFINITY, f64::min);
    let near = (0..candidates.len()).filter(|&k| error(k) <= 1.01 * least);
    let chosen = near.min_by_key(|&k| (candidates[k].parameters, k)).unwrap_or(0);
    let name = &candidates[chosen].name;
    let own = fits.iter().find(|fit| fit.selection.iter().any(|c| c.chosen && c.name == *name));
    let mut model = own.unwrap_or(&fits[0]).model.clone();
    // Each recording finds the zero of its own encoders.
    model.gear.deflection_zero_rad = 0.0;
    Ok(model)
}

/// Follows a gear over models. Their standard deviations come from what `fit --json` wrote beside them under the same name, where there is such a file.
///
/// # Errors
/// [`HealthError`].
pub fn of_models(models: &[(PathBuf, Model)], options: &HealthOptions) -> Result<Health, HealthError> {
    if models.is_empty() {
        return Err(HealthError::Nothing);
    }
    let gears = models.iter().map(|(path, model)| Gear::of_model(path, model)).collect::<Result<Vec<_>, _>>()?;
    let names: Vec<String> = gears.iter().map(|g| g.name.clone()).collect();
    let property = options.against.as_deref().map(|asked| against::tabled(asked, &names)).transpose()?;
    finding(gears, options, 1.0, property)
}

fn finding(
    gears: Vec<Gear>,
    options: &HealthOptions,
    widened: f64,
    property: Option<Property>,
) -> Result<Health, HealthError> {
    condition::comparable(&gears)?;
    let rating = Rating::settle(&options.rating, &gears)?;
    let first = &gears[0];
    let (unit, structure) = (first.model.torque_unit, first.structure());
    let conditions = gears.iter().map(|gear| gear.condition(&rating)).collect::<Result<Vec<_>, _>>()?;
    let changes = if conditions.len() > 1 { change::changes(&conditions, FALSE_ALARM_RATE) } else { Vec::new() };
    let against = property.map(|property| {
        let regressions = against::regressions(&conditions, &property, FALSE_ALARM_RATE);
        Against { property, regressions }
    });
    let seed = options.seed;
    Ok(Health {
        false_alarm_rate: FALSE_ALARM_RATE,
        unit,
        seed,
        rating,
        structure,
        widened,
        conditions,
        changes,
        against,
    })
}
