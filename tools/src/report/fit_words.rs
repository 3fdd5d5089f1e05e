//! The verdict on a fit in words.

use crate::fit::rated::BetterRated;
use crate::fit::units::DoubtfulUnit;
use crate::fit::verdict::{Cause, FitVerdict, Grade, Reason};
use crate::recording::TorqueUnit;

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
            "the error held out is {heldout_rms:.3} {unit} rms, {:.2} % of the peak {}",
            100.0 * share,
            torque_unit.quantity()
        ),
        Cause::Overfit { ratio } => {
            format!("rows not used in the fit are predicted {ratio:.1} times worse than those fitted")
        }
        Cause::TorqueFalls => "the torque falls while the deflection rises, so one of them is counted backwards: flip it with --map deflection_rad=-COLUMN".to_owned(),
        Cause::BetterRated(BetterRated { rated_deflection_rad: seen, heldout_rms, given_heldout_rms }) => format!(
            "a rated deflection of {:.4} mrad, the largest seen, would leave {heldout_rms:.3} instead of {given_heldout_rms:.3} {unit} of rows held out, and e and c1–c3 depend on it: set --rated-deflection {seen:e}",
            1e3 * seen
        ),
        Cause::DoubtfulUnit(DoubtfulUnit { column, size, limit, unit, .. }) => format!(
            "{column} reaches ±{size:.3} {unit}, strain wave gears at most about {limit} {unit}: check its unit, --map {column}=COLUMN*1e-3 scales it"
        ),
        Cause::Clipped(clipped) => format!("{clipped}: repeat with a larger range, or less load"),
        Cause::SingleStroke => "the deflection never turns back, so that the hysteresis is only what the law makes of one branch: record a closed cycle".to_owned(),
        Cause::InverseRange { share } => format!(
            "feed-forward has an inverse up to {:.0} % of the rated deflection only: beyond, the torque can fall while the deflection rises",
            100.0 * share
        ),
        Cause::FeedForwardRefused(refusal) => format!("feed-forward: {refusal}"),
        Cause::HeldInvertible { up_to_rated } => format!("the parameters are {}", held_invertible(*up_to_rated)),
        Cause::AtBound { name, value } => format!("{name} is at its bound {value}"),
        Cause::OneLoadDirection => "only one load direction was recorded, and nothing is known of the other".to_owned(),
        Cause::Reach { share } => format!(
            "only {:.0} % of the rated deflection was recorded in both load directions, and nothing is known beyond",
            100.0 * share
        ),
        Cause::Repeats { share } => format!(
            "{:.0} % of what is left repeats at the same place and direction, so physics is left out: run gmhm diagnose",
            100.0 * share
        ),
        Cause::PhysicsLeft => "what is left is physics more than noise, as a fit against it as noise predicts worse: run gmhm diagnose".to_owned(),
        Cause::BetterModel { model, ratio } => {
            format!("another model, {model}, predicts with {ratio:.2} times the error")
        }
        Cause::NoHysteresis => "a linear spring predicts as well: these recordings show no hysteresis".to_owned(),
        Cause::Undetermined(names) => {
            let (are, them) = if names.len() == 1 { ("is", "it") } else { ("are", "them") };
            format!(
                "{} {are} not determined by these recordings: within the motion recorded that does no harm, beyond it do not rely on {them}",
                names.join(", ")
            )
        }
        Cause::Unfinished => "the search used up its evaluations before it settled".to_owned(),
    }
}
