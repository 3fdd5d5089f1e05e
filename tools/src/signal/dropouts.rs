//! Dropouts of angle sensors: few rows at which an angle jumps away and back, where the gear cannot have been.
//!
//! A lost word on an encoder's line is one wrong row. To a gear with memory it is a reversal, or two, and every later row hangs on it, so that leaving out its torque is not enough.

use std::fmt;

use crate::numerics::robust;
use crate::recording::Recording;

/// What was bridged in a channel. A deflection that the torque follows is a motion, and is kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Bridged {
    /// The recording.
    pub recording: String,
    /// The channel, as the column is named.
    pub channel: &'static str,
    /// Rows.
    pub rows: usize,
    /// Time of the first, s.
    pub first_s: f64,
}

impl fmt::Display for Bridged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { recording, channel, rows, first_s } = self;
        write!(
            f,
            "{recording}: {channel} has dropouts of at most {LONGEST} rows, {rows} rows in all, the first at {first_s:.4} s: interpolated linearly; check the encoder's line"
        )
    }
}

/// Rows that a dropout lasts at most.
const LONGEST: usize = 3;

/// Both edges of a dropout are as large as so many usual steps from row to row.
const EDGE: f64 = 12.0;

/// And the way from the row before to the row after is no more than this share of them.
const BACK: f64 = 0.25;

/// A torque that follows by as much as this share of what the range of torque and angle suggests makes it a motion.
const FOLLOWS: f64 = 0.25;

/// More of the rows than this are no dropouts, but what the sensor is like.
const MOST: f64 = 0.02;

impl Recording {
    /// Bridges dropouts of the angle channels by straight lines, and says where.
    pub fn bridge_dropouts(&mut self) -> Vec<Bridged> {
        let torque = self.torque.as_deref();
        let channels = [
            ("deflection_rad", &mut self.deflection_rad, torque),
            ("theta_in_rad", &mut self.theta_in_rad, None),
            ("theta_out_rad", &mut self.theta_out_rad, None),
        ];
        let mut bridged = Vec::new();
        for (channel, angle, torque) in channels {
            let Some(angle) = angle else { continue };
            let found = dropouts(angle, torque);
            let rows: usize = found.iter().map(|(_, count)| count).sum();
            if rows == 0 || rows as f64 > MOST * angle.len() as f64 {
                continue;
            }
            for (first, count) in &found {
                let (before, after) = (angle[first - 1], angle[first + count]);
                for k in 0..*count {
                    angle[first + k] = before + (after - before) * (k + 1) as f64 / (count + 1) as f64;
                }
            }
            let first_s = self.time_s[found[0].0];
            bridged.push(Bridged { recording: self.name.clone(), channel, rows, first_s });
        }
        bridged
    }
}

/// First row and length of each dropout.
fn dropouts(angle: &[f64], torque: Option<&[f64]>) -> Vec<(usize, usize)> {
    let mut steps: Vec<f64> =
        angle.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0).collect();
    if steps.len() < 8 {
        return Vec::new();
    }
    let median = robust::median(&mut steps);
    let stiffness = torque.map(|torque| spread(torque) / spread(angle));
    let is_one = |first: usize, count: usize| {
        let (before, after) = (angle[first - 1], angle[first + count]);
        let inside = &angle[first..first + count];
        let (down, up) = (inside[0] - before, inside[count - 1] - after);
        let edge = down.abs().min(up.abs());
        let away = inside.iter().map(|x| (x - before) * down.signum()).fold(f64::INFINITY, f64::min);
        let leaves =
            down * up > 0.0 && edge > EDGE * median && away > 0.5 * edge && (after - before).abs() < BACK * edge;
        let follows = torque.zip(stiffness).is_some_and(|(torque, stiffness)| {
            let between = 0.5 * (torque[first - 1] + torque[first + count]);
            let most = torque[first..first + count]
                .iter()
                .map(|t| (t - between) * down.signum())
                .fold(f64::NEG_INFINITY, f64::max);
            most > FOLLOWS * stiffness * edge
        });
        leaves && !follows
    };
    let mut found = Vec::new();
    let mut row = 1;
    while row + 1 < angle.len() {
        let longest = LONGEST.min(angle.len() - 1 - row);
        match (1..=longest).find(|count| is_one(row, *count)) {
            Some(count) => {
                found.push((row, count));
                row += count + 1;
            }
            None => row += 1,
        }
    }
    found
}

/// Between the twentieths at both ends.
fn spread(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize];
    (at(0.95) - at(0.05)).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Samples;

    fn moving(angle: Vec<f64>, torque: Option<Vec<f64>>) -> Recording {
        let time_s = (0..angle.len()).map(|k| 0.01 * k as f64).collect();
        Recording {
            time_s,
            torque: torque.map(Samples::from),
            deflection_rad: Some(angle.into()),
            ..Recording::default()
        }
    }

    fn sine(rows: usize) -> Vec<f64> {
        (0..rows).map(|k| (0.02 * k as f64).sin()).collect()
    }

    #[test]
    fn lost_words_are_bridged() {
        let clean = sine(2000);
        let mut angle = clean.clone();
        for (row, count, value) in [(100, 1, 0.0), (533, 3, 5.0), (900, 2, -1.5)] {
            angle[row..row + count].fill(value);
        }
        let mut recording = moving(angle, Some(clean.iter().map(|x| 20.0 * x).collect()));
        let bridged = recording.bridge_dropouts();
        assert!(
            matches!(bridged[..], [Bridged { channel: "deflection_rad", rows: 6, first_s: 1.0, .. }]),
            "{bridged:?}"
        );
        let off = recording.deflection_rad.iter().flatten().zip(&clean).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-3);
    }

    #[test]
    fn motions_are_kept() {
        let rows = 2000;
        let triangle = (0..rows).map(|k| f64::from((k % 80 - 40_i32).abs())).collect();
        let counted = sine(2000).iter().map(|x| (50.0 * x).round()).collect();
        let stairs = (0..rows).map(|k| f64::from(k / 200 % 2)).collect();
        // A tap at a joint that stands still, which the torque follows.
        let mut tap: Vec<f64> = (0..rows).map(|k| 1e-6 * f64::from(k % 7)).collect();
        tap[1000..1003].copy_from_slice(&[0.6, 1.0, 0.6]);
        let torque: Vec<f64> = tap.iter().map(|x| 20.0 * x).collect();
        for (angle, torque) in [(triangle, None), (counted, None), (stairs, None), (tap, Some(torque))] {
            let mut recording = moving(angle, torque);
            assert_eq!(recording.bridge_dropouts(), []);
        }
    }
}
