//! Whether a fit is good enough for the drive, with the reasons. `report` puts them into words.

use std::borrow::Cow;

use gmhm::inverse::{InverseError, invertible_range};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::fit::Fit;
use crate::fit::comparison::{Comparison, compare};
use crate::fit::coverage::{Coverage, JointCoverage};
use crate::fit::options::FitOptions;
use crate::fit::rated::BetterRated;
use crate::fit::thresholds::THRESHOLDS;
use crate::fit::torque_side::BetterSide;
use crate::fit::units::{DoubtfulUnit, doubtful};
use crate::numerics::extremes::range;
use crate::numerics::particle_swarm::Stop;
use crate::physics::{PredictError, Prediction};
use crate::progress::Progress;
use crate::recording::Recording;
use crate::regression::error::EstimateError;
use crate::regression::rows::spread_over;
use crate::signal::clipping::{Clipped, clipped};
use crate::signal::recorded::predict;

/// How far a fit may be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Grade {
    /// Fit for the drive.
    Good,
    /// Fit for the drive, within limits.
    Caution,
    /// Not fit for the drive.
    Bad,
}

/// The verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct FitVerdict {
    /// The grade: that of the gravest reason.
    pub grade: Grade,
    /// The error held out.
    pub error: Cause,
    /// Every reason, the gravest first.
    pub reasons: Vec<Reason>,
}

/// A reason.
#[derive(Debug, Clone, PartialEq)]
pub struct Reason {
    /// What it does to the grade.
    pub grade: Grade,
    /// What it is.
    pub cause: Cause,
}

/// What speaks against a fit.
#[derive(Debug, Clone, PartialEq)]
pub enum Cause {
    /// The error on rows held out, N·m or A, and as a share of the peak torque.
    Error {
        /// Root mean square.
        heldout_rms: f64,
        /// Over the peak.
        share: f64,
    },
    /// Held-out rows are predicted worse than fitted ones.
    Overfit(f64),
    /// The torque falls while the deflection rises.
    TorqueFalls,
    /// Another rated deflection predicts better.
    BetterRated(BetterRated),
    /// Friction and inertia have the other sign.
    BetterSide(BetterSide),
    /// A quantity that no gear reaches.
    DoubtfulUnit(DoubtfulUnit),
    /// A sensor was driven beyond its range.
    Clipped(Clipped),
    /// The deflection never turns back.
    SingleStroke,
    /// Feed-forward has an inverse up to this share of the rated deflection only.
    InverseRange(f64),
    /// The core refuses feed-forward with this gear.
    FeedForwardRefused(InverseError),
    /// The parameters are held where feed-forward has an inverse.
    HeldInvertible(bool),
    /// A parameter is at its bound.
    AtBound {
        /// Its name.
        name: String,
        /// The bound.
        value: f64,
    },
    /// Only one load direction was recorded.
    OneLoadDirection,
    /// Only a part of ±A was recorded in both load directions.
    Reach(f64),
    /// What is left repeats.
    Repeats(f64),
    /// What is left is physics more than noise.
    PhysicsLeft,
    /// Another model predicts better.
    BetterModel {
        /// Its name.
        model: String,
        /// Its held-out rms over the gear's.
        ratio: f64,
    },
    /// A linear spring predicts as well.
    NoHysteresis,
    /// Parameters that the recordings do not determine.
    Undetermined(Vec<String>),
    /// The search used up its evaluations.
    Unfinished,
}

/// A fit beside its recordings: what the verdict rests on, and the verdict.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Assessment {
    /// The verdict. Files have it in words.
    #[serde(skip)]
    pub verdict: FitVerdict,
    /// What the recordings exercise; absent for a joint log.
    pub coverage: Option<Coverage>,
    /// What joint logs exercise; absent for a gear.
    pub joint_coverage: Option<JointCoverage>,
    /// What the residual repeats; absent where the recordings are too short to tell.
    pub structure: Option<Structure>,
    /// Other models on the same recordings, the gear's own first.
    pub comparison: Vec<Comparison>,
    /// Rows of all recordings together, spread over the whole of each, that the comparison looked at.
    pub comparison_rows: usize,
    /// The prediction for each recording, from rest.
    #[serde(skip)]
    pub predictions: Vec<Prediction>,
    /// What the fit leaves of the recordings it was fitted to; of others recording minus offset minus prediction.
    #[serde(skip)]
    pub residuals: Vec<Vec<f64>>,
    /// Largest torque beside its mean, N·m or A.
    pub torque_peak: f64,
    /// Channels that were driven beyond their range.
    pub clipped: Vec<Clipped>,
    /// Quantities that no gear reaches.
    pub doubtful_units: Vec<DoubtfulUnit>,
    /// A rated deflection that suits the recordings better than the one given.
    pub better_rated: Option<BetterRated>,
    /// The other side of the gear, where it suits the recordings of a joint better.
    pub better_side: Option<BetterSide>,
}

/// Why a fit could not be assessed.
#[derive(Debug, thiserror::Error)]
pub enum AssessError {
    /// The fitted model predicts nothing for a recording.
    #[error(transparent)]
    Predict(#[from] PredictError),
    /// The other models could not be fitted.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
}

impl Assessment {
    /// Assesses a fit on the recordings it was fitted to, whose deflection has been derived and [aligned](Fit::align).
    ///
    /// # Errors
    /// What prediction or comparison refuse; cancelled by `progress`.
    pub fn of(fit: &Fit, recordings: &[Recording], progress: &dyn Progress) -> Result<Self, AssessError> {
        Self::with(fit, recordings, true, progress)
    }

    /// The same without other models and another rated deflection, which take several times as long as the fit: for fleets.
    ///
    /// # Errors
    /// As of [`of`](Self::of).
    pub fn of_model_alone(fit: &Fit, recordings: &[Recording], progress: &dyn Progress) -> Result<Self, AssessError> {
        Self::with(fit, recordings, false, progress)
    }

    fn with(fit: &Fit, recordings: &[Recording], compares: bool, progress: &dyn Progress) -> Result<Self, AssessError> {
        let predictions = recordings.iter().map(|r| predict(&fit.model, None, r)).collect::<Result<Vec<_>, _>>()?;
        let unpredicted = |((recording, prediction), offset): ((&Recording, &Prediction), &f64)| {
            let torque = recording.torque.as_deref().unwrap_or_default();
            torque.iter().zip(&prediction.torque).map(|(t, model)| t - offset - model).collect()
        };
        let as_fitted = fit.residuals.iter().map(Vec::len).eq(recordings.iter().map(Recording::len));
        let residuals: Vec<Vec<f64>> = if as_fitted {
            fit.residuals.clone()
        } else {
            recordings.iter().zip(&predictions).zip(&fit.offsets).map(unpredicted).collect()
        };
        let gear = &fit.model.gear;
        // A joint log has neither a rated deflection nor baselines for a loop.
        let rated = gear.rated_deflection_rad.filter(|_| fit.model.has_gear());
        let compared: Vec<Recording> =
            spread_over(recordings, THRESHOLDS.comparison_rows).into_iter().map(Cow::into_owned).collect();
        let comparison_rows = compared.iter().map(Recording::len).sum();
        let options = FitOptions {
            seed: fit.seed,
            rated_deflection_rad: gear.rated_deflection_rad,
            start: Some(fit.model.clone()),
            ..FitOptions::default()
        };
        let size = |r: &Recording| {
            let torque = r.torque.as_deref().unwrap_or_default();
            let mean = torque.iter().sum::<f64>() / torque.len().max(1) as f64;
            torque.iter().fold(0.0, |size: f64, t| size.max((t - mean).abs()))
        };
        let mut assessment = Self {
            verdict: FitVerdict { grade: Grade::Good, error: Cause::Unfinished, reasons: Vec::new() },
            coverage: rated.map(|rated| Coverage::of(recordings, gear.deflection_zero_rad, rated)),
            joint_coverage: (!fit.model.has_gear()).then(|| JointCoverage::of(recordings)),
            structure: structure(recordings, &residuals, fit.seed),
            comparison: if compares && rated.is_some() && fit.model.terms.is_empty() {
                compare(&compared, &options, progress)?
            } else {
                Vec::new()
            },
            comparison_rows,
            clipped: recordings.iter().filter_map(|r| clipped(r, r.deflection_rad.as_deref()?)).collect(),
            doubtful_units: if fit.started_from_model { Vec::new() } else { doubtful(recordings) },
            better_rated: None,
            better_side: BetterSide::of(fit, recordings, &options, progress)?,
            torque_peak: recordings.iter().map(size).fold(0.0, f64::max),
            predictions,
            residuals,
        };
        let given = assessment.comparison.first().filter(|_| !fit.rated_is_largest_seen);
        if let Some((coverage, given)) = assessment.coverage.as_ref().zip(given) {
            assessment.better_rated = BetterRated::of(&compared, &options, coverage, given.heldout_rms, progress)?;
        }
        assessment.verdict = decide(fit, &assessment);
        Ok(assessment)
    }
}

/// Decides whether a fit is good enough for the drive.
fn decide(fit: &Fit, evidence: &Assessment) -> FitVerdict {
    let mut reasons = Vec::new();
    let mut add = |grade: Grade, cause: Cause| reasons.push(Reason { grade, cause });
    // The cause of most that follows.
    if let Some(better) = evidence.better_side {
        add(Grade::Bad, Cause::BetterSide(better));
    }
    let share = fit.heldout_rms / evidence.torque_peak;
    let error = Cause::Error { heldout_rms: fit.heldout_rms, share };
    let [careful, bad] = THRESHOLDS.error_shares;
    match share {
        share if share > bad || share.is_nan() => add(Grade::Bad, error.clone()),
        share if share > careful => add(Grade::Caution, error.clone()),
        _ => {}
    }
    let (rms, floor) = (fit.rms, 1e-9 * evidence.torque_peak);
    let [careful, bad] = THRESHOLDS.overfit_ratios;
    if fit.heldout_rms > careful * rms + floor {
        let grade = if fit.heldout_rms > bad * rms + floor { Grade::Bad } else { Grade::Caution };
        add(grade, Cause::Overfit(fit.heldout_rms / rms));
    }
    let rated = evidence.coverage.as_ref().map_or(f64::NAN, |c| c.rated_deflection_rad);
    // In another unit the deflection may be any angle, and its sign tells nothing.
    if evidence.doubtful_units.is_empty() && fit.model.elastic.is_some_and(|elastic| elastic.torque_nm(rated) < 0.0) {
        add(Grade::Bad, Cause::TorqueFalls);
    }
    if let Some(better) = evidence.better_rated {
        add(Grade::Caution, Cause::BetterRated(better));
    }
    evidence.doubtful_units.iter().for_each(|doubtful| add(doubtful.grade, Cause::DoubtfulUnit(*doubtful)));
    evidence.clipped.iter().for_each(|clipped| add(Grade::Bad, Cause::Clipped(clipped.clone())));
    if evidence.coverage.as_ref().is_some_and(|coverage| coverage.strokes <= 1) {
        add(Grade::Caution, Cause::SingleStroke);
    }
    if let Some(Ok(params)) = fit.model.params(rated) {
        let [whole, half] = THRESHOLDS.inverse_shares;
        match invertible_range(&params, THRESHOLDS.drive_period_s) {
            Ok(share) if share > whole => {}
            Ok(share) => {
                add(if share < half { Grade::Bad } else { Grade::Caution }, Cause::InverseRange(share));
            }
            Err(refusal) => add(Grade::Bad, Cause::FeedForwardRefused(refusal)),
        }
    }
    if let Some(up_to_rated) = fit.held_invertible_up_to_rated() {
        add(Grade::Caution, Cause::HeldInvertible(up_to_rated));
    }
    for p in fit.uncertainty.parameters.iter().filter(|p| p.at_bound) {
        add(Grade::Caution, Cause::AtBound { name: p.name.to_string(), value: p.value });
    }
    match evidence.coverage.as_ref().map(Coverage::reach) {
        Some(share) if share < THRESHOLDS.one_sided_share => add(Grade::Caution, Cause::OneLoadDirection),
        Some(share) if share < THRESHOLDS.reach_share => add(Grade::Caution, Cause::Reach(share)),
        _ => {}
    }
    match evidence.structure {
        Some(Structure { share, significant: true }) if share > THRESHOLDS.repeated_share => {
            add(Grade::Caution, Cause::Repeats(share));
        }
        _ if fit.leaves_physics() => add(Grade::Caution, Cause::PhysicsLeft),
        _ => {}
    }
    let better = evidence.comparison.iter().skip(1).min_by(|a, b| a.heldout_rms.total_cmp(&b.heldout_rms));
    if let (Some(own), Some(best)) = (evidence.comparison.first(), better) {
        if best.heldout_rms < THRESHOLDS.better_model_share * own.heldout_rms {
            let ratio = best.heldout_rms / own.heldout_rms;
            add(Grade::Caution, Cause::BetterModel { model: best.model.clone(), ratio });
        }
        let spring = evidence.comparison.iter().find(|r| r.model == "linear spring");
        if spring.is_some_and(|s| s.heldout_rms < THRESHOLDS.spring_ratio * own.heldout_rms) {
            add(Grade::Bad, Cause::NoHysteresis);
        }
    }
    let vague = fit.uncertainty.parameters.iter().filter(|p| p.undetermined && p.sd.is_some() && !p.at_bound);
    let vague: Vec<String> = vague.map(|p| p.name.to_string()).collect();
    if !vague.is_empty() {
        add(Grade::Caution, Cause::Undetermined(vague));
    }
    if fit.stop == Stop::Evaluations {
        add(Grade::Caution, Cause::Unfinished);
    }
    reasons.sort_by_key(|reason| std::cmp::Reverse(reason.grade));
    FitVerdict { grade: reasons.first().map_or(Grade::Good, |r| r.grade), error, reasons }
}

/// What of a residual comes back at the same deflection (angle of a joint log) and direction.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Structure {
    /// Share of the residual's power that its first half predicts of its second, by deflection and direction.
    pub share: f64,
    /// Whether noise does that less than once in a hundred times.
    pub significant: bool,
}

/// Bins across the deflection.
const BINS: usize = 32;
/// Blocks of the second half whose signs are drawn.
const BLOCKS: usize = 16;
/// Draws.
const DRAWS: usize = 199;

/// Looks for what repeats in a residual: the mean of each bin of deflection and direction in the first half of each recording, times that in the second. Noise,
/// however coloured, is as often of the other sign, which random signs of blocks show.
pub fn structure(recordings: &[Recording], residuals: &[Vec<f64>], seed: u64) -> Option<Structure> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut power = 0.0;
    // Product of the bin means of the first half with the sums of each block of the second.
    let mut blocks: Vec<f64> = Vec::new();
    for (recording, residual) in recordings.iter().zip(residuals) {
        let theta = recording.deflection_rad.as_deref().or(recording.theta_out_rad.as_deref())?;
        let rows = theta.len().min(residual.len());
        let (low, high) = range(&theta[..rows]);
        if rows < 8 * BINS || high <= low {
            continue;
        }
        let mut rising = true;
        let bins: Vec<usize> = (0..rows)
            .map(|row| {
                let before = theta[row.saturating_sub(1)];
                rising = if theta[row] == before { rising } else { theta[row] > before };
                let place = (theta[row] - low) / (high - low) * BINS as f64;
                2 * (place as usize).min(BINS - 1) + usize::from(rising)
            })
            .collect();
        let half = rows / 2;
        let mut means = [(0.0, 0.0); 2 * BINS];
        for row in 0..half {
            means[bins[row]].0 += residual[row];
            means[bins[row]].1 += 1.0;
        }
        let mean = |bin: usize| if means[bin].1 >= 4.0 { means[bin].0 / means[bin].1 } else { 0.0 };
        for block in 0..BLOCKS {
            let range = half + (rows - half) * block / BLOCKS..half + (rows - half) * (block + 1) / BLOCKS;
            blocks.push(range.map(|row| mean(bins[row]) * residual[row]).sum());
        }
        power += residual[half..rows].iter().map(|r| r * r).sum::<f64>();
    }
    if power <= 0.0 {
        return None;
    }
    let share = blocks.iter().sum::<f64>() / power;
    let drawn =
        |random: &mut ChaCha8Rng| blocks.iter().map(|b| if random.random() { *b } else { -b }).sum::<f64>() / power;
    let above = (0..DRAWS).filter(|_| drawn(&mut random) >= share).count();
    Some(Structure { share, significant: (above + 1) as f64 / (DRAWS + 1) as f64 <= 0.01 })
}
