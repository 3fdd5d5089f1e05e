//! Fewer rows of long recordings: means of rows where everything moves slowly, stretches of all rows where a mean would hide motion.

use std::borrow::Cow;
use std::ops::Range;

use crate::recording::{Recording, Samples};
use crate::signal::plausible::{Remark, sd};

/// Within the rows of a mean a motion may change by this share of its standard deviation, rms.
const MOST_OF_DEVIATION: f64 = 0.05;

/// Within a mean of slow motion position, velocity and load may change by this share.
const MOST_OF_SLOW_DEVIATION: f64 = 0.01;

/// Within a mean the motor may turn by this angle, rms, rad: of an order of 4 a mean leaves sin(0.2)/0.2 = 0.993.
const MOST_OF_TURN_RAD: f64 = 0.1;

/// On means of the signals the search evaluates a gear only if a wave of order 2 of the motor's turn loses less than this part of its amplitude, rms, in a mean: one that loses 0.026 seems to
/// change with the speed in a recording of ten million rows, and a kind that does not is not named.
const MOST_LOST_OF_WAVE: f64 = 0.02;

/// Rows that the search looks at: means where there are more. The final fit takes all.
const SEARCH_ROWS: usize = 10_000;

/// So many do where everything moves slowly.
const SEARCH_ROWS_OF_SLOW_MOTION: usize = 4_500;

/// The longest mean that the search takes of slow motion, s: a tone of 40 Hz keeps sin(0.63)/0.63 = 0.94 of its amplitude.
const LONGEST_MEAN_S: f64 = 0.005;

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
        if moves_within(&recording, each, MOST_OF_DEVIATION) {
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

/// How many rows the search looks at as one: as few as leave it [`SEARCH_ROWS`], or more where position, velocity and load hardly change within their mean. Not if the base is `far` from the
/// machine: all shapes are approximate there, and with fewer rows more of them get a name.
pub fn rows_of_mean(recordings: &[Cow<'_, Recording>], ratio: Option<f64>, far: bool) -> usize {
    let rows: usize = recordings.iter().map(|r| r.len()).sum();
    let least = rows.div_ceil(SEARCH_ROWS);
    if far {
        return least;
    }
    let slow = |each: &usize| recordings.iter().all(|r| moves_slowly(r, ratio, *each));
    (least + 1..=rows / SEARCH_ROWS_OF_SLOW_MOTION).rev().find(slow).unwrap_or(least)
}

/// Whether a mean of so many rows takes [`MOST_LOST_OF_WAVE`] of a wave over the motor's turn: of order n, with equal steps that sum up to φ, n² φ²/24 · (rows + 1)/(rows − 1).
pub fn loses_waves(recordings: &[Cow<'_, Recording>], rows: usize) -> bool {
    const ORDER: f64 = 2.0;
    let lost = |motor: &Samples| {
        let of_steps = (rows + 1) as f64 / (rows - 1) as f64;
        (ORDER * motion_within(motor, rows)).powi(2) / 24.0 * of_steps
    };
    rows > 1 && recordings.iter().filter_map(|r| r.theta_in_rad.as_ref()).any(|motor| lost(motor) > MOST_LOST_OF_WAVE)
}

/// Whether a mean of so many rows stands for them, for their velocities and for what repeats with the turns of the motor.
fn moves_slowly(recording: &Recording, ratio: Option<f64>, rows: usize) -> bool {
    let seconds = recording.time_s[recording.len() - 1] - recording.time_s[0];
    let mean_s = seconds * rows as f64 / recording.len() as f64;
    let motions = [&recording.deflection_rad, &recording.theta_out_rad, &recording.theta_in_rad];
    let steady = |motion: &Samples| {
        let turns: Vec<f64> = changes(motion, rows).collect();
        motion_within(&turns, 2) <= MOST_OF_SLOW_DEVIATION * motion_within(motion, rows)
    };
    let even = |velocity: &Samples| motion_within(velocity, rows) <= MOST_OF_SLOW_DEVIATION * sd(velocity);
    // The motor's turns by those of the output, where it is not recorded.
    let motor_slow =
        |output: &Samples| ratio.is_some_and(|ratio| ratio * motion_within(output, rows) <= MOST_OF_TURN_RAD);
    mean_s <= LONGEST_MEAN_S
        && !moves_within(recording, rows, MOST_OF_SLOW_DEVIATION)
        && motions.into_iter().flatten().all(steady)
        && recording.velocity_out_rad_per_s.as_ref().is_none_or(even)
        && (recording.theta_in_rad.is_some() || recording.theta_out_rad.as_ref().is_none_or(motor_slow))
}

/// Whether something moves too far within so many rows for their mean to stand for them: by more than a share of its standard deviation, or a motor by more than [`MOST_OF_TURN_RAD`].
fn moves_within(recording: &Recording, rows: usize, share: f64) -> bool {
    let slow = [&recording.deflection_rad, &recording.theta_out_rad, &recording.torque_sim_nm];
    let moves = |motion: &Samples| motion_within(motion, rows) > share * sd(motion);
    let turns = |motor: &Samples| motion_within(motor, rows) > MOST_OF_TURN_RAD;
    slow.into_iter().flatten().any(moves) || recording.theta_in_rad.as_ref().is_some_and(turns)
}

/// By how much a signal changes within so many rows, rms.
fn motion_within(motion: &[f64], rows: usize) -> f64 {
    (changes(motion, rows).map(|x| x * x).sum::<f64>() / changes(motion, rows).count().max(1) as f64).sqrt()
}

/// The change of a signal from the first to the last of so many rows, again and again.
fn changes(motion: &[f64], rows: usize) -> impl Iterator<Item = f64> {
    motion.chunks_exact(rows).map(move |chunk| chunk[rows - 1] - chunk[0])
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
    fn turning(rad_per_s: f64, load_hz: f64, rows: u32) -> Recording {
        let time_s: Vec<f64> = (0..rows).map(|k| f64::from(k) * 1e-3).collect();
        Recording {
            theta_in_rad: Some(time_s.iter().map(|t| rad_per_s * t).collect()),
            deflection_rad: Some(time_s.iter().map(|t| (std::f64::consts::TAU * load_hz * t).sin()).collect()),
            time_s: time_s.into(),
            ..Recording::default()
        }
    }

    #[test]
    fn slow_motion_is_read_in_means_fast_motion_in_stretches_of_all_rows() {
        let (means, remarks) = reduced(&[turning(1.0, 0.1, 100_000)], None, 10_000);
        assert_eq!((means.len(), means[0].len(), remarks.len()), (1, 10_000, 0));
        let (stretches, remarks) = reduced(&[turning(100.0, 1.0, 100_000)], None, 10_000);
        assert_eq!((stretches.len(), stretches[0].len(), remarks.len()), (8, 1250, 1));
        assert_eq!(stretches[7].time_s.last(), Some(&99.999));
        assert_eq!(reduced(&[turning(100.0, 1.0, 100_000)], None, 100_000).0, [turning(100.0, 1.0, 100_000)]);
    }

    #[test]
    fn the_search_takes_longer_means_of_slow_motion_only() {
        let rows = |recording: Recording| rows_of_mean(&[Cow::Owned(recording)], Some(100.0), false);
        assert_eq!(rows(turning(20.0, 0.2, 18_000)), 4);
        assert_eq!(rows(turning(20.0, 2.0, 18_000)), 2, "a load that swings fast");
        assert_eq!(rows(turning(50.0, 0.2, 18_000)), 2, "a motor that turns fast");
        assert_eq!(rows(turning(20.0, 0.2, 100_000)), 10, "long means already");
        let mut jerky = turning(20.0, 0.2, 18_000);
        jerky.theta_in_rad = Some(jerky.time_s.iter().map(|t| 20.0 * t + 2e-3 * (600.0 * t).sin()).collect());
        assert_eq!(rows(jerky), 2, "a motor whose velocity changes");
        let output = Recording {
            theta_out_rad: turning(0.2, 0.2, 18_000).theta_in_rad,
            deflection_rad: None,
            theta_in_rad: None,
            ..turning(0.0, 0.2, 18_000)
        };
        let (known, unknown) = (Some(100.0), None);
        assert_eq!([known, unknown].map(|ratio| rows_of_mean(&[Cow::Borrowed(&output)], ratio, false)), [4, 2]);
        assert_eq!(rows_of_mean(&[Cow::Borrowed(&output)], known, true), 2, "a base far from the machine");
    }

    #[test]
    fn a_mean_of_two_rows_loses_more_of_a_wave_than_one_of_many_rows_over_the_same_turn() {
        let recording = [Cow::Owned(turning(100.0, 0.2, 18_000))];
        // Steps of 0.1 rad: a mean of two rows has cos(0.1) of a wave of order 2, a mean of four sin(0.4)/(4 sin(0.1)).
        assert_eq!([2, 3, 4].map(|rows| loses_waves(&recording, rows)), [false, false, true]);
        let lost = [0.1_f64.cos(), (1.0 + 2.0 * 0.2_f64.cos()) / 3.0, 0.4_f64.sin() / (4.0 * 0.1_f64.sin())];
        assert_eq!(lost.map(|kept| 1.0 - kept > MOST_LOST_OF_WAVE), [false, false, true]);
    }
}
