//! Recordings as the estimator reads them.

use std::borrow::Cow;

use crate::model::GearSection;
use crate::numerics::extremes::range;
use crate::numerics::mark::Mark;
use crate::numerics::robust;
use crate::recording::Recording;
use crate::regression::error::EstimateError;
use crate::signal::counts::Counts;
use crate::signal::counts::DRAWN_ROWS;

/// Fewest rows of a recording.
pub const FEWEST_ROWS: usize = 12;

/// A recording as the estimator reads it.
#[derive(Debug, Clone)]
pub struct Rows<'a> {
    /// All its columns.
    pub recording: &'a Recording,
    /// Deflection as recorded, or the motion behind its counts, rad.
    pub deflection_rad: Cow<'a, [f64]>,
    /// Torque to be explained, N·m or A.
    pub torque: Cow<'a, [f64]>,
    /// What each row is used for.
    pub marks: Vec<Mark>,
    /// Where the gear came from before the first row; law `masing`.
    pub past: Past,
    /// What was recorded, where the deflection is the motion behind counts.
    pub counts: Option<Counts>,
}

/// What a gear did before its recording began, as law `masing` remembers it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Past {
    /// Nothing: y = 0, as a prediction starts.
    #[default]
    Rest,
    /// It came up from the lower tip of the rated cycle.
    Rising,
    /// It came down from the upper tip of the rated cycle.
    Falling,
}

impl Rows<'_> {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.marks.len()
    }

    /// True without rows.
    pub fn is_empty(&self) -> bool {
        self.marks.is_empty()
    }

    /// Takes a zero off the deflection.
    pub fn shift(&mut self, by_rad: f64) {
        self.deflection_rad.to_mut().iter_mut().for_each(|theta| *theta -= by_rad);
    }

    /// Time since the row before, s; 0 for the first.
    pub fn period_s(&self, row: usize) -> f64 {
        let time = &self.recording.time_s;
        if row == 0 { 0.0 } else { time[row] - time[row - 1] }
    }
}

/// All rows count; where time jumps, a new run of noise begins.
pub fn gaps(time_s: &[f64]) -> Vec<Mark> {
    let mut periods: Vec<f64> = time_s.windows(2).take(10_001).map(|w| w[1] - w[0]).collect();
    let median = robust::median(&mut periods);
    let mut marks = vec![Mark::Used; time_s.len()];
    for (mark, pair) in marks.iter_mut().skip(1).zip(time_s.windows(2)) {
        if pair[1] - pair[0] > 4.0 * median {
            *mark = Mark::First;
        }
    }
    marks
}

/// Lowest and highest deflection of all recordings, rad.
pub fn deflection_range(rows: &[Rows<'_>]) -> (f64, f64) {
    range(rows.iter().flat_map(|r| &*r.deflection_rad))
}

/// Largest torque beside its mean, N·m; 0 where only rounding is left.
pub fn torque_size(rows: &[Rows<'_>]) -> f64 {
    let count: usize = rows.iter().map(Rows::len).sum();
    let mean = rows.iter().flat_map(|r| r.torque.iter()).sum::<f64>() / count.max(1) as f64;
    let size = rows.iter().flat_map(|r| r.torque.iter()).fold(0.0, |size: f64, t| size.max((t - mean).abs()));
    if size > 1e-12 * mean.abs() { size } else { 0.0 }
}

/// Squares of the rows that are but rounding, N²·m².
pub fn rounding(rows: &[Rows<'_>]) -> f64 {
    let count: usize = rows.iter().map(Rows::len).sum();
    count as f64 * (1e-9 * torque_size(rows)).powi(2)
}

/// The rates 1/s between which a memory differs from a spring and from an offset: a tenth of the recordings' length to ten a sample.
pub fn rates_per_s(rows: &[Rows<'_>]) -> (f64, f64) {
    let lengths = rows.iter().map(|r| r.recording.time_s[r.len() - 1] - r.recording.time_s[0]);
    let longest = lengths.fold(0.0, f64::max);
    let periods = rows.iter().map(|r| (r.recording.time_s[r.len() - 1] - r.recording.time_s[0]) / (r.len() - 1) as f64);
    (0.1 / longest, 10.0 / periods.fold(f64::INFINITY, f64::min))
}

/// How many rows of a recording of all.
pub fn share_of_beginning(rows: usize, total: usize, most_rows: usize) -> usize {
    let share = (most_rows as f64 / total.max(1) as f64).min(1.0);
    ((rows as f64 * share) as usize).clamp(FEWEST_ROWS.min(rows), rows)
}

/// The first rows of each recording, at most so many together.
pub fn beginning<'a>(rows: &'a [Rows<'a>], most_rows: usize) -> Vec<Rows<'a>> {
    let total: usize = rows.iter().map(Rows::len).sum();
    rows.iter()
        .map(|r| {
            let count = share_of_beginning(r.len(), total, most_rows);
            Rows {
                recording: r.recording,
                deflection_rad: Cow::Borrowed(&r.deflection_rad[..count]),
                torque: Cow::Borrowed(&r.torque[..count]),
                marks: r.marks[..count].to_vec(),
                past: r.past,
                counts: r.counts.clone(),
            }
        })
        .collect()
}

/// Rows of recordings spread over the whole of each, with the time and name of the recordings they are of.
///
/// Of long recordings these are rows at equal distances, and between them the extremes of the deflection, where a memory turns.
pub struct Spread {
    /// The rows kept of each recording; `None` where all are.
    kept: Vec<Option<(Vec<usize>, Recording)>>,
}

/// An extreme between two rows that are kept is kept where it lies beyond both by this share of the range of the deflection.
const EXTREME: f64 = 0.002;

impl Spread {
    /// About so many rows of all recordings together.
    pub fn over(rows: &[Rows<'_>], about_rows: usize) -> Self {
        let total: usize = rows.iter().map(Rows::len).sum();
        let kept = |r: &Rows<'_>| {
            let stride = r.len().div_ceil(share_of_beginning(r.len(), total, about_rows).max(1));
            (stride > 1).then(|| {
                let kept = spread_rows(&r.deflection_rad, r.len(), stride);
                let recording = Recording {
                    name: r.recording.name.clone(),
                    torque_unit: r.recording.torque_unit,
                    time_s: kept.iter().map(|&row| r.recording.time_s[row]).collect(),
                    ..Recording::default()
                };
                (kept, recording)
            })
        };
        Self { kept: rows.iter().map(kept).collect() }
    }

    /// These rows. Each stands for those up to the next that is kept.
    pub fn of<'a>(&'a self, rows: &'a [Rows<'a>]) -> Vec<Rows<'a>> {
        let spread = |(r, kept): (&'a Rows<'a>, &'a Option<(Vec<usize>, Recording)>)| match kept {
            None => Rows {
                recording: r.recording,
                deflection_rad: Cow::Borrowed(&r.deflection_rad),
                torque: Cow::Borrowed(&r.torque),
                marks: r.marks.clone(),
                past: r.past,
                counts: None,
            },
            Some((kept, recording)) => {
                let pick = |values: &[f64]| kept.iter().map(|&row| values[row]).collect::<Vec<f64>>();
                Rows {
                    recording,
                    deflection_rad: Cow::Owned(pick(&r.deflection_rad)),
                    torque: Cow::Owned(pick(&r.torque)),
                    marks: kept.iter().map(|&row| r.marks[row]).collect(),
                    past: r.past,
                    counts: None,
                }
            }
        };
        rows.iter().zip(&self.kept).map(spread).collect()
    }
}

/// Recordings with about so many rows together, spread over the whole of each; all rows where there are no more, or no deflection.
pub fn spread_over<'a>(recordings: &'a [Recording], about_rows: usize) -> Vec<Cow<'a, Recording>> {
    let total: usize = recordings.iter().map(Recording::len).sum();
    let spread = |recording: &'a Recording| {
        let stride = recording.len().div_ceil(share_of_beginning(recording.len(), total, about_rows).max(1));
        match &recording.deflection_rad {
            Some(deflection_rad) if stride > 1 => {
                Cow::Owned(recording.picked(&spread_rows(deflection_rad, recording.len(), stride)))
            }
            _ => Cow::Borrowed(recording),
        }
    };
    recordings.iter().map(spread).collect()
}

/// Every `stride`-th row, and the extremes between them.
fn spread_rows(deflection_rad: &[f64], rows: usize, stride: usize) -> Vec<usize> {
    let (low, high) = range(deflection_rad);
    let beyond = EXTREME * (high - low);
    let mut kept = Vec::new();
    for from in (0..rows).step_by(stride) {
        kept.push(from);
        let to = (from + stride).min(rows - 1);
        let ends = [deflection_rad[from], deflection_rad[to]];
        let inner = from + 1..to;
        let extreme = |sign: f64| {
            let row =
                inner.clone().max_by(|&a, &b| (sign * deflection_rad[a]).total_cmp(&(sign * deflection_rad[b])))?;
            let edge = ends.iter().fold(f64::NEG_INFINITY, |edge: f64, end| edge.max(sign * end));
            (sign * deflection_rad[row] > edge + beyond).then_some(row)
        };
        let mut extremes: Vec<usize> = [extreme(1.0), extreme(-1.0)].into_iter().flatten().collect();
        extremes.sort_unstable();
        kept.extend(extremes);
    }
    kept
}

/// The rows of each recording, its deflection relative to the gear's deflection zero.
pub fn of_recordings<'a>(recordings: &'a [Recording], gear: &GearSection) -> Result<Vec<Rows<'a>>, EstimateError> {
    let total: usize = recordings.iter().map(Recording::len).sum();
    let mut rows = with_deflection(recordings, |recording| {
        let drawn = share_of_beginning(recording.len(), total, DRAWN_ROWS);
        let recorded = deflection(recording, gear)?;
        let (low, high) = range(&*recorded);
        // Where the torque is steepest and the motion slowest, near the tips, a count weighs most, and many rows share it.
        Ok(match Counts::found(recorded, &recording.time_s, FINEST * (high - low), drawn) {
            Ok((motion, counts)) => (Cow::Owned(motion), Some(counts)),
            Err(recorded) => (recorded, None),
        })
    })?;
    if gear.deflection_zero_rad != 0.0 {
        rows.iter_mut().for_each(|rows| rows.shift(gear.deflection_zero_rad));
    }
    Ok(rows)
}

/// Counts below this share of the range are as good as none. Those of an encoder of 26 bits, 4e-5 of the published gear's range, still take 2 % off e.
const FINEST: f64 = 1e-6;

/// The rows of recordings whose model sees to the deflection, or has none.
pub fn without_deflection(recordings: &[Recording]) -> Result<Vec<Rows<'_>>, EstimateError> {
    with_deflection(recordings, |_| Ok((Cow::Borrowed(&[]), None)))
}

fn with_deflection<'a>(
    recordings: &'a [Recording],
    deflection: impl Fn(&'a Recording) -> Result<(Cow<'a, [f64]>, Option<Counts>), EstimateError>,
) -> Result<Vec<Rows<'a>>, EstimateError> {
    let first = recordings.first().ok_or(EstimateError::NoRecording)?;
    recordings
        .iter()
        .map(|recording| {
            let name = || recording.name.clone();
            if recording.torque_unit != first.torque_unit {
                return Err(EstimateError::MixedUnits { first: first.name.clone(), other: name() });
            }
            if recording.len() < FEWEST_ROWS {
                return Err(EstimateError::TooFewRows {
                    recording: name(),
                    rows: recording.len(),
                    needed: FEWEST_ROWS,
                });
            }
            let torque = recording.torque.as_deref().ok_or_else(|| EstimateError::NoTorque { recording: name() })?;
            let (deflection_rad, counts) = deflection(recording)?;
            Ok(Rows {
                recording,
                deflection_rad,
                torque: Cow::Borrowed(torque),
                marks: gaps(&recording.time_s),
                past: Past::Rest,
                counts,
            })
        })
        .collect()
}

fn deflection<'a>(recording: &'a Recording, gear: &GearSection) -> Result<Cow<'a, [f64]>, EstimateError> {
    if let Some(deflection) = &recording.deflection_rad {
        return Ok(Cow::Borrowed(deflection));
    }
    let name = || recording.name.clone();
    match (&recording.theta_in_rad, &recording.theta_out_rad) {
        (Some(input), Some(output)) => {
            let ratio = gear.ratio.ok_or_else(|| EstimateError::NoRatio { recording: name() })?;
            Ok(Cow::Owned(input.iter().zip(output).map(|(q_m, q_o)| q_m / ratio - q_o).collect()))
        }
        _ if recording.is_joint_log() => Err(EstimateError::JointLog { recording: name() }),
        _ => Err(EstimateError::NoDeflection { recording: name() }),
    }
}
