//! The recordings under diagnosis, row after row in one line, and the torque that a model has to explain.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use gmhm::Law;

use crate::kinds;
use crate::model::{Model, Term};
use crate::numerics::extremes;
use crate::numerics::mark::Mark;
use crate::physics::{Evaluation, Parts, PredictError, Signals, UnitColumn};
use crate::recording::{Recording, TorqueUnit};
use crate::regression::error::EstimateError;
use crate::regression::parameters::{self, FreeParameter};
use crate::regression::rows;
use crate::signal::acceleration::acceleration;
use crate::signal::denoise::{denoised, uncounted};

/// Recordings of one gear or joint, their rows in one line.
#[derive(Clone)]
pub struct Dataset<'a> {
    /// The recordings, their angles freed of noise.
    pub recordings: Vec<Cow<'a, Recording>>,
    /// The acceleration of each, of the motion as it was recorded.
    accelerations: Vec<Option<Vec<f64>>>,
    /// What terms add to each, as far as it was asked for.
    parts: Arc<Vec<Parts>>,
    /// So many rows of a recording are looked at as one, their mean; the gear follows all of them.
    pub stride: usize,
    /// The rows of each that are looked at.
    pub spans: Vec<Range<usize>>,
    /// What each row is used for, recording by recording.
    pub marks: Vec<Vec<Mark>>,
    /// The torque to be explained, N·m or A.
    pub target: Vec<f64>,
    /// What each recording adds that is no property of the gear: its offset, what the gear remembers from before the first row. Recording by recording, as many
    /// lines for each, 0 in the rows of the others.
    pub nuisances: Vec<Vec<f64>>,
    /// Smoothings of the friction of a base model, each of a term by its number, and their highest values, rad/s.
    highest_smoothings: Vec<(usize, f64)>,
    /// So many first terms are the base model of a joint without a simulation, whose friction and inertia resist.
    resisting_terms: usize,
    /// The largest velocity, rad/s; infinite where none is recorded or asked for.
    pub fastest_rad_per_s: f64,
}

impl<'a> Dataset<'a> {
    /// The recordings of a gear or a joint.
    ///
    /// # Errors
    /// Recordings without a torque or with too few rows, or a model that cannot be evaluated on them.
    pub fn new(recordings: &'a [Recording], model: &Model) -> Result<Self, EstimateError> {
        let mut spans = Vec::with_capacity(recordings.len());
        let mut target = Vec::new();
        for recording in recordings {
            let torque = recording
                .torque
                .as_deref()
                .ok_or_else(|| EstimateError::NoTorque { recording: recording.name.clone() })?;
            if recording.len() < FEWEST_ROWS {
                return Err(EstimateError::TooFewRows {
                    recording: recording.name.clone(),
                    rows: recording.len(),
                    needed: FEWEST_ROWS,
                });
            }
            if recording.torque_unit != recordings[0].torque_unit {
                return Err(EstimateError::MixedUnits {
                    first: recordings[0].name.clone(),
                    other: recording.name.clone(),
                });
            }
            spans.push(target.len()..target.len() + torque.len());
            target.extend_from_slice(torque);
        }
        let simulated = recordings.iter().filter(|r| r.torque_sim_nm.is_some()).count();
        if simulated != 0 && simulated != recordings.len() {
            return Err(EstimateError::SomeSimulated);
        }
        let marks = recordings.iter().map(|r| rows::gaps(&r.time_s)).collect();
        let accelerations = recordings.iter().map(|r| acceleration(r, &uncounted(r), model)).collect();
        let recordings: Vec<Cow<'a, Recording>> = recordings.iter().map(|r| denoised(r, model.gear.ratio)).collect();
        let nuisances = nuisances(&recordings, &spans, model)?;
        let parts = Arc::new(recordings.iter().map(|_| Parts::default()).collect());
        Ok(Self {
            recordings,
            accelerations,
            parts,
            stride: 1,
            spans,
            marks,
            target,
            nuisances,
            highest_smoothings: Vec::new(),
            resisting_terms: 0,
            fastest_rad_per_s: f64::INFINITY,
        })
    }

    /// The same with bounds of a base model: an upper one of the smoothing of each friction, [`LARGEST_BASE_SMOOTHING`](kinds::LARGEST_BASE_SMOOTHING) of the
    /// largest velocity, or what the model gives where that is more; and 0 as the lower one of friction and inertia of a joint without a simulation.
    #[must_use]
    pub fn with_base(mut self, model: &Model) -> Self {
        let velocities = self.recordings.iter().filter_map(|r| Signals::new(r, model).velocity_rad_per_s);
        let fastest = velocities.map(|v| extremes::largest(&v)).fold(0.0, f64::max);
        let given = model.terms.iter().enumerate().filter(|(_, term)| term.values.contains_key(kinds::SMOOTHING));
        let highest = |(at, term): (usize, &Term)| (at, kinds::highest_base_smoothing(term, fastest));
        self.highest_smoothings = given.map(highest).collect();
        if fastest > 0.0 {
            self.fastest_rad_per_s = fastest;
        }
        if !model.is_simulation() {
            self.resisting_terms = model.terms.len();
        }
        self
    }

    /// Whether a fitted number is friction or inertia of the base model of a joint, and held at its lowest value, 0.
    pub fn is_held(&self, model: &Model, parameter: FreeParameter) -> bool {
        self.resists(model, parameter) && parameters::value(model, parameter) == 0.0
    }

    /// Whether a number is linear friction or inertia of the base model of a joint.
    fn resists(&self, model: &Model, parameter: FreeParameter) -> bool {
        parameter.is_linear_of_first(self.resisting_terms) && parameters::resists(model, parameter)
    }

    /// The lowest step of a free number of a model, not above 0: to its lowest value.
    pub fn room(&self, model: &Model, parameter: FreeParameter) -> f64 {
        let lowest = if self.resists(model, parameter) {
            -parameters::value(model, parameter).max(0.0)
        } else {
            f64::NEG_INFINITY
        };
        parameters::room(model, parameter).max(lowest)
    }

    /// The highest value of a free number, beside the bounds of its kind.
    pub fn highest(&self, parameter: FreeParameter) -> f64 {
        let FreeParameter::Term { term, key, .. } = parameter else { return f64::INFINITY };
        let own = self.highest_smoothings.iter().find(|(at, _)| *at == term && key.name == kinds::SMOOTHING);
        own.map_or(f64::INFINITY, |(_, highest)| *highest)
    }

    /// The same recordings, looked at in means of `stride` rows. `residual` is what a first fit left; it bridges outliers, lest they spoil a mean.
    #[must_use]
    pub fn thinned(&self, stride: usize, residual: &[f64]) -> Self {
        let bridged = self.bridged(residual);
        let target: Vec<f64> =
            self.target.iter().zip(residual.iter().zip(&bridged)).map(|(t, (was, is))| t - was + is).collect();
        let thin = |line: &[f64]| -> Vec<f64> {
            self.spans.iter().flat_map(|span| means(&line[span.clone()], stride)).collect()
        };
        let mut end = 0;
        let spans = self.spans.iter().map(|span| {
            let from = end;
            end += span.len().div_ceil(stride);
            from..end
        });
        let spans = spans.collect();
        // The noise goes on through rows that are skipped: one that begins anew behind each gap fits slow structure with a level of its own.
        let whole = |part: &[Mark]| {
            let lost = part.iter().filter(|m| matches!(m, Mark::Skipped | Mark::Outlier)).count();
            match part {
                _ if 2 * lost > part.len() => Mark::Outlier,
                _ if part.contains(&Mark::First) => Mark::First,
                _ => Mark::Used,
            }
        };
        Self {
            recordings: self.recordings.clone(),
            accelerations: self.accelerations.clone(),
            parts: Arc::clone(&self.parts),
            stride: self.stride * stride,
            spans,
            marks: self.marks.iter().map(|marks| marks.chunks(stride).map(whole).collect()).collect(),
            target: thin(&target),
            nuisances: self.nuisances.iter().map(|n| thin(n)).collect(),
            highest_smoothings: self.highest_smoothings.clone(),
            resisting_terms: self.resisting_terms,
            fastest_rad_per_s: self.fastest_rad_per_s,
        }
    }

    /// The same rows with means of the recorded signals in place of the signals: a term costs less to evaluate, and differs by what it bends within a mean.
    #[must_use]
    pub fn with_mean_signals(&self) -> Self {
        let thin = |line: &Vec<f64>| means(line, self.stride).collect();
        Self {
            recordings: self.recordings.iter().map(|r| Cow::Owned(r.in_means(self.stride))).collect(),
            accelerations: self.accelerations.iter().map(|a| a.as_ref().map(thin)).collect(),
            parts: Arc::new(self.recordings.iter().map(|_| Parts::default()).collect()),
            stride: 1,
            spans: self.spans.clone(),
            marks: self.marks.clone(),
            target: self.target.clone(),
            nuisances: self.nuisances.clone(),
            highest_smoothings: self.highest_smoothings.clone(),
            resisting_terms: self.resisting_terms,
            fastest_rad_per_s: self.fastest_rad_per_s,
        }
    }

    /// A residual with its outliers replaced by a line between their neighbours.
    fn bridged(&self, residual: &[f64]) -> Vec<f64> {
        let mut bridged = residual.to_vec();
        for (span, marks) in self.spans.iter().zip(&self.marks) {
            let own = &mut bridged[span.clone()];
            let counts = |row: &usize| marks[*row].counts();
            let mut last: Option<usize> = None;
            for next in (0..own.len()).filter(counts) {
                let (from, start) = last.map_or((own[next], 0), |l| (own[l], l + 1));
                let to = own[next];
                let length = (next + 1 - start) as f64;
                (start..next).for_each(|row| own[row] = from + (to - from) * (row + 1 - start) as f64 / length);
                last = Some(next);
            }
            if let Some(last) = last {
                let value = own[last];
                own[last..].fill(value);
            }
        }
        bridged
    }

    /// What the torque is measured in.
    pub fn torque_unit(&self) -> TorqueUnit {
        self.recordings.first().map_or_else(TorqueUnit::default, |r| r.torque_unit)
    }

    /// Number of rows that are looked at.
    pub fn len(&self) -> usize {
        self.target.len()
    }

    /// No rows at all.
    pub fn is_empty(&self) -> bool {
        self.target.is_empty()
    }

    /// Rows that count.
    pub fn counted(&self) -> usize {
        self.marks.iter().flatten().filter(|mark| mark.counts()).count()
    }

    /// A model on every recording.
    ///
    /// # Errors
    /// As [`Evaluation::new`].
    pub fn evaluate(&self, model: &Model) -> Result<Vec<Evaluation<'_>>, PredictError> {
        (0..self.recordings.len()).map(|index| self.evaluate_one(model, index)).collect()
    }

    /// The torque of a model, all recordings in one line.
    ///
    /// # Errors
    /// As [`Evaluation::new`].
    pub fn total(&self, model: &Model) -> Result<Vec<f64>, PredictError> {
        let mut total = Vec::with_capacity(self.target.len());
        for index in 0..self.recordings.len() {
            total.extend(self.looked_at(self.evaluate_one(model, index)?.total()));
        }
        Ok(total)
    }

    pub(crate) fn evaluate_one(&self, model: &Model, index: usize) -> Result<Evaluation<'_>, PredictError> {
        let recording = &self.recordings[index];
        let mut signals = Signals::new(recording, model);
        signals.acceleration_rad_per_s2.clone_from(&self.accelerations[index]);
        Evaluation::along(model, None, recording, signals, Some(&self.parts[index]))
    }

    /// What a term would add to the torque of a model evaluated on every recording, in one line.
    ///
    /// # Errors
    /// As [`Evaluation::change`].
    pub fn change(&self, evaluations: &[Evaluation<'_>], term: &Term) -> Result<Vec<f64>, PredictError> {
        let mut line = Vec::with_capacity(self.target.len());
        for evaluation in evaluations {
            line.extend(self.looked_at(&evaluation.change(term)?));
        }
        Ok(line)
    }

    /// What a unit of each linear number of a term adds to the torque of a model evaluated on every recording, each in one line.
    ///
    /// # Errors
    /// As [`Evaluation::columns`].
    pub fn unit_columns(&self, evaluations: &[Evaluation<'_>], term: &Term) -> Result<Vec<UnitColumn>, PredictError> {
        let mut lines: Vec<UnitColumn> = Vec::new();
        for evaluation in evaluations {
            let columns = evaluation.columns(term)?;
            if lines.is_empty() {
                let empty = |c: &UnitColumn| UnitColumn { values: Vec::with_capacity(self.target.len()), ..*c };
                lines.extend(columns.iter().map(empty));
            }
            lines.iter_mut().zip(&columns).for_each(|(line, c)| line.values.extend(self.looked_at(&c.values)));
        }
        Ok(lines)
    }

    /// A signal of every recording in one line, if every recording tells it.
    pub fn signal<'e, 's>(
        &self,
        evaluations: &'e [Evaluation<'s>],
        of: impl Fn(&'e Signals<'s>) -> Option<&'e [f64]>,
    ) -> Option<Vec<f64>> {
        let mut line = Vec::with_capacity(self.target.len());
        for evaluation in evaluations {
            line.extend(self.looked_at(of(&evaluation.context().signals)?));
        }
        Some(line)
    }

    /// A line of a recording as it is looked at.
    pub fn looked_at<'v>(&self, values: &'v [f64]) -> impl Iterator<Item = f64> + use<'v> {
        means(values, self.stride)
    }

    /// Time in one line, s.
    pub fn time_s(&self) -> Vec<f64> {
        self.recordings.iter().flat_map(|r| self.looked_at(&r.time_s)).collect()
    }

    /// Largest less smallest torque of the rows that count.
    pub fn torque_span(&self) -> f64 {
        let own = (0..self.len()).filter(|row| self.counts(*row)).map(|row| self.target[row]);
        let (least, most) = own.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        (most - least).max(0.0)
    }

    /// What no term of the torque exceeds: the largest torque of the rows that count, recorded or simulated, or, where that is less, the span of the recorded one. A load that holds the torque on one side
    /// of 0 may be larger than what it spans; a simulated torque that is too large may be what a load and a wrong gain take away.
    pub fn most_of_a_term(&self) -> f64 {
        let own = (0..self.len()).filter(|row| self.counts(*row)).map(|row| self.target[row].abs());
        let simulated =
            self.recordings.iter().filter_map(|r| r.torque_sim_nm.as_ref()).flat_map(|torque| torque.iter());
        own.chain(simulated.map(|torque| torque.abs())).fold(self.torque_span(), f64::max)
    }

    /// The mean period of the first recording's rows as looked at, s.
    pub fn period_s(&self) -> f64 {
        let (time, rows) = (&self.recordings[0].time_s, self.spans[0].len());
        let lasts = time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first);
        (lasts / rows.saturating_sub(1).max(1) as f64).max(f64::MIN_POSITIVE)
    }

    /// Whether a row is one of those that a fit explains.
    pub fn counts(&self, row: usize) -> bool {
        let index = self.spans.partition_point(|span| span.end <= row);
        self.marks[index][row - self.spans[index].start].counts()
    }

    /// [`counts`](Self::counts) of every row.
    pub fn rows_that_count(&self) -> Vec<bool> {
        (0..self.len()).map(|row| self.counts(row)).collect()
    }
}

/// Means of so many values each.
fn means(values: &[f64], stride: usize) -> impl Iterator<Item = f64> {
    values.chunks(stride).map(|part| part.iter().sum::<f64>() / part.len() as f64)
}

/// Fewest rows of a recording.
const FEWEST_ROWS: usize = 64;

/// What each recording adds to the torque that is no property of the gear: a constant offset and, where the gear remembers its way, what it may still
/// remember from before the first row.
///
/// Of the elementary relays of which law `masing` is the continuum, those that switch beyond the deflections seen so far are as the unknown past has left
/// them. Their torque is a function of the highest and the lowest deflection so far that vanishes when either reaches its tip: a polynomial here.
fn nuisances(
    recordings: &[Cow<'_, Recording>],
    spans: &[Range<usize>],
    model: &Model,
) -> Result<Vec<Vec<f64>>, EstimateError> {
    let rows = spans.last().map_or(0, |s| s.end);
    let mut columns = Vec::new();
    for (recording, span) in recordings.iter().zip(spans) {
        let mut ones = vec![0.0; rows];
        ones[span.clone()].fill(1.0);
        columns.push(ones);
        let Some(past) = past(recording, model)? else { continue };
        columns.extend(past.into_iter().map(|own| {
            let mut line = vec![0.0; rows];
            line[span.clone()].copy_from_slice(&own);
            line
        }));
    }
    Ok(columns)
}

/// What a gear may remember from before the first row of a recording, where law `masing` remembers: the polynomials of which its torque is made.
pub(crate) fn past(recording: &Recording, model: &Model) -> Result<Option<Vec<Vec<f64>>>, PredictError> {
    let Some(room) = untouched(recording, model)? else { return Ok(None) };
    let power = |of: fn(f64, f64) -> f64| room.iter().map(|(above, below)| of(*above, *below)).collect();
    let powers: [fn(f64, f64) -> f64; 4] = [|a, b| a * b, |a, b| a * a * b, |a, b| a * b * b, |a, b| (a * b).powi(2)];
    Ok(Some(powers.into_iter().map(power).collect()))
}

/// Row by row the parts of the rated deflection that lie above the highest and below the lowest one so far, where law `masing` remembers.
pub(crate) fn untouched(recording: &Recording, model: &Model) -> Result<Option<Vec<(f64, f64)>>, PredictError> {
    let masing = model.memory.is_some_and(|m| m.law == Law::Masing);
    let Some(rated) = model.gear.rated_deflection_rad.filter(|_| masing) else { return Ok(None) };
    let evaluation = Evaluation::new(model, None, recording)?;
    let theta = evaluation.followed().deflection_rad.as_slice();
    let before = evaluation.followed().past.iter().map(|sample| sample.deflection);
    let (mut highest, mut lowest) = before.fold((theta[0], theta[0]), |(a, b), x| (a.max(x), b.min(x)));
    let room = theta.iter().map(|theta| {
        (highest, lowest) = (highest.max(*theta), lowest.min(*theta));
        ((1.0 - highest / rated).max(0.0), (1.0 + lowest / rated).max(0.0))
    });
    Ok(Some(room.collect()))
}
