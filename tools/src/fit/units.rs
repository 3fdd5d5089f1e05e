//! Quantities that no strain wave gear reaches: a unit is probably wrong. Asked where no model says what the gear is.

use super::verdict::Grade;
use crate::numerics::extremes::range;
use crate::recording::{Recording, TorqueUnit};

/// A quantity beyond what gears reach.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct DoubtfulUnit {
    /// The column.
    pub column: &'static str,
    /// Its largest size beside its middle, in `unit`.
    pub size: f64,
    /// What gears reach at most, or, where the size is less, at least under load, in `unit`.
    pub limit: f64,
    /// The unit that the column is read in.
    pub unit: &'static str,
    /// How much that is worth.
    pub grade: Grade,
}

/// A column, its unit and the sizes beyond which it is questioned and no longer believed.
struct Limit {
    column: &'static str,
    unit: &'static str,
    questioned: f64,
    refused: f64,
    /// The sizes below which it is questioned, and no longer believed; 0 where any is possible.
    small: [f64; 2],
}

/// Strain wave gears of sizes 5 to 100 deflect by 1e-4 to 1e-2 rad at their peak torque (catalogues); joints with a spring in series by some 0.3 rad. What deflects
/// by less than a fiftieth of that was hardly loaded, and is beyond most encoders.
const DEFLECTION: Limit =
    Limit { column: "deflection_rad", unit: "rad", questioned: 0.05, refused: 0.5, small: [2e-5, 2e-6] };

/// The largest strain wave gears in catalogues bear momentary peaks of about 1e4 N·m.
const TORQUE: Limit = Limit { column: "torque_nm", unit: "N·m", questioned: 1.2e4, refused: 2e4, small: [0.0; 2] };

/// The quantities of a recording that no gear reaches.
pub fn doubtful(recordings: &[Recording]) -> Vec<DoubtfulUnit> {
    let of = |limit: Limit, column: &dyn Fn(&Recording) -> Option<&[f64]>| {
        let half = |recording: &Recording| {
            let (low, high) = range(column(recording)?);
            Some(0.5 * (high - low))
        };
        let size = recordings.iter().filter_map(half).fold(0.0, f64::max);
        let Limit { column, unit, questioned, refused, small } = limit;
        let grade = if size > refused || size < small[1] { Grade::Bad } else { Grade::Caution };
        let found = |limit| DoubtfulUnit { column, size, limit, unit, grade };
        (size > questioned)
            .then(|| found(questioned))
            .or_else(|| (0.0 < size && size < small[0]).then(|| found(small[0])))
    };
    let mut found: Vec<DoubtfulUnit> = of(DEFLECTION, &|r| r.deflection_rad.as_deref()).into_iter().collect();
    if recordings.iter().all(|recording| recording.torque_unit == TorqueUnit::NewtonMetre) {
        found.extend(of(TORQUE, &|r| r.torque.as_deref()));
    }
    found
}
