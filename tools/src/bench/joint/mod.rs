//! Experiment `joint`: a flexible joint under a drive, with and without compensation of its gear.
//!
//! Motor and link inertia with the gear between; motor friction; a 2 kHz cascade (position P, velocity PI, current lag) on the motor's encoder with
//! noise, quantisation, a period of delay each way and feed-forward of torque. The core's feed-forward adds the deflection under the
//! reference torque to the motor's reference. It knows the gear only from a fit to a noisy bench recording of that very gear.
//!
//! Gears: the model's own, and eight of Maxwell slip that no GMHM parameters describe, fixed here before any of them was run. Two tasks: the link
//! *tracks* an angle under gravity and inertia, judged by the link's angle error; the held link *presses* with a torque that is set
//! through the motor's position alone, judged by the torque error. With compensation off the drive takes the gear for rigid.

mod compensator;
mod drive;
pub(super) mod gear;
mod plant;
mod report;
mod task;

pub use compensator::Compensation;
pub use report::{Errors, Identified, JointReport, Knows, Line};

use gmhm::{Memory, Params};
use rayon::prelude::*;

use super::error::BenchError;
use super::noise::Noise;
use super::options::{Experiment, Options};
use super::plan;
use super::sensors;
use super::stage::{Stream, gear_of, random};
use crate::device::Lockstep;
use crate::fit;
use crate::fit::FitOptions;
use crate::model::Model;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::regression::error::EstimateError;
use crate::report::plot::Drawing;
use compensator::Knowledge;
use drive::{Drive, PERIOD_S, Servo};
pub use gear::Plant;

use gear::JointGear;
use plant::{Joint, Masses};
use task::{DURATION_S, SETTLED_S, Task};

/// Physics steps a control period.
const STEPS: u32 = 10;
/// Their length, s.
const STEP_S: f64 = PERIOD_S / STEPS as f64;

/// Runs both tasks on gears under every compensation, with fitted parameters and with wrong ones.
///
/// # Errors
/// A model without a gear; a gear that cannot be fitted; `progress` cancels.
pub fn run(model: &Model, plants: &[Plant], seed: u64, progress: &dyn Progress) -> Result<JointReport, BenchError> {
    let bench = Bench::new(model, seed)?;
    let known: Vec<Knowledge> =
        plants.iter().map(|plant| identify(*plant, &bench.params, seed, progress)).collect::<Result<_, _>>()?;
    let identified = plants.iter().zip(&known).map(|(plant, known)| Identified {
        plant: *plant,
        left_nm: known.left_nm,
        left_rad: known.left_nm / known.spring_nm_per_rad,
    });
    let identified = identified.collect();
    let mut runs = Vec::new();
    for (plant, fitted) in plants.iter().zip(known) {
        for knows in Knows::ALL {
            for compensation in Compensation::ALL.into_iter().filter(|kind| knows.matters_to(*kind)) {
                runs.push((*plant, knows, compensation, fitted));
            }
        }
    }
    let done = std::sync::atomic::AtomicUsize::new(0);
    let line = |(plant, knows, compensation, fitted): &(Plant, Knows, Compensation, Knowledge)| {
        if progress.cancelled() {
            return Err(BenchError::Estimate(EstimateError::Cancelled));
        }
        let [elastic, memory] = knows.factors();
        let line = bench.line(*plant, *knows, *compensation, &fitted.scaled(elastic, memory)?);
        let done = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
        progress.report("joint", done as f64 / runs.len() as f64);
        line
    };
    Ok(JointReport { seed, identified, lines: runs.par_iter().map(line).collect::<Result<_, _>>()? })
}

/// The link's position error over time on one gear, by compensation with fitted parameters.
///
/// # Errors
/// As [`run`].
pub fn figure(model: &Model, plant: Plant, seed: u64) -> Result<Drawing, BenchError> {
    let bench = Bench::new(model, seed)?;
    let knowledge = identify(plant, &bench.params, seed, &())?;
    let mut traces = Vec::new();
    for compensation in Compensation::ALL {
        let joint = bench.joint(Task::Track, plant);
        let errors = bench.drive(Task::Track, joint, compensation, &knowledge, Servo::here(), |_, _, _| {})?;
        let time = |k: usize| SETTLED_S + k as f64 * PERIOD_S;
        traces.push((compensation, errors.iter().enumerate().map(|(k, error)| (time(k), 1e6 * error)).collect()));
    }
    Ok(report::figure(plant, &traces))
}

/// One run of the tracking task as perfect sensors on the joint record it.
pub(super) fn record(model: &Model, options: &Options, seed: u64) -> Result<Recording, BenchError> {
    Ok(recorded(model, options, seed, Servo::here())?.0)
}

/// The tracking task by a drive at the end of a line, held against the same servo on this host.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lockstepped {
    /// The link's rms position error once settled by the drive, rad.
    pub drive_rad: f64,
    /// That by this host, rad.
    pub host_rad: f64,
    /// Both runs agree in every bit of every row.
    pub equal: bool,
}

/// Runs the tracking task on this host and by a drive at the end of a line.
///
/// # Errors
/// As the experiment has them; the drive did not answer.
pub fn in_lockstep(
    model: &Model,
    options: &Options,
    seed: u64,
    drive: &mut Lockstep,
) -> Result<Lockstepped, BenchError> {
    let (here, host_rad) = recorded(model, options, seed, Servo::here())?;
    let (there, drive_rad) = recorded(model, options, seed, Servo::There(drive))?;
    Ok(Lockstepped { drive_rad, host_rad, equal: here == there })
}

/// A run and its rms error.
fn recorded(model: &Model, options: &Options, seed: u64, servo: Servo<'_>) -> Result<(Recording, f64), BenchError> {
    let ratio = model.gear.ratio.ok_or(BenchError::NoRatio(Experiment::Joint))?;
    let sample_rate_hz = options.sample_rate_hz.unwrap_or(500.0);
    let every = (1.0 / (PERIOD_S * sample_rate_hz)).round();
    if !(1.0..=1000.0).contains(&every) || (every * PERIOD_S * sample_rate_hz - 1.0).abs() > 1e-9 {
        let must = "2000 Hz, the drive's control rate, over a whole number";
        return Err(BenchError::Value { option: "--sample-rate", value: sample_rate_hz, must });
    }
    let plant = options.plant.unwrap_or_default();
    let compensation = options.compensation.unwrap_or(Compensation::Off);
    let bench = Bench::new(model, seed)?;
    let knowledge = identify(plant, &bench.params, seed, &())?;
    let (mut time, mut torque, mut input, mut output, mut velocity) = (vec![], vec![], vec![], vec![], vec![]);
    let mut deflection = vec![];
    let joint = bench.joint(Task::Track, plant);
    let errors = bench.drive(Task::Track, joint, compensation, &knowledge, servo, |period, t, joint| {
        if period % every as usize == 0 {
            time.push(t);
            torque.push(joint.torque_nm);
            input.push(joint.motor_rad * ratio);
            output.push(joint.link_rad - model.gear.deflection_zero_rad);
            deflection.push(joint.deflection_rad() + model.gear.deflection_zero_rad);
            velocity.push(joint.link_rad_per_s);
        }
    })?;
    let recording = Recording {
        torque: Some(torque.into()),
        deflection_rad: Some(deflection.into()),
        theta_in_rad: Some(input.into()),
        theta_out_rad: Some(output.into()),
        velocity_out_rad_per_s: Some(velocity.into()),
        time_s: time.into(),
        ..Recording::default()
    };
    Ok((recording, rms(&errors)))
}

fn rms(of: &[f64]) -> f64 {
    (of.iter().map(|x| x * x).sum::<f64>() / of.len() as f64).sqrt()
}

/// What all runs of a model have in common.
struct Bench {
    params: Params,
    masses: Masses,
    seed: u64,
}

impl Bench {
    fn new(model: &Model, seed: u64) -> Result<Self, BenchError> {
        let params = gear_of(model)?;
        Ok(Self { params, masses: Masses::of(&params), seed })
    }

    fn joint(&self, task: Task, plant: Plant) -> Joint {
        Joint::at_rest(self.masses, task.output(), JointGear::of(plant, &self.params, STEP_S))
    }

    fn line(
        &self,
        plant: Plant,
        knows: Knows,
        compensation: Compensation,
        knowledge: &Knowledge,
    ) -> Result<Line, BenchError> {
        // Without loop, what the drive knows of it would be one more error.
        let without = if compensation.knows_hysteresis() { knowledge.without_loop()? } else { *knowledge };
        let both = |task: Task| -> Result<[f64; 2], BenchError> {
            let joint = self.joint(task, plant);
            let middle = joint.clone().without_hysteresis(self.params.rated_deflection_rad());
            let errors = self.drive(task, joint, compensation, knowledge, Servo::here(), |_, _, _| {})?;
            let calm = self.drive(task, middle, compensation, &without, Servo::here(), |_, _, _| {})?;
            let difference: Vec<f64> = errors.iter().zip(calm).map(|(a, b)| a - b).collect();
            Ok([rms(&errors), rms(&difference)])
        };
        let (track, press) = (both(Task::Track)?, both(Task::Press)?);
        let [all, by_hysteresis] = [0, 1].map(|k| Errors { position_rad: track[k], torque_nm: press[k] });
        Ok(Line { plant, knows, compensation, all, by_hysteresis })
    }

    /// Runs a task from rest and returns its error in every control period once settled. `watch` sees the joint at the start of every period.
    fn drive(
        &self,
        task: Task,
        mut joint: Joint,
        compensation: Compensation,
        knowledge: &Knowledge,
        servo: Servo<'_>,
        mut watch: impl FnMut(usize, f64, &Joint),
    ) -> Result<Vec<f64>, BenchError> {
        let rated_nm = self.params.rated_torque_nm();
        let noise = random(self.seed, Stream::Joint);
        let mut drive = Drive::new(&self.masses, rated_nm, compensation, knowledge, noise, servo)?;
        let mut errors = Vec::new();
        for period in 0..(DURATION_S / PERIOD_S) as usize {
            let t = period as f64 * PERIOD_S;
            let reference = task.reference(&self.masses, rated_nm, t);
            watch(period, t, &joint);
            if t >= SETTLED_S {
                errors.push(match task {
                    Task::Track => joint.link_rad - reference.angle_rad,
                    Task::Press => joint.torque_nm - reference.torque_nm,
                });
            }
            let asked_nm = drive.control(&reference, &self.masses, joint.motor_rad, joint.link_rad)?;
            for _ in 0..STEPS {
                let motor_nm = drive.torque_nm(asked_nm, STEP_S);
                joint.step(motor_nm, STEP_S);
            }
        }
        Ok(errors)
    }
}

/// Fits law `masing`, and a linear spring, to a noisy bench recording of the gear.
fn identify(plant: Plant, params: &Params, seed: u64, progress: &dyn Progress) -> Result<Knowledge, BenchError> {
    let mut recording = bench_recording(plant, params, seed);
    recording.name = format!("bench recording of the gear {}", plant.name());
    let start = Model {
        gear: crate::model::GearSection {
            rated_deflection_rad: Some(params.rated_deflection_rad()),
            ..Default::default()
        },
        elastic: Some(params.elastic()),
        memory: Some(Memory { alpha: 1.0, beta_per_s: 1.0, omega_per_s: 1.0, ..Memory::default() }),
        ..Model::default()
    };
    let torque = recording.torque.as_deref().unwrap_or_default();
    let theta = recording.deflection_rad.as_deref().unwrap_or_default();
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let spring_nm_per_rad = product(torque, theta) / product(theta, theta);
    let options = FitOptions { seed, start: Some(start), ..FitOptions::default() };
    let fit = fit::fit(&[recording], &options, progress)?;
    let params = fit.model.drive_params(params.rated_deflection_rad()).ok_or(BenchError::NoGear)??;
    Ok(Knowledge { params, spring_nm_per_rad, left_nm: fit.rms })
}

/// Locked input, several amplitudes, sensors of a good bench.
fn bench_recording(plant: Plant, params: &Params, seed: u64) -> Recording {
    let noise = Noise::typical(params.rated_torque_nm());
    let (time_s, theta) = plan::nested_cycles(params.rated_deflection_rad());
    let mut gear = JointGear::of(plant, params, time_s[1] - time_s[0]);
    let mut torque: Vec<f64> = theta.iter().map(|theta| gear.step(*theta)).collect();
    let mut deflection_rad = theta;
    sensors::torque(&noise, &mut torque, &mut random(seed, Stream::Identification));
    sensors::encoder(&noise, &mut deflection_rad);
    Recording {
        time_s: time_s.into(),
        torque: Some(torque.into()),
        deflection_rad: Some(deflection_rad.into()),
        ..Recording::default()
    }
}
