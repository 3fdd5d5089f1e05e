//! Sensors driven beyond their range.

use std::fmt;

use crate::number::trimmed;
use crate::numerics::autoregression::quantisation_step;
use crate::numerics::extremes::range;
use crate::recording::Recording;

/// A channel that stays at its extreme, to the digit, while the other changes, as a sensor does beyond its range.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Clipped {
    /// The recording.
    pub recording: String,
    /// The channel.
    pub channel: &'static str,
    /// The channel that changes.
    pub other: &'static str,
    /// Where it stands, mrad, N·m or A.
    pub at: f64,
    /// The unit of that.
    pub unit: &'static str,
}

impl fmt::Display for Clipped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { recording, channel, other, at, unit } = self;
        write!(
            f,
            "{recording}: the {channel} stays at {} {unit} while the {other} changes: a sensor beyond its range; reduce the load, or use a sensor of a larger range",
            trimmed(*at, 5)
        )
    }
}

/// Part of the range of the other channel that may go by while the torque, and while the deflection stands at its extreme: a gear that is held creeps.
const STANDS: (f64, f64) = (0.05, 0.2);

/// The channel of a recording, of its torque and its deflection, that is.
pub fn clipped(recording: &Recording, deflection_rad: &[f64]) -> Option<Clipped> {
    let (theta, torque) = (deflection_rad, recording.torque.as_deref()?);
    let (quantity, symbol) = (recording.torque_unit.quantity(), recording.torque_unit.symbol());
    let found = |channel, other, at, unit| Clipped { recording: recording.name.clone(), channel, other, at, unit };
    let of_torque = stands(torque, theta, STANDS.0).map(|at| found(quantity, "deflection", at, symbol));
    of_torque.or_else(|| stands(theta, torque, STANDS.1).map(|at| found("deflection", quantity, 1e3 * at, "mrad")))
}

/// The extreme at which a channel stands while more than a part of the other's range goes by. Counts stand too, but over a few of their own steps only, and at no load there is nothing
/// to see.
fn stands(channel: &[f64], other: &[f64], part: f64) -> Option<f64> {
    let ((low, high), (left, right)) = (range(channel), range(other));
    let step = quantisation_step(channel).unwrap_or(0.0);
    let most = part.max(4.0 * step / (high - low)) * (right - left);
    [low, high].into_iter().filter(|extreme| *extreme != 0.0).find(|extreme| {
        channel
            .chunk_by(|a, b| a == b)
            .scan(0, |row, run| {
                *row += run.len();
                Some((run[0], *row - run.len()..*row))
            })
            .any(|(value, rows)| {
                let (from, to) = range(&other[rows]);
                value == *extreme && to - from > most
            })
    })
}
