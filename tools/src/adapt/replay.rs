//! One recording, row by row: predicted by what is in force, then learnt from.

use gmhm::adapt::{Adaptation, AdaptationState, Change, Settings};
use gmhm::memory::masing::Masing;
use gmhm::{Gear, State};
use serde::Serialize;

use super::{AdaptReplayError, coefficients, units, with_params};
use crate::model::Model;
use crate::numerics::robust;
use crate::progress::{Progress, at_row};
use crate::recording::{Recording, TorqueUnit};
use crate::signal::recorded::predict_under;

/// Points of the trace at most.
const MOST_POINTS: usize = 1000;

/// Errors one step ahead, rms over all rows, in the recording's unit of torque.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rms {
    /// Of the model file.
    pub block: f64,
    /// Of what was in force.
    pub adapted: f64,
}

/// The estimate at a time: SI units, bounds not applied.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TracePoint {
    /// When, s of the recording.
    pub time_s: f64,
    /// c1, N·m/rad.
    pub c1: f64,
    /// c2, N·m/rad³.
    pub c2: f64,
    /// c3, N·m/rad⁵.
    pub c3: f64,
    /// e, N·m/rad.
    pub e: f64,
    /// h, N·m/rad.
    pub h: f64,
    /// Standard deviations of the five.
    pub sd: [f64; 5],
    /// Offset of the torque signal, N·m: nothing in force uses it.
    pub torque_offset: f64,
    /// Its standard deviation, N·m.
    pub torque_offset_sd: f64,
    /// Errors since the point before, rms.
    #[serde(skip)]
    pub rms: Rms,
}

impl TracePoint {
    /// The five coefficients.
    pub fn coefficients(&self) -> [f64; 5] {
        [self.c1, self.c2, self.c3, self.e, self.h]
    }
}

/// What came of a replay.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Replay {
    /// Errors one step ahead.
    pub rms: Rms,
    /// When adapted parameters were taken over, s of the recording.
    pub taken_over_s: Vec<f64>,
    /// When the block's were put back.
    pub given_back_s: Vec<f64>,
    /// The estimate over time.
    pub trace: Vec<TracePoint>,
    /// What was latched, by name.
    pub warnings: Vec<&'static str>,
    /// Stretches of motion that were fit to be learnt from.
    pub stretches: u32,
    /// Coefficients of the model file, SI units.
    #[serde(skip)]
    pub block: [f64; 5],
    /// The unit of torque.
    #[serde(skip)]
    pub unit: TorqueUnit,
    /// The model with the parameters in force at the end.
    #[serde(skip)]
    pub model: Model,
}

/// Sums of squares of both errors.
#[derive(Debug, Clone, Copy, Default)]
struct Squares {
    rows: usize,
    block: f64,
    adapted: f64,
}

impl Squares {
    fn add(&mut self, block: f64, adapted: f64) {
        self.rows += 1;
        self.block += block * block;
        self.adapted += adapted * adapted;
    }

    fn rms(&self) -> Rms {
        let rms = |sum: f64| (sum / self.rows.max(1) as f64).sqrt();
        Rms { block: rms(self.block), adapted: rms(self.adapted) }
    }
}

/// The adaptation of one joint as a drive has it.
struct Joint {
    block: gmhm::Params,
    /// What is in force, SI units.
    params: gmhm::Params,
    adaptation: Adaptation<f32>,
    adapted: AdaptationState<f32>,
    of_block: Gear<f32, Masing<f32>>,
    in_force: Gear<f32, Masing<f32>>,
    path: State<f32, 16, Masing<f32>>,
}

impl Joint {
    fn new(block: gmhm::Params, period_s: f64, start_rad: f64) -> Result<Self, AdaptReplayError> {
        let adaptation = Adaptation::new(&block, &Settings { period_s, ..Settings::default() })?;
        let gear = Gear::with_law(&block, Masing::new(&block));
        let (adapted, path) = (adaptation.start(), gear.start(start_rad as f32));
        Ok(Self { block, params: block, adaptation, adapted, of_block: gear, in_force: gear, path })
    }

    /// Torques of the block and of what is in force at the next deflection.
    fn predict(&mut self, deflection_rad: f64) -> [f64; 2] {
        let block = self.of_block.step(&mut self.path, deflection_rad as f32);
        // The path is the same for all coefficients.
        [block.torque, self.in_force.output(&self.path).torque].map(f64::from)
    }

    /// Learns from a torque, and changes what is in force.
    fn learn(&mut self, torque: f64) -> Change {
        let change = self.adaptation.period(&mut self.adapted, &self.path, torque as f32);
        let params = match change {
            Change::None => return change,
            // As a drive does whose store refuses a block.
            Change::TakenOver => self.adaptation.params(&self.adapted, &self.block).ok(),
            Change::GivenBack => Some(self.block),
        };
        let Some(params) = params else {
            self.adapted.give_back();
            return Change::None;
        };
        self.params = params;
        self.in_force = Gear::with_law(&params, Masing::new(&params));
        change
    }

    fn point(&self, time_s: f64, rms: Rms) -> TracePoint {
        let scale = self.block.torque_scale_nm();
        let units = units(self.block.rated_deflection_rad(), scale);
        let base = coefficients(&self.block.elastic(), &self.block.memory());
        let (change, variances) = (self.adapted.estimate(), self.adapted.variances());
        let [c1, c2, c3, e, h] = std::array::from_fn(|k| base[k] + units[k] * f64::from(change[k]));
        let sd = std::array::from_fn(|k| units[k] * f64::from(variances[k]).sqrt());
        let [offset, variance] = self.adapted.offset().map(f64::from);
        let (torque_offset, torque_offset_sd) = (scale * offset, scale * variance.sqrt());
        TracePoint { time_s, c1, c2, c3, e, h, sd, torque_offset, torque_offset_sd, rms }
    }
}

/// The middle one of the steps of time.
fn period_s(time_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    robust::median(&mut steps)
}

/// Replays a recording. Terms of the model are taken off the torque; each row is predicted before it is learnt from. The rated deflection is the one asked for, else the model's.
///
/// # Errors
/// [`AdaptReplayError`].
pub fn replay(
    model: &Model,
    asked_rad: Option<f64>,
    recording: &Recording,
    progress: &dyn Progress,
) -> Result<Replay, AdaptReplayError> {
    let rated = asked_rad.or(model.gear.rated_deflection_rad).ok_or(AdaptReplayError::NoRatedDeflection)?;
    let block = model.drive_params(rated).ok_or(AdaptReplayError::NoGear)??;
    let file = || recording.name.clone();
    let torque = recording.torque.as_ref().ok_or_else(|| AdaptReplayError::NoTorque { file: file() })?;
    if recording.len() < 2 {
        return Err(AdaptReplayError::TooShort { file: file(), rows: recording.len() });
    }
    let mut derived = recording.clone();
    if derived.deflection_rad.is_none() {
        derived.derive_deflection(model.gear.ratio)?;
    }
    let zero_rad = model.gear.deflection_zero_rad;
    let deflection: Vec<f64> = derived.deflection()?.iter().map(|theta| theta - zero_rad).collect();
    let of_terms = terms(model, asked_rad, recording, progress)?;
    let time_s = &recording.time_s;
    let mut joint = Joint::new(block, period_s(time_s), deflection[0])?;
    let (mut all, mut since) = (Squares::default(), Squares::default());
    let (mut taken_over_s, mut given_back_s, mut trace) = (Vec::new(), Vec::new(), Vec::new());
    let every = recording.len().div_ceil(MOST_POINTS);
    for (row, (torque, time_s)) in torque.iter().zip(time_s).enumerate() {
        at_row(progress, "Adapting", row, recording.len());
        let torque = torque - of_terms.get(row).copied().unwrap_or(0.0);
        let [by_block, by_adapted] = joint.predict(deflection[row]);
        for squares in [&mut all, &mut since] {
            squares.add(torque - by_block, torque - by_adapted);
        }
        match joint.learn(torque) {
            Change::None => {}
            Change::TakenOver => taken_over_s.push(*time_s),
            Change::GivenBack => given_back_s.push(*time_s),
        }
        if (row + 1) % every == 0 || row + 1 == recording.len() {
            trace.push(joint.point(*time_s, since.rms()));
            since = Squares::default();
        }
    }
    Ok(Replay {
        rms: all.rms(),
        taken_over_s,
        given_back_s,
        trace,
        warnings: joint.adapted.warnings().iter().map(|warning| warning.name()).collect(),
        stretches: joint.adapted.stretches(),
        block: coefficients(&block.elastic(), &block.memory()),
        unit: recording.torque_unit,
        model: with_params(model, &joint.params),
    })
}

/// What the terms of a model add to the torque, row by row; empty without any.
fn terms(
    model: &Model,
    asked_rad: Option<f64>,
    recording: &Recording,
    progress: &dyn Progress,
) -> Result<Vec<f64>, AdaptReplayError> {
    if model.terms.is_empty() {
        return Ok(Vec::new());
    }
    let prediction = predict_under(model, asked_rad, recording, progress)?;
    let base = prediction.elastic.iter().zip(&prediction.hysteresis).map(|(elastic, hysteresis)| elastic + hysteresis);
    Ok(prediction.torque.iter().zip(base).map(|(torque, base)| torque - base).collect())
}
