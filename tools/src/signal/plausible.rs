//! Whether recordings and a model can be of one gear, before anything is concluded from their difference: units, signs, zeros, channels that are dead, files given twice.
//!
//! A unit or a sign is blamed only where it explains: the model as given misses the torque altogether, and follows it once a column is converted.

use std::fmt;

use crate::model::Model;
use crate::number::{number, trimmed};
use crate::numerics::extremes::range;
use crate::physics::Signals;
use crate::recording::{Recording, TorqueUnit};
use crate::signal::clipping::{Clipped, clipped};
use crate::signal::conversion::{Channel, Conversion, conversions};
use crate::signal::denoise::channel_sd;
use crate::signal::recorded::evaluate;

/// Why a recording and a model cannot be of one gear, as they stand.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Implausible {
    /// A column in another unit or of the other sign.
    #[error(
        "{file}: the model's error is {missed} {unit} rms of a torque of {torque} {unit} rms; with {} it is {left}: {}",
        conversion.words(*torque_unit), conversion.mistake(), unit = torque_unit.symbol(),
        missed = number(*missed, 4), torque = number(*torque, 4), left = number(*left, 4)
    )]
    Unit {
        /// The recording.
        file: String,
        /// What would explain the torque.
        conversion: Conversion,
        /// What the torque is measured in.
        torque_unit: TorqueUnit,
        /// Rms of the torque about its mean, as recorded.
        torque: f64,
        /// What the model given misses of it, rms.
        missed: f64,
        /// What it misses of the torque as recorded once the column is converted, rms.
        left: f64,
    },
    /// Deflections that this gear cannot have.
    #[error(
        "{file}: {rows} of {of} rows lie beyond three times the rated deflection of {rated} rad, the farthest at {farthest} rad",
        rated = trimmed(*rated_rad, 6), farthest = number(*farthest_rad, 4)
    )]
    BeyondRated {
        /// The recording.
        file: String,
        /// Rows beyond.
        rows: usize,
        /// Rows of the recording.
        of: usize,
        /// The rated deflection in use, rad.
        rated_rad: f64,
        /// The largest deflection, rad.
        farthest_rad: f64,
        /// The middle between the extremes as recorded, where they are no farther apart than this gear's may be, rad.
        middle_rad: Option<f64>,
    },
    /// A current beside a model per newton-metre, or a torque beside one per ampere.
    #[error("{file} holds a {}, and the model is per {}", found.quantity(), match found { TorqueUnit::Ampere => "newton-metre", TorqueUnit::NewtonMetre => "ampere" })]
    OtherQuantity {
        /// The recording.
        file: String,
        /// What it holds.
        found: TorqueUnit,
    },
    /// A torque that never changes.
    #[error("{file}: the torque is the same in every row: there is nothing to explain")]
    NoTorqueChange {
        /// The recording.
        file: String,
    },
    /// Nothing moves.
    #[error(
        "{file}: does not move beyond its noise ({what} varies by {varies} rad rms, of which {noise} is noise): nothing can be identified from it",
        varies = number(*varies, 3), noise = number(*noise, 3)
    )]
    Still {
        /// The recording.
        file: String,
        /// Deflection or angle.
        what: &'static str,
        /// Its rms about its mean, rad.
        varies: f64,
        /// Its noise, rad rms.
        noise: f64,
    },
}

impl Implausible {
    /// How to fix it.
    pub fn fix(&self) -> String {
        match self {
            Implausible::Unit { conversion, torque_unit, .. } => {
                let either = match conversion.of {
                    Channel::Deflection if conversion.factor == -1.0 => {
                        let torque = Conversion { of: Channel::Torque, ..*conversion };
                        format!(" or --map {}", torque.map(*torque_unit))
                    }
                    _ => String::new(),
                };
                format!(
                    "add --map {}{either}, COLUMN being the name in the file; or give the model of this gear",
                    conversion.map(*torque_unit)
                )
            }
            Implausible::BeyondRated { middle_rad: Some(middle), .. } => format!(
                "the encoders' zero differs: set deflection_zero_rad = {middle:.6e} in the model's [gear], identify it by `gmhm fit`, or, where only this recording's does, add --own-zeros to `gmhm diagnose`"
            ),
            Implausible::BeyondRated { .. } => {
                "check the unit of the deflection (--map scales columns), rated_deflection_rad in the model, and --rated-deflection"
                    .to_owned()
            }
            Implausible::OtherQuantity { found: TorqueUnit::Ampere, .. } => {
                "fit a model per ampere to this recording, or convert the current: --map torque_nm=current_a*NM_PER_A"
                    .to_owned()
            }
            Implausible::OtherQuantity { .. } => "fit a model per newton-metre to this recording".to_owned(),
            Implausible::NoTorqueChange { .. } => {
                "check that the sensor is connected and that the column is the right one".to_owned()
            }
            Implausible::Still { .. } => {
                "check that the sensor is connected and that the columns are the right ones; record while the gear is loaded or the joint moves"
                    .to_owned()
            }
        }
    }
}

/// What is odd about recordings, and does not forbid a diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub enum Remark {
    /// Many rows beyond the rated deflection.
    OutOfRange {
        /// The recording.
        file: String,
        /// Rows beyond.
        rows: usize,
        /// Rows of the recording.
        of: usize,
        /// The rated deflection in use, rad.
        rated_rad: f64,
    },
    /// The deflection stands still while something else moves.
    DeflectionStill {
        /// The recording.
        file: String,
    },
    /// Another stiffness than the model's.
    Stiffness {
        /// The recording.
        file: String,
        /// Slope of the torque over the deflection, N·m/rad or A/rad.
        recorded: f64,
        /// The same slope of the model's torque.
        given: f64,
    },
    /// A sensor driven beyond its range.
    Clipped(Clipped),
    /// A recording that goes better with the others from a zero of its own.
    OtherZero {
        /// The first recording.
        first: String,
        /// This one.
        other: String,
        /// How far its zero is from that of the first, rad.
        apart_rad: f64,
    },
    /// The base model is not refitted.
    BaseHeld,
    /// Rows near standstill are not used.
    NearStandstill {
        /// Rows that are not used.
        rows: usize,
        /// Rows of all recordings.
        of: usize,
    },
    /// Of a long recording some stretches are read.
    Stretches {
        /// The recording.
        file: String,
        /// Stretches.
        stretches: usize,
        /// Rows of all stretches.
        rows: usize,
        /// Rows of the recording.
        of: usize,
    },
    /// Two files of one content.
    Repeated {
        /// The first.
        first: String,
        /// The other.
        other: String,
        /// Whether one is to be predicted from the other.
        held_out: bool,
    },
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Remark::OutOfRange { file, rows, of, rated_rad } => write!(
                f,
                "{file}: {rows} of {of} rows lie more than a twentieth outside the rated deflection of {} rad, where the model is not calibrated; check the unit of the deflection and the rated deflection",
                trimmed(*rated_rad, 6)
            ),
            Remark::DeflectionStill { file } => write!(
                f,
                "{file}: the deflection does not move beyond its noise: stiffness, hysteresis and effects of the deflection cannot be identified from it"
            ),
            Remark::Stiffness { file, recorded, given } => write!(
                f,
                "{file}: the torque rises by {} per rad of deflection, that of the model by {}: check units, signs, and that the model is of this gear",
                number(*recorded, 4),
                number(*given, 4)
            ),
            Remark::Clipped(clipped) => write!(f, "{clipped}; effects found may be caused by it"),
            Remark::OtherZero { first, other, apart_rad } => write!(
                f,
                "{other}: its deflection fits that of {first} better with a zero {} rad away; if its encoders were restarted or moved, add --own-zeros",
                number(*apart_rad, 5)
            ),
            Remark::BaseHeld => f.write_str(
                "the numbers of the base model are kept as given: refitted together with what was found, the model predicts held-out parts of these recordings worse than the base model as given",
            ),
            Remark::NearStandstill { rows, of } => write!(
                f,
                "{rows} of {of} rows near standstill are not used: the noise of the motion alone changes the friction of the model there by about as much as the residual"
            ),
            Remark::Stretches { file, stretches, rows, of } => write!(
                f,
                "{file}: {rows} of its {of} rows are diagnosed, in {stretches} stretches from its beginning to its end: the motion is too fast for averaging rows"
            ),
            Remark::Repeated { first, other, held_out: false } => {
                write!(
                    f,
                    "{first} and {other} are the same recording: it counts twice, and standard deviations come out too small"
                )
            }
            Remark::Repeated { first, other, held_out: true } => {
                write!(
                    f,
                    "{first} and {other} are the same recording: what is held out was fitted to, and proves nothing"
                )
            }
        }
    }
}

/// Rows that are looked at; of longer recordings means.
const LOOKED_AT: usize = 20_000;
/// A model that misses less than this share of the torque is not suspected.
const SUSPECT: f64 = 0.8;
/// A conversion explains where it leaves less than this share of the torque, and than half of what there was.
const EXPLAINED: f64 = 0.4;
/// A deflection that is rated deflections so far out is none of this gear.
const FAR: f64 = 3.0;
/// Rows may lie so far beyond the rated deflection, and so many of them, before it is said.
const OUTSIDE: (f64, f64) = (1.05, 0.05);
/// A deflection that varies by fewer standard deviations of its noise, and does not go with the torque, stands still.
const MOVES: f64 = 2.0;
/// The stiffness may differ by this factor before it is said.
const STIFFER: f64 = 5.0;

/// Examines recordings beside a model with its rated deflection, and recordings held out.
///
/// # Errors
/// What cannot be of one gear.
pub fn examine(recordings: &[Recording], held_out: &[Recording], model: &Model) -> Result<Vec<Remark>, Implausible> {
    let mut remarks = repeated(recordings, held_out);
    for recording in recordings.iter().chain(held_out) {
        if recording.torque.as_deref().is_some_and(|torque| sd(torque) <= resolution(torque)) {
            return Err(Implausible::NoTorqueChange { file: recording.name.clone() });
        }
        if model.has_gear() && recording.torque.is_some() && recording.torque_unit != model.torque_unit {
            return Err(Implausible::OtherQuantity { file: recording.name.clone(), found: recording.torque_unit });
        }
        let theta = Signals::new(recording, model).deflection_rad;
        let theta = theta.as_deref();
        let still = still(recording, theta)?;
        units(recording, model)?;
        if let Some((theta, rated_rad)) = theta.zip(model.gear.rated_deflection_rad) {
            remarks.extend(outside(&recording.name, theta, rated_rad, model.gear.deflection_zero_rad)?);
        }
        if still {
            remarks.push(Remark::DeflectionStill { file: recording.name.clone() });
        } else {
            remarks.extend(stiffness(recording, model));
            remarks.extend(theta.and_then(|theta| clipped(recording, theta)).map(Remark::Clipped));
        }
    }
    Ok(remarks)
}

/// Files given twice.
pub fn repeated(recordings: &[Recording], held_out: &[Recording]) -> Vec<Remark> {
    let all: Vec<&Recording> = recordings.iter().chain(held_out).collect();
    let mut remarks = Vec::new();
    for (at, other) in all.iter().enumerate() {
        let same = |one: &&&Recording| !one.sha256.is_empty() && one.sha256 == other.sha256;
        if let Some((before, first)) = all[..at].iter().enumerate().find(|(_, one)| same(one)) {
            let held_out = before < recordings.len() && at >= recordings.len();
            remarks.push(Remark::Repeated { first: first.name.clone(), other: other.name.clone(), held_out });
        }
    }
    remarks
}

/// Refuses a column in another unit or of the other sign, where converting it explains what the model misses.
///
/// # Errors
/// [`Implausible::Unit`].
pub fn units(recording: &Recording, model: &Model) -> Result<(), Implausible> {
    if recording.torque_sim_nm.is_some() {
        return Ok(());
    }
    let few;
    let seen = if recording.len() > LOOKED_AT {
        few = recording.in_means(recording.len().div_ceil(LOOKED_AT));
        &few
    } else {
        recording
    };
    let Some(torque) = seen.torque.as_deref().map(sd).filter(|sd| *sd > 0.0) else { return Ok(()) };
    let missed = share_missed(seen, model);
    if missed < SUSPECT {
        return Ok(());
    }
    let apart = |recording: &Recording| {
        let theta = Signals::new(recording, model).deflection_rad;
        let largest = theta.map(|theta| theta.iter().fold(0.0, |most: f64, x| most.max(x.abs())));
        largest.zip(model.gear.rated_deflection_rad).map_or(0.0, |(largest, rated)| (largest / rated).ln().abs())
    };
    let tried = conversions(seen, model).into_iter().filter_map(|conversion| {
        let converted = conversion.applied(seen)?;
        // The unit of a deflection is not to blame where it would leave the size of the gear's.
        (apart(&converted) <= apart(seen)).then(|| (conversion, share_missed(&converted, model)))
    });
    match tried.min_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((conversion, left)) if left < EXPLAINED && left < 0.5 * missed => Err(Implausible::Unit {
            file: recording.name.clone(),
            conversion,
            torque_unit: recording.torque_unit,
            torque,
            missed: missed * torque,
            left: left * torque,
        }),
        _ => Ok(()),
    }
}

/// The rms that a model misses, as a share of the torque's, both about their means; infinite where it cannot be evaluated.
fn share_missed(recording: &Recording, model: &Model) -> f64 {
    let Some(torque) = recording.torque.as_deref() else { return f64::INFINITY };
    let Ok(evaluation) = evaluate(model, recording) else { return f64::INFINITY };
    let left: Vec<f64> = torque.iter().zip(evaluation.total()).map(|(t, m)| t - m).collect();
    let share = sd(&left) / sd(torque);
    if share.is_nan() { f64::INFINITY } else { share }
}

/// Whether the deflection stands still.
fn still(recording: &Recording, deflection_rad: Option<&[f64]>) -> Result<bool, Implausible> {
    if recording.torque_sim_nm.is_some() {
        // A simulated torque tells enough without a motion.
        return Ok(false);
    }
    let torque = recording.torque.as_deref().unwrap_or_default();
    let stands = |x: &[f64]| {
        let (varies, noise) = (sd(x), channel_sd(x));
        (varies <= MOVES * noise.max(resolution(x)) && correlation(x, torque).powi(2) < 0.1).then_some((varies, noise))
    };
    let angles = [&recording.theta_in_rad, &recording.theta_out_rad, &recording.velocity_out_rad_per_s];
    let others: Vec<_> = angles.into_iter().flatten().map(|x| stands(x)).collect();
    let deflection = deflection_rad.map(stands);
    let refused = |what, (varies, noise)| Implausible::Still { file: recording.name.clone(), what, varies, noise };
    match (deflection, others.iter().flatten().next()) {
        (Some(Some(found)), _) if others.iter().all(Option::is_some) => Err(refused("the deflection", found)),
        (None, Some(found)) if others.iter().all(Option::is_some) => Err(refused("the angle", *found)),
        (deflection, _) => Ok(deflection.flatten().is_some()),
    }
}

/// Refuses deflections beside a zero, most of which lie far outside what the gear is rated for.
///
/// # Errors
/// [`Implausible::BeyondRated`].
pub fn within(file: &str, theta: &[f64], rated_rad: f64, zero_rad: f64) -> Result<(), Implausible> {
    outside(file, theta, rated_rad, zero_rad).map(drop)
}

/// Deflections outside what the gear is rated for.
fn outside(file: &str, theta: &[f64], rated_rad: f64, zero_rad: f64) -> Result<Option<Remark>, Implausible> {
    let (file, of) = (file.to_owned(), theta.len());
    let beyond = |times: f64| theta.iter().filter(|x| x.abs() > times * rated_rad).count();
    let (low, high) = range(theta);
    let (far, rows) = (beyond(FAR), beyond(OUTSIDE.0));
    if 2 * far > of {
        let near = high - low <= FAR * rated_rad;
        return Err(Implausible::BeyondRated {
            file,
            rows: far,
            of,
            rated_rad,
            farthest_rad: if high > -low { high } else { low },
            middle_rad: near.then_some(0.5 * (low + high) + zero_rad),
        });
    }
    let many = rows as f64 > OUTSIDE.1 * of as f64;
    Ok(many.then_some(Remark::OutOfRange { file, rows, of, rated_rad }))
}

/// A stiffness that is none of the model's.
fn stiffness(recording: &Recording, model: &Model) -> Option<Remark> {
    model.elastic?;
    let torque = recording.torque.as_deref().filter(|_| recording.torque_sim_nm.is_none())?;
    let evaluation = evaluate(model, recording).ok()?;
    let theta = evaluation.context().signals.deflection_rad.as_deref()?;
    let slope = |y: &[f64]| correlation(theta, y) * sd(y) / sd(theta);
    let (recorded, given) = (slope(torque), slope(evaluation.total()));
    let told = correlation(theta, torque).powi(2) > 0.5;
    let alike = (STIFFER.recip()..STIFFER).contains(&(recorded / given));
    (told && !alike).then(|| Remark::Stiffness { file: recording.name.clone(), recorded, given })
}

/// What of the size of numbers their sums lose.
fn resolution(x: &[f64]) -> f64 {
    1e-12 * x.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len().max(1) as f64
}

/// Root mean square about the mean.
pub(crate) fn sd(x: &[f64]) -> f64 {
    let mean = mean(x);
    (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// 0 where either does not change.
pub(crate) fn correlation(x: &[f64], y: &[f64]) -> f64 {
    let (a, b, size) = (mean(x), mean(y), sd(x) * sd(y));
    let product = x.iter().zip(y).map(|(x, y)| (x - a) * (y - b)).sum::<f64>() / x.len().max(1) as f64;
    if size > 0.0 { product / size } else { 0.0 }
}
