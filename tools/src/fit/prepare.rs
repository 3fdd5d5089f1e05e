//! From recordings to rows: deflection, torque, scale, and what each row may be used for.

use std::borrow::Cow;

use crate::fit::start::{Start, decide_start};
use crate::fit::zeros;
use crate::fit::zeros::Zeros;
use crate::fit::{FitOptions, Method, select};
use crate::model::GearSection;
use crate::recording::{Recording, TorqueUnit};
use crate::regression::base::Structure;
use crate::regression::columns::{Mark, Past, Rows};
use crate::regression::error::EstimateError;
use crate::signal::counts::{Counts, DRAWN_ROWS};
use crate::signal::plausible;

/// Recordings ready to be fitted.
pub struct Prepared<'a> {
    /// Their rows, the deflection beside its zeros.
    pub rows: Vec<Rows<'a>>,
    /// The gear section of the model given, if any.
    pub gear: GearSection,
    /// A, rad.
    pub rated_deflection_rad: f64,
    /// Scale of the torque, N·m.
    pub torque_nm: f64,
    /// How each begins.
    pub start: Start,
    /// What was taken off the deflections beside the zero of the gear section.
    pub zeros: Zeros,
}

impl<'a> Prepared<'a> {
    /// The rows of recordings, their zeros found or `known`.
    ///
    /// # Errors
    /// As [`fit`](crate::fit::fit()).
    pub fn new(recordings: &'a [Recording], options: &FitOptions, known: Option<Zeros>) -> Result<Self, EstimateError> {
        let gear = options.start.as_ref().map_or_else(GearSection::default, |m| m.gear.clone());
        if let Some(term) = options.start.as_ref().and_then(|m| m.terms.first()) {
            return Err(EstimateError::HasTerms { kind: term.kind.clone() });
        }
        let mut rows = rows(recordings, &gear)?;
        let torque_nm = torque_size(&rows);
        if torque_nm <= 0.0 {
            return Err(EstimateError::NoTorqueChange);
        }
        rows.iter().try_for_each(believable)?;
        all_move(&rows)?;
        let given = options.rated_deflection_rad.or(gear.rated_deflection_rad);
        let zeros = match known {
            Some(zeros) => zeros,
            None => zeros::settle(
                &rows,
                &zeros::structures(options.start.as_ref().and_then(|model| model.memory.as_ref())),
                given,
            )?,
        };
        rows.iter_mut().zip(&zeros.rad).filter(|(_, zero)| **zero != 0.0).for_each(|(rows, zero)| rows.shift(*zero));
        let rated_deflection_rad = given.unwrap_or_else(|| zeros::largest(&rows, |_| 0.0));
        if zeros::apart(&zeros.rad).is_none() {
            reach_each_other(&rows)?;
        }
        for (rows, zero) in rows.iter().zip(&zeros.rad) {
            let zero_rad = gear.deflection_zero_rad + zero;
            plausible::within(&rows.recording.name, &rows.deflection_rad, rated_deflection_rad, zero_rad)?;
        }
        let start = decide_start(&mut rows, rated_deflection_rad)?;
        Ok(Self { rows, gear, rated_deflection_rad, torque_nm, start, zeros })
    }

    /// What to choose from: the model's structure if there is one, else all.
    pub fn structures(&self, options: &FitOptions) -> Vec<Structure> {
        match options.start.as_ref().and_then(|m| m.memory.as_ref()) {
            Some(memory) => vec![Structure::of(memory)],
            None if options.method == Method::Pso => vec![Structure::MASING],
            None => select::structures(self.rated_deflection_rad),
        }
    }
}

/// Fewest rows of a recording.
const FEWEST_ROWS: usize = 12;

/// The rows of each recording, its deflection relative to the gear's deflection zero.
pub fn rows<'a>(recordings: &'a [Recording], gear: &GearSection) -> Result<Vec<Rows<'a>>, EstimateError> {
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

/// The rows of joint logs, which have no deflection.
pub fn joint_rows(recordings: &[Recording]) -> Result<Vec<Rows<'_>>, EstimateError> {
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

/// All rows count; where time jumps, a new run of noise begins.
pub fn gaps(time_s: &[f64]) -> Vec<Mark> {
    let mut periods: Vec<f64> = time_s.windows(2).take(10_001).map(|w| w[1] - w[0]).collect();
    let middle = periods.len() / 2;
    let usual = if periods.is_empty() { 0.0 } else { *periods.select_nth_unstable_by(middle, f64::total_cmp).1 };
    let mut marks = vec![Mark::Used; time_s.len()];
    for (mark, pair) in marks.iter_mut().skip(1).zip(time_s.windows(2)) {
        if pair[1] - pair[0] > 4.0 * usual {
            *mark = Mark::First;
        }
    }
    marks
}

/// Lowest and highest deflection of all recordings, rad.
pub fn deflection_range(rows: &[Rows<'_>]) -> (f64, f64) {
    range(rows.iter().flat_map(|r| &*r.deflection_rad))
}

/// Lowest and highest value.
pub fn range<'v>(values: impl IntoIterator<Item = &'v f64>) -> (f64, f64) {
    values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)))
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

/// The rates 1/s between which a memory can be told from a spring and from an offset: a tenth of the recordings' length to ten a sample.
pub fn rates_per_s(rows: &[Rows<'_>]) -> (f64, f64) {
    let lengths = rows.iter().map(|r| r.recording.time_s[r.len() - 1] - r.recording.time_s[0]);
    let longest = lengths.fold(0.0, f64::max);
    let periods = rows.iter().map(|r| (r.recording.time_s[r.len() - 1] - r.recording.time_s[0]) / (r.len() - 1) as f64);
    (0.1 / longest, 10.0 / periods.fold(f64::INFINITY, f64::min))
}

/// What a deflection in rad and a torque in N·m or A may vary by: far more and far less than those of any gear, in whatever units they are taken.
const BELIEVABLE: std::ops::Range<f64> = 1e-15..1e15;

/// Refuses numbers whose powers and products are none.
pub fn believable(rows: &Rows<'_>) -> Result<(), EstimateError> {
    let unit = rows.recording.torque_unit;
    let channels: [(&'static str, &[f64], &'static str); 2] =
        [("deflection", &rows.deflection_rad, "rad"), (unit.quantity(), &rows.torque, unit.symbol())];
    for (what, values, unit) in channels {
        let (low, high) = range(values);
        let size = high - low;
        if size != 0.0 && !BELIEVABLE.contains(&size) {
            return Err(EstimateError::Absurd { recording: rows.recording.name.clone(), what, size, unit });
        }
    }
    Ok(())
}

/// Refuses recordings that tell nothing beside others.
pub fn all_move(rows: &[Rows<'_>]) -> Result<(), EstimateError> {
    for rows in rows.iter().filter(|_| rows.len() > 1) {
        let constant = |values: &[f64]| values.windows(2).all(|pair| pair[0] == pair[1]);
        let recording = || rows.recording.name.clone();
        if constant(&rows.torque) {
            return Err(EstimateError::Still { recording: recording(), what: rows.recording.torque_unit.quantity() });
        }
        if constant(&rows.deflection_rad) {
            return Err(EstimateError::Still { recording: recording(), what: "deflection" });
        }
    }
    Ok(())
}

/// Refuses recordings whose deflections lie too far from each other to be of one gear and one zero.
pub fn reach_each_other(rows: &[Rows<'_>]) -> Result<(), EstimateError> {
    let Some((first, others)) = rows.split_first() else { return Ok(()) };
    let (low, high) = range(&*first.deflection_rad);
    for other in others {
        let (left, right) = range(&*other.deflection_rad);
        let apart_rad = 0.5 * ((left + right) - (low + high)).abs();
        // Loads to one side and to the other meet at least at rest.
        if apart_rad > (high - low) + (right - left) {
            let (first, other) = (first.recording.name.clone(), other.recording.name.clone());
            return Err(EstimateError::OtherZero { first, other, apart_rad });
        }
    }
    Ok(())
}

/// The unit word of the torque column in file names.
pub fn unit_word(unit: TorqueUnit) -> &'static str {
    match unit {
        TorqueUnit::NewtonMetre => "nm",
        TorqueUnit::Ampere => "a",
    }
}

/// The first row at which law `masing` no longer depends on the unknown past but for a constant torque.
///
/// At a tip of the rated cycle the loop is closed whatever came before. Between the extremes of a smaller recording, once both were reached, every
/// branch starts at a turning point that was seen, so the past shifts the loop and no more, and the offset of the recording takes that up. `None`
/// if that never comes.
pub fn settled_row(deflection_rad: &[f64], rated_deflection_rad: f64) -> Option<usize> {
    let (lowest, highest) = range(deflection_rad);
    // Noise decides which cycle holds the very extreme; the first visit to its neighbourhood counts, at the furthest point of that visit.
    let margin = 0.02 * (highest - lowest);
    let furthest = |height: &dyn Fn(f64) -> f64, level: f64| {
        let arrival = deflection_rad.iter().position(|&theta| height(theta) >= level)?;
        let visit = deflection_rad[arrival..].iter().take_while(|&&theta| height(theta) >= level).enumerate();
        visit.max_by(|a, b| height(*a.1).total_cmp(&height(*b.1)).then(b.0.cmp(&a.0))).map(|(row, _)| arrival + row)
    };
    let tip = furthest(&f64::abs, 0.98 * rated_deflection_rad);
    let both = furthest(&|theta| -theta, -lowest - margin).zip(furthest(&|theta| theta, highest - margin));
    let both = both.map(|(low, high)| low.max(high));
    match (tip, both) {
        (Some(tip), Some(both)) => Some(tip.min(both)),
        (tip, both) => tip.or(both),
    }
}

/// How many rows of a recording of all.
fn share_of_beginning(rows: usize, total: usize, most_rows: usize) -> usize {
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
