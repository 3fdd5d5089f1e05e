//! Experiment `joint`: a flexible joint under a drive, with and without compensation of its gear.
//!
//! Motor and link inertia with the gear between; motor friction; a 2 kHz cascade (position P, velocity PI, current lag) on the motor's encoder with
//! quantisation, a period of delay each way and feed-forward of velocity and torque. The compensation adds the deflection under the reference
//! torque to the motor's reference. It knows the gear only from a fit to a noisy bench recording of that very gear.
//!
//! Two gears: the model's own, and a Maxwell-slip gear that no GMHM parameters describe. Two tasks: the link *tracks* an angle under gravity and
//! inertia, judged by the link's angle error; the held link *presses* with a torque that is set through the motor's position alone, judged by the
//! torque error. With compensation off the drive takes the gear for rigid.

mod compensator;
mod drive;
mod gear;
mod plant;
mod report;
mod task;

pub use compensator::Compensation;
pub use report::{JointReport, Line};

use clap::ValueEnum;
use gmhm::{Memory, Params};

use super::noise::Noise;
use super::plan;
use super::{BenchError, Experiment, Options, Stream, random, sensors};
use crate::estimate::{self, FitOptions};
use crate::model::Model;
use crate::recording::Recording;
use compensator::{Compensator, Knowledge};
use drive::{Cascade, Command, Measured, PERIOD_S};
use gear::JointGear;
use plant::{Joint, Masses};
use task::{DURATION_S, SETTLED_S, Task};

/// Which gear sits in the joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Plant {
    /// The model's own
    #[default]
    Model,
    /// A Maxwell-slip gear with the model's elastic torque and about as wide a loop
    MaxwellSlip,
}

impl Plant {
    /// Its name on the command line and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Model => "model",
            Self::MaxwellSlip => "maxwell-slip",
        }
    }

    fn gear(self, params: &Params, period_s: f64) -> JointGear {
        match self {
            Self::Model => JointGear::model(params, period_s),
            Self::MaxwellSlip => JointGear::maxwell_slip(params),
        }
    }
}

/// Share of the motor's friction that the drive knows and feeds forward.
const KNOWN_FRICTION: f64 = 0.8;

/// Physics steps a control period.
const STEPS: u32 = 10;
/// Their length, s.
const STEP_S: f64 = PERIOD_S / STEPS as f64;

/// Runs both tasks on both gears under every compensation, with fitted parameters and with all of them 10 % off.
///
/// # Errors
/// A model without a gear; a gear that cannot be fitted.
pub fn run(model: &Model, seed: u64) -> Result<JointReport, BenchError> {
    let params = super::gear_of(model)?;
    let masses = Masses::of(&params);
    let mut lines = Vec::new();
    for plant in [Plant::Model, Plant::MaxwellSlip] {
        let fitted = identify(plant, &params, seed)?;
        for (parameters, knowledge) in [
            ("fitted", fitted),
            ("memory 10 % off", fitted.scaled(1.0, 1.1)?),
            ("all 10 % off", fitted.scaled(1.1, 1.1)?),
        ] {
            for compensation in Compensation::ALL {
                let error = |task| run_task(task, plant, &params, &masses, compensation, knowledge, |_, _, _| {});
                lines.push(Line {
                    plant,
                    parameters,
                    compensation,
                    position_error_rad: error(Task::Track)?.angle_rad,
                    torque_error_nm: error(Task::Press)?.torque_nm,
                });
            }
        }
    }
    Ok(JointReport { seed, lines })
}

/// One run of the tracking task as perfect sensors on the joint record it.
pub(super) fn record(model: &Model, params: &Params, options: &Options, seed: u64) -> Result<Recording, BenchError> {
    let ratio = model.gear.ratio.ok_or(BenchError::NoRatio { experiment: Experiment::Joint })?;
    let sample_rate_hz = options.sample_rate_hz.unwrap_or(500.0);
    let every = (1.0 / (PERIOD_S * sample_rate_hz)).round();
    if !(1.0..=1000.0).contains(&every) || (every * PERIOD_S * sample_rate_hz - 1.0).abs() > 1e-9 {
        let must = "2000 Hz, the drive's control rate, over a whole number";
        return Err(BenchError::Value { option: "--sample-rate", value: sample_rate_hz, must });
    }
    let plant = options.plant.unwrap_or_default();
    let compensation = options.compensation.unwrap_or(Compensation::Off);
    let masses = Masses::of(params);
    let knowledge = identify(plant, params, seed)?;
    let (mut time, mut torque, mut input, mut output, mut velocity) = (vec![], vec![], vec![], vec![], vec![]);
    let mut deflection = vec![];
    run_task(Task::Track, plant, params, &masses, compensation, knowledge, |period, t, joint| {
        if period % every as usize == 0 {
            time.push(t);
            torque.push(joint.torque_nm);
            input.push(joint.motor_rad * ratio);
            output.push(joint.link_rad - model.gear.deflection_zero_rad);
            deflection.push(joint.deflection_rad() + model.gear.deflection_zero_rad);
            velocity.push(joint.link_rad_per_s);
        }
    })?;
    Ok(Recording {
        torque: Some(torque),
        deflection_rad: Some(deflection),
        theta_in_rad: Some(input),
        theta_out_rad: Some(output),
        velocity_out_rad_per_s: Some(velocity),
        time_s: time,
        ..Recording::default()
    })
}

/// Root mean square errors of a run once settled.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Errors {
    angle_rad: f64,
    torque_nm: f64,
}

/// Runs a task from rest. `watch` sees the joint at the start of every control period.
fn run_task(
    task: Task,
    plant: Plant,
    params: &Params,
    masses: &Masses,
    compensation: Compensation,
    knowledge: Knowledge,
    mut watch: impl FnMut(usize, f64, &Joint),
) -> Result<Errors, BenchError> {
    let rated_nm = params.rated_torque_nm();
    let mut joint = Joint::at_rest(*masses, task.output(), plant.gear(params, STEP_S));
    let mut cascade = Cascade::new(masses, rated_nm);
    let mut compensator = Compensator::new(compensation, knowledge)?;
    let mut seen = Measured::default();
    let (mut angle, mut torque, mut count) = (0.0, 0.0, 0.0);
    for period in 0..(DURATION_S / PERIOD_S) as usize {
        let t = period as f64 * PERIOD_S;
        let reference = task.reference(masses, rated_nm, t);
        watch(period, t, &joint);
        if t >= SETTLED_S {
            angle += (joint.link_rad - reference.angle_rad).powi(2);
            torque += (joint.torque_nm - reference.torque_nm).powi(2);
            count += 1.0;
        }
        let offset = compensator.offset_rad(reference.torque_nm, seen.motor_rad - seen.link_rad);
        let asked_nm = cascade.asked_nm();
        cascade.control(
            &Command {
                motor_rad: reference.angle_rad + offset,
                torque_nm: masses.motor_kgm2 * reference.acceleration
                    + reference.torque_nm
                    + KNOWN_FRICTION * masses.friction_nm(reference.velocity),
            },
            &seen,
        );
        seen = Measured::of(joint.motor_rad, joint.link_rad);
        for _ in 0..STEPS {
            let motor_nm = cascade.torque_nm(asked_nm, STEP_S);
            joint.step(motor_nm, STEP_S);
        }
    }
    Ok(Errors { angle_rad: f64::sqrt(angle / count), torque_nm: f64::sqrt(torque / count) })
}

/// Fits law `masing`, and a linear spring, to a noisy bench recording of the gear.
fn identify(plant: Plant, params: &Params, seed: u64) -> Result<Knowledge, BenchError> {
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
    let fit = estimate::fit(&[recording], &options, &())?;
    let params = fit.model.params(params.rated_deflection_rad()).ok_or(BenchError::NoGear)??;
    Ok(Knowledge { params, spring_nm_per_rad })
}

/// Locked input, several amplitudes, sensors of a good bench.
fn bench_recording(plant: Plant, params: &Params, seed: u64) -> Recording {
    let noise = Noise::typical(params.rated_torque_nm());
    let (time_s, theta) = plan::nested_cycles(params.rated_deflection_rad());
    let mut gear = plant.gear(params, time_s[1] - time_s[0]);
    let mut torque: Vec<f64> = theta.iter().map(|theta| gear.step(*theta)).collect();
    let mut deflection_rad = theta;
    sensors::torque(&noise, &mut torque, &mut random(seed, Stream::Identification));
    sensors::encoder(&noise, &mut deflection_rad);
    Recording { time_s, torque: Some(torque), deflection_rad: Some(deflection_rad), ..Recording::default() }
}
