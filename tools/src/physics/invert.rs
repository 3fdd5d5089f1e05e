//! The deflection at which a model transmits the torques of a recording, one after the other.

use gmhm::inverse::{Inverse, InverseError};
use gmhm::terms::compensated::CompensatedState;
use gmhm::terms::{Compensated, Domain, Need, Sample};
use gmhm::{Gear, Law, Params};

use super::error::PredictError;
use super::evaluate::CAPACITY;
use super::predict::add;
use super::term::{MOST_TERMS, Terms, no_terms};
use crate::model::{Model, refusal};
use crate::number::number;
use crate::progress::{Progress, at_row};
use crate::recording::{Need as ColumnNeed, Needs, Recording, TorqueUnit};

/// The deflection of every row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Inversion {
    /// θ as the encoders show it, the model's zero included, rad.
    pub deflection_rad: Vec<f64>,
    /// Whether the torque lies beyond the range of the model: the deflection is the edge of the range.
    pub saturated: Vec<bool>,
    /// The edge, rad from the model's zero.
    pub range_rad: f64,
    /// Pairs of turning points given up because more were open than are remembered.
    pub merged_pairs: u32,
}

/// Why nothing was inverted.
#[derive(Debug, thiserror::Error)]
pub enum InvertError {
    /// The model's gear or terms are refused.
    #[error(transparent)]
    Model(#[from] PredictError),
    /// A joint log has no deflection.
    #[error("the model has no gear ([elastic] and [memory]): there is no deflection to find")]
    NoGear,
    /// No deflection tells the rated one.
    #[error("the model states no rated_deflection_rad; it cannot be derived from torques")]
    NotRated,
    /// Torque increases with the deflection nowhere.
    #[error("{}", refusal::of_inverse(.0))]
    NoRange(#[from] InverseError),
    /// Current for torque, or torque for current.
    #[error("{file} holds {found}, and the parameters of the model are per {expected}")]
    Unit {
        /// The recording.
        file: String,
        /// What it holds.
        found: &'static str,
        /// What the model needs.
        expected: &'static str,
    },
    /// A torque beyond anything that a gear transmits.
    #[error("{file}, row {row}: the torque {} is beyond anything that this gear transmits", number(*torque, 4))]
    Absurd {
        /// The recording.
        file: String,
        /// Row of numbers, counted from 1.
        row: usize,
        /// Its torque.
        torque: f64,
    },
    /// A term that depends on more than the deflection and the time.
    #[error("the term `{kind}` cannot be inverted from torques alone: its share of the torque depends on {needs}")]
    Term {
        /// Its kind.
        kind: String,
        /// On what it depends.
        needs: String,
    },
}

impl InvertError {
    /// How to fix it, where there is more to say than the message does.
    pub fn fix(&self) -> Option<String> {
        let text = match self {
            InvertError::Model(error) => return error.fix(),
            InvertError::NoGear => "identify a gear by `gmhm fit` from recordings with a deflection",
            InvertError::NotRated => "give --rated-deflection, or rated_deflection_rad in [gear]",
            InvertError::NoRange(_) => {
                "the memory is too strong for the spring: check alpha and the units of [elastic], or fit again"
            }
            InvertError::Unit { .. } => "map the other column with --map",
            InvertError::Absurd { .. } => "check the unit of the torque: --map torque_nm=COLUMN*0.001 scales it",
            InvertError::Term { .. } => {
                "remove the term: what is found is then the deflection for the torque of the gear and the other terms"
            }
        };
        Some(text.to_owned())
    }
}

/// Torques of so many times the rated one are no torques of the gear: the core holds the deflection there.
const ABSURD: f64 = 1e6;

/// What a model asks of a recording of torques.
pub fn needs(model: &Model) -> Needs {
    let timed = model.memory.is_some_and(|memory| memory.law == Law::Time) || !model.terms.is_empty();
    Needs { time: if timed { ColumnNeed::Required } else { ColumnNeed::Ignored }, ..Needs::INVERT }
}

/// Finds the deflection of every row, so that [`predict`](super::predict()) of what is found gives the torque back. The first row is the start: y = 0, m = 0
/// there (MODEL.md sections 3 and 4). Terms take part that depend on the deflection and the time alone.
///
/// # Errors
/// [`InvertError`].
pub fn invert(
    model: &Model,
    asked_rad: Option<f64>,
    recording: &Recording,
    progress: &dyn Progress,
) -> Result<Inversion, InvertError> {
    let torques = recording.torque.as_deref().unwrap_or_default();
    if recording.torque_unit != model.torque_unit {
        let names = |unit| match unit {
            TorqueUnit::NewtonMetre => ("torque_nm", "newton-metre"),
            TorqueUnit::Ampere => ("current_a", "ampere"),
        };
        let (found, expected) = (names(recording.torque_unit).0, names(model.torque_unit).1);
        return Err(InvertError::Unit { file: recording.name.clone(), found, expected });
    }
    if model.elastic.is_none() || model.memory.is_none() {
        return Err(InvertError::NoGear);
    }
    let rated = asked_rad.or(model.gear.rated_deflection_rad).ok_or(InvertError::NotRated)?;
    let refused = |error| PredictError::Params { rated_deflection_rad: rated, error };
    let params = model.params(rated).ok_or(InvertError::NoGear)?.map_err(refused)?;
    let most = ABSURD * params.torque_scale_nm();
    if let Some(row) = torques.iter().position(|torque| torque.abs() > most) {
        return Err(InvertError::Absurd { file: recording.name.clone(), row: row + 1, torque: torques[row] });
    }
    let mut found = if model.terms.is_empty() {
        of_gear(&params, &recording.time_s, torques, progress)?
    } else {
        with_terms(model, &params, &recording.time_s, torques, progress)?
    };
    for theta in &mut found.deflection_rad {
        *theta += model.gear.deflection_zero_rad;
    }
    Ok(found)
}

fn period_s(time_s: &[f64], row: usize) -> f64 {
    time_s[row] - time_s[row.saturating_sub(1)]
}

/// By the core's inverse.
fn of_gear(
    params: &Params,
    time_s: &[f64],
    torques: &[f64],
    progress: &dyn Progress,
) -> Result<Inversion, InvertError> {
    let longest_s = (0..time_s.len()).map(|row| period_s(time_s, row)).fold(0.0, f64::max);
    let inverse = Inverse::<f64>::with_period(params, longest_s)?;
    let mut found = Inversion { range_rad: inverse.range(), ..Inversion::default() };
    let mut state = None;
    for (row, torque) in torques.iter().enumerate() {
        at_row(progress, "Inverting", row, torques.len());
        let solution = match &mut state {
            None => {
                let (start, solution) = inverse.start::<CAPACITY>(*torque);
                state = Some(start);
                solution
            }
            Some(state) => inverse.commit_after(state, *torque, period_s(time_s, row)).0,
        };
        found.deflection_rad.push(solution.theta);
        found.saturated.push(solution.saturated);
    }
    found.merged_pairs = state.map_or(0, |state| inverse.gear().merged_pairs(&state));
    Ok(found)
}

/// By a search on gear and terms together; no equation of theirs is known here.
fn with_terms(
    model: &Model,
    params: &Params,
    time_s: &[f64],
    torques: &[f64],
    progress: &dyn Progress,
) -> Result<Inversion, InvertError> {
    let mut stack = no_terms(model, Some(params.rated_deflection_rad()));
    model.terms.iter().try_for_each(|term| add(&mut stack, term))?;
    check(&stack)?;
    let gear = Compensated { gear: Gear::new(params), stack };
    let range_rad = params.rated_deflection_rad();
    let mut found = Inversion { range_rad, ..Inversion::default() };
    let mut state: Option<CompensatedState<f64, CAPACITY, _, MOST_TERMS>> = None;
    for (row, torque) in torques.iter().enumerate() {
        at_row(progress, "Inverting", row, torques.len());
        let sample = |theta: f64| Sample {
            time: time_s[row],
            period: period_s(time_s, row),
            deflection: theta,
            ..Sample::default()
        };
        let moved = |theta: f64| match &state {
            None => gear.start(&sample(theta)),
            Some(state) => {
                let mut state = state.clone();
                gear.step(&mut state, &sample(theta));
                state
            }
        };
        let from = found.deflection_rad.last().copied().unwrap_or(0.0);
        let root = crossing(|theta| moved(theta).last().torque - torque, from, range_rad, params.torque_scale_nm());
        let theta = root.unwrap_or(range_rad.copysign(*torque));
        state = Some(moved(theta));
        found.deflection_rad.push(theta);
        found.saturated.push(root.is_none());
    }
    found.merged_pairs = state.map_or(0, |state| gear.gear.merged_pairs(state.gear()));
    Ok(found)
}

/// Refuses terms that a torque and its time do not tell.
fn check(stack: &Terms) -> Result<(), InvertError> {
    for term in stack.terms() {
        let info = term.info();
        let needs: Vec<&str> = info
            .needs
            .iter()
            .chain(term.needs_besides())
            .filter(|need| !matches!(need, Need::Deflection | Need::Gear))
            .map(|need| need.words())
            .collect();
        let empirical = info.key("coordinate").is_some();
        let needs = match info.domain {
            Domain::Delay => "the torque of other times".to_owned(),
            _ if empirical => "a coordinate of its own".to_owned(),
            _ if needs.is_empty() => continue,
            _ => needs.join(" and "),
        };
        return Err(InvertError::Term { kind: info.name.to_owned(), needs });
    }
    Ok(())
}

/// Where an excess of torque that grows with the deflection is zero, next to `from_rad` and within ±`reach_rad`.
///
/// A bracket that doubles, then false position (Illinois), until the torque is met within 1e-12 of `scale_nm`.
pub(crate) fn crossing(excess: impl Fn(f64) -> f64, from_rad: f64, reach_rad: f64, scale_nm: f64) -> Option<f64> {
    let tolerance_nm = 1e-12 * scale_nm;
    let mut near = (from_rad, excess(from_rad));
    if near.1.abs() <= tolerance_nm {
        return Some(near.0);
    }
    let direction = -near.1.signum();
    let mut step = near.1.abs() * reach_rad / scale_nm;
    let mut far = near;
    while far.1 * near.1 > 0.0 {
        if direction * far.0 >= reach_rad {
            return (far.1.abs() <= 1e-9 * scale_nm).then_some(far.0);
        }
        near = far;
        let theta = (far.0 + direction * step).clamp(-reach_rad, reach_rad);
        far = (theta, excess(theta));
        step *= 2.0;
    }
    for _ in 0..200 {
        let theta = far.0 - far.1 * (far.0 - near.0) / (far.1 - near.1);
        let here = (theta, excess(theta));
        if here.1.abs() <= tolerance_nm || theta == far.0 || theta == near.0 {
            return Some(theta);
        }
        if here.1 * far.1 < 0.0 {
            near = far;
        } else {
            near.1 *= 0.5;
        }
        far = here;
    }
    Some(far.0)
}
