//! What the recordings exercise: how far, how fast, how often turned. A model is good where it was exercised.

use crate::recording::{Recording, Samples};

/// What a set of recordings exercises of a gear.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Coverage {
    /// Rated deflection A, rad.
    pub rated_deflection_rad: f64,
    /// Lowest and highest deflection seen, about the gear's zero, rad.
    pub deflection_rad: (f64, f64),
    /// Median and 95th percentile of abs(θ̇) while it moves, rad/s.
    pub rate_rad_per_s: (f64, f64),
    /// Strokes between reversals, those shorter than a fiftieth of the range not counted.
    pub strokes: usize,
    /// Of these, how many ended well inside the extremes: minor loops or other amplitudes.
    pub inner_reversals: usize,
    /// Rows in every cell of deflection (first to last column: −A to A) and rate (first to last row: −95th to 95th percentile).
    #[serde(skip)]
    pub cells: Vec<Vec<usize>>,
}

/// Cells across the deflection and along the rate.
const CELLS: (usize, usize) = (40, 21);

impl Coverage {
    /// What recordings with a deflection exercise; those without add nothing.
    pub fn of(recordings: &[Recording], zero_rad: f64, rated_deflection_rad: f64) -> Self {
        let moving = |r: &Recording| r.deflection_rad.as_ref().map(|theta| (r.time_s.clone(), theta.clone()));
        let paths: Vec<(Samples, Samples)> = recordings.iter().filter_map(moving).collect();
        let all = || paths.iter().flat_map(|(_, theta)| theta.iter().map(|x| x - zero_rad));
        let (low, high) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
        let rates = || paths.iter().flat_map(|(time, theta)| rates(time, theta));
        let mut sizes: Vec<f64> = rates().map(f64::abs).filter(|v| *v > 0.0).collect();
        let rate_rad_per_s = (quantile(&mut sizes, 0.5), quantile(&mut sizes, 0.95));
        let (mut strokes, mut inner_reversals) = (0, 0);
        for (_, theta) in &paths {
            let turns = turning_points(theta, 0.02 * (high - low));
            strokes += turns.len() + usize::from(theta.len() > 1 && high > low);
            let inside =
                |x: &f64| *x - zero_rad > low + 0.1 * (high - low) && *x - zero_rad < high - 0.1 * (high - low);
            inner_reversals += turns.iter().filter(|x| inside(x)).count();
        }
        let shown = || {
            paths.iter().flat_map(|(time, theta)| {
                theta.iter().map(|x| x - zero_rad).zip(crate::fit::coverage::rates(time, theta))
            })
        };
        let cells = cells(shown(), (-rated_deflection_rad, rated_deflection_rad), rate_rad_per_s.1);
        Self { rated_deflection_rad, deflection_rad: (low, high), rate_rad_per_s, strokes, inner_reversals, cells }
    }

    /// The part of ±A that was reached on both sides, 0 to 1 and beyond.
    pub fn reach(&self) -> f64 {
        let (low, high) = self.deflection_rad;
        high.min(-low).max(0.0) / self.rated_deflection_rad
    }
}

/// What joint logs exercise.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct JointCoverage {
    /// Lowest and highest output angle, rad.
    pub angle_rad: (f64, f64),
    /// Fastest movement each way, rad/s: negative or 0, positive or 0.
    pub velocity_rad_per_s: (f64, f64),
    /// Rows in every cell of angle (first to last column: lowest to highest) and velocity (first to last row: − to + the fastest).
    #[serde(skip)]
    pub cells: Vec<Vec<usize>>,
}

impl JointCoverage {
    /// What joint logs with an output angle exercise; those without add nothing.
    pub fn of(recordings: &[Recording]) -> Self {
        let moving = |r: &Recording| {
            let angle = r.theta_out_rad.clone()?;
            let velocity = r.velocity_out_rad_per_s.clone().unwrap_or_else(|| rates(&r.time_s, &angle).collect());
            Some(angle.into_iter().zip(velocity))
        };
        let rows: Vec<(f64, f64)> = recordings.iter().filter_map(moving).flatten().collect();
        let range =
            |values: &mut dyn Iterator<Item = f64>| values.fold((0.0_f64, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
        let first = rows.first().map_or(0.0, |row| row.0);
        let (low, high) = range(&mut rows.iter().map(|row| row.0 - first));
        let angle_rad = (first + low, first + high);
        let velocity_rad_per_s = range(&mut rows.iter().map(|row| row.1));
        let fastest = velocity_rad_per_s.1.max(-velocity_rad_per_s.0);
        Self { angle_rad, velocity_rad_per_s, cells: cells(rows.iter().copied(), angle_rad, fastest) }
    }
}

/// Rows in cells of a coordinate in its range, and of a rate up to a limit either way; what lies beyond counts in the outermost.
fn cells(rows: impl Iterator<Item = (f64, f64)>, (low, high): (f64, f64), fastest: f64) -> Vec<Vec<usize>> {
    let place = |share: f64, count: usize| {
        let share = if share.is_finite() { share } else { 0.5 };
        ((share * count as f64).floor().max(0.0) as usize).min(count - 1)
    };
    let mut cells = vec![vec![0; CELLS.0]; CELLS.1];
    for (x, rate) in rows {
        let (column, row) = ((x - low) / (high - low), 0.5 * (rate / fastest + 1.0));
        cells[place(row, CELLS.1)][place(column, CELLS.0)] += 1;
    }
    cells
}

/// Change of the deflection a second, between each row and the one after it; the last repeats.
fn rates<'r>(time_s: &'r [f64], deflection_rad: &'r [f64]) -> impl Iterator<Item = f64> + 'r {
    let last = deflection_rad.len().saturating_sub(2);
    (0..deflection_rad.len()).filter(move |_| deflection_rad.len() > 1).map(move |row| {
        let row = row.min(last);
        (deflection_rad[row + 1] - deflection_rad[row]) / (time_s[row + 1] - time_s[row])
    })
}

/// The deflections at which a path turned by more than `play`.
fn turning_points(deflection_rad: &[f64], play: f64) -> Vec<f64> {
    let mut turns = Vec::new();
    let Some(&first) = deflection_rad.first() else { return turns };
    let (mut extreme, mut direction) = (first, 0.0_f64);
    for &x in deflection_rad {
        if direction == 0.0 {
            if (x - first).abs() > play {
                (direction, extreme) = ((x - first).signum(), x);
            }
        } else if (x - extreme) * direction > 0.0 {
            extreme = x;
        } else if (extreme - x) * direction > play {
            turns.push(extreme);
            (direction, extreme) = (-direction, x);
        }
    }
    turns
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let at = ((values.len() - 1) as f64 * share).round() as usize;
    *values.select_nth_unstable_by(at, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_reach_and_rates_are_those_of_the_motion() {
        // Two cycles to 1 mrad at 1 rad/s of phase, then a minor loop between 0 and 0.4 mrad.
        let theta: Vec<f64> = (0..4000).map(|k| 1e-3 * (k as f64 * std::f64::consts::TAU / 2000.0).sin()).collect();
        let minor = (0..2000).map(|k| 0.2e-3 - 0.2e-3 * (k as f64 * std::f64::consts::TAU / 2000.0).cos());
        let theta: Vec<f64> = theta.into_iter().chain(minor).collect();
        let time_s: Vec<f64> = (0..theta.len()).map(|k| k as f64 * 1e-2).collect();
        let recording = Recording { time_s: time_s.into(), deflection_rad: Some(theta.into()), ..Recording::default() };
        let coverage = Coverage::of(&[recording], 0.0, 1.25e-3);
        assert!((coverage.reach() - 0.8).abs() < 1e-3, "{}", coverage.reach());
        // Turns: 1, −1, 1, −1 mrad, then 0.4 mrad.
        assert_eq!((coverage.strokes, coverage.inner_reversals), (6, 1));
        let fastest = 1e-3 * std::f64::consts::TAU / 20.0;
        assert!(coverage.rate_rad_per_s.1 < fastest && coverage.rate_rad_per_s.1 > 0.9 * fastest);
        assert_eq!(coverage.cells.iter().flatten().sum::<usize>(), 6000);
        let beyond = |row: &Vec<usize>| row[..3].iter().chain(&row[37..]).sum::<usize>();
        assert_eq!(coverage.cells.iter().map(beyond).sum::<usize>(), 0, "nothing beyond 1 mrad");
    }

    #[test]
    fn a_joint_that_moves_one_way_shows_in_one_half() {
        let time_s: Vec<f64> = (0..1000).map(|k| k as f64 * 1e-2).collect();
        let angle = time_s.iter().map(|t| 2.0 + 0.1 * t).collect();
        let recording = Recording { time_s: time_s.into(), theta_out_rad: Some(angle), ..Recording::default() };
        let coverage = JointCoverage::of(&[recording]);
        assert!((coverage.angle_rad.0 - 2.0).abs() < 1e-9 && (coverage.angle_rad.1 - 2.999).abs() < 1e-9);
        assert!(coverage.velocity_rad_per_s.0 == 0.0 && (coverage.velocity_rad_per_s.1 - 0.1).abs() < 1e-9);
        assert_eq!(coverage.cells[CELLS.1 - 1].iter().sum::<usize>(), 1000);
    }

    #[test]
    fn nothing_is_no_coverage() {
        let coverage = Coverage::of(&[], 0.0, 1e-3);
        assert_eq!((coverage.reach(), coverage.strokes), (0.0, 0));
    }
}
