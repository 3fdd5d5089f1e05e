//! Fewer rows of long recordings: means of rows where everything moves slowly, stretches of all rows where a mean would hide motion.

use std::ops::Range;

use crate::recording::{Recording, Samples};
use crate::signal::plausible::{Remark, sd};

/// Within the rows of a mean a motion may change by this share of its standard deviation, rms.
const MOST_OF_DEVIATION: f64 = 0.05;

/// Within a mean the motor may turn by this angle, rms, rad: of an order of 4 a mean leaves sin(0.2)/0.2 = 0.993.
const MOST_OF_TURN_RAD: f64 = 0.1;

/// Stretches of a recording.
const STRETCHES: usize = 8;

/// The recordings with about `most` rows together, where they have more, and what is to be told of it. `ratio` is that of the gear.
pub fn reduced(recordings: &[Recording], ratio: Option<f64>, most: usize) -> (Vec<Recording>, Vec<Remark>) {
    let rows: usize = recordings.iter().map(Recording::len).sum();
    let each = rows.div_ceil(most.max(1)).max(1);
    let (mut reduced, mut remarks) = (Vec::new(), Vec::new());
    for recording in recordings {
        let mut recording = recording.clone();
        if each == 1 {
            reduced.push(recording);
            continue;
        }
        // Without a ratio it stays without a deflection, and what needs one is refused later.
        let _ = recording.derive_deflection(ratio);
        if moves_within(&recording, each) {
            let stretches = stretches(recording.len(), each);
            remarks.push(Remark::Stretches {
                file: recording.name.clone(),
                stretches: stretches.len(),
                rows: stretches.iter().map(ExactSizeIterator::len).sum(),
                of: recording.len(),
            });
            reduced.extend(stretches.into_iter().map(|stretch| recording.part_with_past(stretch)));
        } else {
            reduced.push(recording.in_means(each));
        }
    }
    (reduced, remarks)
}

/// Whether something moves too far within so many rows for their mean to stand for them.
fn moves_within(recording: &Recording, rows: usize) -> bool {
    let slow = [&recording.deflection_rad, &recording.theta_out_rad, &recording.torque_sim_nm];
    let moves = |motion: &Samples| motion_within(motion, rows) > MOST_OF_DEVIATION * sd(motion);
    let turns = |motor: &Samples| motion_within(motor, rows) > MOST_OF_TURN_RAD;
    slow.into_iter().flatten().any(moves) || recording.theta_in_rad.as_ref().is_some_and(turns)
}

/// By how much a signal changes within so many rows, rms.
fn motion_within(motion: &[f64], rows: usize) -> f64 {
    let ends = || motion.chunks_exact(rows).map(|chunk| chunk[rows - 1] - chunk[0]);
    (ends().map(|x| x * x).sum::<f64>() / ends().count().max(1) as f64).sqrt()
}

/// Stretches of together 1/`part` of so many rows, from the first row to the last.
fn stretches(rows: usize, part: usize) -> Vec<Range<usize>> {
    let length = rows / part / STRETCHES;
    let begin = |k| k * (rows - length) / (STRETCHES - 1);
    (0..STRETCHES).map(|k| begin(k)..begin(k) + length).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A motor that turns at a steady speed under a swinging load, 1 kHz.
    fn turning(rad_per_s: f64, load_hz: f64) -> Recording {
        let time_s: Vec<f64> = (0..100_000).map(|k| f64::from(k) * 1e-3).collect();
        Recording {
            theta_in_rad: Some(time_s.iter().map(|t| rad_per_s * t).collect()),
            deflection_rad: Some(time_s.iter().map(|t| (std::f64::consts::TAU * load_hz * t).sin()).collect()),
            time_s: time_s.into(),
            ..Recording::default()
        }
    }

    #[test]
    fn slow_motion_is_read_in_means_fast_motion_in_stretches_of_all_rows() {
        let (means, remarks) = reduced(&[turning(1.0, 0.1)], None, 10_000);
        assert_eq!((means.len(), means[0].len(), remarks.len()), (1, 10_000, 0));
        let (stretches, remarks) = reduced(&[turning(100.0, 1.0)], None, 10_000);
        assert_eq!((stretches.len(), stretches[0].len(), remarks.len()), (8, 1250, 1));
        assert_eq!(stretches[7].time_s.last(), Some(&99.999));
        assert_eq!(reduced(&[turning(100.0, 1.0)], None, 100_000).0, [turning(100.0, 1.0)]);
    }
}
