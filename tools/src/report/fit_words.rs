//! The verdict on a fit in words.

use crate::fit::rated::BetterRated;
use crate::fit::torque_side::BetterSide;
use crate::fit::units::DoubtfulUnit;
use crate::fit::verdict::{Cause, FitVerdict, Grade, Reason};
use crate::model::refusal;
use crate::number::{number, trimmed};
use crate::recording::TorqueUnit;
use crate::report::note_words::enumeration;

/// The verdict as files and reports have it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct WordedVerdict {
    /// The grade: that of the gravest reason.
    pub grade: Grade,
    /// One sentence.
    pub sentence: String,
    /// Every reason, the gravest first.
    pub reasons: Vec<WordedReason>,
}

/// A reason in words.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct WordedReason {
    /// What it does to the grade.
    pub grade: Grade,
    /// What it is, as a clause.
    pub words: String,
}

/// A verdict in words. `unit` is that of the torque.
pub fn worded(verdict: &FitVerdict, unit: TorqueUnit) -> WordedVerdict {
    let reasons: Vec<WordedReason> = verdict
        .reasons
        .iter()
        .map(|Reason { grade, cause }| WordedReason { grade: *grade, words: clause(cause, unit) })
        .collect();
    let sentence = match (verdict.grade, reasons.first()) {
        (Grade::Bad, Some(reason)) => format!("Not good enough to flash: {}.", reason.words),
        (Grade::Caution, Some(reason)) => format!("Good enough to flash, with care: {}.", reason.words),
        _ => {
            let error = clause(&verdict.error, unit);
            format!("Good enough to flash: {error}, and the recordings give no reason against it.")
        }
    };
    WordedVerdict { grade: verdict.grade, sentence, reasons }
}

/// A number to be typed, no smaller than the one meant: six digits.
fn rounded_up(value: f64) -> String {
    let unit = 10_f64.powi(value.abs().log10().floor() as i32 - 5);
    format!("{:.5e}", (value / unit).ceil() * unit)
}

/// How parameters that are held where there is an inverse are described.
pub fn held_invertible(up_to_rated: bool) -> &'static str {
    if up_to_rated {
        "held at the bound where feed-forward has an inverse up to the rated deflection"
    } else {
        "held at the bound where feed-forward has an inverse up to half the rated deflection"
    }
}

/// A cause as a clause.
pub fn clause(cause: &Cause, torque_unit: TorqueUnit) -> String {
    let unit = torque_unit.symbol();
    match cause {
        Cause::Error { heldout_rms, share } => format!(
            "the error held out is {} {unit} rms, {} % of the peak {}",
            number(*heldout_rms, 2),
            number(100.0 * share, 2),
            torque_unit.quantity()
        ),
        Cause::Overfit(ratio) => {
            format!("rows not used in the fit are predicted {ratio:.1} times worse than those fitted")
        }
        Cause::TorqueFalls => "the torque falls while the deflection rises, so one of them is counted backwards: flip it with --map deflection_rad=-COLUMN".to_owned(),
        Cause::BetterRated(BetterRated { rated_deflection_rad: seen, heldout_rms, given_heldout_rms }) => format!(
            "with a rated deflection of {} mrad, the largest recorded, the error of rows held out is {} instead of {} {unit}; e and c1–c3 depend on it: set --rated-deflection {}",
            number(1e3 * seen, 5),
            number(*heldout_rms, 2),
            number(*given_heldout_rms, 2),
            rounded_up(*seen)
        ),
        Cause::BetterSide(BetterSide { torque_side, heldout_rms, given_heldout_rms }) => {
            let [of_other, of_given] = [heldout_rms, given_heldout_rms].map(|rms| number(*rms, 2));
            let side = torque_side.name();
            format!("friction and inertia have the other sign: with the torque taken at the {side} the error of rows held out is {of_other} instead of {of_given} {unit}; add --torque-side {side}, or set torque_side in the model's [gear]")
        }
        Cause::DoubtfulUnit(DoubtfulUnit { column, size, limit, unit, .. }) if size < limit => format!(
            "{column} reaches ±{} {unit}, strain wave gears under load at least about {} {unit}: check its unit, --map {column}=COLUMN*1e3 scales it",
            number(*size, 4),
            trimmed(*limit, 2)
        ),
        Cause::DoubtfulUnit(DoubtfulUnit { column, size, limit, unit, grade }) => format!(
            "{column} reaches ±{} {unit}, strain wave gears at most about {} {unit}: check its unit, --map {column}=COLUMN*1e-3 scales it{}",
            number(*size, 4),
            trimmed(*limit, 2),
            match (*column, *grade) {
                ("deflection_rad", Grade::Bad) => ", or whether an encoder starts again after each turn",
                _ => "",
            }
        ),
        Cause::Clipped(clipped) => format!("{clipped}: repeat with a larger range, or less load"),
        Cause::SingleStroke => "the deflection never turns back, so the hysteresis is extrapolated from one branch: record a closed cycle".to_owned(),
        Cause::InverseRange(share) => format!(
            "feed-forward has an inverse up to {:.0} % of the rated deflection only: beyond, the torque can fall while the deflection rises",
            100.0 * share
        ),
        Cause::FeedForwardRefused(error) => format!("feed-forward: {}", refusal::of_inverse(error)),
        Cause::HeldInvertible(up_to_rated) => format!("the parameters are {}", held_invertible(*up_to_rated)),
        Cause::AtBound { name, value } => format!("{name} is at its bound {value}"),
        Cause::OneLoadDirection => "only one load direction was recorded; the other is extrapolated".to_owned(),
        Cause::Reach(share) => format!(
            "only {:.0} % of the rated deflection was recorded in both load directions; the rest is extrapolated",
            100.0 * share
        ),
        Cause::Repeats(share) => format!(
            "{:.0} % of the residual repeats at the same position and direction, so physics is missing: run gmhm diagnose",
            100.0 * share
        ),
        Cause::PhysicsLeft => "the residual is more physics than noise (taken as noise, it makes predictions worse): run gmhm diagnose".to_owned(),
        Cause::BetterModel { model, ratio } => {
            format!("another model, {model}, predicts with {ratio:.2} times the error")
        }
        Cause::NoHysteresis => "a linear spring predicts as well: these recordings show no hysteresis".to_owned(),
        Cause::Undetermined(names) => {
            let (are, them) = if names.len() == 1 { ("is", "it") } else { ("are", "them") };
            format!(
                "{} {are} not determined by these recordings: predictions of such motions do not need {them}, but do not extrapolate",
                enumeration(&names.iter().map(String::as_str).collect::<Vec<_>>())
            )
        }
        Cause::Unfinished => "the search reached its limit of evaluations before it converged".to_owned(),
    }
}
