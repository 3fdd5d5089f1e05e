//! Angles of single-turn encoders: they start again after each turn.

use std::f64::consts::TAU;

use super::Recording;
use super::error::{RecordingError, RecordingProblem};
use crate::numerics::extremes::range;

/// A step of at least such a share of a turn may be the end of one.
const JUMP: f64 = 0.8;
/// Beside a whole turn such a step differs by at most so many times the steps next to it, and such a share of a turn.
const LIKE_ITS_NEIGHBOURS: (f64, f64) = (2.0, 1e-3);
/// An angle that starts again stays within a turn, and this share of one.
const WITHIN: f64 = 1.001;

/// Refuses angles that start again after each turn where their course counts: as the deflection of a gear, or as the velocity of a joint.
///
/// # Errors
/// [`RecordingProblem::StartsAgain`].
pub fn check(recording: &Recording) -> Result<(), RecordingError> {
    let joint = recording.theta_in_rad.is_none() || recording.theta_out_rad.is_none();
    if recording.deflection_rad.is_some() || joint && recording.velocity_out_rad_per_s.is_some() {
        return Ok(());
    }
    let angles = [("theta_in_rad", &recording.theta_in_rad), ("theta_out_rad", &recording.theta_out_rad)];
    for (column, angle) in angles {
        let rows = angle.as_deref().map(jumps).unwrap_or_default();
        if let Some(first) = rows.first() {
            let first_s = recording.time_s.get(*first).copied().unwrap_or_default();
            let problem = RecordingProblem::StartsAgain { column, jumps: rows.len(), first_s };
            return Err(RecordingError::of_file(&recording.name, problem));
        }
    }
    Ok(())
}

/// Rows at which an angle starts a turn again.
fn jumps(angle: &[f64]) -> Vec<usize> {
    let (low, high) = range(angle);
    if high - low > WITHIN * TAU || high - low < JUMP * TAU {
        return Vec::new();
    }
    let step = |row: usize| angle.get(row).zip(angle.get(row.wrapping_sub(1))).map(|(to, from)| to - from);
    let starts_again = |row: &usize| {
        let Some(jump) = step(*row).filter(|jump| jump.abs() >= JUMP * TAU) else { return false };
        let next_to_it = [row.wrapping_sub(1), row + 1].into_iter().filter_map(step);
        let largest =
            next_to_it.filter(|step| step.abs() < JUMP * TAU).fold(0.0, |most: f64, step| most.max(step.abs()));
        (jump.abs() - TAU).abs() <= LIKE_ITS_NEIGHBOURS.0 * largest + LIKE_ITS_NEIGHBOURS.1 * TAU
    };
    (1..angle.len()).filter(starts_again).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn angle(rows: i32, a_row: f64) -> Vec<f64> {
        (0..rows).map(|row| a_row * f64::from(row)).collect()
    }

    fn wrapped(angle: &[f64]) -> Vec<f64> {
        angle.iter().map(|x| x.rem_euclid(TAU)).collect()
    }

    #[test]
    fn ends_of_turns_are_found_at_any_speed_forth_and_back() {
        let slow = angle(1000, 0.02);
        assert!(jumps(&slow).is_empty());
        assert_eq!(jumps(&wrapped(&slow)), [315, 629, 943]);
        assert_eq!(jumps(&wrapped(&angle(100, -1.0))).len(), 16);
        let about_zero: Vec<f64> = wrapped(&slow).iter().map(|x| x - TAU / 2.0).collect();
        assert_eq!(jumps(&about_zero).len(), 3);
    }

    #[test]
    fn dropouts_and_fast_shafts_are_no_ends_of_turns() {
        let mut dropout: Vec<f64> = angle(1000, 0.006);
        dropout[950] = 0.0;
        dropout[951] = 0.0;
        assert!(jumps(&dropout).is_empty());
        assert!(jumps(&angle(1000, 6.0)).is_empty());
    }
}
